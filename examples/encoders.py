"""Pose of the platform: forward kinematics from measured lengths."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

robot = sl.load_robot("article-suspended")
path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2)], durations=4.0, rate=50)
plan = sl.inverse(robot, path)
# errors of 1 mm per cable
noise = np.random.default_rng(1).normal(
    scale=1e-3, size=plan.unstrained_length.shape
)
measured = plan.unstrained_length + noise
found = sl.forward(
    robot, measured, start=plan.state.pose[0], wrench=plan.state.wrench
)
error = np.linalg.norm(found.pose.position - plan.state.pose.position, axis=1)
print(f"{found.solved.sum()} of {len(error)} samples found")
print(
    f"1 mm of noise per cable: position error {1e3 * error.mean():.1f} mm,",
    f"{1e3 * error.max():.1f} mm at most",
)
figure = Figure(figsize=(6.0, 3.0), layout="constrained")
ax = figure.subplots()
ax.plot(path.time, 1e3 * (found.pose.position - plan.state.pose.position))
ax.set(xlabel="time [s]", ylabel="computed minus planned position [mm]")
ax.legend(["x", "y", "z"])
figure.savefig("encoders.png", dpi=150)
