"""Level (signed feasibility) as a function of the position, values in a plane, and pose nearest to feasibility."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Indices, blocks, locked
from sagline.core.numbers import n
from sagline.core.results import Result
from sagline.kernels import codes
from sagline.kinematics.inverse import inverse
from sagline.kinematics.inverse_rows import Given as GivenValue
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.workspaces.balanced import BalancedMargins
from sagline.workspaces.criteria import LeastMargin
from sagline.workspaces.criterion import Criterion, Given
from sagline.workspaces.grid import Grid
from sagline.workspaces.margin import MarginRows
from sagline.workspaces.moving_exits import Bracket
from sagline.workspaces.region import AXES, Orientations
from sagline.workspaces.wrench_sets import NO_LOAD, WrenchSet

Hull = Literal["exact", "inner", "outer"]
BLOCK: Final = 1 << 12  # poses per block; a block takes about 0.1 s, and interrupts are handled between blocks


class Details(NamedTuple):
    """Levels and limiting criteria at N positions."""

    level: Array  # >= 0 inside, shape (N,)
    margin: Array  # margin of the loads, in the limiting rotation [N], shape (N,)
    criterion: Indices  # index of the limiting criterion, shape (N,)
    cable: Indices  # limiting cable, -1 for none, shape (N,)
    rotation: Indices  # index of the limiting rotation, shape (N,)
    # Error bound of the level, shape (N,). The bound is 0 if the sign of the level is certain or another criterion than
    # the margin is limiting.
    uncertainty: Array


@dataclass(eq=False)
class Levels:
    """Level function: the smallest value of all criteria, each divided by its scale, at a position; >= 0 inside."""

    # If the margin is negative, no tensions exist, and criteria on tensions are ignored. The level at a position is the
    # smallest level of all rotations, or the largest level if one feasible rotation is sufficient.
    # `middle` is the middle of the wrench set, shape (6,); the tensions balance this wrench.

    robot: Robot
    wrenches: WrenchSet  # set of loads
    orientations: Orientations
    criteria: tuple[Criterion, ...]  # the criteria, the margin first
    model: CableModel
    tension: TensionMethod
    moment_arm: float | None  # lever arm as in `margin` [m]
    # for a planar workspace, the normal axis and the coordinate of its plane [m]; otherwise None
    held: tuple[int, float] | None = None
    # function that is called after each block with the number of poses in the block
    on_block: Callable[[int], None] | None = None
    # margin to use: "exact" for its value, "inner" for its lower bound, "outer" for its upper bound
    hull: Hull = "exact"
    # given values of an underconstrained platform, as in `inverse`; None for its default
    given: tuple[GivenValue, ...] | None = None

    def __post_init__(self) -> None:
        """Prepare the margin."""
        self.middle = middle_wrench(self.wrenches)
        self._margins = self._margins_under(self.wrenches)
        self._scales = [one.scale(self.robot) for one in self.criteria]

    def __call__(self, positions: Array) -> Array:
        """Levels (N,) at positions (N, 3) of the platform origin [m]; -inf if a criterion has no value."""
        return self.details(positions).level

    def details(self, positions: Array) -> Details:
        """Levels with limiting criterion, cable and rotation, at positions (N, 3) of the platform origin [m]."""
        count = len(positions)
        level, margin, uncertainty = np.empty((3, count))
        criterion, cable, rotation = np.full((3, count), -1)
        found = Details(level, margin, criterion, cable, rotation, uncertainty)
        for part in blocks(count, BLOCK):
            own = self._block(self.in_plane(positions[part]))
            for whole, piece in zip(found, own, strict=True):
                whole[part] = piece
            if self.on_block is not None:
                self.on_block(len(own.level))
        return Details(*map(locked, found))

    def in_plane(self, positions: Array) -> Array:
        """Positions (N, 3) [m]; for a planar workspace, their projections onto the plane."""
        if self.held is None:
            return positions
        axis, where = self.held
        flat = positions.copy()
        flat[:, axis] = where
        return flat

    def margins_of(self, wrenches: WrenchSet, positions: Array, rotation: Indices) -> Array:
        """Margins (N,) [N] of `wrenches` at `positions` (N, 3) [m]. `rotation`: indices of the rotations, (N,)."""
        rows = np.hstack((self.in_plane(positions), self.orientations.quaternion[rotation]))
        return self._margins_under(wrenches).rows(rows).value

    def _margins_under(self, wrenches: WrenchSet) -> MarginRows | BalancedMargins:
        """Margins of a wrench set as a function of pose rows."""
        if is_underconstrained(self.robot):
            return BalancedMargins(self.robot, wrenches, self.model, self.given)
        return MarginRows(self.robot, wrenches, self.model, self.moment_arm)

    def _block(self, positions: Array) -> Details:
        found = self._in_rotation(positions, 0)
        for k in range(1, len(self.orientations)):
            other = self._in_rotation(positions, k)
            worse = other.level < found.level
            taken = worse if self.orientations.need == "all" else ~worse
            found = Details(*(np.where(taken, theirs, ours) for theirs, ours in zip(other, found, strict=True)))
        return found

    def _in_rotation(self, positions: Array, rotation: int) -> Details:
        """Details at positions, in one rotation."""
        rows = self.orientations.at(positions, rotation)
        bracket = self._margins.rows(rows)
        margin = {"exact": bracket.value, "inner": bracket.low, "outer": bracket.high}[self.hull]
        given = Given(self.robot, self.model, self.tension, self.middle, rows, margin, bracket.cable, self.given)
        level, criterion = np.full(len(rows), np.inf), np.zeros(len(rows), dtype=np.int64)
        cable = np.array(bracket.cable, dtype=np.int64)
        for index, (one, scale) in enumerate(zip(self.criteria, self._scales, strict=True)):
            if one.needs_tensions and not given.held.any():
                continue
            judged = one.judge(given)
            # If tensions exist, but the tension method does not find them, the pose counts as outside. At other poses
            # without tensions, the margin decides.
            lost = np.isnan(judged.value) & (bracket.low >= 0.0)
            value = np.where(lost, -np.inf, judged.value / scale)
            least = value < level  # the comparison is False for NaN
            level[least], criterion[least] = value[least], index
            cable[least] = -1 if judged.cable is None else judged.cable[least]
        uncertainty = np.where(criterion == 0, self._uncertainty(bracket), 0.0)
        return Details(level, margin, criterion, cable, np.full(len(rows), rotation, dtype=np.int64), uncertainty)

    def _uncertainty(self, bracket: Bracket) -> Array:
        """Distance from the reserve to the farther margin bound, divided by the scale; 0 outside `bracket`."""
        reserve = self.criteria[0].limit if isinstance(self.criteria[0], LeastMargin) else 0.0
        unsure = (bracket.low < reserve) & (reserve <= bracket.high)
        if reserve == 0.0:
            unsure &= bracket.status == codes.MARGIN_OPEN
        if self.hull != "exact" or not unsure.any():
            return np.zeros(len(bracket.value))
        farther = np.maximum(reserve - bracket.low, bracket.high - reserve) / self._scales[0]
        return np.where(unsure, farther, 0.0)


_IN_PLANE: Final = ((1, 2), (0, 2), (0, 1))  # horizontal and vertical axis of a drawing, for each normal axis


class Plane(NamedTuple):
    """A plane perpendicular to an axis of the world."""

    normal: int  # index of the axis, 0 to 2
    at: float  # coordinate of the plane along the axis [m]

    @property
    def axes(self) -> tuple[int, int]:
        """Horizontal and vertical axis of a drawing of the plane."""
        return _IN_PLANE[self.normal]

    def __str__(self) -> str:
        """Equation of the plane."""
        return f"{AXES[self.normal]} = {self.at:.3g} m"

    def positions(self, across: Array, up: Array) -> Array:
        """Positions (U C, 3) [m] of a grid, row by row; across, up: coordinates of the C columns and U rows [m]."""
        places = np.empty((up.size, across.size, 3))
        first, second = self.axes
        places[..., self.normal] = self.at
        places[..., first], places[..., second] = across, up[:, None]
        return places.reshape(-1, 3)


Find = Callable[[Array], Details]


@dataclass(frozen=True, slots=True, eq=False)
class Slice:
    """Levels and margins on a grid in a plane."""

    plane: Plane
    across: Array  # coordinates of the columns [m], shape (C,)
    up: Array  # coordinates of the rows [m], shape (U,)
    level: Array  # level of each node, >= 0 in the workspace, shape (U, C)
    # signed margins [N], shape (U, C): negative if the loads are infeasible, -infinite if the robot is singular
    margin: Array
    criterion: Indices  # index of the limiting criterion, shape (U, C)
    cable: Indices  # limiting cable, -1 for none, shape (U, C)


def slice_of(find: Find, plane: Plane, low: Array, high: Array, shape: tuple[int, int]) -> Slice:
    """Slice through `find`, a function of positions such as `Levels.details`. `low`, `high`: box corners (3,) [m]."""
    first, second = plane.axes
    across, up = np.linspace(low[first], high[first], shape[0]), np.linspace(low[second], high[second], shape[1])
    found = find(plane.positions(across, up))
    grid = (up.size, across.size)
    parts = (found.level, found.margin, found.criterion, found.cable)
    return Slice(plane, locked(across), locked(up), *(locked(part.reshape(grid)) for part in parts))


def middle_wrench(wrenches: WrenchSet) -> Array:
    """Middle of a wrench set: force [N], moment [N m], shape (6,). For a polytope, the mean of its corners."""
    ends = np.cumsum(wrenches.sizes)
    means = [wrenches.corners[end - size : end].mean(axis=0) for end, size in zip(ends, wrenches.sizes, strict=True)]
    return locked(wrenches.center + sum(means, start=np.zeros(6)))


_STARTS: Final = 3  # the search starts from this number of best grid points
_STEP: Final = 0.1  # initial step, as a share of the box
_EVALUATIONS: Final = 300  # largest number of evaluations from each start
_PRECISION: Final = 1e-4  # precision of the position [m]
_FAR: Final = 1e6  # an infinite level is replaced by this finite value in the search
_UNHELD: Final = 1e3  # amount by which the merit of infeasible poses is reduced if criteria need tensions


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Nearest(Result):
    """Pose that is nearest to feasibility.

    Attributes:
        pose: A single pose.
        level: Level of the pose: < 0, or >= 0 if the search has found a feasible region that is smaller than a cell.
        margin: Margin of the loads at the pose [N].
        criterion: Index of the most violated criterion.
        cables: Indices of the cables that make the pose infeasible.
        reason: Sentence that explains why the pose is infeasible.
    """

    pose: Pose
    level: float
    margin: float
    criterion: int
    cables: tuple[int, ...]
    reason: str

    def __str__(self) -> str:
        """The reason."""
        return self.reason


def nearest_to(levels: Levels, grid: Grid, low: Array, high: Array) -> Nearest:
    """Pose with the largest level, by simplex searches from the best nodes of `grid`. `low`, `high`: corners [m]."""
    nodes = np.stack(np.unravel_index(np.arange(grid.values.size), grid.values.shape), axis=1)
    positions = np.clip(grid.positions(nodes), low, high)
    values = _merit(levels, positions)
    order = np.argsort(values)[::-1][:_STARTS]
    best, found = positions[order[0]], float(values[order[0]])
    for start in positions[order][values[order] > -_FAR]:
        place, value = _simplex_search(levels, start, low, high)
        if value > found:
            best, found = place, value
    details = levels.details(best[None])
    rows = levels.orientations.at(best[None], int(details.rotation[0]))
    pose = Pose._adopt(rows[0, :3].copy(), rows[0, 3:].copy())
    cables, reason = _reason(levels, pose, details)
    margin, criterion = float(details.margin[0]), int(details.criterion[0])
    return Nearest(pose, float(details.level[0]), margin, criterion, cables, reason)


def _merit(levels: Levels, positions: Array) -> Array:
    """Finite merit of `positions`: the level, or a value from the feasible fraction if the loads are infeasible."""
    # With the margin as merit, the search would end at singular poses, where all margins are small.
    found = levels.details(positions)
    bare = levels.margins_of(NO_LOAD, positions, found.rotation)
    weight = levels.criteria[0].scale(levels.robot)
    with np.errstate(divide="ignore", invalid="ignore"):
        short = np.where(bare > 0.0, _share(bare, found.margin), bare / weight) - 1.0
    tensions = any(one.needs_tensions for one in levels.criteria)
    short -= _UNHELD if tensions else 0.0  # levels of poses with tensions are above this value
    return np.maximum(np.where(found.margin >= 0.0, found.level, short), -_FAR)


def _share(bare: Array, margin: Array) -> Array:
    """Lower bound of the feasible fraction of the load. The bound holds because margins are concave in the load."""
    return np.asarray(bare / (bare - margin))


def _simplex_search(levels: Levels, start: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Position of a local maximum of the merit, found by a simplex search from `start`, and the merit there."""
    from scipy.optimize import minimize  # this import takes a quarter of a second

    free = np.flatnonzero(high > low)
    step = _STEP * (high - low)[free]
    step = np.where(start[free] + step > high[free], -step, step)
    simplex = start[free] + np.vstack((np.zeros(len(free)), np.diag(step)))

    def below(part: Array) -> float:
        place = start.copy()
        place[free] = part
        return -float(_merit(levels, place[None])[0])

    options = {"maxfev": _EVALUATIONS, "initial_simplex": simplex, "xatol": _PRECISION, "fatol": 0.0}
    bounds = list(zip(low[free], high[free], strict=True))
    answer = minimize(below, start[free], method="Nelder-Mead", bounds=bounds, options=options)
    place = start.copy()
    place[free] = answer.x
    return place, -float(answer.fun)


