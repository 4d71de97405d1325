"""Forward kinematics: equilibrium pose from unstrained lengths, with or without an initial pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from attrs import field, fields, frozen
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import callback, check_poses, optional
from sagline.core.arrays import (
    LARGEST,
    SMALLEST,
    Array,
    Flags,
    Indices,
    Progress,
    blocks,
    checked,
    locked,
    numbers,
    rows_of,
)
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, reduced, rule
from sagline.core.results import Result
from sagline.kernels import codes, tables
from sagline.kinematics import forward_rows
from sagline.kinematics.forward_rows import ForwardRows, ForwardSolution, solve_forward_rows
from sagline.robot import batch
from sagline.robot.checks import PLANAR, ROTATING
from sagline.robot.equilibrium import Equilibrium, cables_of_results, limited_tension
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.robot.routing import differs, with_routing
from sagline.statics.balance import external_wrench
from sagline.statics.tables import pose_rows

_TILTS = (25.0, 60.0)  # tilts of the other start orientations, after the level one has failed [degree]
DEPTH = 0.1  # distance of the first position below the center, relative to the mean length
_LIMIT_SLACK = 0.01  # a tension counts as within its limits up to this relative excess
# status -> rank: a smaller rank is better, and FITTED has the same rank as SOLVED
_POOR = np.array([0, 1, 2, 3, 4, 5, 6, 0])


def search(
    robot: batch.Robots, model: CableModel, lengths: Array, wrenches: Array, progress: Progress | None = None
) -> ForwardRows:
    """Forward kinematics of lengths (N, m) without initial poses. Each sample is searched independently."""
    # With a fixed orientation the platform has a single equilibrium, because the energy is convex in the position. Any
    # start leads to this equilibrium. From there, the search continues with all motions free. The first start
    # orientation is level. If no stable equilibrium within the tension limits is found, the search is repeated from
    # tilted starts. The results are compared first by status, then by the number of cables outside their limits, then
    # by energy.
    count, m = lengths.shape
    found = ForwardRows.empty(robot, count)
    for part in blocks(count, max(1, forward_rows.BLOCK // m), progress):
        robots = batch.robots_at(robot, part)
        found.keep(part, _search_block(robots, model, lengths[part], rows_of(wrenches, part)))
    return found


def _search_block(robot: batch.Robots, model: CableModel, lengths: Array, wrenches: Array) -> ForwardRows:
    found = ForwardRows.empty(robot, len(lengths))
    ranks, left = np.full((len(lengths), 3), np.inf), np.arange(len(lengths))
    for quaternion in start_quaternions(batch.first_of(robot)):
        loads = wrenches if len(wrenches) == 1 else locked(wrenches[left])
        robots = batch.robots_at(robot, left)
        answer = from_orientations(robots, model, locked(lengths[left]), loads, quaternion)
        outside = _outside_limits(robots, model, answer)
        energy = np.nan_to_num(answer.numbers[:, tables.ENERGY], nan=0.0)
        rank = np.stack((_POOR[answer.pose_status].astype(np.float64), outside, energy), axis=1)
        first = np.argmax(rank != ranks[left], axis=1)[:, None]  # column of the first difference of two rankings
        better = np.flatnonzero(np.take_along_axis(rank, first, 1) < np.take_along_axis(ranks[left], first, 1))
        found.keep(left[better], answer, better)
        ranks[left[better]] = rank[better]
        done = np.isin(answer.pose_status, (codes.FORWARD_SOLVED, codes.FORWARD_NO_LENGTHS)) & (outside == 0)
        left = left[~done]
        if not len(left):
            break
    return found


def from_orientations(
    robot: batch.Robots, model: CableModel, lengths: Array, wrenches: Array, quaternion: Array
) -> ForwardRows:
    """Equilibria from the middle of the frame: first with fixed `quaternion` (4,) or (N, 4), then with all motions."""
    shared = batch.first_of(robot)
    freedom = shared.freedom
    starts = pose_rows(Pose.from_quaternion(_starting_positions(robot, lengths, quaternion), quaternion))
    if shared.motion_pattern not in ROTATING:
        return solve_forward_rows(robot, model, lengths, starts, wrenches)
    translations = locked(freedom[~freedom[:, 3:].any(axis=1)])
    placed = solve_forward_rows(robot, model, lengths, starts, wrenches, freedom=translations)
    return solve_forward_rows(robot, model, lengths, locked(placed.poses), wrenches)


def _starting_positions(robot: batch.Robots, lengths: Array, quaternion: Array) -> Array:
    """Start positions (N, 3) [m] slightly below the center of the frame ends, within the platform's free motions."""
    # The center itself is excluded, because there the two ends of a single cable would coincide.
    freedom = batch.first_of(robot).freedom
    depth = DEPTH * np.nan_to_num(lengths.mean(axis=1, keepdims=True), nan=1.0)
    position: Array = centered_positions(robot, quaternion) - depth * (freedom[:, 2] @ freedom[:, :3])
    return position


