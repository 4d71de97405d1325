"""What an execution did less what was planned."""

from __future__ import annotations

import numpy as np

from sagline.control.execution import Execution
from sagline.control.gains import gains_along
from sagline.control.tension_loop import TensionSettings
from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked, number


def planned_position(execution: Execution) -> Array:
    """Where the platform's origin was to be.

    Args:
        execution: N cycles.

    Returns:
        Positions [m], shape (N, 3); NaN beside the plan.
    """
    done = instance(execution, Execution, "execution")
    plan = done.plan
    if plan is None or plan.path is None:
        still = np.full((len(done), 3), np.nan)
        if plan is not None and not plan.state.pose.shape:
            still[np.isfinite(done.clock)] = plan.state.pose.position
        return locked(still)
    clock, time = done.clock + plan.path.time[0], plan.path.time
    return locked(np.stack([np.interp(clock, time, course) for course in plan.path.pose.position.T], axis=1))


def position_error(execution: Execution) -> Array:
    """The estimated position of the platform's origin less the planned one.

    Args:
        execution: N cycles.

    Returns:
        Along the world's axes [m], shape (N, 3); NaN beside the plan and where there is no estimate.
    """
    planned = planned_position(execution)
    return locked(execution.position - planned)


def null_space_error(execution: Execution, filter_time: float | None = None) -> Array:
    """The part of the tension errors that lengths can mend without moving the platform, as the tension loop sees it.

    Args:
        execution: N cycles.
        filter_time: Of the filter in front [s]; None: that of the tension loop.

    Returns:
        e_N = K_A N_L G f with f the filtered T_A less the planned T_A [N], shape (N, m); NaN beside the plan, and of a
        robot without redundancy.

    Source:
        docs/model.md, section 12.
    """
    done = instance(execution, Execution, "execution")
    default = TensionSettings().filter_time
    time = default if filter_time is None else number(filter_time, "filter_time", "s", low=0.0)
    plan, error = done.plan, np.full(done.tension.shape, np.nan)
    gains = None if plan is None else gains_along(plan)
    if plan is None or gains is None:
        return locked(error)
    start = 0.0 if plan.path is None else float(plan.path.time[0])
    share = done.period / (time + done.period)
    filtered = np.zeros(done.tension.shape[1:])
    clock = (done.clock + start).tolist()
    away = done.tension - done.planned_tension
    known = np.isfinite(away.sum(axis=1)).tolist()
    for k, at in enumerate(clock):
        if known[k]:
            filtered += share * (away[k] - filtered)
        if at == at:
            error[k] = gains.at(at).visible @ filtered
    return locked(error)
