"""A start from the robot and its lengths alone."""

from __future__ import annotations

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.progress import Progress, blocks, rows_of
from sagline.kernels import codes
from sagline.kernels.forward.problem import ENERGY
from sagline.kinematics.forward_rows import BLOCK, ForwardRows, solve_forward_rows
from sagline.robot.batch import Robots, anchors_of, first_of, has_routing, limits_of, robots_at
from sagline.robot.equilibrium import cables_of_results, limited_tension
from sagline.robot.pattern import PLANAR, ROTATING
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows

_TILTS = (25.0, 60.0)  # degrees, tried where the level platform leads nowhere
_DEPTH = 0.1  # of the mean length
_LIMIT_SLACK = 0.01  # a measured tension may miss its limit by this share
_POOR = np.array([0, 1, 2, 3, 4, 5, 6, 0])  # rank of each status; fitted ranks like solved


def search(
    robot: Robots, model: CableModel, lengths: Array, wrenches: Array, progress: Progress | None = None
) -> ForwardRows:
    """Forward kinematics without a start, sample by sample.

    With its orientation held, the platform has a single equilibrium, because the energy is convex in the position:
    it is found from anywhere, and is the start for the whole motion. First the platform is held level. Samples whose
    answer is not a stable equilibrium within the tension limits are tried again from tilted starts; the best answer
    counts: the better status, then fewer cables outside their limits, then the lower energy.

    lengths: unstrained lengths (N, m), rows of NaN are left out; wrenches: external plus inertial (1 or N, 6);
    progress: called after each block with the numbers of completed and of all samples.
    """
    count, m = lengths.shape
    found = ForwardRows.empty(count, m, has_routing(robot))
    for part in blocks(count, max(1, BLOCK // m), progress):
        robots = robots_at(robot, part)
        found.keep(part, _search_block(robots, model, lengths[part], rows_of(wrenches, part)))
    return found


def _search_block(robot: Robots, model: CableModel, lengths: Array, wrenches: Array) -> ForwardRows:
    found = ForwardRows.empty(len(lengths), lengths.shape[1], has_routing(robot))
    open_samples = np.arange(len(lengths))
    for round_, quaternion in enumerate(start_quaternions(first_of(robot))):
        loads = wrenches if len(wrenches) == 1 else locked(wrenches[open_samples])
        robots = robots_at(robot, open_samples)
        answer = from_orientations(robots, model, locked(lengths[open_samples]), loads, quaternion)
        better = np.ones(len(open_samples), dtype=np.bool_)
        if round_:
            better = _is_better(_rank(robots, model, answer), _rank(robots, model, found.part(open_samples)))
        found.keep(open_samples[better], answer, np.flatnonzero(better))
        iterate_routing = _is_plausible(robots, model, answer)
        open_samples = open_samples[~iterate_routing]
        if not len(open_samples):
            break
    return found


def from_orientations(
    robot: Robots, model: CableModel, lengths: Array, wrenches: Array, quaternion: Array
) -> ForwardRows:
    """From the middle of the frame: first the position alone, then all motions.

    lengths: unstrained lengths (N, m); wrenches: external plus inertial (1 or N, 6); quaternion: orientation to begin
    with (x, y, z, w), shape (4,), or one a sample (N, 4).
    """
    shared = first_of(robot)
    freedom = shared.freedom
    starts = pose_rows(Pose.from_quaternion(starting_positions(robot, lengths, quaternion), quaternion))
    if shared.motion_pattern not in ROTATING:
        return solve_forward_rows(robot, model, lengths, starts, wrenches)
    translations = locked(freedom[~freedom[:, 3:].any(axis=1)])
    placed = solve_forward_rows(robot, model, lengths, starts, wrenches, freedom=translations)
    return solve_forward_rows(robot, model, lengths, locked(placed.poses), wrenches)


def starting_positions(robot: Robots, lengths: Array, quaternion: Array) -> Array:
    """Positions a little below the middle of the frame ends, as far as the platform can move.

    Not in the middle itself, because the two ends of a single cable must not coincide.

    lengths: unstrained lengths (N, m); quaternion: orientation of the platform, shape (4,) or (N, 4). Returns positions
    of the platform origin [m], shape (N, 3).
    """
    freedom = first_of(robot).freedom
    depth = _DEPTH * np.nan_to_num(lengths.mean(axis=1, keepdims=True), nan=1.0)
    position: Array = centered_positions(robot, quaternion) - depth * (freedom[:, 2] @ freedom[:, :3])
    return position


def centered_positions(robot: Robots, quaternion: Array) -> Array:
    """Position at which the middle of the platform ends is in the middle of the frame ends.

    quaternion: orientation of the platform, shape (4,) or (N, 4). Returns position of the platform origin [m], shape
    (3,) or (N, 3).
    """
    anchors = anchors_of(robot)
    ends = anchors.platform.mean(axis=-2)
    vector, scalar = quaternion[..., :3], quaternion[..., 3:]
    turn = 2.0 * np.cross(vector, ends)
    position: Array = anchors.frame.mean(axis=-2) - (ends + scalar * turn + np.cross(vector, turn))
    return position


def start_quaternions(robot: Robot) -> Array:
    """Orientations to start from: level, then tilted about each axis that the robot can turn about, both ways.

    Returns quaternions (K, 4), scalar last.
    """
    rows = [np.array([0.0, 0.0, 0.0, 1.0])]
    if robot.motion_pattern in ROTATING:
        axes = robot.freedom[2:, 3:] if robot.motion_pattern in PLANAR else np.eye(3)
        halves = [0.5 * sign * np.radians(tilt) for tilt in _TILTS for sign in (1.0, -1.0)]
        rows += [np.append(np.sin(half) * axis, np.cos(half)) for half in halves for axis in axes]
    return np.array(rows)


def outside_limits(robot: Robots, model: CableModel, found: ForwardRows) -> Indices:
    """Number of cables of each sample outside their robot's tension limits.

    Returns counts (N,); 0 for straight cables, whose tensions are not known.
    """
    limits = limits_of(robot)
    cables, contact = cables_of_results(robot, model, found.results, found.cable_status, found.pose_status.shape)
    tension = limited_tension(robot, cables, contact)
    low = (1.0 - _LIMIT_SLACK) * limits.low
    high = (1.0 + _LIMIT_SLACK) * limits.high
    count: Indices = ((tension < low) | (tension > high)).sum(axis=1)
    return count


def _is_plausible(robot: Robots, model: CableModel, found: ForwardRows) -> Flags:
    done = np.isin(found.pose_status, (codes.FORWARD_SOLVED, codes.FORWARD_NO_LENGTHS))
    return np.asarray(done & (outside_limits(robot, model, found) == 0))


def _rank(robot: Robots, model: CableModel, found: ForwardRows) -> Array:
    """Rows (status, cables outside their limits, energy) of which the smaller is the better, (N, 3)."""
    energy = np.nan_to_num(found.numbers[:, ENERGY], nan=0.0)
    return np.stack((_POOR[found.pose_status].astype(np.float64), outside_limits(robot, model, found), energy), axis=1)


def _is_better(new: Array, old: Array) -> Flags:
    first = np.argmax(new != old, axis=1)[:, None]
    return np.asarray(np.take_along_axis(new, first, 1) < np.take_along_axis(old, first, 1))[:, 0]
