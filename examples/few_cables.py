"""A load on three ropes: its vibration, and lengths that avoid it."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

angle = np.radians([90.0, 210.0, 330.0])
circle = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
robot = sl.Robot(
    "three ropes",
    frame_anchors=3.0 * circle + [0.0, 0.0, 5.0],
    platform_anchors=0.4 * circle,
    cables=sl.Cable(linear_density=0.02, axial_stiffness=2e5),
    mass=20.0,
    inertia=np.diag([0.6, 0.8, 1.3]),
    center_of_mass=(0.0, 0.0, -0.2),
)
first, last = np.array([4.0, 4.0, 4.0]), np.array([3.6, 4.1, 4.1])
start, goal = sl.forward(robot, first), sl.forward(robot, last)
_, aside, height = goal.pose.position - start.pose.position
print(f"the load moves {aside:.2f} m aside and {height:.2f} m up")
swing = sl.modes(goal.state).frequency[:2]
print(f"the load vibrates at {swing.round(2)} Hz, massless cables")

# x of this path is the completed share of the change of lengths
share = sl.quintic_path([(0, 0, 0), (1, 0, 0)], durations=0.8, rate=1000.0)
ways = {"unshaped": share, "shaped": sl.shaped(share, sl.ZV(swing))}
figure = Figure(figsize=(6.0, 3.0), layout="constrained")
ax = figure.subplots()
left = {}
for name, path in ways.items():
    lengths = first + path.pose.position[:, :1] * (last - first)
    run = sl.simulate(
        start.state,
        unstrained_length=(path.time, lengths),
        duration=path.duration + 4.0,
    )
    after = run.time >= path.duration
    away = run.pose.position[after] - goal.pose.position
    left[name] = np.linalg.norm(away, axis=1).max()
    whole = np.linalg.norm(run.pose.position - goal.pose.position, axis=1)
    ax.plot(run.time, 1e3 * whole, label=name)
    print(f"{name}: {path.duration:.2f} s, then {1e3 * left[name]:.0f} mm off")
ax.set(xlabel="time [s]", ylabel="distance from the goal [mm]")
ax.legend()
figure.savefig("few_cables.png", dpi=150)
