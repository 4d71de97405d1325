"""NSGA-II, by the package pymoo: a front of robots of which none is better than another in every goal."""

from __future__ import annotations

import numpy as np

from sagline.optimization.extras import extra
from sagline.optimization.search import Task


def search(task: Task) -> None:
    """Rate generation after generation until the evaluations are used up.

    Args:
        task: What is searched.

    Source:
        Deb, Pratap, Agarwal & Meyarivan 2002.
    """
    evaluator, problems = extra("pymoo.core.evaluator"), extra("pymoo.core.problem")
    static, termination = extra("pymoo.problems.static"), extra("pymoo.core.termination")
    population = np.concatenate((task.start[None], task.sample))
    dimensions = len(task.start)
    problem = problems.Problem(n_var=dimensions, n_obj=task.goals, xl=np.zeros(dimensions), xu=np.ones(dimensions))
    algorithm = extra("pymoo.algorithms.moo.nsga2").NSGA2(pop_size=len(population), sampling=population)
    algorithm.setup(problem, termination=termination.NoTermination(), seed=task.seed)
    left = task.evaluations
    while left > 0:
        asked = algorithm.ask()
        if asked is None or not 0 < len(asked) <= left:  # none: it finds no point that it has not tried
            return
        costs = task.rate(asked.get("X"))
        evaluator.Evaluator().eval(static.StaticProblem(problem, F=costs), asked)
        algorithm.tell(infills=asked)
        left -= len(asked)
