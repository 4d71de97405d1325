"""An artificial calibration with known numbers, for comparison with texts, figures and pages.

The readings belong to a robot with known values. The estimates have errors drawn from the stated covariance, and the
residuals are drawn from the deviations of the sensors.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import sagline as sl
from sagline.calibration.findings import Criticism, CrossValidation, Direction, Outlier
from sagline.calibration.parameters import KINDS, Parameters
from sagline.core.arrays import Array, locked

NAMES = ("frame_anchors", "length_zero", "axial_stiffness", "mass", "center_of_mass")
SENSORS = sl.Sensors(length_deviation=5e-4, tension_deviation=5.0, position_deviation=1e-3)
LIFT = 0.04  # standard deviation of the information in the readings, and of the priors
MOTIONS = ("the world shifted along x", "the world shifted along y", "the world shifted along z",
           "the world turned about the vertical")  # fmt: skip
STEP = "fix a frame anchor, or measure 3 points"


def parameters(robot: sl.Robot, names: tuple[str, ...] = NAMES) -> Parameters:
    """Parameters of the given kinds with usual priors."""
    rows: list[tuple[str, str, str, int, float, float, bool]] = []
    m = robot.cable_count
    where = np.full((max(kind.first + len(kind.axes) for kind in KINDS.values()), m), -1, dtype=np.int64)
    for name in names:
        kind = KINDS[name]
        own = kind.each and not kind.shared
        for cable in range(m if own else 1):
            for axis, letter in enumerate(kind.axes):
                number = len(rows)
                where[kind.first + axis, cable if own or not kind.each else slice(None)] = number
                label = name + (f"[{cable}]" if own else "") + (f".{letter}" if letter else "")
                value = value_in(robot, name, cable, axis)
                deviation = kind.deviation * (abs(value) if kind.logarithmic else 1.0)
                unit = "rad" if letter.startswith("about") else kind.unit
                rows.append((name, label, unit, cable if own else -1, value, deviation, kind.logarithmic))
    kinds, labels, units, cables, prior, deviations, logarithmic = zip(*rows, strict=True)
    return Parameters(
        kinds, labels, units, locked(np.array(cables)), locked(where), locked(np.array(prior)),
        locked(np.array(deviations)), locked(np.zeros(len(rows), dtype=bool)), locked(np.array(logarithmic)),
        counted=False,
    )  # fmt: skip


def value_in(robot: sl.Robot, name: str, cable: int, axis: int) -> float:
    """Value of a parameter in a robot."""
    if name in ("frame_anchors", "platform_anchors"):
        return float(getattr(robot, name)[cable, axis])
    if name in ("linear_density", "axial_stiffness"):
        return float(getattr(robot.cables, name)[cable])
    if name == "center_of_mass":
        return float(robot.center_of_mass[axis])
    return {"mass": robot.mass, "load_cell_gain": 1.0}.get(name, 0.0)


def covariance_of(numbers: Parameters, robot: sl.Robot, random: np.random.Generator) -> Array:
    """Covariance after readings that determine everything except a shift and a rotation of the world."""
    told = random.standard_normal((3 * len(numbers.prior), len(numbers.prior))) / np.sqrt(3.0 * len(numbers.prior))
    told /= LIFT * numbers.prior_deviation
    unseen, _ = np.linalg.qr(motions(numbers, robot))
    told -= told @ unseen @ unseen.T
    scale = numbers.prior_deviation
    telling = scale * (told.T @ told) * scale[:, None]
    return locked(scale * np.linalg.inv(telling + np.eye(len(scale))) * scale[:, None])


def motions(numbers: Parameters, robot: sl.Robot) -> Array:
    """Shifts of the frame anchors along x, y and z by a meter, and their rotation about z by a radian, (P, 4)."""
    ways = np.zeros((len(numbers.prior), 4))
    for axis in range(3):
        for cable, number in enumerate(numbers.where[axis]):
            if number >= 0:
                x, y, _ = robot.frame_anchors[cable]
                ways[number, axis] = 1.0
                ways[number, 3] = (-y, x, 0.0)[axis]
    return ways


def made_up(
    name: str = "cogiro",
    count: int = 30,
    names: tuple[str, ...] = NAMES,
    *,
    slipped: tuple[tuple[int, int, float], ...] = ((4, 3, 0.02), (17, 6, -0.015)),
    seed: int = 7,
    **changed: Any,
) -> sl.Calibration:
    """A calibration whose numbers are drawn from what it says of them.

    Args:
        name: Of the robot.
        count: How many poses.
        names: Kinds of unknowns.
        slipped: Row, cable and by how much [m] of what does not fit.
        seed: Of all that is drawn.
        changed: Fields in place of what they are else.
    """
    random, before = np.random.default_rng(seed), sl.load_robot(name)
    numbers, box = parameters(before, names), before.test_box
    assert box is not None
    covariance = covariance_of(numbers, before, random)
    scale = numbers.prior_deviation
    root = np.linalg.cholesky(covariance / np.outer(scale, scale))
    values = locked(numbers.prior + scale * (root @ random.standard_normal(len(scale))))
    places = random.uniform(box.low + 0.1 * (box.high - box.low), box.high - 0.1 * (box.high - box.low), (count, 3))
    poses = sl.Pose(places, np.eye(3))
    robot = changed_robot(before, numbers, values)
    plan = sl.inverse(robot, poses)
    m, slips = before.cable_count, [each for each in slipped if each[0] < count]
    residuals = np.full((count, 2 * m + 6), np.nan)
    residuals[:, :m] = random.normal(0.0, 3e-4, (count, m))
    residuals[:, m : 2 * m] = random.normal(0.0, 4.0, (count, m))
    residuals[::2, 2 * m : 2 * m + 3] = random.normal(0.0, 8e-4, (len(range(0, count, 2)), 3))
    for row, cable, size in slips:
        residuals[row, cable] = size
    deviations = np.concatenate((np.full(m, 5e-4), np.full(m, 5.0), np.full(3, 1e-3), np.full(3, np.nan)))
    squares = np.nansum((residuals / deviations) ** 2, axis=1)
    held = np.array([row in [slip[0] for slip in slips] for row in range(count)])
    weights = np.where(held, 0.02, 1.0)
    freedom = int(np.isfinite(residuals).sum()) - m * count
    fields: dict[str, Any] = {
        "robot": robot,
        "before": before,
        "sensors": SENSORS,
        "length_offset": locked(np.zeros(m)),
        "status": sl.CalibrationStatus.FOUND,
        "parameters": numbers,
        "values": values,
        "covariance": covariance,
        "chi_squared": 1.02 * freedom,
        "degrees_of_freedom": freedom,
        "rows": locked(np.arange(count)),
        "left_out": {
            sl.Omission.MOVING: locked(np.array([count, count + 2])),
            sl.Omission.SLACK: locked(np.array([count + 1])),
        },
        "poses": poses,
        "unstrained_length": plan.unstrained_length,
        "residuals": locked(residuals),
        "chi_squared_of_pose": locked(squares),
        "weights": locked(weights),
        "criticisms": (Criticism("mass", "mass", 41.5, 1.2e-10, numbers.labels[0], 0.021, 0.6),),
        "outliers": tuple(Outlier(row, cable, "length", size, abs(size) / 5e-4) for row, cable, size in slips),
        "gauge": tuple(
            Direction(what, locked(way * 0.02), 1.0, STEP)
            for what, way in zip(MOTIONS, motions(numbers, before).T, strict=True)
        ),
        "cannot_tell_apart": (),
        "cross_validation": CrossValidation(5, 6.1, 1.4e-3, 212.0, 0.0463),
        "iterations": 5,
        "model": sl.Catenary(),
        "log": "winches.csv",
        "date": "2026-11-22",
    }  # fmt: skip
    return sl.Calibration(**fields | changed)


def changed_robot(robot: sl.Robot, numbers: Parameters, values: Array) -> sl.Robot:
    """A robot with estimated frame anchors and mass."""
    frame = np.array(robot.frame_anchors)
    for axis in range(3):
        found = numbers.where[axis]
        frame[found >= 0, axis] = values[found[found >= 0]]
    mass = [value for value, label in zip(values, numbers.labels, strict=True) if label == "mass"]
    return robot.replace(frame_anchors=frame, mass=float(mass[0]) if mass else robot.mass)
