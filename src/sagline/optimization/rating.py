"""What candidates reach of the goals: whole generations at once, from tables of cables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags
from sagline.core.errors import InvalidValueError
from sagline.kernels import tables
from sagline.optimization.candidates import Candidates, Solid, impossible
from sagline.optimization.goals import AT_POSES, Goal, Measured
from sagline.optimization.inner import best_moved
from sagline.optimization.planned import planned
from sagline.optimization.robust import AnchorErrors
from sagline.robot.pose import Pose
from sagline.statics.tables import body_table, cable_table, pose_rows
from sagline.workspaces.levels import middle_of
from sagline.workspaces.margin_rows import MarginRows, mean_arms
from sagline.workspaces.wrench_sets import NO_LOAD, WrenchSet

ROWS: Final = 1 << 14  # poses of candidates at once: a tenth of a second, and little memory


class Rating:
    """Made once for a search; then called for each generation."""

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
        """Prepare it.

        Args:
            candidates: The robots.
            goals: What they are rated by.
            wrenches: What they have to bear; None for their weight alone.
            poses: A batch of G.
            model: Cable model.
            robust: Errors of the anchors, or None.
            inner: What moves at each pose, or None.

        Raises:
            InvalidValueError: If the load cannot be shared, a cost is missing, or the first robot holds no pose where
                a goal needs tensions.
        """
        self._candidates, self._goals, self._robust, self._inner = candidates, tuple(goals), robust, inner
        self._model, self._poses, self.rows = model, poses, pose_rows(poses)
        self._wrench = np.zeros(6) if wrenches is None else middle_of(wrenches)
        self._wrenches = NO_LOAD if wrenches is None else wrenches
        # the first robot's, so that margins of candidates compare
        self._arm = float(mean_arms(cable_table(candidates.robot), body_table(candidates.robot))[0])
        self._needs = {goal.needs for goal in self._goals}
        self._solid = Solid(candidates.robot, poses)
        self._held = np.ones(len(self.rows), dtype=np.bool_)
        if self._needs & set(AT_POSES):
            self._held = self._held_at(candidates.cables(candidates.start[None]))

    def __call__(self, values: Array) -> Array:
        """Values of the goals, each in its unit.

        Args:
            values: Numbers of the candidates, shape (N, d).

        Returns:
            Shape (N, g); NaN where a candidate is no robot: two of its cables are one, limits are crossed, a frame
            anchor is inside the platform, or it loses a pose that the first robot holds and a goal needs.
        """
        size = max(1, ROWS // (len(self.rows) * (1 if self._robust is None else self._robust.samples)))
        parts = [self._rated(values[first : first + size]) for first in range(0, len(values), size)]
        return np.concatenate(parts)

    def margins(self, cables: Array, rows: Array) -> Array:
        """Margins [N] of tables (R, m, CABLE_COLUMNS), each at as many of the pose rows (N, POSE_COLUMNS), (N,)."""
        made = MarginRows(self._candidates.robot, self._wrenches, self._model, self._arm, cables)
        return made.rows(rows).value

    def _rated(self, values: Array) -> Array:
        cables = self._candidates.cables(values)
        none = impossible(cables) | self._in_platform(cables)
        measured = self._measured(cables[~none], values[~none])
        found = np.full((len(values), len(self._goals)), np.nan)
        worst = self._robust is not None and self._robust.take == "worst"
        whole: Flags = np.ones(int((~none).sum()), dtype=np.bool_)
        if measured.tension is not None:
            whole = np.asarray(~np.isnan(measured.tension).any(axis=(1, 2)))
        columns = [np.where(whole, goal.values(measured, worst=worst), np.nan) for goal in self._goals]
        found[~none] = np.stack(columns, axis=-1)
        return found

    def _measured(self, cables: Array, values: Array) -> Measured:
        """Everything that the goals need of candidates that are robots."""
        many = cables[:, None] if self._robust is None else self._robust.added(cables)
        shape = (*many.shape[:2], len(self.rows))
        robots = many.reshape(-1, *many.shape[2:])
        rows = np.tile(self.rows, (len(robots), 1))
        margin, each = np.zeros(shape), robots
        if self._inner is not None:
            each = np.repeat(robots, len(self.rows), axis=0)
            shifts, margin = best_moved(self._inner, self.margins, each, rows)
            self._inner.write(each, shifts)
        elif "margin" in self._needs:
            margin = self.margins(robots, rows)
        margin = margin.reshape(shape)
        if self._needs <= {"margin"}:
            return Measured(margin)
        if self._inner is None:
            each = np.repeat(robots, len(self.rows), axis=0)
        cost = self._cost(each.reshape(*shape, *each.shape[1:]), values) if "cost" in self._needs else None
        if not self._needs & set(AT_POSES):
            return Measured(margin, cost=cost)
        held = np.tile(self._held, shape[0] * shape[1])
        plan = planned(
            self._candidates.robot, self._model, each[held], rows[held], self._wrench,
            stiffness="stiffness" in self._needs,
        )  # fmt: skip
        tension, sag = (array.reshape(*shape[:2], -1) for array in (plan.tension, plan.sag))
        stiffness = None if plan.stiffness is None else plan.stiffness.reshape(*shape[:2], -1)
        return Measured(margin, tension, sag, stiffness, cost)

    def _cost(self, cables: Array, values: Array) -> Array:
        """Cost of cables as long as the longest chords, of tables (N, S, G, m, CABLE_COLUMNS), shape (N, S)."""
        costs = self._candidates.costs(values)
        if costs is None:
            step = "Free the cable: FreeCable([CableChoice(name, cable, cost=1.5), ...])."
            raise InvalidValueError("goals: cable_cost", "without a catalogue", "a FreeCable with costs", step)
        ends = cables[..., tables.PLATFORM_X : tables.PLATFORM_Z + 1] @ np.swapaxes(self._poses.matrix, -1, -2)
        chords = np.linalg.norm(ends + self._poses.position[:, None] - cables[..., : tables.FRAME_Z + 1], axis=-1)
        return np.asarray(costs[:, None] * chords.max(axis=2).sum(axis=-1))

    def _in_platform(self, cables: Array) -> Flags:
        """Whether a frame anchor of tables (N, m, CABLE_COLUMNS) is inside the platform at a pose, (N,)."""
        return np.asarray((self._solid.holds(cables[..., : tables.FRAME_Z + 1]) >= 0).any(axis=-1))

    def _held_at(self, cables: Array) -> Flags:
        """The poses at which a robot has tensions, shape (G,)."""
        each = np.repeat(cables, len(self.rows), axis=0)
        held = ~np.isnan(
            planned(self._candidates.robot, self._model, each, self.rows, self._wrench, stiffness=False).tension
        )
        if not held.any():
            value, step = "held at none of the poses", "Choose other poses, wrenches or tension limits."
            raise InvalidValueError(self._candidates.robot.name, value, "one that is held somewhere", step)
        return held