def _reason(levels: Levels, pose: Pose, details: Details) -> tuple[tuple[int, ...], str]:
    """Cables that make a pose infeasible, and a sentence with the reason."""
    place = ", ".join(n(x, ".3f") for x in pose.position)
    at = f"at ({place}) m"
    if details.level[0] >= 0.0:
        return (), f"{at} a region smaller than a cell of the grid is feasible: search there in a smaller box"
    index, cable, margin = int(details.criterion[0]), int(details.cable[0]), float(details.margin[0])
    own = (cable,) if cable >= 0 else ()
    criterion = levels.criteria[index]
    if margin >= 0.0:
        if np.isinf(details.level[0]):
            plan = inverse(levels.robot, pose, levels.model, levels.tension, levels.middle, given=levels.given)
            how = PoseStatus(int(plan.status)).text
            return own, f"{at} {type(levels.tension).__name__} finds no tensions for {criterion.title}: {how}"
        short = -float(details.level[0]) * criterion.scale(levels.robot)
        return own, f"{at} the {criterion.title} fails by {n(short, '.3g', criterion.unit)}{_of(own)}"
    if is_underconstrained(levels.robot) and np.isinf(margin):
        cables, why = BalancedMargins(levels.robot, levels.wrenches, levels.model, levels.given).reason(pose)
        return cables, f"{at}{_of(cables)}: {why}"
    if is_underconstrained(levels.robot):
        return own, f"{at} a tension of the equilibrium is outside its limits by {n(-margin, '.3g', 'N')}{_of(own)}"
    if np.isinf(margin):
        return own, f"{at}, as in the whole box, the platform is singular, or a cable has no length"
    if criterion.title != "margin":
        return own, f"{at} the {criterion.title} fails, and the margin is {n(margin, '.3g', 'N')}"
    plan = inverse(levels.robot, pose, levels.model, wrench=levels.middle)
    cables = tuple(int(k) for k in np.flatnonzero(plan.blocking)) or own
    here = pose.position[None]
    bare = levels.margins_of(NO_LOAD, here, details.rotation)
    if not bare[0] > 0.0:
        return cables, f"{at} the weight alone exceeds the limits by {n(-margin, '.3g', 'N')}{_of(cables)}"
    share = 100.0 * float(_share(bare, details.margin)[0])
    text = f"{at} the cables bear {n(share, '.2g')} % of the loads; {n(-margin, '.3g', 'N')} are missing{_of(cables)}"
    if levels.margins_of(_moments_of(levels.wrenches), here, details.rotation)[0] < 0.0:
        text += "; the moments of the loads alone are infeasible there"
    return cables, text


def _of(cables: tuple[int, ...]) -> str:
    if not cables:
        return ""
    return f" ({'cable' if len(cables) == 1 else 'cables'} {', '.join(map(str, cables))})"


def _moments_of(wrenches: WrenchSet) -> WrenchSet:
    """Wrench set without its forces."""
    parts = (wrenches.center, wrenches.segments, wrenches.ellipsoids, wrenches.corners, wrenches.accelerations)
    center, segments, ellipsoids, corners, accelerations = (part.copy() for part in parts)
    center[:3] = segments[:, :3] = ellipsoids[:, :3] = corners[:, :3] = accelerations[0] = 0.0
    for part in (center, segments, ellipsoids, corners, accelerations):
        locked(part)
    return WrenchSet(center, segments, ellipsoids, corners, wrenches.sizes, accelerations)
