"""Optimizers: CMA-ES from the package cma, differential evolution from scipy, and NSGA-II from the package pymoo."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from types import MappingProxyType
from typing import Any, Final, TypeAlias

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError


def _optional_module(module: str) -> Any:
    """Import a module of an optional package; the error of a missing package states the command that installs it."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        package = module.partition(".")[0]
        if error.name is None or error.name.partition(".")[0] != package:
            raise
        step = 'Install it: pip install "sagline[design]"; or choose "differential_evolution", which needs no package.'
        raise InvalidValueError(f"the package {package}", "missing", "installed", step) from None


Rate: TypeAlias = Callable[[Array], Array]  # points of the unit cube (N, d) -> costs (N, g)
# Arguments of a search: function that rates the points of a generation; first generation (K, d), which begins with the
# initial robot; largest number of rated points, including the first generation; seed; number of costs g.


def latin_hypercube(count: int, dimensions: int, seed: int) -> Array:
    """Random points (count, dimensions) in the unit cube by Latin hypercube sampling (McKay et al. 1979)."""
    random = np.random.default_rng(seed)
    intervals = np.stack([random.permutation(count) for _ in range(dimensions)], axis=-1)
    return np.asarray((intervals + random.random((count, dimensions))) / count)


SPREAD: Final = 0.2  # initial standard deviation of CMA-ES in the unit cube
GROWTH: Final = 2  # factor by which the population of CMA-ES grows at each restart
LEAST_DIMENSIONS: Final = 2  # the package needs two variables; a single variable gets a second one without effect


def _search_cma(rate: Rate, first: Array, evaluations: int, seed: int, _: int) -> None:
    """CMA-ES (Hansen & Ostermeier 2001), restarted with a growing population (Auger & Hansen 2005)."""
    cma = _optional_module("cma")
    costs = rate(first)[:, 0]
    order = iter(np.argsort(costs, kind="stable"))
    left, population = evaluations - len(first), None
    random = np.random.default_rng(seed)
    while True:
        strategy = _strategy(cma, first[next(order, 0)], random, population)
        population = strategy.popsize * GROWTH
        if left < strategy.popsize:
            return
        while left >= strategy.popsize and not strategy.stop():
            points = strategy.ask()
            found = rate(np.clip(points, 0.0, 1.0)[:, : first.shape[1]])[:, 0]
            strategy.tell(points, found.tolist())
            left -= len(points)


def _strategy(cma: Any, start: Array, random: np.random.Generator, population: int | None) -> Any:
    """CMA-ES for one run, with its own generator of random numbers in place of numpy's global generator."""
    padded = np.concatenate((start, np.full(max(LEAST_DIMENSIONS - len(start), 0), 0.5)))
    options = {
        "bounds": [0.0, 1.0],
        "randn": lambda *shape: random.standard_normal(shape),
        "seed": np.nan,  # the generator `randn` already has a seed
        "verbose": -9,
        **({} if population is None else {"popsize": population}),
    }
    return cma.CMAEvolutionStrategy(padded, SPREAD, options)


def _search_differential_evolution(rate: Rate, first: Array, evaluations: int, seed: int, _: int) -> None:
    """Differential evolution (Storn & Price 1997)."""
    from scipy.optimize import differential_evolution

    def costs(points: Array) -> Array:  # scipy passes each point as a column
        return rate(np.ascontiguousarray(points.T))[:, 0]

    differential_evolution(
        costs,
        [(0.0, 1.0)] * first.shape[1],
        init=first,
        maxiter=evaluations // len(first) - 1,  # number of generations after the first generation
        vectorized=True,
        updating="deferred",
        polish=False,
        tol=0.0,
        atol=0.0,
        rng=np.random.default_rng(seed),
    )


def _search_nsga2(rate: Rate, first: Array, evaluations: int, seed: int, goals: int) -> None:
    """NSGA-II (Deb, Pratap, Agarwal & Meyarivan 2002)."""
    evaluator, problems = _optional_module("pymoo.core.evaluator"), _optional_module("pymoo.core.problem")
    static, termination = _optional_module("pymoo.problems.static"), _optional_module("pymoo.core.termination")
    dimensions = first.shape[1]
    problem = problems.Problem(n_var=dimensions, n_obj=goals, xl=np.zeros(dimensions), xu=np.ones(dimensions))
    algorithm = _optional_module("pymoo.algorithms.moo.nsga2").NSGA2(pop_size=len(first), sampling=first)
    algorithm.setup(problem, termination=termination.NoTermination(), seed=seed)
    while True:
        asked = algorithm.ask()
        if asked is None or not 0 < len(asked) <= evaluations:  # None: the optimizer found only known points
            return
        costs = rate(asked.get("X"))
        evaluator.Evaluator().eval(static.StaticProblem(problem, F=costs), asked)
        algorithm.tell(infills=asked)
        evaluations -= len(asked)


SEARCHES: Final[MappingProxyType[str, Callable[[Rate, Array, int, int, int], None]]] = MappingProxyType(
    {"cma": _search_cma, "differential_evolution": _search_differential_evolution, "nsga2": _search_nsga2}
)
