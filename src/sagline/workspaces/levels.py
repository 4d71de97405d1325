"""Signed feasibility function of the position."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Indices, locked
from sagline.core.progress import blocks
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.workspaces.criterion import Criterion, Given
from sagline.workspaces.margin_rows import MarginRows
from sagline.workspaces.orientations import Orientations
from sagline.workspaces.wrench_sets import WrenchSet

BLOCK: Final = 1 << 12  # poses at once: a tenth of a second, after which an interrupt is heard


class Details(NamedTuple):
    """Level and deciding criterion at N positions.

    Attributes:
        level: >= 0 inside, shape (N,).
        margin: Of the loads, in the rotation that decides [N], shape (N,).
        criterion: Which criterion decides, as an index, shape (N,).
        cable: Which cable, -1 where none does, shape (N,).
        rotation: Which rotation, as an index, shape (N,).
    """

    level: Array
    margin: Array
    criterion: Indices
    cable: Indices
    rotation: Indices


class Levels:
    """Least value of all criteria, each over its scale, at positions of the platform: >= 0 inside.

    Where the margin says that the platform cannot be held it decides alone: criteria that look at tensions have none
    there. Over rotations the least counts, or the greatest where any of them will do.

    Attributes:
        robot: The robot.
        wrenches: Loads that it has to bear.
        orientations: In which it is held.
        criteria: What has to be met, the margin first.
        model: Cable model.
        tension: How the load is shared.
        middle: The wrench in the middle of the set, that tensions balance, shape (6,).
        told: Called after each block: how many poses it had. None for nobody.
    """

    def __init__(
        self,
        robot: Robot,
        wrenches: WrenchSet,
        orientations: Orientations,
        criteria: tuple[Criterion, ...],
        model: CableModel,
        tension: TensionMethod,
        moment_arm: float | None,
        held: tuple[int, float] | None = None,
    ) -> None:
        """Prepare the margin; `moment_arm` as of `margin`, `held` an axis of constant coordinate and its value [m]."""
        self.robot, self.wrenches, self.orientations, self.criteria = robot, wrenches, orientations, criteria
        self.model, self.tension, self.middle = model, tension, middle_of(wrenches)
        self.told: Callable[[int], None] | None = None
        self._moment_arm, self._held = moment_arm, held
        self._margins = MarginRows(robot, wrenches, model, moment_arm)
        self._scales = [one.scale(robot) for one in criteria]

    def __call__(self, positions: Array) -> Array:
        """Levels at positions (N, 3) of the platform origin [m], shape (N,); -inf where no distance is known."""
        return self.details(positions).level

    def details(self, positions: Array) -> Details:
        """Levels, and deciding criterion, cable and rotation, at positions (N, 3) of the platform origin [m]."""
        count = len(positions)
        found = Details(*np.empty((2, count)), *np.full((3, count), -1))
        for part in blocks(count, BLOCK):
            own = self._block(self._in_plane(positions[part]))
            for whole, piece in zip(found, own, strict=True):
                whole[part] = piece
            if self.told is not None:
                self.told(len(own.level))
        return Details(*map(locked, found))

    def _in_plane(self, positions: Array) -> Array:
        """Positions (N, 3) [m]; of a planar workspace their projections into the plane."""
        if self._held is None:
            return positions
        axis, where = self._held
        flat = positions.copy()
        flat[:, axis] = where
        return flat

    def margins_of(self, wrenches: WrenchSet, positions: Array, rotation: Indices) -> Array:
        """Margins of another wrench set [N], (N,), at positions (N, 3) [m] in the rotations of these indices (N,)."""
        rows = np.hstack((self._in_plane(positions), self.orientations.quaternion[rotation]))
        return MarginRows(self.robot, wrenches, self.model, self._moment_arm).rows(rows).value

    def _block(self, positions: Array) -> Details:
        found = self._in_rotation(positions, 0)
        for k in range(1, len(self.orientations)):
            other = self._in_rotation(positions, k)
            worse = other.level < found.level
            taken = worse if self.orientations.need == "all" else ~worse
            found = Details(*(np.where(taken, theirs, ours) for theirs, ours in zip(other, found, strict=True)))
        return found

    def _in_rotation(self, positions: Array, rotation: int) -> Details:
        """Details in one of the rotations."""
        rows = self.orientations.at(positions, rotation)
        bracket = self._margins.rows(rows)
        given = Given(self.robot, self.model, self.tension, self.middle, rows, bracket.value, bracket.cable)
        level, criterion = np.full(len(rows), np.inf), np.zeros(len(rows), dtype=np.int64)
        cable = np.array(bracket.cable, dtype=np.int64)
        for index, (one, scale) in enumerate(zip(self.criteria, self._scales, strict=True)):
            if one.needs_tensions and not given.held.any():
                continue
            judged = one.judge(given)
            # tensions that a way of sharing does not find where they surely are: outside. At the border of what can
            # be held, and beyond, the margin decides.
            lost = np.isnan(judged.value) & (bracket.low >= 0.0)
            value = np.where(lost, -np.inf, judged.value / scale)
            least = value < level  # NaN is not
            level[least], criterion[least] = value[least], index
            cable[least] = -1 if judged.cable is None else judged.cable[least]
        return Details(level, bracket.value, criterion, cable, np.full(len(rows), rotation, dtype=np.int64))


def middle_of(wrenches: WrenchSet) -> Array:
    """Middle of a wrench set, of polytopes the mean of the corners: force [N], moment [N m], shape (6,)."""
    ends = np.cumsum(wrenches.sizes)
    means = [wrenches.corners[end - size : end].mean(axis=0) for end, size in zip(ends, wrenches.sizes, strict=True)]
    return locked(wrenches.center + sum(means, start=np.zeros(6)))
