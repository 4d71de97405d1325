"""Where on a timeline something is wrong, and why."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.robot import Robot
from sagline.viewer.timeline_track import Span
from sagline.viewer.wording import ForceUnit

MOST: Final = 400  # spans on a timeline: those nearer than its length over that are one


def spans_of(time: Array, wrong: NDArray[np.bool_], why: Callable[[slice], str]) -> tuple[Span, ...]:
    """The runs of samples that are wrong, as times; a sample lasts until the next.

    Args:
        time: Of the samples [s], shape (N,).
        wrong: Which are, shape (N,).
        why: Says what is wrong with some samples.
    """
    edges = np.flatnonzero(np.diff(np.concatenate(([False], wrong, [False])).astype(np.int8))).reshape(-1, 2)
    if not edges.size:
        return ()
    until = np.minimum(edges[:, 1], time.size - 1)
    apart = time[edges[1:, 0]] - time[until[:-1]] > (time[-1] - time[0]) / MOST
    first = edges[np.concatenate(([True], apart)), 0]
    end = edges[np.concatenate((apart, [True])), 1]
    return tuple(
        Span(float(time[a]), float(time[min(b, time.size - 1)]), why(slice(int(a), int(b))))
        for a, b in zip(first, end, strict=True)
    )


def infeasible(plan: Plan, time: Array, unit: ForceUnit) -> tuple[Span, ...]:
    """Where a plan of N poses has no answer."""

    def why(rows: slice) -> str:
        lost = ~plan.feasible[rows]
        status = PoseStatus(int(plan.status[rows][lost][0]))
        if status is not PoseStatus.INFEASIBLE:
            return status.name.replace("_", " ").lower()
        short = plan.shortfall[rows][lost]
        known = short[np.isfinite(short)]
        parts = ["not feasible"]
        if np.isinf(short).any():
            parts.append("no force alone would do")
        elif known.size:
            parts.append(f"short of up to {unit.written(float(known.max()))}")
        blocking = np.flatnonzero(plan.blocking[rows][lost].any(axis=0))
        return ": ".join(parts) + (f"; at their limits: {_cables(blocking)}" if blocking.size else "")

    return spans_of(time, ~plan.feasible, why)


def outside(robot: Robot, time: Array, tension: Array, unit: ForceUnit) -> tuple[Span, ...]:
    """Where a tension at the winch, shape (N, m) [N], is not within its limits."""
    below = np.asarray(tension < robot.tension_min)  # NaN is neither
    above = np.asarray(tension > robot.tension_max)

    def why(rows: slice) -> str:
        parts = []
        for which, word, limits, worst in (
            (below[rows], "below", robot.tension_min, np.fmin),
            (above[rows], "above", robot.tension_max, np.fmax),
        ):
            cables = np.flatnonzero(which.any(axis=0))
            if cables.size:
                reached = float(worst.reduce(tension[rows][:, cables], axis=None))
                limit = unit.written(float(limits[cables[0]]))
                parts.append(f"{_cables(cables)} {word} {limit}: {unit.written(reached)} at the winch")
        return "; ".join(parts)

    return spans_of(time, np.asarray((below | above).any(axis=1)), why)


def _cables(which: NDArray[np.intp]) -> str:
    return f"cable{'s' if which.size > 1 else ''} {', '.join(map(str, which))}"
