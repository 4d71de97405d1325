"""Design search: optimization of the design variables of a robot."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.core.arguments import callback, instance, whole_number
from sagline.core.arrays import Progress
from sagline.core.errors import InvalidValueError
from sagline.optimization.candidates import AnchorErrors
from sagline.optimization.folder import open_record
from sagline.optimization.free import Free
from sagline.optimization.front import Front, Ledger
from sagline.optimization.request import COUNTS, MOST_EVALUATIONS, Goal, Request, poses_of
from sagline.optimization.search import SEARCHES, latin_hypercube
from sagline.robot.pose import PoseBox, PoseLike
from sagline.robot.robot import Robot
from sagline.workspaces.wrench_sets import WrenchSet

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
    ledger = Ledger(request, candidates, count, progress)  # raises errors before a file is written
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
