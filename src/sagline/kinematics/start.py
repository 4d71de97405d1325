"""A start from nothing but the robot and its lengths."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array, Flags, Indices, locked
from sagline.cables.model import CableModel
from sagline.kernels import codes
from sagline.kernels.forward import forward as kernel
from sagline.kinematics.blocks import Progress, blocks, rows_of
from sagline.kinematics.forward_rows import BLOCK, Found, solve_rows
from sagline.robot.equilibrium import limited_tension
from sagline.robot.pattern import PLANAR, ROTATING
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows

_TILTS = (25.0, 60.0)  # degrees, tried where the level platform leads nowhere
_BELOW = 0.1  # of the mean length
_LIMIT_SLACK = 0.01  # a measured tension may miss its limit by this share
_POOR = np.array([0, 1, 2, 3, 4, 5, 6, 0])  # how little each status is worth; fitted is as good as solved


def search(robot: Robot, model: CableModel, lengths: Array, wrenches: Array, progress: Progress | None = None) -> Found:
    """Forward kinematics without a start, sample by sample.

    With its orientation held, the platform has a single equilibrium, because the energy is convex in the position:
    it is found from anywhere, and is the start for the whole motion. First the platform is held level. Samples whose
    answer is not a stable equilibrium within the tension limits are tried again from tilted starts; the best answer
    counts: the better status, then fewer cables outside their limits, then the lower energy.

    Args:
        robot: The robot.
        model: Cable model.
        lengths: Unstrained lengths (N, m), rows of NaN are left out.
        wrenches: External plus inertial (1 or N, 6).
        progress: Told after each block how many samples are done, of how many.
    """
    found = Found.empty(*lengths.shape)
    for part in blocks(len(lengths), max(1, BLOCK // robot.cable_count), progress):
        found.keep(part, _search_block(robot, model, lengths[part], rows_of(wrenches, part)))
    return found


def _search_block(robot: Robot, model: CableModel, lengths: Array, wrenches: Array) -> Found:
    found = Found.empty(*lengths.shape)
    open_samples = np.arange(len(lengths))
    for round_, quaternion in enumerate(start_quaternions(robot)):
        loads = wrenches if len(wrenches) == 1 else locked(wrenches[open_samples])
        answer = from_orientations(robot, model, locked(lengths[open_samples]), loads, quaternion)
        better = np.ones(len(open_samples), dtype=np.bool_)
        if round_:
            better = _is_better(_rank(robot, model, answer), _rank(robot, model, found.part(open_samples)))
        found.keep(open_samples[better], answer, np.flatnonzero(better))
        settled = _is_plausible(robot, model, answer)
        open_samples = open_samples[~settled]
        if not len(open_samples):
            break
    return found


def from_orientations(robot: Robot, model: CableModel, lengths: Array, wrenches: Array, quaternion: Array) -> Found:
    """From the middle of the frame, with one orientation or one a sample: first the position alone, then all motions.

    Quaternions (x, y, z, w) of shape (4,) or (N, 4).
    """
    starts = pose_rows(Pose.from_quaternion(hung(robot, lengths, quaternion), quaternion))
    if robot.motion_pattern not in ROTATING:
        return solve_rows(robot, model, lengths, starts, wrenches)
    freedom = robot.freedom
    translations = locked(freedom[~freedom[:, 3:].any(axis=1)])
    placed = solve_rows(robot, model, lengths, starts, wrenches, freedom=translations)
    return solve_rows(robot, model, lengths, locked(placed.poses), wrenches)


def hung(robot: Robot, lengths: Array, quaternion: Array) -> Array:
    """Positions (N, 3) in which the platform hangs a little below the middle of the frame ends, as far as it can move.

    Not in the middle itself, because the two ends of a single cable must not coincide.
    """
    depth = _BELOW * np.nan_to_num(lengths.mean(axis=1, keepdims=True), nan=1.0)
    position: Array = middle(robot, quaternion) - depth * (robot.freedom[:, 2] @ robot.freedom[:, :3])
    return position


def middle(robot: Robot, quaternion: Array) -> Array:
    """Position at which the middle of the platform ends is in the middle of the frame ends."""
    ends = robot.platform_anchors.mean(axis=0)
    vector, scalar = quaternion[..., :3], quaternion[..., 3:]
    turn = 2.0 * np.cross(vector, ends)
    position: Array = robot.frame_anchors.mean(axis=0) - (ends + scalar * turn + np.cross(vector, turn))
    return position


def start_quaternions(robot: Robot) -> Array:
    """Level first, then tilted about each axis that the robot can turn about, one way and the other, (K, 4)."""
    rows = [np.array([0.0, 0.0, 0.0, 1.0])]
    if robot.motion_pattern in ROTATING:
        axes = robot.freedom[2:, 3:] if robot.motion_pattern in PLANAR else np.eye(3)
        halves = [0.5 * sign * np.radians(tilt) for tilt in _TILTS for sign in (1.0, -1.0)]
        rows += [np.append(np.sin(half) * axis, np.cos(half)) for half in halves for axis in axes]
    return np.array(rows)


def outside_limits(robot: Robot, model: CableModel, found: Found) -> Indices:
    """How many cables of each sample are outside the robot's tension limits, (N,); none known for straight ones."""
    tension = limited_tension(robot, found.cables(robot, model, found.pose_status.shape))
    low = (1.0 - _LIMIT_SLACK) * robot.tension_min
    high = (1.0 + _LIMIT_SLACK) * robot.tension_max
    count: Indices = ((tension < low) | (tension > high)).sum(axis=1)
    return count


def _is_plausible(robot: Robot, model: CableModel, found: Found) -> Flags:
    done = np.isin(found.pose_status, (codes.FORWARD_SOLVED, codes.FORWARD_NO_LENGTHS))
    return np.asarray(done & (outside_limits(robot, model, found) == 0))


def _rank(robot: Robot, model: CableModel, found: Found) -> Array:
    """Rows (status, cables outside their limits, energy) of which the smaller is the better, (N, 3)."""
    energy = np.nan_to_num(found.numbers[:, kernel.ENERGY], nan=0.0)
    return np.stack((_POOR[found.pose_status].astype(np.float64), outside_limits(robot, model, found), energy), axis=1)


def _is_better(new: Array, old: Array) -> Flags:
    first = np.argmax(new != old, axis=1)[:, None]
    return np.asarray(np.take_along_axis(new, first, 1) < np.take_along_axis(old, first, 1))[:, 0]
