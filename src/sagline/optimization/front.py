"""What a search for better robots found."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Final

import numpy as np

from sagline.core.arguments import file_path
from sagline.core.arrays import Array, Flags, Indices
from sagline.core.results import Result
from sagline.files.robot_file import dump_robot
from sagline.files.writing import file_stem, made_folder, written_together
from sagline.optimization.free import Part
from sagline.optimization.goals import Goal
from sagline.robot.robot import Robot

FRONT: Final = "front.csv"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Front(Result):
    """Result of `design`: better robots, none of which is better than another in every goal.

    Attributes:
        start: The robot that the search began with.
        robots: The better ones, K of them, best by the first goal first; the start alone where none is better. One
            only, the best by the weights, where the optimizer is not "nsga2".
        goals: What they are better at, g goals.
        values: Of the robots, each goal in its unit, shape (K, g).
        start_values: Of the start, shape (g,).
        parts: What was free, d numbers.
        changed: These numbers of the robots, shape (K, d).
        better: Whether a robot is better than the start.
        evaluated: The numbers of all candidates, in their order, the start first, shape (N, d).
        evaluated_values: Their goals, shape (N, g), NaN where a candidate is no robot.
        optimizer: Who searched.
        seed: Of the search.
    """

    start: Robot
    robots: tuple[Robot, ...]
    goals: tuple[Goal, ...]
    values: Array
    start_values: Array
    parts: tuple[Part, ...]
    changed: Array
    better: bool
    evaluated: Array
    evaluated_values: Array
    optimizer: str
    seed: int

    @property
    def best(self) -> Robot:
        """The first of the robots."""
        return self.robots[0]

    @property
    def text(self) -> str:
        """What came out, in a sentence."""
        count, name = len(self.evaluated), self.start.name
        if not self.better:
            return f"None of {count:,} robots is better than {name}: widen what is free, or allow more evaluations."
        goals = "; ".join(
            f"{goal.kind} {was:.4g} -> {now:.4g} {goal.unit}".rstrip()
            for goal, was, now in zip(self.goals, self.start_values, self.values[0], strict=True)
        )
        if len(self.robots) == 1:
            return f"The best of {count:,} robots is better than {name}: {goals}."
        return f"{len(self.robots)} of {count:,} robots are better than {name} in a goal; the first: {goals}."

    def save(self, folder: Path | str) -> list[Path]:
        """Write the robots as robot files, and a table of them.

        Args:
            folder: Where; created if missing. Files of the same names are replaced.

        Returns:
            The files: front.csv, and for each robot its name with .yaml.

        Raises:
            FileError: If one cannot be written.
        """
        place = made_folder(file_path(folder, "folder", folder=True))
        robots = self.robots if self.better else ()
        names = [FRONT, *(f"{file_stem(robot.name)}.yaml" for robot in robots)]
        heads = ["robot", *(f"{goal.kind} [{goal.unit}]" if goal.unit else goal.kind for goal in self.goals)]
        heads += [f"{part.name} [{part.unit}]" if part.unit else part.name for part in self.parts]
        rows = [[self.start.name, *self.start_values.tolist(), *(part.start for part in self.parts)]]
        for robot, goals, values in zip(robots, self.values, self.changed, strict=False):
            rows.append([robot.name, *goals.tolist(), *values.tolist()])
        text = StringIO()
        csv.writer(text, lineterminator="\n").writerows([heads, *rows])
        texts = [text.getvalue(), *(dump_robot(robot) for robot in robots)]
        with written_together(place, names) as parts:
            for part, content in zip(parts, texts, strict=True):
                part.write_bytes(content.encode())
        return [place / name for name in names]

    def __str__(self) -> str:
        """The sentence."""
        return self.text


def costs_of(values: Array, goals: tuple[Goal, ...], start: Array) -> Array:
    """Values of goals as costs, of which the least are wanted, each in what counts as one of it.

    Args:
        values: Shape (N, g), NaN where a candidate is no robot.
        goals: The goals.
        start: Values of the first robot, shape (g,).

    Returns:
        Shape (N, g), finite: no worse than PENALTY, which is what a candidate gets that is no robot.
    """
    signs = np.array([-1.0 if goal.maximize else 1.0 for goal in goals])
    scales = np.array([scale_of(goal, value) for goal, value in zip(goals, start, strict=True)])
    costs = np.nan_to_num(signs * values / scales, nan=2.0 * PENALTY, posinf=PENALTY, neginf=-PENALTY)
    return np.asarray(np.where(np.isnan(values), PENALTY * 2.0, np.clip(costs, -PENALTY, PENALTY)))


PENALTY = 1e9  # what a goal counts at most, many times more than any is worth


def scale_of(goal: Goal, start: float) -> float:
    """What counts as one of a goal, in its unit: its own scale, or what the first robot has."""
    if goal.scale is not None:
        return goal.scale
    return abs(float(start)) if np.isfinite(start) and start != 0.0 else 1.0


def weighted(costs: Array, goals: tuple[Goal, ...]) -> Array:
    """Costs (N, g) as one, by the goals' weights, shape (N,)."""
    weights = np.array([goal.weight for goal in goals])
    return np.asarray(np.einsum("ng,g->n", costs, weights / weights.sum()))


def best_of_front(costs: Array) -> Indices:
    """Candidates that no other beats in one goal without losing in another, of costs (N, g); of equals the first."""
    _, first = np.unique(costs, axis=0, return_index=True)
    kept = np.sort(first)
    own = costs[kept]
    beaten: Flags = np.array([_beaten(one, own) for one in own])
    return np.asarray(kept[~beaten])


def _beaten(one: Array, others: Array) -> bool:
    return bool(((others <= one).all(axis=1) & (others < one).any(axis=1)).any())