def centered_positions(robot: batch.Robots, quaternion: Array) -> Array:
    """Positions (3,) or (N, 3) at which the centroids of the platform ends and of the frame ends coincide [m]."""
    frame, platform = batch.robot_fields(robot, "frame_anchors", "platform_anchors")
    ends = platform.mean(axis=-2)
    vector, scalar = quaternion[..., :3], quaternion[..., 3:]
    turn = 2.0 * np.cross(vector, ends)
    position: Array = frame.mean(axis=-2) - (ends + scalar * turn + np.cross(vector, turn))
    return position


def start_quaternions(robot: Robot) -> Array:
    """Start orientations (K, 4), level, then tilted about each free rotation axis in both directions."""
    rows = [np.array([0.0, 0.0, 0.0, 1.0])]
    if robot.motion_pattern in ROTATING:
        axes = robot.freedom[2:, 3:] if robot.motion_pattern in PLANAR else np.eye(3)
        halves = [0.5 * sign * np.radians(tilt) for tilt in _TILTS for sign in (1.0, -1.0)]
        rows += [np.append(np.sin(half) * axis, np.cos(half)) for half in halves for axis in axes]
    return np.array(rows)


def _outside_limits(robot: batch.Robots, model: CableModel, found: ForwardRows) -> Indices:
    """Number of cables outside their tension limits, (N,), or 0 for straight cables, whose tensions are unknown."""
    least, most = batch.robot_fields(robot, "tension_min", "tension_max")
    cables, contact = cables_of_results(robot, model, found.results, found.cable_status, found.pose_status.shape)
    tension = limited_tension(robot, cables, contact)
    low = (1.0 - _LIMIT_SLACK) * least
    high = (1.0 + _LIMIT_SLACK) * most
    count: Indices = ((tension < low) | (tension > high)).sum(axis=1)
    return count


_STEPS = 100
_HALVINGS = 20
# The fit ends if a step would decrease the sum of squares by less than this share of it. The
# optimum is then closer than 1e-4 standard deviations.
_TOLERANCE = 1e-8


@frozen(eq=False, weakref_slot=False)
class MeasuredTension(Result):
    """Load cell data: tensions at the frame ends of the cables, and standard deviations of tensions and lengths.

    Attributes:
        frame_end_tension: Measured tensions [N], shape (m,) or (N, m); NaN for a cable without a load cell.
        tension_deviation: Standard deviation of a measured tension [N], > 0, a number or shape (m,).
        length_deviation: Standard deviation of an unstrained length [m], > 0, a number or shape (m,).

    Raises:
        InvalidValueError: If a measured tension is negative or infinite. If a deviation is not positive.
    """

    frame_end_tension: Array = field(converter=given, metadata=rule("N", low=0.0, missing=True))
    tension_deviation: Array = field(converter=given, metadata=rule("N", above=0.0))
    length_deviation: Array = field(converter=given, metadata=rule("m", above=0.0))

    def __attrs_post_init__(self) -> None:
        """Check the three fields."""
        for about in fields(MeasuredTension):
            object.__setattr__(self, about.name, checked(getattr(self, about.name), about.name, **about.metadata))

    __reduce__ = reduced


def _fit_measurements(
    robot: batch.Robots, model: CableModel, found: ForwardRows, loads: Array, measured: MeasuredTension
) -> Array:
    """Replace equilibria at measured lengths by best fits to lengths and tensions. Returns covariances (N, 6, 6)."""
    # For each sample, Gauss-Newton iterations find the lengths L_true with the smallest sum ((L_true - L)/sigma_L)^2 +
    # sum ((T_A - reading)/sigma_T)^2. The platform is in equilibrium at L_true. The search starts at the equilibria at
    # the measured lengths. The covariances refer to displacement of the center of mass and rotation vector; NaN without
    # a solution.
    if model.code == codes.STRAIGHT:
        step = "Use Catenary() with measured tensions."
        raise InvalidValueError("model", "Straight()", "a cable model other than Straight", step)
    lengths = found.results[tables.LENGTH]
    readings = _fitting("frame_end_tension", measured.frame_end_tension, lengths.shape)
    names = "tension_deviation", "length_deviation"
    deviations = [_fitting(name, getattr(measured, name), lengths.shape[1:]) for name in names]
    covariance = np.full((len(lengths), 6, 6), np.nan)
    for i in np.flatnonzero(found.stable):
        sample = np.array([i])
        load = locked(loads[i % len(loads)].copy())
        own = robot if isinstance(robot, Robot) else robot[i]
        given = own, model, lengths[i].copy(), load, readings[i], *deviations
        answer, covariance[i] = _best_fit(found.part(sample), *given)
        found.keep(sample, answer)
    return locked(covariance)


