"""Design search: rating of candidates for an optimizer, Pareto front, and result."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.core.arguments import callback, file_path, instance, whole_number
from sagline.core.arrays import Array, Flags, Indices, Progress, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result, csv_text
from sagline.files.robot_file import dump_robot
from sagline.files.writing import atomic_files, create_folder, file_stem
from sagline.optimization.candidates import AnchorErrors, Candidates
from sagline.optimization.folder import DesignFolder, open_record
from sagline.optimization.free import DesignVariable, Free
from sagline.optimization.rating import Rating
from sagline.optimization.request import COUNTS, MOST_EVALUATIONS, Goal, Request, heading, poses_of
from sagline.optimization.search import SEARCHES, latin_hypercube
from sagline.robot.pose import PoseBox, PoseLike
from sagline.robot.robot import Robot
from sagline.workspaces.wrench_sets import WrenchSet

FRONT: Final = "front.csv"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Front(Result):
    """Result of `design`: a Pareto front of robots that are better than the initial robot.

    Attributes:
        start: Initial robot of the search.
        robots: K better robots, the best in the first goal first. Optimizers other than "nsga2" give one robot, which
            has the best weighted sum. If no robot is better, the only robot is the initial robot.
        goals: The g goals.
        values: Goal values of the K robots, in the units of the goals, shape (K, g).
        start_values: Goal values of the initial robot, shape (g,).
        parts: The d design variables.
        changed: Values of the design variables of the K robots, shape (K, d).
        better: True if a robot is better than the initial robot.
        evaluated: Design variables of all N candidates in the order of evaluation, initial robot first, shape (N, d).
        evaluated_values: Goal values of all candidates, shape (N, g); NaN for a dropped candidate.
        optimizer: Name of the optimizer.
        seed: Seed of the search.
    """

    start: Robot
    robots: tuple[Robot, ...]
    goals: tuple[Goal, ...]
    values: Array
    start_values: Array
    parts: tuple[DesignVariable, ...]
    changed: Array
    better: bool
    evaluated: Array
    evaluated_values: Array
    optimizer: str
    seed: int

    @property
    def best(self) -> Robot:
        """Robot with the best value of the first goal."""
        return self.robots[0]

    @property
    def text(self) -> str:
        """Sentence with the goal values of the best robot."""
        count, name = len(self.evaluated), self.start.name
        if not self.better:
            return f"None of {count:,} robots is better than {name}: widen the bounds, or allow more evaluations."
        goals = "; ".join(
            f"{goal.kind} {was:.4g} -> {now:.4g} {goal.unit}".rstrip()
            for goal, was, now in zip(self.goals, self.start_values, self.values[0], strict=True)
        )
        if len(self.robots) == 1:
            return f"The best of {count:,} robots is better than {name}: {goals}."
        return f"{len(self.robots)} of {count:,} robots are better than {name} in a goal; the first: {goals}."

    def save(self, folder: Path | str) -> list[Path]:
        """Write a robot file for each robot, and a table of all robots.

        Args:
            folder: The folder; it is created if its parent folder exists. Files with the same names are replaced.

        Returns:
            Paths of the files: front.csv, and for each robot a .yaml file with the robot's name.

        Raises:
            FileError: If a file cannot be written.
        """
        place = create_folder(file_path(folder, "folder", folder=True), parents=False)
        robots = self.robots if self.better else ()
        names = [FRONT, *(f"{file_stem(robot.name)}.yaml" for robot in robots)]
        heads = ["robot", *(heading(goal.kind, goal.unit) for goal in self.goals)]
        heads += [heading(part.name, part.unit) for part in self.parts]
        rows = [[self.start.name, *self.start_values.tolist(), *(part.start for part in self.parts)]]
        for robot, goals, values in zip(robots, self.values, self.changed, strict=False):
            rows.append([robot.name, *goals.tolist(), *values.tolist()])
        texts = [csv_text([heads, *rows]), *(dump_robot(robot) for robot in robots)]
        with atomic_files(place, names) as parts:
            for part, content in zip(parts, texts, strict=True):
                part.write_bytes(content.encode())
        return [place / name for name in names]

    def __str__(self) -> str:
        """Sentence with the goal values of the best robot."""
        return self.text


def costs_of(values: Array, goals: tuple[Goal, ...], start: Array) -> Array:
    """Costs (N, g) that an optimizer minimizes, from goal values (N, g); at most PENALTY, or 2 PENALTY for NaN."""
    signs = np.array([-1.0 if goal.maximize else 1.0 for goal in goals])
    scales = np.array([_scale_of(goal, value) for goal, value in zip(goals, start, strict=True)])
    costs = np.nan_to_num(signs * values / scales, nan=2.0 * PENALTY, posinf=PENALTY, neginf=-PENALTY)
    return np.asarray(np.where(np.isnan(values), PENALTY * 2.0, np.clip(costs, -PENALTY, PENALTY)))


PENALTY = 1e9  # largest cost of a goal, much larger than usual costs


def _scale_of(goal: Goal, start: float) -> float:
    """Scale by which a goal is divided: `goal.scale` or, if this is None, the initial robot's value `start`."""
    if goal.scale is not None:
        return goal.scale
    return abs(float(start)) if np.isfinite(start) and start != 0.0 else 1.0


