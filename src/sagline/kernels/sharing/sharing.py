"""Choosing among feasible tensions: the one switch between the ways of sharing the load.

docs/model.md, section 5. With an orthonormal null-space basis N, the objective (55) of the article,
closest to given tensions, is the projection of N^T (t_ref - t0) onto the feasible set; the minimum
norm is the projection of 0. No iteration is needed for two redundant cables or fewer.
"""

from __future__ import annotations

from sagline.arrays import Array, Indices
from sagline.kernels.codes import (
    CLOSED_FORM,
    LOWEST_MAXIMUM,
    POLYGON_WALK,
    POSE_INFEASIBLE,
    POSE_NOT_CONVERGED,
    POSE_NOT_COVERED,
    POSE_SOLVED,
    PUNCTURE,
    QUADRATIC_PROGRAM,
)
from sagline.kernels.jit import formula, kernel
from sagline.kernels.sharing.closed_form import share_near_middle
from sagline.kernels.sharing.feasible_set import feasible_corners, within_limits
from sagline.kernels.sharing.polygon import (
    TOLERANCE,
    largest_tension,
)
from sagline.kernels.sharing.sharing_corners import share_on_corners
from sagline.kernels.sharing.sharing_many import share_among_many, share_lowest_maximum
from sagline.kernels.sharing.sharing_nearest import share_at_limits
from sagline.kernels.sharing.walk import walk_polygon
from sagline.kernels.tables import SHARED, START


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
