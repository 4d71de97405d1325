"""Set points for winches: one pose at a time, without allocation."""

from time import perf_counter

import numpy as np

import sagline as sl

robot = sl.load_robot("ipanema-1")
path = sl.quintic_path(
    [(0, 0, 1.2), (0.5, 0.4, 1.4), (-0.5, 0.2, 1.0), (0, 0, 1.2)],
    speed=0.8,
    rate=1000,
)
# feedforward of the platform's inertia
load = sl.inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
solver = sl.InverseSolver(robot)
lengths = np.empty(robot.cable_count)
wound, times = [], []
for position, quaternion, wrench in zip(
    path.pose.position, path.pose.quaternion, load, strict=True
):
    start = perf_counter()
    status = solver.step_into(position, quaternion, lengths, wrench)
    times.append(perf_counter() - start)
    if status != sl.PoseStatus.SOLVED:
        raise SystemExit(status.text)  # stop the winches
    wound.append(lengths.copy())
plan = sl.inverse(robot, path)  # the same lengths from a single call
difference = np.abs(np.array(wound) - plan.unstrained_length).max()
print(f"{len(path)} set points, within {difference:.0e} m of the plan")
print(f"{1e6 * np.median(times):.1f} µs per pose, median")
sl.plot.save(sl.plot.lengths(plan), "control_loop.png")
