"""Pulleys that swivel about any axis or on the platform, compared with vertical axes: `python -m benchmarks.swivels`.

The times are processor times. The robots are solved in turn, and the table contains the shortest times, so that other
programs have little effect on the ratios.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

import sagline as sl
from benchmarks.measure import Row, print_table
from sagline.core.arrays import Array
from tests.kinematics.test_on_platform import aboard
from tests.kinematics.test_slanted import AXES, with_axes

POSES, REPEATS = 2000, 7
STEP = 20  # of the poses of a calibration
LEVEL = (0.0, 0.0, 0.0, 1.0)
ROBOTS = {
    "vertical": with_axes([0.0, 0.0, 1.0]),
    "any": with_axes(AXES["any"]),
    "horizontal": with_axes(AXES["tangential"]),
    "platform": aboard(0.05, 0.6),
}
TARGETS = {
    "forward, steps of 2 mm": "≤ 1.5 x vertical",
    "forward, start pose wrong by 35 mm": "≤ 1.5 x vertical",
    "forward, no start pose": "≤ 1.5 x vertical",
    "inverse": "≤ 1.5 x vertical",
    "inverse without stability": "≤ 1.5 x vertical",
    "stiffness and sensitivities": "≤ 1.5 x vertical",
    "calibration of 100 poses with lengths and load cells": "≤ 1.5 x vertical",
}


def pose_at(position: Array) -> sl.Pose:
    """Poses without rotation."""
    return sl.Pose.from_quaternion(position, np.tile(LEVEL, (len(position), 1)))


def calls(robot: sl.Robot) -> dict[str, Callable[[], object]]:
    """The calls to measure, in the order of the targets."""
    angle = np.linspace(0.0, 2.0 * np.pi, POSES, endpoint=False)
    radius = 2e-3 * POSES / (2.0 * np.pi)
    path = pose_at(np.column_stack((radius * np.cos(angle), radius * np.sin(angle), np.full(POSES, 2.0))))
    near, plan = pose_at(path.position + 0.02), sl.inverse(robot, path)
    lengths, state = plan.unstrained_length, plan.state
    noise = np.random.default_rng(1).normal(size=(2, *lengths[::STEP].shape))
    log = sl.WinchLog(
        unstrained_length=lengths[::STEP] + 1e-3 * noise[0],
        load_cells=state.cables.frame_end_tension[::STEP] + 5.0 * noise[1],
        commanded=path[::STEP],
        sensors=sl.Sensors(1e-3, 5.0),
    )
    return {
        "forward, steps of 2 mm": lambda: sl.forward(robot, lengths, path[0]),
        "forward, start pose wrong by 35 mm": lambda: sl.forward(robot, lengths, near),
        "forward, no start pose": lambda: sl.forward(robot, lengths[::10]),
        "inverse": lambda: sl.inverse(robot, path),
        "inverse without stability": lambda: sl.inverse(robot, path, stability=False),
        "stiffness and sensitivities": lambda: sl.stiffness(state),
        "calibration of 100 poses with lengths and load cells": lambda: sl.calibrate(robot, log, folds=0),
    }


def times() -> Iterator[Row]:
    """CoGiRo with pulleys of 50 mm radius and 3 m of dead length."""
    ready = {name: calls(robot) for name, robot in ROBOTS.items()}
    for quantity, target in TARGETS.items():
        best = {name: np.inf for name, each in ready.items() if quantity in each}
        for _ in range(REPEATS):
            for name in best:
                each = ready[name]
                start = time.process_time()
                each[quantity]()
                best[name] = min(best[name], time.process_time() - start)
        poses = POSES / 10 if "no start" in quantity else POSES / STEP if "calibration" in quantity else POSES
        texts = [f"{name} {1e6 * t / poses:.3g} µs ({t / best['vertical']:.2f} x)" for name, t in best.items()]
        yield Row(quantity, target, "; ".join(texts))


if __name__ == "__main__":
    print_table("Swivel axes, 8 exact cables", [times])
