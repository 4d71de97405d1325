"""All candidates of a search in their order: rated once, whatever interrupts it."""

from __future__ import annotations

from typing import Final, Protocol

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.progress import Progress
from sagline.optimization.candidates import Candidates
from sagline.optimization.front import Front, best_of_front, costs_of, weighted
from sagline.optimization.request import Request

LONGEST: Final = 80  # letters of a robot's name that are kept before what is added


class Record(Protocol):
    """What is known of a search that was begun before, and where it goes on."""

    @property
    def known(self) -> Array:
        """Numbers and goals of the candidates that are rated, in their order, shape (K, d + g)."""

    def add(self, rows: Array) -> None:
        """Keep further ones, shape (N, d + g)."""


class Ledger:
    """Rates candidates for an optimizer.

    An optimizer with a seed asks for the same candidates again: what a record knows of them is not worked out anew, and
    so a search that goes on from its record ends as if it had never been interrupted.
    """

    def __init__(
        self,
        request: Request,
        candidates: Candidates,
        evaluations: int,
        progress: Progress | None,
    ) -> None:
        """Begin.

        Args:
            request: What is asked.
            candidates: Its candidates.
            evaluations: How many there will be.
            progress: Told after each generation.

        Raises:
            InvalidValueError: If a goal says nothing of the first robot.
        """
        self._request, self._candidates = request, candidates
        self.record: Record | None = None
        self._evaluations, self._progress = evaluations, progress
        self._rating = request.rating(candidates)
        self._start = candidates.units(candidates.start[None])[0]
        width = len(candidates.parts)
        self._rows: Array = np.zeros((0, width + len(request.goals)))
        self._width = width
        self._first = self._rating(candidates.start[None])[0]
        self._check_first()

    @property
    def costs(self) -> int:
        """How many costs a candidate has: one, or for a front one a goal."""
        return len(self._request.goals) if self._request.optimizer == "nsga2" else 1

    def rate(self, points: Array) -> Array:
        """Costs of points of the unit cube (N, d), shape (N, costs); the first ever is the first robot."""
        values = self._candidates.values(points)
        values[(points == self._start).all(axis=1)] = self._candidates.start
        known = self._recalled(values)
        fresh = values[len(known) :]
        if len(fresh):
            rows = np.concatenate((fresh, self._rating(fresh)), axis=1)
            if self.record is not None:
                self.record.add(rows)
            known = np.concatenate((known, rows))
        self._rows = np.concatenate((self._rows, known))
        if self._progress is not None:
            self._progress(len(self._rows), self._evaluations)
        costs = self._costs(known)
        return costs if self.costs > 1 else weighted(costs, self._request.goals)[:, None]

    def front(self) -> Front:
        """The best of them."""
        request, costs = self._request, self._costs(self._rows)
        goals = self._rows[:, self._width :]
        if request.optimizer == "nsga2":
            which = best_of_front(costs)
            which = which[which != 0]
            which = which[np.isfinite(goals[which]).all(axis=1)]
            which = which[np.argsort(costs[which, 0], kind="stable")]
        else:
            total = weighted(costs, request.goals)
            which = np.array([np.argmin(total)])
            which = which[total[which] < total[0]]
        better = bool(len(which))
        values = self._rows[which if better else [0]]
        name = request.robot.name[:LONGEST]
        names = [f"{name}-better"] if len(which) == 1 else [f"{name}-front-{k + 1}" for k in range(len(which))]
        found = self._candidates.robots(values[:, : self._width], names) if better else (request.robot,)
        return Front(
            start=request.robot,
            robots=found,
            goals=request.goals,
            values=locked(values[:, self._width :].copy()),
            start_values=locked(goals[0].copy()),
            parts=self._candidates.parts,
            changed=locked(values[:, : self._width].copy()),
            better=better,
            evaluated=locked(self._rows[:, : self._width].copy()),
            evaluated_values=locked(goals.copy()),
            optimizer=request.optimizer,
            seed=request.seed,
        )

    def _costs(self, rows: Array) -> Array:
        return costs_of(rows[:, self._width :], self._request.goals, self._first)

    def _recalled(self, values: Array) -> Array:
        """Rows of the record for the first of these candidates, as far as it goes."""
        if self.record is None:
            return np.zeros((0, self._rows.shape[1]))
        first = len(self._rows)
        known = self.record.known[first : first + len(values)]
        if not np.array_equal(known[:, : self._width], values[: len(known)]):
            wrong = int(np.argmax((known[:, : self._width] != values[: len(known)]).any(axis=1)))
            allowed = "what this search asks for: packages or machine are others than when it began"
            raise InvalidValueError(
                f"row {first + wrong + 1} of the folder", "another robot", allowed, "Name another folder."
            )
        return known

    def _check_first(self) -> None:
        """Refuse goals that say nothing of the first robot."""
        for goal, value in zip(self._request.goals, self._first, strict=True):
            if np.isinf(value):
                item = f"{goal.kind} of {self._request.robot.name}"
                step = "Give it finite tension_max, or choose workspace_share."
                if value < 0.0:
                    step = "Leave out the poses where it is singular or a cable has no length."
                raise InvalidValueError(item, f"{value:g} {goal.unit}".rstrip(), "a finite number", step)
