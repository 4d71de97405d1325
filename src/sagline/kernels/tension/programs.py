"""Distribution by a linear program, among any number of redundant cables: lowest sum and lowest maximum of tensions."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS, TOLERANCE, largest_bound
from sagline.kernels.algebra.linear_program import LP_GAVE_UP, LP_SOLVED, LP_UNBOUNDED, Basis, lowest_point
from sagline.kernels.algebra.nearest_point import nearest_point
from sagline.kernels.codes import POSE_INFEASIBLE, POSE_NOT_CONVERGED, POSE_SOLVED, POSE_UNBOUNDED
from sagline.kernels.jit import formula, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.tension.nearest import ReferencePoint

TIED = 1e-10  # of the largest tension: sums that differ by less are the same; of the largest weight: none


@formula
def program_status(outcome: int) -> int:
    """Status of the pose from a linear program's outcome."""
    if outcome == LP_SOLVED:
        return POSE_SOLVED
    if outcome == LP_UNBOUNDED:
        return POSE_UNBOUNDED
    return POSE_NOT_CONVERGED if outcome == LP_GAVE_UP else POSE_INFEASIBLE


@formula
def _is_tied(basis: Basis) -> bool:
    """True if a program has more than one optimum: an active bound with zero multiplier."""
    largest = 0.0
    least = math.inf
    for j in range(basis.weights.size - 1):
        largest = max(largest, basis.weights[j])
        least = min(least, basis.weights[j])
    return least <= TIED * largest


@kernel
def share_lowest_sum(bounds: Array, null: Array, near: ReferencePoint, basis: Basis, memory: Memory) -> int:
    """Fill the point (r,) of near whose tensions have the least sum; of several the one nearest to the reference."""
    r, m = null.shape
    costs, at = block(memory.numbers, 0, 1, r)
    cost = costs[0]
    for k in range(r):
        cost[k] = 0.0
        for i in range(m):
            cost[k] += null[k, i]
    outcome = lowest_point(null, bounds, cost, 0.0, basis, near.point)
    if outcome != LP_SOLVED:
        basis.labels[0] = -1
        return program_status(outcome)
    if not _is_tied(basis):
        return POSE_SOLVED
    rows, at = block(memory.numbers, at, r, m + 1)
    tied, at = block(memory.numbers, at, STRIP_ROWS, m + 1)
    found, at = block(memory.numbers, at, 1, r)
    least = 0.0
    for k in range(r):
        rows[k, m] = cost[k]
        least += cost[k] * near.point[k]
    for i in range(m):
        for k in range(r):
            rows[k, i] = null[k, i]
        for row in range(STRIP_ROWS):
            tied[row, i] = bounds[row, i]
    largest = largest_bound(bounds)
    tied[START, m], tied[LOW, m], tied[HIGH, m] = 0.0, -math.inf, least + TIED * largest
    if nearest_point(rows, tied, near.reference, TOLERANCE * largest, near.held, found[0]):
        for k in range(r):
            near.point[k] = found[0, k]
    return POSE_SOLVED


@kernel
def share_lowest_maximum(
    bounds: Array, offset: Array, null: Array, near: ReferencePoint, basis: Basis, memory: Memory
) -> int:
    """Fill the point (r,) of near whose largest tension is least; of several the one nearest to the reference.

    The program's last unknown is the largest tension.
    """
    r, m = null.shape
    rows, at = block(memory.numbers, 0, r + 1, 2 * m)
    wide, at = block(memory.numbers, at, STRIP_ROWS, 2 * m)
    lower, at = block(memory.numbers, at, STRIP_ROWS, m)
    vectors, at = block(memory.numbers, at, 3, r + 1)
    cost, found, nearest = vectors[0], vectors[1], vectors[2, :r]
    for i in range(m):
        for k in range(r):
            rows[k, i] = null[k, i]
            rows[k, m + i] = -null[k, i]
        rows[r, i] = 0.0
        rows[r, m + i] = 1.0
        for row in range(STRIP_ROWS):
            wide[row, i] = bounds[row, i]
        # the largest tension less this one is not negative
        wide[START, m + i], wide[LOW, m + i], wide[HIGH, m + i] = -bounds[START, i] - offset[i], 0.0, math.inf
    for k in range(r):
        cost[k] = 0.0
    cost[r] = 1.0
    largest = largest_bound(bounds)
    outcome = lowest_point(rows, wide, cost, TOLERANCE * largest, basis, found)
    if outcome != LP_SOLVED:
        basis.labels[0] = -1
        return POSE_INFEASIBLE if program_status(outcome) == POSE_INFEASIBLE else POSE_NOT_CONVERGED
    for k in range(r):
        near.point[k] = found[k]
    if not _is_tied(basis):
        return POSE_SOLVED
    for i in range(m):
        for row in range(STRIP_ROWS):
            lower[row, i] = bounds[row, i]
        highest = found[r] - offset[i] + 4.0 * TOLERANCE * largest
        lower[HIGH, i] = max(min(bounds[HIGH, i], highest), bounds[LOW, i])
    if nearest_point(null, lower, near.reference, TOLERANCE * largest, near.held, nearest):
        for k in range(r):
            near.point[k] = nearest[k]
    return POSE_SOLVED
