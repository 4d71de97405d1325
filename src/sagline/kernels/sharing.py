"""Choosing among feasible tensions: the one switch between the ways of sharing the load.

docs/model.md, section 5. With an orthonormal null-space basis N, the objective (55) of the article,
closest to given tensions, is the projection of N^T (t_ref - t0) onto the feasible set; the minimum
norm is the projection of 0. No iteration is needed for two redundant cables or fewer.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.centers import analytic_center, centroid, deepest_point
from sagline.kernels.closed_form import share_near_middle
from sagline.kernels.codes import (
    ANALYTIC_CENTER,
    CLOSED_FORM,
    LOWEST_MAXIMUM,
    LOWEST_SUM,
    P_NORM,
    POLYGON_WALK,
    POSE_INFEASIBLE,
    POSE_NOT_CONVERGED,
    POSE_NOT_COVERED,
    POSE_SOLVED,
    POSE_UNBOUNDED,
    PUNCTURE,
    QUADRATIC_PROGRAM,
)
from sagline.kernels.jit import formula, kernel
from sagline.kernels.linear import LP_EMPTY, LP_GAVE_UP, LP_SOLVED, LP_UNBOUNDED, limit_rows, lowest_point
from sagline.kernels.p_norm import lowest_p_norm
from sagline.kernels.polygon import (
    TOLERANCE,
    box_radius,
    feasible_polygon,
    largest_tension,
    nearest_on_side,
    nearest_point,
)
from sagline.kernels.projection import project
from sagline.kernels.tables import HIGH, LOW, OFFSET, SHARED, START
from sagline.kernels.walk import walk_polygon

TIED = 1e-10  # of the largest tension: sums that differ by less are the same
WALK_SUM, WALK_NORM, WALK_CENTROID = 0.0, 1.0, 2.0  # the optimum of the polygon walk


@kernel
def feasible_interval(work: Array, null: Array) -> tuple[float, float]:
    """Ends of the feasible interval of one redundant cable; the first exceeds the second where it is empty."""
    slack = TOLERANCE * largest_tension(work)
    first = -math.inf
    last = math.inf
    for i in range(work.shape[1]):
        row = null[0, i]
        below = work[LOW, i] - work[START, i]
        above = work[HIGH, i] - work[START, i]
        if abs(row) < TOLERANCE:
            if below > slack or above < -slack:
                return 1.0, 0.0
        elif row > 0.0:
            first = max(first, below / row)
            last = min(last, above / row)
        else:
            first = max(first, above / row)
            last = min(last, below / row)
    if first > last and first - last <= slack:
        first = last = 0.5 * (first + last)
    return first, last


@kernel
def feasible_corners(work: Array, null: Array, corners: Array, labels: Indices) -> int:
    """Corners of the feasible polygon, or for r = 1 the two ends of the interval on the first axis; 0 if empty.

    An end at infinity is as far out as the polygon's box, and labeled as such.
    """
    if null.shape[0] == 2:
        return feasible_polygon(work, null, corners, labels)
    first, last = feasible_interval(work, null)
    if first > last:
        return 0
    radius = box_radius(largest_tension(work), work)
    corners[0, 0] = max(first, -radius)
    corners[1, 0] = min(last, radius)
    corners[0, 1] = corners[1, 1] = 0.0
    labels[0] = 0 if first > -math.inf else 2 * work.shape[1]
    labels[1] = 0 if last < math.inf else 2 * work.shape[1]
    return 2


@formula
def within_limits(work: Array, slack: float) -> bool:
    """Whether every shared tension keeps its limits, up to a slack."""
    for i in range(work.shape[1]):
        if not work[LOW, i] - slack <= work[SHARED, i] <= work[HIGH, i] + slack:
            return False
    return True


@formula
def share_load(
    method: int, parameter: float, work: Array, null: Array, reference: Array, corners: Array, labels: Indices
) -> int:
    """Fill SHARED of work by a way of sharing; returns POSE_SOLVED, or why there is no answer.

    Args:
        method: Code of the way of sharing.
        parameter: Its exponent, or which optimum of the polygon walk.
        work: Rows START (minimum-norm tensions t0), LOW and HIGH (may be infinite), OFFSET; SHARED is filled.
        null: Orthonormal null-space basis, one vector a row, (r, m).
        reference: lambda_ref = N^T (t_ref - t0), (r,): what the nearest tensions are near to.
        corners: Working space of `feasible_polygon`.
        labels: Working space of `feasible_polygon`.
    """
    r, m = null.shape
    for i in range(m):
        work[SHARED, i] = work[START, i]
    if method > QUADRATIC_PROGRAM:
        return share_otherwise(method, parameter, work, null, reference, corners, labels)
    for k in range(r):
        for i in range(m):
            work[SHARED, i] += null[k, i] * reference[k]
    if within_limits(work, 0.0):
        return POSE_SOLVED
    return share_at_limits(work, null, reference, corners, labels)


@kernel
def set_point(work: Array, null: Array, point: Array) -> None:
    """Fill the shared tensions of a point in the null space."""
    for i in range(work.shape[1]):
        work[SHARED, i] = work[START, i]
    for k in range(point.size):
        for i in range(work.shape[1]):
            work[SHARED, i] += null[k, i] * point[k]


@kernel
def share_at_limits(work: Array, null: Array, reference: Array, corners: Array, labels: Indices) -> int:
    """The nearest tensions where the reference itself is not feasible: its projection onto the feasible set."""
    r, m = null.shape
    if r == 0:
        return POSE_SOLVED if within_limits(work, TOLERANCE * largest_tension(work)) else POSE_INFEASIBLE
    if r > 2:
        return share_nearest_of_many(work, null, reference)
    count = feasible_corners(work, null, corners, labels)
    if count == 0:
        return POSE_INFEASIBLE
    x, y = nearest_point(corners, count, reference[0], reference[1] if r == 2 else 0.0)
    for i in range(m):
        work[SHARED, i] = work[START, i] + null[0, i] * x
        if r == 2:
            work[SHARED, i] += null[1, i] * y
    return POSE_SOLVED


@kernel
def share_nearest_of_many(work: Array, null: Array, reference: Array) -> int:
    """The same for more than two redundant cables, by the active-set method."""
    r, m = null.shape
    rows = np.empty((2 * m, r))
    sides = np.empty(2 * m)
    count = limit_rows(work, null, rows, sides, np.empty(2 * m, dtype=np.int64))
    point = np.empty(r)
    if not project(rows, sides, count, reference, TOLERANCE * largest_tension(work), point):
        return POSE_INFEASIBLE
    set_point(work, null, point)
    return POSE_SOLVED


@kernel
def share_otherwise(
    method: int, parameter: float, work: Array, null: Array, reference: Array, corners: Array, labels: Indices
) -> int:
    """All ways of sharing that are no projection of a reference; ties go to the point nearest to it."""
    r = null.shape[0]
    slack = TOLERANCE * largest_tension(work)
    if r == 0:
        return POSE_SOLVED if within_limits(work, slack) else POSE_INFEASIBLE
    if CLOSED_FORM <= method <= PUNCTURE:
        if share_near_middle(method, work, null, slack):
            return POSE_SOLVED
        found = share_at_limits(work, null, reference, corners, labels)
        return POSE_NOT_COVERED if found == POSE_SOLVED else found
    if method == LOWEST_MAXIMUM:
        return share_lowest_maximum(work, null, reference, corners, labels)
    if r > 2:
        return share_among_many(method, parameter, work, null, corners)
    count = walk_polygon(work, null, corners, labels) if method == POLYGON_WALK else 0
    if count < 0:
        return POSE_NOT_CONVERGED
    if method != POLYGON_WALK:
        count = feasible_corners(work, null, corners, labels)
    if count == 0:
        return POSE_INFEASIBLE
    return share_on_corners(method, parameter, work, null, reference, corners, labels, count)


@kernel
def share_on_corners(
    method: int,
    parameter: float,
    work: Array,
    null: Array,
    reference: Array,
    corners: Array,
    labels: Indices,
    count: int,
) -> int:
    """A way of sharing that looks at the feasible polygon or interval."""
    r, m = null.shape
    point = np.zeros(r)
    x = reference[0]
    y = reference[1] if r == 2 else 0.0
    walked_norm = method == POLYGON_WALK and parameter == WALK_NORM
    if method == LOWEST_SUM or (method == POLYGON_WALK and parameter == WALK_SUM):
        x, y = lowest_corner(work, null, corners, count, x, y)
    elif method == P_NORM or walked_norm:
        point[0] = x
        if r == 2:
            point[1] = y
        set_point(work, null, point)
        if not within_limits(work, 0.0):
            x, y = nearest_point(corners, count, x, y)
    else:
        for k in range(count):
            if labels[k] >= 2 * m:
                return POSE_UNBOUNDED
        x, y = centroid(corners, count)
    point[0] = x
    if r == 2:
        point[1] = y
    if method == P_NORM and not lowest_p_norm(work, null, parameter, corners, count, point):
        return POSE_NOT_CONVERGED
    if method == ANALYTIC_CENTER and not analytic_center(work, null, point):
        return POSE_NOT_CONVERGED
    set_point(work, null, point)
    return POSE_SOLVED


@kernel
def lowest_corner(
    work: Array, null: Array, corners: Array, count: int, goal_x: float, goal_y: float
) -> tuple[float, float]:
    """The point of least sum of tensions: a corner, or of a tied side the point nearest to a goal."""
    r, m = null.shape
    gx = 0.0
    gy = 0.0
    for i in range(m):
        gx += null[0, i]
        gy += null[1, i] if r == 2 else 0.0
    least = math.inf
    for k in range(count):
        least = min(least, gx * corners[k, 0] + gy * corners[k, 1])
    tie = least + TIED * largest_tension(work)
    best = math.inf
    best_x = best_y = 0.0
    for k in range(count):
        following = k + 1 if k + 1 < count else 0
        if gx * corners[k, 0] + gy * corners[k, 1] <= tie:
            x, y = corners[k, 0], corners[k, 1]
            if gx * corners[following, 0] + gy * corners[following, 1] <= tie:
                x, y = nearest_on_side(x, y, corners[following, 0], corners[following, 1], goal_x, goal_y)
            distance = (x - goal_x) * (x - goal_x) + (y - goal_y) * (y - goal_y)
            if distance < best:
                best = distance
                best_x, best_y = x, y
    return best_x, best_y


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
