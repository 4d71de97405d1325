"""Signed margin of a wrench set: the additional load that the cables can balance; positive inside the workspace."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import callback, check_memory
from sagline.core.arrays import Array, Codes, Flags, Indices, Progress, blocks, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted, n
from sagline.core.results import Columns, Result, Status, Tabular
from sagline.kernels import codes, tables
from sagline.kernels.memory import memory_for
from sagline.kernels.workspaces.signed_margin import margin_memory, signed_margins
from sagline.kernels.workspaces.wrench_set import SetTerms
from sagline.robot.batch import Robots, first_of, has_slanted_axes, one_a_pose, robot_fields, together
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.reach import check_cable_count, check_reach
from sagline.robot.robot import Robot
from sagline.statics.tables import check_slanted, eyelets_at, geometry_of, pose_rows, robot_terms, tangent_exits
from sagline.tension.method import LIMITS_OF
from sagline.workspaces.moving_exits import Bracket, with_moving_exits
from sagline.workspaces.wrench_sets import NO_LOAD, WrenchSet, load_of

if TYPE_CHECKING:
    from sagline.kernels.inverse.poses import LimitTerms, ModelTerms
    from sagline.kernels.inverse.poses import Robots as RobotTerms

    _Given = tuple[ModelTerms, LimitTerms, RobotTerms, SetTerms, tuple[Array, Array]]

BLOCK = 1 << 13  # poses per block; a block takes about 0.1 s, and interrupts are handled between blocks
_CATENARY, _ALL = Catenary(), slice(None)


class MarginRows:
    """Margins of pose rows, for one robot or for robots with the same motion pattern, gravity and number of cables.

    All pose-independent data are prepared once. A call of `rows` then takes a few microseconds, plus a few microseconds
    per pose. Several threads may call `rows` at the same time.
    """

    __slots__ = ("_given", "_robots", "cable_count", "robot_count")

    def __init__(
        self,
        robot: Robot | Sequence[Robot],
        wrenches: WrenchSet = NO_LOAD,
        model: CableModel = _CATENARY,
        moment_arm: float | None = None,
        cables: Array | None = None,
    ) -> None:
        """Prepare one robot or R robots. `moment_arm` [m]: as in `margin`."""
        # If `cables` (R, m, CABLE_COLUMNS) is given, the R robots are copies of `robot` with these tables of cables.
        robots = together(robot)
        shared = first_of(robots)
        moving = not model.weightless and has_slanted_axes(robots)
        if moving:
            check_slanted(robots, model)
        # robots with exit points that move with the tensions
        self._robots = (robots, model) if moving else None
        freedom, bodies, table = robot_terms(robots, slanted=cables is None)
        if cables is not None:
            table = _locked(cables)
        check_cable_count(shared)
        self.cable_count = m = shared.cable_count
        alike = cables is None or table.shape[1:] == (m, tables.CABLE_COLUMNS)
        if not alike or not len(table) or len(bodies) not in (1, len(table)):
            wanted, step = f"shape (R, {m}, {tables.CABLE_COLUMNS})", "Make the tables with cable_table(robot)."
            raise InvalidValueError("cables", f"of shape {table.shape}", wanted, step)
        self.robot_count = len(table)
        limits, terms = (LIMITS_OF[shared.tension_limits_of], np.nan), (freedom, bodies, table)
        (inertias,) = robot_fields(robots, "inertia")
        loads = _set_terms(wrenches, _locked(inertias.reshape(-1, 3, 3)))
        self._given = (model.code, *model.parameters), limits, terms, loads, _arms(table, bodies, moment_arm)

    def about(self, wrench: Array) -> MarginRows:
        """`MarginRows` for the wrench set shifted by `wrench` [N, N m], (6,), which is not checked."""
        model, limits, terms, loads, arms = self._given
        moved = object.__new__(MarginRows)
        moved.cable_count, moved.robot_count, moved._robots = self.cable_count, self.robot_count, self._robots
        moved._given = (model, limits, terms, (_locked(loads[0] + wrench), *loads[1:]), arms)
        return moved

    def rows(self, poses: NDArray[np.float64], progress: Progress | None = None) -> Bracket:
        """Margins at the rows `poses` (N, 7), N/R per robot, without checks. Rows with NaN get the status NO_CHORD."""
        rows = np.ascontiguousarray(poses, dtype=np.float64).view()
        count = len(rows)
        if count % self.robot_count:
            step = f"Give every one of the {self.robot_count} robots the same number of poses."
            raise InvalidValueError("poses", f"{count} of them", f"a multiple of {self.robot_count}", step)
        if self._given[2][2].shape[2] == tables.CABLE_COLUMNS:
            return _measured(self._given, rows, progress)
        model, limits, (freedom, *terms), loads, both = self._given
        bodies, table, inertias, arm, lever = (_each(array, count) for array in (*terms, loads[-1], *both))
        pose, geometry = Pose._adopt(rows[:, :3], rows[:, 3:]), geometry_of(table, bodies, rows)

        def at_exits(exits: Array, off: Array | None = None, which: Indices | slice = _ALL) -> Bracket:
            """Margins of the poses `which` of cables from eyelets at `exits`. `off`: wrenches of winches aboard."""
            eyelets = locked(eyelets_at(_at(table, which), pose[which], exits))
            own, arms = (freedom, _at(bodies, which), eyelets), (_at(arm, which), _at(lever, which))
            given = model, limits, own, (*loads[:-1], _at(inertias, which)), arms
            return _measured(given, rows[which], progress if which is _ALL else None, off)

        exits = tangent_exits(table, pose, geometry)
        if self._robots is None:
            return at_exits(exits)
        robots, cable_model = self._robots
        if not isinstance(robots, Robot):
            robots = tuple(robots[k * len(robots) // count] for k in range(count))
        given = limits[0], bodies, table, geometry, arm
        return with_moving_exits(robots, cable_model, pose, exits, given, (*loads[:-1], inertias), at_exits)


def _measured(given: _Given, rows: Array, progress: Progress | None, off: Array | None = None) -> Bracket:
    """Margins at the poses `rows` (N, 7) from the arguments of the kernel. `off`: further wrenches, one per pose."""
    count, (freedom, _bodies, table) = len(rows), given[2]
    m = table.shape[1]
    numbers, counters = _memory_sizes(len(freedom), m)
    memory = np.empty(numbers), np.empty(counters, dtype=np.int64), np.empty(m, dtype=np.int8)
    margins = (
        np.empty((3, count)),
        np.empty((count, 6)),
        np.empty(count, dtype=np.int64),
        np.empty(count, dtype=np.int8),
    )
    arguments = locked(rows), memory, margins
    if off is not None:
        for k in (k for part in blocks(count, BLOCK, progress) for k in range(part.start, part.stop)):
            loads = locked(given[3][0] + off[k]), *given[3][1:]
            signed_margins(*given[:3], loads, given[4], *arguments, k, k + 1)
    elif count <= BLOCK and progress is None:
        signed_margins(*given, *arguments, 0, count)
    else:
        for part in blocks(count, BLOCK, progress):
            signed_margins(*given, *arguments, part.start, part.stop)
    values, directions, limiting, statuses = margins
    return Bracket(values[0], values[1], values[2], limiting, statuses, directions)


@lru_cache(maxsize=64)
def _memory_sizes(n: int, m: int) -> tuple[int, int]:
    """Sizes of the work arrays of the kernel for n free motions and m cables: numbers and counters."""
    numbers, counters = memory_for(m)
    return 2 * numbers.size + margin_memory(n, m), 2 * counters.size


def _each(array: Array, count: int) -> Array:
    """Rows of `count` poses from the rows of one or R robots; one row remains one row."""
    return array if len(array) == 1 else locked(np.repeat(array, count // len(array), axis=0))


def _at(array: Array, which: Indices | slice) -> Array:
    """Rows `which` of an array with one row per pose; one row remains one row."""
    return array if len(array) == 1 else locked(array[which])


def mean_arms(table: Array, bodies: Array) -> Array:
    """Mean distance (R,) [m] of platform anchors from center of mass. `table`: cable_table. `bodies`: body_table."""
    anchors = table[:, :, tables.PLATFORM_X : tables.PLATFORM_Z + 1]
    centers = bodies[:, None, tables.CENTER_X : tables.CENTER_Z + 1]
    return np.asarray(np.linalg.norm(anchors - centers, axis=-1).mean(axis=-1))


def _arms(table: Array, bodies: Array, moment_arm: float | None) -> tuple[Array, Array]:
    """Lever arms of the norm [m] (0 allowed), and positive lever arms [m] by which moments are divided."""
    means = mean_arms(table, bodies)
    own = means if moment_arm is None else np.array([number(moment_arm, "moment_arm", "m", low=0.0)])
    return locked(own), locked(np.where(means > 0.0, means, 1.0))


def _set_terms(wrenches: WrenchSet, inertias: Array) -> SetTerms:
    """Wrench set in the form for the kernel: all segments along a single axis become one box."""
    segments = np.abs(wrenches.segments)
    straight = np.count_nonzero(segments, axis=1) <= 1
    half = segments[straight].sum(axis=0)
    others = _locked(wrenches.segments[~straight])
    ellipsoids, corners, sizes = _locked(wrenches.ellipsoids.transpose(0, 2, 1)), wrenches.corners, wrenches.sizes
    return wrenches.center, locked(half), others, ellipsoids, corners, sizes, wrenches.accelerations, inertias


def _locked(array: Array) -> Array:
    return locked(np.ascontiguousarray(array, dtype=np.float64).view())


class MarginStatus(Status):
    """Status of one pose of a margin; `text` states its meaning and the next step."""

    FEASIBLE = codes.MARGIN_FEASIBLE, "the cables, with their sag, balance every load of the set within their limits"
    INFEASIBLE = (
        codes.MARGIN_INFEASIBLE,
        "at least one load of the set exceeds the limits of the cables, for any sag force; move the platform, "
        "widen the limits of the limiting cable, or reduce the load",
    )
    OPEN = (
        codes.MARGIN_OPEN,
        "zero is within the bracket of the margin, so nothing is proved; call inverse at single loads, or move the "
        "platform by a millimeter",
    )
    SINGULAR = (
        codes.MARGIN_SINGULAR,
        "the structure matrix has lost rank: no cable resists some motion; move the platform",
    )
    NO_CHORD = (
        codes.MARGIN_NO_CHORD,
        "both ends of a cable coincide, or its platform end is inside its pulley or below it, nearer to the swivel "
        "axis than the pulley's diameter, or the pose is not known; move the platform away from the anchor",
    )
    TOO_SLACK = (
        codes.MARGIN_TOO_SLACK,
        "the largest allowed tension of a cable is less than a tenth of its weight; raise tension_max",
    )


_POSE_BYTES = 200.0  # memory per pose for rows and results [bytes]


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Margin(Result, Tabular):
    """Result of `margin` at a single pose or at N poses.

    Attributes:
        robot: The robot, or one robot per pose.
        pose: The poses.
        wrenches: The set of loads.
        moment_arm: Lever arm that converts moments to forces [m]; None for each robot's mean lever arm.
        value: Largest additional load that can be balanced in every direction [N], shape () or (N,). A moment counts as
            a force at the lever arm. A negative value is minus the excess of the load. The value is infinite for
            straight cables without limits. The value is -infinite if the pose has no margin (see status), or if a cable
            has no admissible tension. The value is never NaN. The value is a continuous function of the pose, except
            for small jumps where the exact shape of the cables determines its sign.
        low: Lower bound of the margin for all sag forces [N], with the shape of value. If this bound is nonnegative,
            every load of the set is proved feasible. Without sag, both bounds are equal to the value.
        high: Upper bound of the margin [N]. If the bound is negative, at least one load is proved infeasible.
        direction: Normal of the nearest facet, shape (..., 6): force part, and moment part [1/m], in world axes. The
            length of the vector is 1 if the moment part is multiplied by the lever arm. An additional load opposite to
            `direction` exceeds the limits first. If the force part is zero, such a load is a pure moment.
        limiting_cable: Index of the cable whose tension limit has the largest effect on the value, -1 for none, with
            the shape of value.
        status: Codes of `MarginStatus`, with the shape of value.
    """

    _columns: ClassVar[Columns] = ("pose", "value", "low", "high", "limiting_cable", ("status", MarginStatus))

    robot: Robots
    pose: Pose
    wrenches: WrenchSet
    moment_arm: float | None
    value: Array
    low: Array
    high: Array
    direction: Array
    limiting_cable: Indices
    status: Codes

    @property
    def feasible(self) -> Flags:
        """True if every load of the set is proved feasible, shape () or (N,)."""
        return locked(np.asarray(self.status == MarginStatus.FEASIBLE))

    def __str__(self) -> str:
        """Margin of a single pose; for a batch, the number of poses per status, the smallest and the largest margin."""
        if self.value.ndim == 0:
            cable = f", cable {int(self.limiting_cable)}" * (int(self.limiting_cable) >= 0)
            status = MarginStatus(int(self.status))
            alone = -np.inf < float(self.value) < 0.0 and not self.direction[:3].any()
            return (
                f"{_newtons(self.value)}{cable}: {status.name}, {status.text}"
                + "; the moments alone are infeasible" * alone
            )
        kinds, counts = np.unique(self.status, return_counts=True)
        each = ", ".join(f"{count:,} {MarginStatus(int(kind)).name}" for kind, count in zip(kinds, counts, strict=True))
        if not len(self.value):
            return counted(0, "pose")
        return (
            f"{counted(len(self.value), 'pose')}, {_newtons(self.value.min())} to {_newtons(self.value.max())}: {each}"
        )


def _newtons(value: ArrayLike) -> str:
    """Text of a margin in newtons, finite or infinite."""
    number = float(np.asarray(value))
    return n(number, unit="N") if np.isfinite(number) else f"{number:g} N".replace("-", "−")


def margin(
    robot: Robot | Sequence[Robot],
    pose: PoseLike,
    wrenches: WrenchSet | None = None,
    *,
    model: CableModel | str = _CATENARY,
    moment_arm: float | None = None,
    progress: Progress | None = None,
) -> Margin:
    """Signed margin of a set of loads at each pose, with a bracket for the cables' sag.

    A pose without a tension distribution also has a margin. The bracket from `low` to `high` is proved for the sag
    forces of all tensions. If low >= 0, every load of the set can be balanced within the limits. If high < 0, at least
    one load cannot be balanced. If zero is within the bracket, `inverse` can decide on a single load. The admissible
    tensions are the same as in `inverse`: a sagging cable is at most fifteen times as long as its chord, and a cable
    without upper limit is stretched to at most twice its length.

    Args:
        robot: The robot, or a sequence of N robots, one per pose.
        pose: A single pose or N.
        wrenches: The set of loads; None for the weight alone.
        model: Cable model; with `Straight()` both ends of the bracket are equal to the value.
        moment_arm: Lever arm [m], >= 0; a moment counts as a force at this arm. None: the mean distance of the platform
            anchors from the center of mass. 0: only additional forces count, as in `capacity_margin`. The value is then
            -infinite if the moments alone are infeasible.
        progress: Function that is called from time to time with the number of finished poses and of all poses.

    Returns:
        Margin.

    Raises:
        InvalidValueError: If an argument is of the wrong kind. If the robot has fewer cables than degrees of freedom.
            If its motion pattern does not allow the motion from the first pose to another pose.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> pose = sl.Pose.from_euler([0, 0, 2], 0, 0, 0)
        >>> found = sl.margin(robot, pose, sl.WrenchBox(force=100.0, moment=20.0))
        >>> print(found.value.round(1), "N beyond the set;", bool(found.feasible))
        91.1 N beyond the set; True

    Source:
        docs/model.md, section 13; Guay, Cardou, Cruz-Ruiz & Caro 2014.
    """
    pose, model = pose_of(pose), model_of(model)
    shape = pose.shape
    robots = one_a_pose(robot, shape[0] if shape else None)
    check_reach(first_of(robots), pose, "pose")
    report = callback(progress, "progress")
    load = load_of(wrenches)
    arm = None if moment_arm is None else number(moment_arm, "moment_arm", "m", low=0.0)
    prepared = MarginRows(robots, load, model, arm)
    rows = pose_rows(pose)
    size = _POSE_BYTES + (8.0 * tables.CABLE_COLUMNS * prepared.cable_count if has_slanted_axes(robots) else 0.0)
    check_memory(f"margins at {len(rows):,} poses", size * len(rows), "Divide the poses between several calls.")
    found = prepared.rows(rows, report)
    value, low, high, cable, status = (locked(array.reshape(shape)) for array in found[:5])
    direction = locked(found.direction.reshape(*shape, 6))
    return Margin(robots, pose, load, arm, value, low, high, direction, cable, status)
