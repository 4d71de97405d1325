"""Differential evolution, by scipy: a population that begins with the first robot and the sample."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.optimization.search import Task

LEAST = 5  # points of a population, for scipy


def search(task: Task) -> None:
    """Rate generation after generation until the evaluations are used up.

    Args:
        task: What is searched; one goal.

    Source:
        Storn & Price 1997.
    """
    from scipy.optimize import differential_evolution

    population = np.concatenate((task.start[None], task.sample))
    generations = task.evaluations // len(population) - 1

    def costs(points: Array) -> Array:  # scipy's points are columns
        return task.rate(np.ascontiguousarray(points.T))[:, 0]

    differential_evolution(
        costs,
        [(0.0, 1.0)] * len(task.start),
        init=population,
        maxiter=generations,
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0.0,
        atol=0.0,
        rng=np.random.default_rng(task.seed),
    )
