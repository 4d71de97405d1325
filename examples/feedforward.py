"""Feedforward control: planned lengths and tensions every ms."""

import numpy as np
from matplotlib.figure import Figure

import sagline as sl

robot = sl.load_robot("article-prototype")
path = sl.septic_path([(0, 0, 1.0), (0.3, 0.2, 1.1)], durations=2.5, rate=1000)
plan = sl.inverse(robot, path, tension=sl.MinimumNorm())
# the same poses without the inertia of the platform
still = sl.inverse(robot, path.pose, tension=sl.MinimumNorm())


def follow(these: sl.Plan) -> list[float]:
    """Distance from the path [m], every ms, until 3 seconds after its end."""
    machine = sl.Simulator(robot, plan.state[0])
    lengths = these.unstrained_length
    tensions = these.state.cables.frame_end_tension
    away = []
    for step in range(1, len(path) + 3000):
        k = min(step, len(path) - 1)
        seen = machine.step(lengths[k], 0.001, tension=tensions[k])
        distance = np.linalg.norm(seen.position - path.pose.position[k])
        away.append(float(distance))
    return away


distance = {"planned": follow(plan), "static": follow(still)}
for name, away in distance.items():
    largest, left = 1e3 * max(away[: len(path)]), 1e3 * max(away[-2000:])
    print(
        f"{name} lengths: {largest:.2f} mm on the path, {left:.2f} mm after it"
    )

figure = Figure(figsize=(6.0, 3.0), layout="constrained")
ax = figure.subplots()
for name, away in distance.items():
    ax.plot(
        0.001 * np.arange(1, 1 + len(away)), 1e3 * np.array(away), label=name
    )
ax.set(xlabel="time [s]", ylabel="distance from the path [mm]")
ax.legend(title="lengths")
figure.savefig("feedforward.png", dpi=150)
