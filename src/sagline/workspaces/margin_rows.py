"""Margins of pose rows; robots and wrench sets are prepared once for repeated calls."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.core.arrays import Array, Codes, Indices, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress, blocks
from sagline.kernels import tables
from sagline.kernels.memory import memory_for
from sagline.kernels.workspaces.signed_margin import FACET_SIZE, signed_margins
from sagline.kernels.workspaces.wrench_set import SetTerms
from sagline.robot.batch import first_of, robot_fields, together
from sagline.robot.reach import check_cable_count
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import LIMITS_OF
from sagline.workspaces.wrench_sets import NO_LOAD, WrenchSet

BLOCK = 1 << 13  # poses per block, about 0.1 s; interrupts are handled between blocks
_CATENARY = Catenary()


class Bracket(NamedTuple):
    """Margins of N poses. `Margin` has the same fields, the robot and the poses.

    Attributes:
        value: Continuous margin between `low` and `high` [N], (N,).
        low: Lower bound of the margin for all sag forces [N], (N,).
        high: Upper bound [N], (N,).
        cable: Cable whose limit has the largest effect on the value, -1 for none, (N,).
        status: Codes of `MarginStatus`, (N,).
        direction: Normal of the nearest facet, (N, 6).
    """

    value: Array
    low: Array
    high: Array
    cable: Indices
    status: Codes
    direction: Array


class MarginRows:
    """Margins of pose rows, for one robot or for robots with the same motion pattern, gravity and number of cables.

    All pose-independent data are prepared once. A call of `rows` then takes a few microseconds, plus a few microseconds
    per pose. Several threads may call `rows` at the same time.
    """

    __slots__ = ("_given", "cable_count", "robot_count")

    def __init__(
        self,
        robot: Robot | Sequence[Robot],
        wrenches: WrenchSet = NO_LOAD,
        model: CableModel = _CATENARY,
        moment_arm: float | None = None,
        cables: Array | None = None,
    ) -> None:
        """Prepare one robot or R robots; `moment_arm` [m] has the meaning that it has in `margin`.

        If `cables` (R, m, CABLE_COLUMNS) is given, the R robots are copies of `robot` with these tables of cables.
        """
        robots = together(robot)
        shared = first_of(robots)
        freedom, bodies, table = robot_terms(robots)
        if cables is not None:
            table = _locked(cables)
        check_cable_count(shared)
        self.cable_count = m = shared.cable_count
        if table.shape[1:] != (m, tables.CABLE_COLUMNS) or not len(table) or len(bodies) not in (1, len(table)):
            wanted = f"shape (R, {m}, {tables.CABLE_COLUMNS})"
            raise InvalidValueError(
                "cables", f"of shape {table.shape}", wanted, "Make the tables with cable_table(robot)."
            )
        self.robot_count = len(table)
        limits = (LIMITS_OF[shared.tension_limits_of], np.nan)
        (inertias,) = robot_fields(robots, "inertia")
        terms = (freedom, bodies, table)
        arms = _arms(table, bodies, moment_arm)
        self._given = (
            (model.code, *model.parameters),
            limits,
            terms,
            _set_terms(wrenches, _locked(inertias.reshape(-1, 3, 3))),
            arms,
        )

    def about(self, wrench: Array) -> MarginRows:
        """Margins for the wrench set plus an unchecked wrench [N, N m], (6,); all other data are shared."""
        model, limits, terms, (center, half, others, ellipsoids, corners, sizes, rates, inertias), arms = self._given
        there = _locked(center + wrench)
        moved = object.__new__(MarginRows)
        moved.cable_count, moved.robot_count = self.cable_count, self.robot_count
        loads = (there, half, others, ellipsoids, corners, sizes, rates, inertias)
        moved._given = (model, limits, terms, loads, arms)
        return moved

    def rows(self, poses: NDArray[np.float64], progress: Progress | None = None) -> Bracket:
        """Margins at the unchecked rows `poses` (N, 7), N/R rows per robot. A row with NaN has the status NO_CHORD."""
        rows = np.ascontiguousarray(poses, dtype=np.float64).view()
        count = len(rows)
        if count % self.robot_count:
            step = f"Give every one of the {self.robot_count} robots the same number of poses."
            raise InvalidValueError("poses", f"{count} of them", f"a multiple of {self.robot_count}", step)
        numbers, counters = memory_for(self.cable_count)
        memory = (
            np.empty(2 * numbers.size + FACET_SIZE),
            np.empty(2 * counters.size, dtype=np.int64),
            np.empty(self.cable_count, dtype=np.int8),
        )
        margins = (
            np.empty((3, count)),
            np.empty((count, 6)),
            np.empty(count, dtype=np.int64),
            np.empty(count, dtype=np.int8),
        )
        given = (*self._given, locked(rows), memory, margins)
        if count <= BLOCK and progress is None:
            signed_margins(*given, 0, count)
        else:
            for part in blocks(count, BLOCK, progress):
                signed_margins(*given, part.start, part.stop)
        values, directions, limiting, statuses = margins
        return Bracket(values[0], values[1], values[2], limiting, statuses, directions)


def mean_arms(table: Array, bodies: Array) -> Array:
    """Mean distance (R,) [m] between platform anchors and center of mass; `table`: cables, `bodies`: bodies."""
    anchors = table[:, :, tables.PLATFORM_X : tables.PLATFORM_Z + 1]
    centers = bodies[:, None, tables.CENTER_X : tables.CENTER_Z + 1]
    return np.asarray(np.linalg.norm(anchors - centers, axis=-1).mean(axis=-1))


def _arms(table: Array, bodies: Array, moment_arm: float | None) -> tuple[Array, Array]:
    """Lever arms of the norm [m], and positive lever arms by which moments are divided [m]."""
    means = mean_arms(table, bodies)
    own = means if moment_arm is None else np.array([number(moment_arm, "moment_arm", "m", low=0.0)])
    return locked(own), locked(np.where(means > 0.0, means, 1.0))


def _set_terms(wrenches: WrenchSet, inertias: Array) -> SetTerms:
    """Wrench set in the form that the kernel needs: segments along a single axis become a box."""
    segments = np.abs(wrenches.segments)
    straight = np.count_nonzero(segments, axis=1) <= 1
    half = segments[straight].sum(axis=0)
    others = _locked(wrenches.segments[~straight])
    ellipsoids, corners, sizes = _locked(wrenches.ellipsoids.transpose(0, 2, 1)), wrenches.corners, wrenches.sizes
    return wrenches.center, locked(half), others, ellipsoids, corners, sizes, wrenches.accelerations, inertias


def _locked(array: Array) -> Array:
    return locked(np.ascontiguousarray(array, dtype=np.float64).view())
