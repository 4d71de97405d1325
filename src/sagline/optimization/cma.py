"""CMA-ES, by the package cma: begins at the best of the first robot and the sample, and again where it gets stuck."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.optimization.extras import extra
from sagline.optimization.search import Task

SPREAD: Final = 0.2  # first standard deviation, of the bounds' distance: they lie within some three of it
GROWTH: Final = 2  # of the population, from each beginning to the next
LEAST: Final = 2  # numbers: with a single one the package fails; a second that means nothing goes along


def search(task: Task) -> None:
    """Rate generation after generation until the evaluations are used up.

    Args:
        task: What is searched; one goal.

    Source:
        Hansen & Ostermeier 2001; restarts with a growing population: Auger & Hansen 2005.
    """
    cma = extra("cma")
    first = np.concatenate((task.start[None], task.sample))
    costs = task.rate(first)[:, 0]
    order = iter(np.argsort(costs, kind="stable"))
    left, population = task.evaluations - len(first), None
    random = np.random.default_rng(task.seed)
    while True:
        strategy = _strategy(cma, first[next(order, 0)], random, population)
        population = strategy.popsize * GROWTH
        if left < strategy.popsize:
            return
        while left >= strategy.popsize and not strategy.stop():
            points = strategy.ask()
            found = task.rate(np.clip(points, 0.0, 1.0)[:, : len(task.start)])[:, 0]
            strategy.tell(points, found.tolist())
            left -= len(points)


def _strategy(cma: Any, start: Array, random: np.random.Generator, population: int | None) -> Any:
    """One run; its random numbers are its own, so that numpy's global ones stay as the caller has them."""
    padded = np.concatenate((start, np.full(max(LEAST - len(start), 0), 0.5)))
    options = {
        "bounds": [0.0, 1.0],
        "randn": lambda *shape: random.standard_normal(shape),
        "seed": np.nan,  # none: randn has its own
        "verbose": -9,
        **({} if population is None else {"popsize": population}),
    }
    return cma.CMAEvolutionStrategy(padded, SPREAD, options)