def _fitting(name: str, value: Array, shape: tuple[int, ...]) -> Array:
    try:
        return np.broadcast_to(value, shape)
    except ValueError:
        allowed = f"a shape that broadcasts to {shape}"
        raise InvalidValueError(name, f"of shape {value.shape}", allowed, f"Reshape {name}.") from None


def _best_fit(
    found: ForwardRows,
    robot: Robot,
    model: CableModel,
    measured: Array,
    load: Array,
    readings: Array,
    tension_deviation: Array,
    length_deviation: Array,
) -> tuple[ForwardRows, Array]:
    """Best fit to one sample, and covariance of its pose. The search starts at the equilibrium at measured lengths."""
    known = ~np.isnan(readings)

    def misfit(state: Equilibrium) -> Array:
        """Lengths and tensions of `state` minus the measured values, in standard deviations."""
        tensions = (state.cables.frame_end_tension - readings) / tension_deviation
        return np.concatenate(((state.unstrained_length - measured) / length_deviation, tensions[known]))

    def moved(step: Array, now: Array) -> tuple[ForwardRows, Equilibrium] | None:
        """Equilibrium after `step`. The step is halved until the fit improves; None if the fit never improves."""
        lengths, starts = found.results[tables.LENGTH], locked(found.poses.view())
        for _ in range(_HALVINGS):
            if (lengths + step > 0.0).all():
                new = solve_forward_rows(robot, model, locked(lengths + step), starts, load[None])
                there = new.solution(robot, model, load, ()).state
                missed = misfit(there)
                if new.stable[0] and missed @ missed < now @ now:
                    return new, there
            step = 0.5 * step
        return None

    from sagline.statics.stiffness import stiffness  # not needed for the confirmation of a plan

    state, covariance = found.solution(robot, model, load, ()).state, np.full((6, 6), np.nan)
    for _ in range(_STEPS):
        stiff, missed = stiffness(state), misfit(state)
        by_length = stiff.length_sensitivity
        misread = stiff.tension_sensitivity / tension_deviation[:, None]
        matrix = np.concatenate((np.diag(1.0 / length_deviation), misread[known]))
        inverse = np.linalg.inv(matrix.T @ matrix)
        downhill = -matrix.T @ missed
        step = inverse @ downhill
        covariance = by_length @ inverse @ by_length.T
        if step @ downhill <= _TOLERANCE:
            return found, covariance
        better = moved(step, missed)
        if better is None:
            break
        found, state = better
    found.pose_status[:] = codes.FORWARD_NOT_CONVERGED
    return found, covariance


_CATENARY = Catenary()


