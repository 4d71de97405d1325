"""Plans for files, and their comparison."""

from operator import attrgetter

import numpy as np

import sagline as sl
from sagline import dump_robot

SUSPENDED = sl.load_robot("article-suspended")
OUTSIDE = sl.quintic_path([(0.0, 0.0, 1.5), (7.2, 3.0, 1.5)], durations=5.0, rate=8.0)  # the last one is infeasible

PLACES = (
    *(
        f"state.cables.{name}"
        for name in ("unstrained_length", "chord_tension", "horizontal_tension", "vertical_force")
    ),
    *(f"state.cables.{name}" for name in ("span", "rise", "status")),
    *("state.pose.position", "state.pose.quaternion", "state.wrench"),
    *("status", "shortfall", "wrench_residual", "blocking", "farkas", "needed"),
)
PATH_PLACES = (
    *("path.time", "path.twist", "path.twist_rate", "path.jerk", "path.rests"),
    *("path.pose.position", "path.pose.quaternion"),
)


def a_plan() -> sl.Plan:
    return sl.inverse(SUSPENDED, OUTSIDE, sl.Empirical(k_p=4.1), sl.Closest("horizontal", 0.1))


def assert_same(plan: sl.Plan, other: sl.Plan) -> None:
    for place in PLACES + (() if plan.path is None else PATH_PLACES):
        mine, theirs = (np.asarray(attrgetter(place)(p)) for p in (plan, other))
        assert (mine.dtype, mine.shape) == (theirs.dtype, theirs.shape), place
        assert mine.tobytes() == theirs.tobytes(), place
        assert not theirs.flags.writeable
    assert plan.tension == other.tension
    assert plan.state.cables.model == other.state.cables.model
    assert dump_robot(plan.state.one_robot) == dump_robot(other.state.one_robot)
    assert (plan.path is None) == (other.path is None)
