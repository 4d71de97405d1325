"""Distributions nearest to a reference: minimum norm, closest to the previous tensions, quadratic program.

docs/model.md, section 5. Objective (55) of the article selects the tensions closest to given tensions t_ref. In
coordinates of an orthonormal null-space basis N, these tensions are the projection of lambda_ref = N^T (t_ref - t0)
onto the feasible set. The distribution of minimum norm is the projection of 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.algebra.bounds import HIGH, LOW, START, TOLERANCE, largest_bound
from sagline.kernels.algebra.programs import ActiveSet, nearest_point, new_active_set
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory, block


class Distribution(NamedTuple):
    """Tension distribution of one pose."""

    method: int  # code of the method
    parameter: float  # exponent of the p-norm, or code of the optimum of the polygon walk
    variable: int  # code of the variable of the distribution
    weight: Array  # root weights of the cables, (m,)
    goal: Array  # target tensions of the quadratic program [N], (m,)


class ReferencePoint(NamedTuple):
    """Reference point of a nearest-point method, in coordinates of the null space."""

    previous: Array  # reference tensions in the distribution's variable (m,), NaN without a reference
    reference: Array  # lambda_ref, (r,)
    held: ActiveSet  # active limits of the last projection
    point: Array  # result of the last projection, (r,)


@glue
def new_reference_point(memory: Memory, previous: Array, r: int) -> tuple[ReferencePoint, Memory]:
    """Work arrays for r redundant cables, and the remaining memory."""
    rows, memory = block(memory, 2, r)
    held, memory = new_active_set(memory, r)
    return ReferencePoint(previous, rows[0], held, rows[1]), memory


@glue
def set_reference(distribution: Distribution, offset: Array, null: Array, near: ReferencePoint) -> None:
    """Fill the reference point of `distribution` in the null space.

    offset: offset of the distribution's variable (m,).
    """
    from_before = distribution.method == codes.CLOSEST and not math.isnan(near.previous[0])
    for k in range(null.shape[0]):
        near.reference[k] = 0.0
        for i in range(null.shape[1]):
            goal = near.previous[i] if from_before else distribution.goal[i]
            near.reference[k] += null[k, i] * distribution.weight[i] * (goal - offset[i])


@formula
def set_point(bounds: Array, null: Array, point: Array, tension: Array) -> None:
    """Fill the tensions (m,) of `point` in the null space."""
    for i in range(tension.size):
        tension[i] = bounds[START, i]
    for k in range(point.size):
        for i in range(tension.size):
            tension[i] += null[k, i] * point[k]


@formula
def satisfies_limits(bounds: Array, tension: Array, slack: float) -> bool:
    """True if every tension is within its limits up to the tolerance `slack`."""
    for i in range(tension.size):
        if not bounds[LOW, i] - slack <= tension[i] <= bounds[HIGH, i] + slack:
            return False
    return True


@glue
def share_nearest(bounds: Array, null: Array, near: ReferencePoint, tension: Array) -> int:
    """Fill the tensions (m,) nearest to the reference. Returns POSE_SOLVED or POSE_INFEASIBLE."""
    set_point(bounds, null, near.reference, tension)
    if satisfies_limits(bounds, tension, 0.0):
        near.held.labels[0] = 0
        return codes.POSE_SOLVED
    slack = TOLERANCE * largest_bound(bounds)
    if null.shape[0] == 0:
        return codes.POSE_SOLVED if satisfies_limits(bounds, tension, slack) else codes.POSE_INFEASIBLE
    if not nearest_point(null, bounds, near.reference, slack, near.held, near.point):
        return codes.POSE_INFEASIBLE
    set_point(bounds, null, near.point, tension)
    return codes.POSE_SOLVED


@glue
def is_nearest(distribution: Distribution) -> bool:
    """True if `distribution` gives the feasible tensions nearest to a reference."""
    return distribution.method <= codes.QUADRATIC_PROGRAM