def _weighted_costs(costs: Array, goals: tuple[Goal, ...]) -> Array:
    """Sums (N,) of the costs (N, g), multiplied by the weights of the goals."""
    weights = np.array([goal.weight for goal in goals])
    return np.asarray(np.einsum("ng,g->n", costs, weights / weights.sum()))


def _pareto_front(costs: Array) -> Indices:
    """Indices of the Pareto-optimal candidates with `costs` (N, g); only the first of several equal candidates."""
    _, first = np.unique(costs, axis=0, return_index=True)
    kept = np.sort(first)
    own = costs[kept]
    beaten: Flags = np.array([((own <= one).all(axis=1) & (own < one).any(axis=1)).any() for one in own])
    return np.asarray(kept[~beaten])


LONGEST: Final = 80  # largest number of letters in a robot's name before its number


class _Ledger:
    """Rating of candidates for an optimizer.

    With the same seed, an optimizer requests the same candidates again. Candidates in the record are not rated again. A
    continued search therefore gives the same result as a search without interruption.
    """

    def __init__(self, request: Request, candidates: Candidates, evaluations: int, progress: Progress | None) -> None:
        """Prepare the rating, and reject goals that have no finite value for the initial robot."""
        self._request, self._candidates = request, candidates
        self.record: DesignFolder | None = None
        self._evaluations, self._progress = evaluations, progress
        moving = Candidates(request.robot, request.inner, "inner") if request.inner else None
        self._rating = Rating(
            candidates, request.goals, request.wrenches, request.poses, request.model, request.robust, moving
        )
        self._start = candidates.units(candidates.start[None])[0]
        width = len(candidates.parts)
        self._rows: Array = np.zeros((0, width + len(request.goals)))
        self._width = width
        self._first = self._rating(candidates.start[None])[0]
        self._check_first()

    @property
    def costs(self) -> int:
        """Number of costs per candidate: the number of goals for a Pareto front, otherwise 1."""
        return len(self._request.goals) if self._request.optimizer == "nsga2" else 1

    def rate(self, points: Array) -> Array:
        """Costs (N, costs) of the candidates at the points (N, d) of the unit cube."""
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
        return costs if self.costs > 1 else _weighted_costs(costs, self._request.goals)[:, None]

    def front(self) -> Front:
        """Result of the search with the best candidates."""
        request, costs = self._request, self._costs(self._rows)
        goals = self._rows[:, self._width :]
        if request.optimizer == "nsga2":
            which = _pareto_front(costs)
            which = which[which != 0]
            which = which[np.isfinite(goals[which]).all(axis=1)]
            which = which[np.argsort(costs[which, 0], kind="stable")]
        else:
            total = _weighted_costs(costs, request.goals)
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
        """Rows of the record for the candidates `values`, up to the first candidate that is not in the record."""
        if self.record is None:
            return np.zeros((0, self._rows.shape[1]))
        first = len(self._rows)
        known = self.record.known[first : first + len(values)]
        if not np.array_equal(known[:, : self._width], values[: len(known)]):
            wrong = int(np.argmax((known[:, : self._width] != values[: len(known)]).any(axis=1)))
            allowed = "the robot of this search; packages or machine may have changed since the search began"
            row = f"row {first + wrong + 1} of the folder"
            raise InvalidValueError(row, "another robot", allowed, "Give another folder.")
        return known

    def _check_first(self) -> None:
        """Reject goals that have no finite value for the initial robot."""
        for goal, value in zip(self._request.goals, self._first, strict=True):
            if np.isinf(value):
                item = f"{goal.kind} of {self._request.robot.name}"
                step = "Give the robot a finite tension_max, or choose workspace_share."
                if value < 0.0:
                    step = "Omit the poses at which the robot is singular or a cable has no length."
                raise InvalidValueError(item, f"{value:g} {goal.unit}".rstrip(), "a finite number", step)