def forward(
    robot: Robot | Sequence[Robot],
    unstrained_length: ArrayLike,
    start: PoseLike | None = None,
    model: CableModel | str = _CATENARY,
    wrench: ArrayLike | None = None,
    tension_measured: MeasuredTension | None = None,
    *,
    winding: ArrayLike | None = None,
    progress: Progress | None = None,
) -> ForwardSolution:
    """Equilibrium pose of the platform on cables of given unstrained lengths.

    Args:
        robot: The robot, with m cables; or a sequence of N robots, one per sample. The robots must have the same number
            of cables, motion pattern, plane normal, type of tension limits and gravity; all other data may differ.
        unstrained_length: L [m], > 0, shape (m,) for one sample or (N, m). A row of NaN gets the status NO_LENGTHS. A
            plan has such a row at each infeasible pose.
        start: Initial pose. With a batch of N poses, each sample has its own start. With a single pose and N samples,
            the samples are a trajectory: the first sample starts at this pose, and each following sample at the
            previous result. With None, every sample is searched independently from the level platform. If several
            equilibria exist, the result is the first that is within the tension limits of the robot. To find the
            others, use `equilibria`.
        model: Cable model; the default is exact.
        wrench: External plus inertial wrench on the platform about its center of mass in world axes, without gravity:
            force [N], then moment [N m], shape (6,) or (N, 6). None for zero.
        tension_measured: Load cell data, or None. Lengths and tensions then count as measured values with standard
            deviations. The result is then the least-squares fit to lengths and tensions, and contains the covariance of
            the pose.
        winding: Last direction of each drum, which determines the friction of pulleys and guides: +1 winding in, -1
            paying out, 0 at rest, shape (m,) or (N, m). None: no friction. Friction and guides change the lengths; an
            iteration computes this change. With load cell data, the change is computed only once, at the measured
            lengths. With high friction and soft cables, several nearby poses can be equilibria.
        progress: Function that is called about ten times per second. The arguments are the number of solved samples and
            the number of all samples.

    Returns:
        ForwardSolution, single or with a leading axis N.

    Raises:
        InvalidValueError: If an argument has the wrong type or shape. If a length is not positive, not longer than the
            dead length, or NaN beside other lengths: the message names the cable. If several robots do not fit
            together: the message names the property. If `start` is outside the motions of the robot's pattern. If the
            samples need more memory than is free.

    Source:
        docs/model.md, section 6.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> plan = sl.inverse(robot, sl.Pose.from_euler([1, 1, 2], 0, 0, 0))
        >>> found = sl.forward(robot, plan.unstrained_length)
        >>> print(found.solved, found.pose.position.round(9))
        True [1. 1. 2.]
    """
    robots = batch.together(robot)
    start = None if start is None else pose_of(start, "start")
    optional(tension_measured, MeasuredTension, "tension_measured")
    model = model_of(model)
    callback(progress, "progress")
    lengths = checked_lengths(robots, unstrained_length)
    shape = lengths.shape[:-1]
    count = shape[0] if shape else None
    batch.check_count(robots, count)
    check_poses(count or 1, lengths.shape[-1], batch.has_routing(robots))
    load = external_wrench(wrench, count)
    direction = None if winding is None else forward_rows.checked_winding(winding, shape, lengths.shape[-1])
    samples, loads = np.atleast_2d(lengths), np.atleast_2d(load)
    if start is None:
        found = search(robots, model, samples, loads, progress)
    else:
        check_reach(batch.first_of(robots), start, "start")
        chained = bool(shape) and not start.shape
        starts = _start_rows(start, lengths)
        found = solve_forward_rows(robots, model, samples, starts, loads, chained=chained, progress=progress)
    if differs(robots, direction):
        found = forward_rows.iterate_routing(robots, model, found, samples, loads, direction)
    covariance = None
    if tension_measured is not None:
        covariance = _fit_measurements(robots, model, found, loads, tension_measured)
    solution = found.solution(robots, model, load, shape, covariance)
    return replace(solution, state=with_routing(solution.state, direction))


def checked_lengths(robot: batch.Robots, lengths: ArrayLike) -> Array:
    """Check lengths (m,) or (N, m) of a caller: positive and longer than the dead lengths, or NaN in whole rows."""
    array = numbers(lengths, "unstrained_length", "m")
    shared, dead = batch.first_of(robot), batch.dead_cable(robot)
    m = shared.cable_count
    if array.ndim not in (1, 2) or array.shape[-1] != m:
        allowed, step = f"shape ({m},) or (N, {m})", f"Give one length for each of the {m} cables of {shared.name}."
        raise InvalidValueError("unstrained_length", f"of shape {array.shape}", allowed, step)
    absent = np.isnan(array).all(axis=-1, keepdims=True)
    wrong = ~((array >= SMALLEST) & (array < LARGEST)) & ~absent
    if wrong.any():
        index, item = _first(wrong)
        allowed = "> 0 m, finite; or NaN for all cables of a sample"
        raise InvalidValueError(item, f"{array[index]:g} m", allowed, "Correct the length of this cable.")
    fitting = dead.shape[:-1] in ((), array.shape[:-1])  # a later check refuses a wrong number of lengths
    if fitting and ((array <= dead) & (dead > 0.0)).any():
        raise dead_only(array, np.broadcast_to(dead, array.shape))
    return locked(array)


def dead_only(lengths: Array, dead: Array) -> InvalidValueError:
    """Error for lengths (m,) or (N, m) that do not exceed the dead length; the message names the first one."""
    index, item = _first((lengths <= dead) & (dead > 0.0))
    allowed = f"> {dead[index]:.9g} m, the dead length between drum and pulley"
    step = "Give the length of all cable off the drum, or correct dead_cable."
    return InvalidValueError(item, f"{lengths[index]:.9g} m", allowed, step)


def _first(wrong: Flags) -> tuple[tuple[int, ...], str]:
    """Index of the first True in `wrong` (m,) or (N, m), and the name of this length for messages."""
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    sample = f"sample {index[0]}, " if wrong.ndim == 2 else ""
    return index, f"{sample}cable {index[-1]}: unstrained length"


def _start_rows(start: Pose, lengths: Array) -> Array:
    """Pose rows (1 or N, POSE_COLUMNS) of the starts for lengths of shape (m,) or (N, m)."""
    if start.shape and start.shape != lengths.shape[:-1]:
        allowed = f"one pose, or {len(lengths)}" if lengths.ndim == 2 else "one pose, for one sample"
        step = "Give one start pose per sample, or a single one."
        raise InvalidValueError("start", f"{len(start)} poses", allowed, step)
    return pose_rows(start)
