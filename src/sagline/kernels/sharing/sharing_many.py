"""Sharing by a linear or quadratic program, for any number of redundant cables."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.algebra.linear import LP_EMPTY, LP_GAVE_UP, LP_SOLVED, LP_UNBOUNDED, limit_rows, lowest_point
from sagline.kernels.codes import (
    ANALYTIC_CENTER,
    LOWEST_SUM,
    P_NORM,
    POSE_INFEASIBLE,
    POSE_NOT_CONVERGED,
    POSE_SOLVED,
    POSE_UNBOUNDED,
)
from sagline.kernels.jit import kernel
from sagline.kernels.sharing.centers import analytic_center, deepest_point
from sagline.kernels.sharing.feasible_set import set_point
from sagline.kernels.sharing.p_norm import lowest_p_norm
from sagline.kernels.sharing.polygon import (
    TOLERANCE,
    box_radius,
    largest_tension,
)
from sagline.kernels.sharing.sharing_nearest import share_at_limits, share_nearest_of_many
from sagline.kernels.tables import HIGH, LOW, OFFSET, SHARED, START


@kernel
def share_lowest_maximum(work: Array, null: Array, reference: Array, corners: Array, labels: Indices) -> int:
    """The tensions whose largest is least; of those the ones of least norm."""
    r, m = null.shape
    rows = np.zeros((3 * m + r + 1, r + 1))
    sides = np.empty(3 * m + r + 1)
    count = limit_rows(work, null, rows, sides, np.empty(2 * m, dtype=np.int64))
    for i in range(m):  # the unknown maximum minus this tension is not negative
        for k in range(r):
            rows[count, k] = -null[k, i]
        rows[count, r] = 1.0
        sides[count] = work[START, i] + work[OFFSET, i]
        count += 1
    cost = np.zeros(r + 1)
    cost[r] = 1.0
    point = np.empty(r + 1)
    largest = largest_tension(work)
    outcome = lowest_point(
        rows,
        sides,
        count,
        cost,
        box_radius(largest, work),
        TOLERANCE * largest,
        point,
        np.empty((r + 1, r + 1)),
        np.empty(r + 2, dtype=np.int64),
        np.empty(r + 2),
    )
    if outcome != LP_SOLVED:
        return POSE_INFEASIBLE if outcome == LP_EMPTY else POSE_NOT_CONVERGED
    before = np.empty(m)
    for i in range(m):
        before[i] = work[HIGH, i]
        work[HIGH, i] = max(min(before[i], point[r] - work[OFFSET, i] + 4.0 * TOLERANCE * largest), work[LOW, i])
    status = share_at_limits(work, null, reference, corners, labels)
    for i in range(m):
        work[HIGH, i] = before[i]
    if status != POSE_SOLVED:
        set_point(work, null, point[:r])
    return POSE_SOLVED


@kernel
def share_among_many(method: int, parameter: float, work: Array, null: Array, corners: Array) -> int:
    """Least sum, p-norm and analytic center for more than two redundant cables."""
    r, m = null.shape
    point = np.zeros(r)
    if method == ANALYTIC_CENTER:
        outcome = deepest_point(work, null, point)
        if outcome != LP_SOLVED:
            return outcome_status(outcome)
        if not analytic_center(work, null, point):
            return POSE_NOT_CONVERGED
        set_point(work, null, point)
        return POSE_SOLVED
    if method == P_NORM:
        status = share_nearest_of_many(work, null, point)
        if status != POSE_SOLVED:
            return status
        for k in range(r):
            for i in range(m):
                point[k] += null[k, i] * (work[SHARED, i] - work[START, i])
        if not lowest_p_norm(work, null, parameter, corners, 0, point):
            return POSE_NOT_CONVERGED
        set_point(work, null, point)
        return POSE_SOLVED
    if method != LOWEST_SUM:
        return POSE_NOT_CONVERGED  # centroid and polygon walk are refused before
    rows = np.empty((2 * m + r, r))
    sides = np.empty(2 * m + r)
    count = limit_rows(work, null, rows, sides, np.empty(2 * m, dtype=np.int64))
    cost = np.zeros(r)
    for k in range(r):
        for i in range(m):
            cost[k] += null[k, i]
    largest = largest_tension(work)
    outcome = lowest_point(
        rows,
        sides,
        count,
        cost,
        box_radius(largest, work),
        TOLERANCE * largest,
        point,
        np.empty((r, r)),
        np.empty(r + 1, dtype=np.int64),
        np.empty(r + 1),
    )
    if outcome != LP_SOLVED:
        return outcome_status(outcome)
    set_point(work, null, point)
    return POSE_SOLVED


@kernel
def outcome_status(outcome: int) -> int:
    """What a linear program's outcome means for the pose."""
    if outcome == LP_UNBOUNDED:
        return POSE_UNBOUNDED
    return POSE_NOT_CONVERGED if outcome == LP_GAVE_UP else POSE_INFEASIBLE
