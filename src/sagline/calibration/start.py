"""Where the least squares begins: poses and true lengths, from what was commanded and read."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.calibration.observing import NO_LOAD, Machine
from sagline.calibration.problem import Problem, State, machine_at, said_lengths
from sagline.calibration.sensors import load_cells_of
from sagline.core.arrays import Array, locked
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.starting_lengths import starting_lengths
from sagline.kernels.memory import memory_for
from sagline.kinematics.start import search
from sagline.robot.pose import Pose
from sagline.statics.tables import body_table, cable_table, pose_rows

_PAIRS = 3  # measured points without which nobody can say where a measuring system stands
_LINE = 1e-3  # of its length: points no farther off than that lie on a line


def start_of(problem: Problem, commanded: Pose | None) -> State:
    """Where to begin: at the priors, the platform where it was commanded or where the lengths that were read put it.

    True lengths are those that hold it there with the tensions that were read: a millimeter of a steel cable is 90 N,
    so that lengths that were read say little of tensions before the anchors are known.

    Args:
        problem: The problem.
        commanded: Poses that were commanded, N of them, or None.

    Returns:
        The state.
    """
    numbers = problem.prior
    machine = machine_at(problem, numbers)
    said = said_lengths(problem, machine, slice(None))
    poses = _poses(problem, machine, said, commanded)
    lengths = held_lengths(problem, machine, poses, said)
    aligned = _aligned(problem, numbers, poses)
    return State(aligned, machine if aligned is numbers else machine_at(problem, aligned), lengths, poses)


def held_lengths(problem: Problem, machine: Machine, poses: Array, said: Array) -> Array:
    """True lengths with which cables hold the platform at poses as load cells say; those that were read without them.

    Args:
        problem: The problem.
        machine: The robot to begin with.
        poses: Pose rows (N, POSE_COLUMNS).
        said: Lengths that were read [m], (N, m).
    """
    if problem.sensors.tension_deviation is None:
        return said.copy()
    robot, cells = machine.robot, problem.log.cells
    gain, bias = load_cells_of(robot)
    tension = np.maximum((cells - bias) / gain, 0.0)
    read = ~np.isnan(tension)
    usual = np.sum(np.where(read, tension, 0.0), axis=1) / np.maximum(np.count_nonzero(read, axis=1), 1)
    tension = np.where(read, tension, usual[:, None])
    lengths = np.empty(said.shape)
    starting_lengths(
        problem.model.terms(robot.gravity),
        robot.freedom,
        cable_table(robot)[0],
        body_table(robot)[0],
        locked(poses.view()),
        locked(tension),
        memory_for(robot.cable_count),
        lengths,
    )
    pulled = np.isfinite(lengths) & np.any(read, axis=1, keepdims=True)
    return np.where(pulled, lengths, said)


def _poses(problem: Problem, machine: Machine, said: Array, commanded: Pose | None) -> Array:
    """Pose rows to begin at: measured, else commanded, else where the lengths put the platform."""
    if commanded is not None:
        poses = np.array(pose_rows(commanded))
        poses = np.broadcast_to(poses, (len(said), poses.shape[1])).copy()
    else:
        found = search(machine.robot, problem.model, locked(said.view()), NO_LOAD, None)
        poses = found.poses.copy()
    if np.any(problem.parameters.where[kinds.SHIFT : kinds.TARGET + 3, 0] >= 0):
        return poses  # nobody knows yet where the measured points are
    sensors, log = machine.sensors, problem.log
    turned = ~np.isnan(log.rotations).any(axis=1)
    placed = ~np.isnan(log.positions).any(axis=1)
    frame = sensors.frame
    if turned.any():
        poses[turned, 3:] = (frame.rotation * Rotation.from_quat(log.rotations[turned])).as_quat()
    both = placed & turned
    if both.any():
        target = frame.position + log.positions[both] @ frame.matrix.T
        poses[both, :3] = target - Rotation.from_quat(poses[both, 3:]).apply(sensors.target.copy())
    return poses


def _aligned(problem: Problem, numbers: Array, poses: Array) -> Array:
    """The numbers with the measuring system where it reads the poses best, if it is looked for.

    Its rotation is the mean of those between the platform's and what was read, or that between measured points; where
    it can stand nowhere better than where it is believed to be, it stays there.
    """
    where = problem.parameters.where[kinds.SHIFT : kinds.TURN + 3, 0]
    if where[0] < 0:
        return numbers
    frame, log, platform = problem.sensors.frame, problem.log, Rotation.from_quat(poses[:, 3:])
    placed, turned = ~np.isnan(log.positions).any(axis=1), ~np.isnan(log.rotations).any(axis=1)
    read = log.positions[placed]
    there = poses[placed, :3] + platform[placed].apply(problem.sensors.target.copy())
    if turned.any():
        turn = (platform[turned] * Rotation.from_quat(log.rotations[turned]).inv()).mean()
    elif _spans(read):
        turn, _ = Rotation.align_vectors(there - there.mean(axis=0), read - read.mean(axis=0))
    else:
        return numbers
    found = numbers.copy()
    found[where[3:]] = (turn * frame.rotation.inv()).as_rotvec()
    if placed.any():
        found[where[:3]] = (there - turn.apply(read)).mean(axis=0)
    return found


def _spans(points: Array) -> bool:
    """Whether points (N, 3) lie on no line: those on one say nothing of a turn about it."""
    if len(points) < _PAIRS:
        return False
    sizes = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(sizes[1] > _LINE * sizes[0])
