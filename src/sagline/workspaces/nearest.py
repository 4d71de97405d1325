"""Pose that is nearest to feasibility, for a robot with an empty workspace."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.numbers import n
from sagline.core.results import Result
from sagline.kinematics.inverse import inverse
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose
from sagline.workspaces.grid import Grid
from sagline.workspaces.levels import Details, Levels
from sagline.workspaces.wrench_sets import NO_LOAD, WrenchSet

_STARTS: Final = 3  # number of best grid points from which the search starts
_STEP: Final = 0.1  # initial step, as a share of the box
_EVALUATIONS: Final = 300  # largest number of evaluations from each start
_PRECISION: Final = 1e-4  # precision of the position [m]
_FAR: Final = 1e6  # finite value that replaces an infinite level in the search
_UNHELD: Final = 1e3  # reduction of the merit at infeasible poses, if criteria need tensions


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
    """Pose with the largest level, by simplex searches from the best nodes of `grid`; `low`, `high`: corners [m]."""
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
    """Finite merit of `positions`: the level, or, for infeasible loads, a value computed from the feasible fraction.

    Margins alone would lead to singular poses, where all margins have a small absolute value.
    """
    found = levels.details(positions)
    bare = levels.margins_of(NO_LOAD, positions, found.rotation)
    weight = levels.criteria[0].scale(levels.robot)
    with np.errstate(divide="ignore", invalid="ignore"):
        short = np.where(bare > 0.0, _share(bare, found.margin), bare / weight) - 1.0
    tensions = any(one.needs_tensions for one in levels.criteria)
    short -= _UNHELD if tensions else 0.0  # levels of poses with tensions are above this value
    return np.maximum(np.where(found.margin >= 0.0, found.level, short), -_FAR)


def _share(bare: Array, margin: Array) -> Array:
    """Lower bound of the feasible fraction of the load. It is a bound because margins are concave in the load."""
    return np.asarray(bare / (bare - margin))


def _simplex_search(levels: Levels, start: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Position of a local maximum of the merit, found by a simplex search from `start`, and the merit there."""
    from scipy.optimize import minimize  # the import takes a quarter of a second

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
            how = PoseStatus(int(inverse(levels.robot, pose, levels.model, levels.tension, levels.middle).status))
            return own, f"{at} {type(levels.tension).__name__} finds no tensions for {criterion.title}: {how.text}"
        short = -float(details.level[0]) * criterion.scale(levels.robot)
        return own, f"{at} the {criterion.title} fails by {n(short, '.3g', criterion.unit)}{_of(own)}"
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
