"""Cascade control: 1 kHz loops in the drives, and a slow loop on the pose.

The real platform is heavier than the planned one.
"""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

PERIOD, GAIN = 0.01, 0.5  # [s], [1/s]
planned = sl.load_robot("article-prototype")
built = planned.replace(mass=1.2 * planned.mass)  # not in the plan
goal = sl.Pose.from_euler([0.3, 0.2, 1.2], 0.0, 0.0, 0.0)
plan = sl.inverse(planned, goal, tension=sl.MinimumNorm())
start = sl.forward(built, plan.unstrained_length, start=goal).state  # lower
rope = sl.Damping(loss_time=5e-3, air_damping=0.5)  # assumed losses


def settle(gain: float) -> list[float]:
    """Distance from the goal [m] in each period of twenty seconds."""
    machine = sl.Simulator(built, start, damping=rope)
    solver = sl.InverseSolver(planned, tension=sl.MinimumNorm())
    lengths, aim = start.unstrained_length.copy(), goal.position.copy()
    away = []
    for _ in range(2000):
        seen = machine.step(lengths, PERIOD)
        error = goal.position - seen.position  # simulated reading of a tracker
        aim += gain * PERIOD * error
        status = solver.step_into(aim, goal.quaternion, lengths)
        if status != sl.PoseStatus.SOLVED:
            raise SystemExit(status.text)  # stop the winches
        away.append(float(np.linalg.norm(error)))
    return away


without, closed = settle(0.0), settle(GAIN)
print(f"no loop on the pose: {1e3 * max(without[-100:]):.2f} mm off")
print(f"with it: {1e3 * max(closed[-100:]):.2f} mm after 20 s")

figure = Figure(figsize=(6.0, 3.0), layout="constrained")
ax = figure.subplots()
time = PERIOD * np.arange(1, 1 + len(closed))
ax.plot(time, 1e3 * np.array(without), label="no loop on the pose")
ax.plot(time, 1e3 * np.array(closed), label="with it")
ax.set(xlabel="time [s]", ylabel="distance from the goal [mm]")
ax.legend()
figure.savefig("pose_loop.png", dpi=150)
