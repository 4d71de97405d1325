"""Ways of sharing that look at the corners of the feasible polygon or interval."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.codes import (
    ANALYTIC_CENTER,
    LOWEST_SUM,
    P_NORM,
    POLYGON_WALK,
    POSE_NOT_CONVERGED,
    POSE_SOLVED,
    POSE_UNBOUNDED,
)
from sagline.kernels.jit import kernel
from sagline.kernels.sharing.centers import analytic_center, centroid
from sagline.kernels.sharing.feasible_set import set_point, within_limits
from sagline.kernels.sharing.p_norm import lowest_p_norm
from sagline.kernels.sharing.polygon import (
    largest_tension,
    nearest_on_side,
    nearest_point,
)

TIED = 1e-10  # of the largest tension: sums that differ by less are the same
WALK_SUM, WALK_NORM, WALK_CENTROID = 0.0, 1.0, 2.0  # the optimum of the polygon walk


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
