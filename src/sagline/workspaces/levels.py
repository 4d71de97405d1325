"""Signed feasibility function of the position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Indices, locked
from sagline.core.progress import blocks
from sagline.kernels import codes
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.workspaces.criteria import LeastMargin
from sagline.workspaces.criterion import Criterion, Given
from sagline.workspaces.margin_rows import Bracket, MarginRows
from sagline.workspaces.orientations import Orientations
from sagline.workspaces.wrench_sets import WrenchSet

Hull = Literal["exact", "inner", "outer"]
BLOCK: Final = 1 << 12  # poses per block, about 0.1 s; interrupts are handled between blocks


class Details(NamedTuple):
    """Levels and limiting criteria at N positions.

    Attributes:
        level: >= 0 inside, shape (N,).
        margin: Margin of the loads, in the limiting rotation [N], shape (N,).
        criterion: Index of the limiting criterion, shape (N,).
        cable: Limiting cable, -1 for none, shape (N,).
        rotation: Index of the limiting rotation, shape (N,).
        uncertainty: Error bound of the level, shape (N,). It is 0 if the sign of the level is certain, or if the margin
            is not the limiting criterion.
    """

    level: Array
    margin: Array
    criterion: Indices
    cable: Indices
    rotation: Indices
    uncertainty: Array


@dataclass(eq=False)
class Levels:
    """Level function: the smallest value of all criteria, each divided by its scale, at a position; >= 0 inside.

    If the margin is negative, criteria on tensions are ignored, because there are no tensions. The level at a position
    is the smallest level of all rotations, or the largest level if one feasible rotation is sufficient.

    Attributes:
        robot: The robot.
        wrenches: Set of loads.
        orientations: Orientations of the platform.
        criteria: The criteria, the margin first.
        model: Cable model.
        tension: Tension distribution method.
        moment_arm: Lever arm as in `margin` [m].
        held: For a planar workspace, the normal axis and the coordinate of its plane [m]; otherwise None.
        on_block: Function that is called after each block with the number of poses in the block.
        hull: Margin to use: "exact" for its value, "inner" for its lower bound, "outer" for its upper bound.
        middle: Middle of the wrench set, shape (6,); the tensions balance this wrench.
    """

    robot: Robot
    wrenches: WrenchSet
    orientations: Orientations
    criteria: tuple[Criterion, ...]
    model: CableModel
    tension: TensionMethod
    moment_arm: float | None
    held: tuple[int, float] | None = None
    on_block: Callable[[int], None] | None = None
    hull: Hull = "exact"

    def __post_init__(self) -> None:
        """Prepare the margin."""
        self.middle = middle_wrench(self.wrenches)
        self._margins = MarginRows(self.robot, self.wrenches, self.model, self.moment_arm)
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
        """Margins (N,) [N] of `wrenches` at `positions` (N, 3) [m]; `rotation`: indices of the rotations, (N,)."""
        rows = np.hstack((self.in_plane(positions), self.orientations.quaternion[rotation]))
        return MarginRows(self.robot, wrenches, self.model, self.moment_arm).rows(rows).value

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
        given = Given(self.robot, self.model, self.tension, self.middle, rows, margin, bracket.cable)
        level, criterion = np.full(len(rows), np.inf), np.zeros(len(rows), dtype=np.int64)
        cable = np.array(bracket.cable, dtype=np.int64)
        for index, (one, scale) in enumerate(zip(self.criteria, self._scales, strict=True)):
            if one.needs_tensions and not given.held.any():
                continue
            judged = one.judge(given)
            # If tensions exist but the tension method does not find them, the pose counts as outside. At other poses
            # without tensions, the margin decides.
            lost = np.isnan(judged.value) & (bracket.low >= 0.0)
            value = np.where(lost, -np.inf, judged.value / scale)
            least = value < level  # False for NaN
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


def middle_wrench(wrenches: WrenchSet) -> Array:
    """Middle of a wrench set: force [N], moment [N m], shape (6,). For a polytope, it is the mean of the corners."""
    ends = np.cumsum(wrenches.sizes)
    means = [wrenches.corners[end - size : end].mean(axis=0) for end, size in zip(ends, wrenches.sizes, strict=True)]
    return locked(wrenches.center + sum(means, start=np.zeros(6)))
