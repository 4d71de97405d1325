"""Rating of candidates by the values of goals, and anchors that move to positions with the largest margin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import callback, instance, optional
from sagline.core.arrays import Array, Flags, Progress, blocks, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted, n
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels import codes, tables
from sagline.kernels.cable.batch import largest_sags
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.memory import memory_for
from sagline.kinematics.inverse_rows import InverseRows, decide_rows
from sagline.optimization.candidates import AnchorErrors, Candidates, PlatformBox, free_parts, impossible
from sagline.optimization.free import DesignVariable, Free
from sagline.optimization.request import AT_POSES, COUNTS, Goal, Measured, poses_of
from sagline.optimization.search import latin_hypercube
from sagline.robot.batch import has_routing
from sagline.robot.pose import Pose, PoseBox, PoseLike
from sagline.robot.robot import Robot
from sagline.statics.slopes import KernelStates
from sagline.statics.stiffness import least_stiffness
from sagline.statics.tables import body_table, cable_table, pose_rows
from sagline.tension.method import kernel_options
from sagline.tension.methods import MinimumNorm
from sagline.workspaces.levels import middle_wrench
from sagline.workspaces.margin import MarginRows, mean_arms
from sagline.workspaces.wrench_sets import NO_LOAD, WrenchSet

BLOCK = 1 << 12  # number of poses per block, which takes about 0.1 s; Ctrl-C is handled between blocks


def distribute(
    robot: Robot, model: CableModel, cables: Array, poses: Array, wrench: Array, *, stiffness: bool
) -> tuple[Array, Array, Array | None]:
    """Largest tension [N], largest sag [m] and least stiffness [N/m] of N poses, each (N,), with `MinimumNorm`."""
    # A value is NaN at a pose without feasible tensions. cables: one table (m, CABLE_COLUMNS) per pose. The stiffness,
    # which is computed only if requested, is the smallest stiffness against a force on the center of mass.
    method = MinimumNorm()
    options = kernel_options(robot, model, method.alone)
    count, m = cables.shape[:2]
    behind = has_routing(robot)
    found = InverseRows.empty(robot, count)
    body, load, memory = body_table(robot), locked(np.atleast_2d(wrench).copy()), memory_for(m)
    cables, poses = locked(np.ascontiguousarray(cables)), locked(np.ascontiguousarray(poses))
    terms = (robot.freedom, body, cables)
    reference = np.full(m, np.nan)
    for part in blocks(count, BLOCK):
        inverse_poses(
            *options, terms, poses, load, reference, memory, None, False, found.answers, part.start, part.stop
        )
    decide_rows(terms, options, poses, load, found)
    lost = found.pose_status != codes.POSE_SOLVED
    found.results[tables.LENGTH :, lost] = np.nan
    tension = found.results[tables.TENSION].max(axis=-1)
    sag = _sag(model, robot.gravity, found.results, cables).max(axis=-1)
    if not stiffness:
        return tension, sag, None
    states = KernelStates.of_rows((model.code, *model.parameters, behind or None), terms, poses, found.results)
    return tension, sag, least_stiffness(robot.freedom, states.describe().found[0])


def _sag(model: CableModel, gravity: float, results: Array, cables: Array) -> Array:
    """Sag (N, m) of each cable [m], from the rows `results` of the kernels."""
    length = results[tables.LENGTH]
    if len(results) > tables.BARE_ROWS:
        length = length - (results[tables.WRAPPED] + results[tables.DEAD])
    rows = (
        *(results[tables.SPAN], results[tables.RISE], cables[..., tables.DENSITY], cables[..., tables.STIFFNESS]),
        *(length, results[tables.HORIZONTAL], results[tables.VERTICAL], results[tables.TENSION]),
    )
    columns: Any = tuple(locked(np.ascontiguousarray(row).reshape(-1)) for row in rows)
    out = np.empty(length.size)
    largest_sags(model.terms(gravity), columns, out)
    return out.reshape(length.shape)


Margins: TypeAlias = Callable[[Array, Array], Array]  # (cable tables, pose rows) -> margins

SPREAD: Final = 4  # number of sample points per moving coordinate
STEP: Final = 0.25  # initial step of the search, relative to the distance between the bounds
ITERATIONS: Final = 14  # number of halvings of the step


def _move_anchors(inner: Candidates, margins: Margins, cables: Array, poses: Array) -> tuple[Array, Array]:
    """Anchor coordinates (R, q) with the largest margin for R pairs of cable table and pose row; margins (R,) [N]."""
    # The search for a local maximum begins at the best point of a sample, moves along one coordinate after another, and
    # halves the steps.
    count, q = len(poses), len(inner.parts)

    def at(points: Array) -> Array:
        moved = cables.copy()
        inner.write(moved, inner.values(points))
        return margins(moved, poses)

    best = np.repeat(inner.units(inner.start[None]), count, axis=0)
    found = at(best)

    def keep(points: Array) -> None:
        nonlocal best, found
        there = at(points)
        better = there > found
        best = np.where(better[:, None], points, best)
        found = np.where(better, there, found)

    for point in latin_hypercube(SPREAD * q, q, 0):
        keep(np.repeat(point[None], count, axis=0))
    step = STEP
    for _ in range(ITERATIONS):
        for k in range(q):
            for way in (-step, step):
                points = best.copy()
                points[:, k] = np.clip(points[:, k] + way, 0.0, 1.0)
                keep(points)
        step *= 0.5
    return inner.values(best), found


ROWS: Final = 1 << 14  # number of pose rows per block, which takes about 0.1 s


class Rating:
    """Callable object that rates candidates, prepared once per search."""

    def __init__(
        self,
        candidates: Candidates,
        goals: Sequence[Goal],
        wrenches: WrenchSet | None,
        poses: Pose,
        model: CableModel,
        robust: AnchorErrors | None,
        inner: Candidates | None,
    ) -> None:
        """Prepare the rating. Raises an error if a goal needs tensions but the initial robot is feasible at no pose."""
        self._candidates, self._goals, self._robust, self._inner = candidates, tuple(goals), robust, inner
        self._model, self._poses, self.rows = model, poses, pose_rows(poses)
        self._wrench = np.zeros(6) if wrenches is None else middle_wrench(wrenches)
        self._wrenches = NO_LOAD if wrenches is None else wrenches
        # All candidates are rated with the lever arm of the initial robot, so that margins are comparable.
        self._arm = float(mean_arms(cable_table(candidates.robot), body_table(candidates.robot))[0])
        self._needs = {goal.needs for goal in self._goals}
        self._solid = PlatformBox(candidates.robot, poses)
        self._held = np.ones(len(self.rows), dtype=np.bool_)
        if self._needs & set(AT_POSES):
            self._held = self._held_at(candidates.cables(candidates.start[None]))

    def __call__(self, values: Array) -> Array:
        """Goal values (N, g) of candidates with the design variables `values` (N, d)."""
        # Goal values are NaN for a candidate with coincident cables, with a lower tension limit above an upper limit,
        # or with a frame anchor inside the platform. If a goal needs tensions, goal values are also NaN for a candidate
        # that is infeasible at a pose at which the initial robot is feasible.
        size = max(1, ROWS // (len(self.rows) * (1 if self._robust is None else self._robust.samples)))
        parts = [self._rated(values[first : first + size]) for first in range(0, len(values), size)]
        return np.concatenate(parts)

    def margins(self, cables: Array, rows: Array) -> Array:
        """Margins (N,) [N] of R cable tables (R, m, CABLE_COLUMNS) at N pose rows, N/R rows per table."""
        # The margin is -inf at a pose at which a frame anchor is inside the platform.
        made = MarginRows(self._candidates.robot, self._wrenches, self._model, self._arm, cables)
        anchors = np.repeat(cables[..., : tables.FRAME_Z + 1], len(rows) // len(cables), axis=0)
        held = self._solid.holds_at(anchors, Pose._adopt(rows[:, :3], rows[:, 3:]))
        return np.where(held, -np.inf, made.rows(rows).value)

    def _rated(self, values: Array) -> Array:
        cables = self._candidates.cables(values)
        in_platform = (self._solid.holds(cables[..., : tables.FRAME_Z + 1]) >= 0).any(axis=-1)
        none = impossible(cables) | in_platform
        measured = self._measured(cables[~none], values[~none])
        found = np.full((len(values), len(self._goals)), np.nan)
        worst = self._robust is not None and self._robust.take == "worst"
        whole: Flags = np.ones(int((~none).sum()), dtype=np.bool_)
        if "tension" in measured:
            whole = np.asarray(~np.isnan(measured["tension"]).any(axis=(1, 2)))
        columns = [np.where(whole, goal.values(measured, worst=worst), np.nan) for goal in self._goals]
        found[~none] = np.stack(columns, axis=-1)
        return found

    def _measured(self, cables: Array, values: Array) -> Measured:
        """Quantities of candidates that the goals need, such as margins and tensions."""
        many = cables[:, None] if self._robust is None else self._robust.added(cables)
        shape = (*many.shape[:2], len(self.rows))
        robots = many.reshape(-1, *many.shape[2:])
        rows = np.tile(self.rows, (len(robots), 1))
        margin, each = np.zeros(shape), robots
        if self._inner is not None:
            each = np.repeat(robots, len(self.rows), axis=0)
            shifts, margin = _move_anchors(self._inner, self.margins, each, rows)
            self._inner.write(each, shifts)
        elif "margin" in self._needs:
            margin = self.margins(robots, rows)
        measured = {"margin": margin.reshape(shape)}
        if self._needs <= {"margin"}:
            return measured
        if self._inner is None:
            each = np.repeat(robots, len(self.rows), axis=0)
        if "cost" in self._needs:
            measured["cost"] = self._cost(each.reshape(*shape, *each.shape[1:]), values)
        if not self._needs & set(AT_POSES):
            return measured
        held = np.tile(self._held, shape[0] * shape[1])
        wanted = "stiffness" in self._needs
        found = distribute(self._candidates.robot, self._model, each[held], rows[held], self._wrench, stiffness=wanted)
        at_poses = zip(AT_POSES, found, strict=True)
        return measured | {name: one.reshape(*shape[:2], -1) for name, one in at_poses if one is not None}

    def _cost(self, cables: Array, values: Array) -> Array:
        """Cost (N, S) of the cables in tables (N, S, G, m, CABLE_COLUMNS), each as long as its longest chord."""
        costs = self._candidates.costs(values)
        if costs is None:
            step = "Add the design variable FreeCable([CableChoice(name, cable, cost=1.5), ...])."
            raise InvalidValueError("goals: cable_cost", "without a catalogue", "a FreeCable with costs", step)
        ends = cables[..., tables.PLATFORM_X : tables.PLATFORM_Z + 1] @ np.swapaxes(self._poses.matrix, -1, -2)
        chords = np.linalg.norm(ends + self._poses.position[:, None] - cables[..., : tables.FRAME_Z + 1], axis=-1)
        return np.asarray(costs[:, None] * chords.max(axis=2).sum(axis=-1))

    def _held_at(self, cables: Array) -> Flags:
        """True for each pose at which a robot has feasible tensions, shape (G,)."""
        each = np.repeat(cables, len(self.rows), axis=0)
        found = distribute(self._candidates.robot, self._model, each, self.rows, self._wrench, stiffness=False)
        held = ~np.isnan(found[0])
        if not held.any():
            value, step = "feasible at no pose", "Choose other poses, wrenches or tension limits."
            raise InvalidValueError(self._candidates.robot.name, value, "feasible at one pose or more", step)
        return held


_CATENARY: Final = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MovingAnchors(Result, Tabular):
    """Result of `moving_anchors`: anchor positions with the largest margin at each of G poses.

    Attributes:
        robot: The robot with the anchors at their original positions.
        pose: The poses, a batch of G.
        parts: The q moving coordinates.
        moved: Values of the moving coordinates at each pose, shape (G, q).
        margin: Margin with moved anchors [N], shape (G,).
        fixed_margin: Margin with the anchors at their original positions [N], shape (G,).
        moving: The argument `moving` of `moving_anchors`.
    """

    _columns: ClassVar[Columns] = ("pose", "margin", "fixed_margin")

    robot: Robot
    pose: Pose
    parts: tuple[DesignVariable, ...]
    moved: Array
    margin: Array
    fixed_margin: Array
    moving: tuple[Free, ...]

    def __str__(self) -> str:
        """Sentence with the mean increase of the margin by moving anchors."""
        gain = n(np.mean(self.margin - self.fixed_margin), unit="N") if len(self.moved) else "–"
        return f"{self.robot.name}, {counted(len(self.moved), 'pose')}: the margin is {gain} larger on average"

    @property
    def robots(self) -> tuple[Robot, ...]:
        """One robot per pose, with the anchors at the best positions, as an argument of functions such as `inverse`."""
        names = [self.robot.name] * len(self.moved)
        return Candidates(self.robot, self.moving, "moving").robots(self.moved, names)


def moving_anchors(
    robot: Robot,
    moving: Sequence[Free],
    wrenches: WrenchSet | None = None,
    poses: PoseLike | None = None,
    *,
    box: PoseBox | None = None,
    grid: Sequence[int] = COUNTS,
    model: CableModel | str = _CATENARY,
    progress: Progress | None = None,
) -> MovingAnchors:
    """Move anchors of a robot to the positions with the largest margin at each pose.

    The search begins at the best positions of a sample, and improves one coordinate after another.

    Args:
        robot: The robot.
        moving: Anchors that move, as `FreeAnchors`.
        wrenches: Set of wrenches, for example a `WrenchBox`; None for the platform's weight alone.
        poses: Poses; None for a grid of level poses in a box.
        box: Box of the grid; None for the robot's test box, level.
        grid: Number of poses of the grid along x, y and z.
        model: Cable model.
        progress: Function that is called repeatedly with the number of finished poses and the number of all poses.

    Returns:
        MovingAnchors with the anchor positions and margins at all poses.

    Raises:
        InvalidValueError: If an argument is of the wrong kind.

    Examples:
        Posts whose anchors move up and down together:

        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> posts = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="together")
        >>> load = sl.WrenchBox(force=50.0, moment=5.0)
        >>> found = sl.moving_anchors(robot, [posts], load, grid=(3, 3, 3))
        >>> bool((found.margin >= found.fixed_margin).all())
        True
    """
    callback(progress, "progress")
    optional(wrenches, WrenchSet, "wrenches")
    places = poses_of(instance(robot, Robot, "robot"), poses, box, grid)
    parts = free_parts(moving, "moving")
    if not parts:
        raise InvalidValueError("moving", "empty", "FreeAnchors", 'Give FreeAnchors("frame", low, high).')
    inner = Candidates(robot, parts, "moving")
    rating = Rating(inner, (Goal("mean_margin"),), wrenches, places, model_of(model), None, None)
    count = len(rating.rows)
    table = inner.cables(inner.start[None])
    moved, margin = np.empty((count, len(inner.parts))), np.empty(count)
    for part in blocks(count, BLOCK // 2, progress):
        own = np.repeat(table, part.stop - part.start, axis=0)
        moved[part], margin[part] = _move_anchors(inner, rating.margins, own, rating.rows[part])
    fixed = rating.margins(table, rating.rows)
    return MovingAnchors(robot, places, inner.parts, locked(moved), locked(margin), locked(fixed), parts)
