"""Training of a small policy: it moves a load on four ropes to its target.

The speed of each winch is a linear function of the position error. CMA-ES finds
the twelve numbers of the policy. Each candidate controls eight robots, and all
robots of a generation move in one vectorized environment.
Needs: pip install "sagline[gymnasium,design]"
"""

import cma
import gymnasium
import numpy as np
from matplotlib.figure import Figure

import sagline as sl
import sagline.gymnasium

GENERATIONS, CANDIDATES, ROBOTS, STEPS = 60, 12, 8, 100

angle = np.radians([45.0, 135.0, 225.0, 315.0])
square = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
robot = sl.Robot(
    "four ropes",
    frame_anchors=4.0 * square + [0.0, 0.0, 5.0],
    platform_anchors=0.4 * square,
    cables=sl.Cable(linear_density=0.05, axial_stiffness=1e5),
    mass=20.0,
    inertia=np.diag([0.6, 0.8, 1.3]),
    center_of_mass=(0.0, 0.0, -0.3),
    test_box=sl.PoseBox([-1.2, -1.2, 1.0], [1.2, 1.2, 3.0]),
)
robots = gymnasium.make_vec(
    "sagline/CableRobot-v0",
    num_envs=CANDIDATES * ROBOTS,
    vectorization_mode="vector_entry_point",
    robot=robot,
    speed=0.4,
    period=0.05,
    episode_steps=STEPS,
    step=0.0025,
    damping=sl.Damping(loss_time=0.002, air_damping=0.2),
)


def run(policies: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean rewards per step, and mean distances at all steps [m].

    `policies` has the shape (CANDIDATES, 4, 3).
    """
    seen, info = robots.reset(seed=seed)
    reward, going, away = (
        np.zeros(len(seen)),
        np.ones(len(seen), dtype=bool),
        [info["distance"].mean()],
    )
    for _ in range(STEPS):
        error = seen[:, :3].reshape(CANDIDATES, ROBOTS, 3)
        speeds = np.einsum("cmk,crk->crm", policies, error)
        seen, gained, ended, _, info = robots.step(speeds.reshape(-1, 4))
        reward += gained * going
        going &= ~ended
        away.append(info["distance"].mean())
    return reward.reshape(CANDIDATES, -1).mean(axis=1) / STEPS, np.array(away)


search = cma.CMAEvolutionStrategy(
    np.zeros(12), 0.2, {"popsize": CANDIDATES, "seed": 1, "verbose": -9}
)
for generation in range(GENERATIONS):
    numbers = search.ask()
    rewards, _ = run(np.reshape(numbers, (-1, 4, 3)), seed=generation)
    search.tell(numbers, -rewards)
    if generation % 20 == 19:
        print(
            f"generation {generation + 1}: reward {rewards.mean():.2f} per step"
        )
best = np.tile(np.reshape(search.mean, (4, 3)), (CANDIDATES, 1, 1))
figure = Figure(figsize=(4.7, 2.6), layout="constrained")
ax = figure.subplots()
distance = {}
for name, policy in {
    "without a policy": 0.0 * best,
    "with the policy": best,
}.items():
    distance[name] = run(policy, seed=10_000)[1]
    ax.plot(0.05 * np.arange(STEPS + 1), distance[name], label=name)
    print(
        f"{name}: mean distance {distance[name][-1]:.2f} m"
        f" after {0.05 * STEPS:.0f} s"
    )
ax.set(
    xlabel="time [s]",
    ylabel="mean distance from the target [m]",
    ylim=(0.0, None),
)
ax.legend()
figure.savefig("train_policy.png", dpi=150)
