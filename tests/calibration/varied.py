"""Logs with different tensions at each pose, and the position error after a calibration."""

from typing import Final

import numpy as np

import sagline as sl
from tests.calibration.reference import counts_of
from tests.calibration.synthetic import Synthetic, Truth, log_of
from tests.kinematics.feasible import box_poses

SETS: Final = 6  # number of sets of tensions, of which each pose has one
POINT: Final = 1e-3  # m, standard deviation of a measured coordinate
ERRORS: Final = {  # standard deviations of a robot that is set up with a tape measure
    "frame_anchors": 0.035,
    "platform_anchors": 0.005,
    "length_zero": 0.03,
    "drum_radius": 0.002,
    "linear_density": 0.05,
    "axial_stiffness": 0.1,
    "mass": 0.03,
    "center_of_mass": 0.02,
}


def varied(truth: Truth, count: int, seed: int, positions: int = 0) -> Synthetic:
    """A log with the given number of poses, each with its own tensions; some positions are measured."""
    made = log_of(truth, SETS * count, seed, sets=SETS)
    rng = np.random.default_rng(seed)
    rows = np.arange(count) * SETS + rng.integers(SETS, size=count)
    log, pose = made.log.rows(rows), made.pose[rows]
    if positions:
        read = np.full((count, 3), np.nan)
        at = np.linspace(0, count - 1, positions).round().astype(int)
        read[at] = pose.position[at] + POINT * rng.normal(size=(positions, 3))
        log = log.replace(position=read)
    return Synthetic(log, pose, made.length[rows], made.tension[rows])


def at_chosen(truth: Truth, chosen: sl.CalibrationPoses, seed: int, positions: int = 0) -> Synthetic:
    """A log of a machine at the poses of `calibration_poses`, with tensions near the given ones."""
    rng, true, sensors = np.random.default_rng(seed), truth.robot, truth.sensors
    plans = [
        sl.inverse(true, chosen.poses[k], tension=sl.QuadraticProgram(target=chosen.frame_end_tension[k]))
        for k in range(len(chosen))
    ]
    rows = [k for k, plan in enumerate(plans) if plan.feasible]
    lengths = np.stack([plans[k].unstrained_length for k in rows])
    tensions = np.stack([plans[k].state.cables.frame_end_tension for k in rows])
    pose = chosen.poses[np.array(rows)]
    believed = lengths + sensors.length_deviation * rng.normal(size=lengths.shape)
    assert sensors.tension_deviation is not None
    cells = tensions + sensors.tension_deviation * rng.normal(size=lengths.shape)
    read = None
    if positions:
        read = np.full((len(rows), 3), np.nan)
        at = np.linspace(0, len(rows) - 1, positions).round().astype(int)
        read[at] = pose.position[at] + POINT * rng.normal(size=(positions, 3))
    log = sl.WinchLog(
        counts=counts_of(true, believed), load_cells=cells, position=read, commanded=pose, sensors=sensors
    )
    return Synthetic(log, pose, lengths, tensions)


def left_error(believed: sl.Robot, true: sl.Robot, seed: int, *, own: bool, scaled: bool = False) -> float:
    """Root mean square distance between commanded and reached positions [m].

    Args:
        believed: The robot by which lengths are wound.
        true: What it is.
        seed: Of where it is sent.
        own: Whether a shift and a turn about the vertical that all have in common do not count.
        scaled: Whether a scale that all have in common does not count either.
    """
    poses = box_poses(believed, 60, seed + 100)
    plan = sl.inverse(believed, poses)
    sent = poses[np.flatnonzero(plan.feasible)]
    counts = counts_of(believed, plan.unstrained_length[plan.feasible])
    stood = sl.forward(true, sl.lengths_from_counts(true, counts), sent).pose.position
    if not own:
        return float(np.sqrt(np.mean(np.sum((stood - sent.position) ** 2, axis=1))))
    asked, there = sent.position - sent.position.mean(axis=0), stood - stood.mean(axis=0)
    sine = np.sum(asked[:, 0] * there[:, 1] - asked[:, 1] * there[:, 0])
    angle = np.arctan2(sine, np.sum(asked[:, :2] * there[:, :2]))
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    turned = asked @ turn.T
    turned *= np.sum(turned * there) / np.sum(turned * turned) if scaled else 1.0
    return float(np.sqrt(np.mean(np.sum((there - turned) ** 2, axis=1))))