_CATENARY: Final = Catenary()


def design(
    robot: Robot,
    free: Sequence[Free],
    goals: Sequence[Goal | str],
    wrenches: WrenchSet | None = None,
    poses: PoseLike | None = None,
    *,
    box: PoseBox | None = None,
    grid: Sequence[int] = COUNTS,
    inner: Sequence[Free] = (),
    robust: AnchorErrors | None = None,
    model: CableModel | str = _CATENARY,
    optimizer: str = "cma",
    evaluations: int = 600,
    seed: int = 0,
    folder: Path | str | None = None,
    progress: Progress | None = None,
) -> Front:
    """Search for a robot that is better than `robot`, or for a Pareto front of better robots.

    The first candidates are the robot itself and random robots. The same seed gives bitwise identical results. A
    candidate with a frame anchor inside the platform at any pose is dropped; its goal values are NaN.

    Args:
        robot: Initial robot of the search.
        free: Design variables: `FreeAnchors`, `FreeCable`, `FreeLimit`.
        goals: Goals, or their names. "cma" and "differential_evolution" optimize the weighted sum of the goals. "nsga2"
            finds a Pareto front, in which no robot is better than another robot in every goal.
        wrenches: Set of wrenches at every pose, for example a `WrenchBox`; None for the platform's weight alone.
        poses: Poses; None for a grid of poses without rotation in a box.
        box: Box of the grid, without tilt; None for the robot's test box without its tilt.
        grid: Number of poses of the grid along x, y and z.
        inner: Anchors that the machine moves during operation, as `FreeAnchors`. Each pose is rated with the moving
            anchors at the positions with the largest margin.
        robust: Errors of the anchors, for the rating of each candidate by robots with random errors. None for exact
            anchors.
        model: Cable model.
        optimizer: "cma", "differential_evolution" or "nsga2".
        evaluations: Largest number of candidates that are rated.
        seed: Seed of all random numbers.
        folder: Folder that records the rated candidates; it is created if its parent folder exists. A second call with
            the same arguments continues an interrupted search. None for no record.
        progress: Function that is called after each generation with the number of rated candidates and `evaluations`.

    Returns:
        Front with the better robots. If there are none, `robots` is the initial robot and `better` is False.

    Raises:
        InvalidValueError: If an argument has a wrong type; if the robot does not have a design variable, or has a value
            outside the bounds; if `evaluations` is too small for two generations.
        FileError: If the folder contains another search, or cannot be written.

    Examples:
        Posts with a variable height, which is the same for all posts:

        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> posts = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="together")
        >>> goal, load = sl.Goal("mean_margin"), sl.WrenchBox(force=50.0, moment=5.0)
        >>> front = sl.design(robot, [posts], [goal], load, grid=(3, 3, 3), evaluations=40)
        >>> front.better
        True

    Source:
        Hansen & Ostermeier 2001 (cma); Storn & Price 1997; Deb, Pratap, Agarwal & Meyarivan 2002 (nsga2).
    """
    callback(progress, "progress")
    places = poses_of(instance(robot, Robot, "robot"), poses, box, grid)
    request = Request(robot, free, goals, wrenches, places, model, inner, robust, optimizer, seed)
    candidates = request.candidates
    dimensions = len(candidates.parts)
    population = _population(optimizer, dimensions)
    count = whole_number(evaluations, "evaluations", 1, MOST_EVALUATIONS)
    if count < 2 * population:
        allowed = f">= {2 * population:,}, two generations of {optimizer} for {dimensions} free numbers"
        raise InvalidValueError("evaluations", f"{count:,}", allowed, "Give more evaluations, or fewer variables.")
    ledger = _Ledger(request, candidates, count, progress)  # raises errors before a file is written
    sample = latin_hypercube(population - 1, dimensions, request.seed)
    first = np.concatenate((candidates.units(candidates.start[None]), sample))
    with nullcontext() if folder is None else open_record(folder, request) as ledger.record:
        SEARCHES[request.optimizer](ledger.rate, first, count, request.seed, ledger.costs)
        return ledger.front()


def _population(optimizer: str, dimensions: int) -> int:
    """Number of candidates in the first generation, including the initial robot."""
    if optimizer == "cma":
        return 2 * (4 + int(3.0 * np.log(dimensions)))
    return max(16, 4 * dimensions) if optimizer == "differential_evolution" else max(24, 4 * dimensions)
