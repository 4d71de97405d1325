"""Sharing by a linear program, for any number of redundant cables: the lowest sum and the lowest maximum of tensions."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array
from sagline.kernels.algebra.linear_program import LP_GAVE_UP, LP_SOLVED, LP_UNBOUNDED, Basis, lowest_point
from sagline.kernels.algebra.nearest_point import nearest_point
from sagline.kernels.algebra.strips import HIGH, LOW, START, STRIP_ROWS, TOLERANCE, largest_number
from sagline.kernels.codes import POSE_INFEASIBLE, POSE_NOT_CONVERGED, POSE_SOLVED, POSE_UNBOUNDED
from sagline.kernels.jit import formula, kernel
from sagline.kernels.sharing.nearest import Nearness

TIED = 1e-10  # of the largest tension: sums that differ by less are the same; and of the largest weight: such weigh nothing


@formula
def status_of(outcome: int) -> int:
    """What a linear program's outcome means for the pose."""
    if outcome == LP_SOLVED:
        return POSE_SOLVED
    if outcome == LP_UNBOUNDED:
        return POSE_UNBOUNDED
    return POSE_NOT_CONVERGED if outcome == LP_GAVE_UP else POSE_INFEASIBLE


@formula
def is_tied(basis: Basis) -> bool:
    """Whether a program has more than one answer: a side it stands on weighs nothing."""
    largest = 0.0
    least = math.inf
    for j in range(basis.weights.size - 1):
        largest = max(largest, basis.weights[j])
        least = min(least, basis.weights[j])
    return least <= TIED * largest


@kernel
def share_lowest_sum(strips: Array, null: Array, near: Nearness, basis: Basis) -> int:
    """Fill the point (r,) of near whose tensions have the least sum; of several the one nearest to the reference."""
    r, m = null.shape
    cost = np.zeros(r)
    for k in range(r):
        for i in range(m):
            cost[k] += null[k, i]
    outcome = lowest_point(null, strips, cost, 0.0, basis, near.point)
    if outcome != LP_SOLVED:
        basis.labels[0] = -1
        return status_of(outcome)
    if not is_tied(basis):
        return POSE_SOLVED
    rows = np.empty((r, m + 1))
    tied = np.empty((STRIP_ROWS, m + 1))
    rows[:, :m] = null
    rows[:, m] = cost
    tied[:, :m] = strips
    least = 0.0
    for k in range(r):
        least += cost[k] * near.point[k]
    largest = largest_number(strips)
    tied[START, m], tied[LOW, m], tied[HIGH, m] = 0.0, -math.inf, least + TIED * largest
    found = np.empty(r)
    if nearest_point(rows, tied, near.reference, TOLERANCE * largest, near.held, found):
        near.point[:] = found
    return POSE_SOLVED


@kernel
def share_lowest_maximum(
    strips: Array, offset: Array, null: Array, near: Nearness, basis: Basis, rows: Array, wide: Array
) -> int:
    """Fill the point (r,) of near whose largest tension is least; of several the one nearest to the reference.

    rows (r + 1, 2m) and wide (3, 2m) are room for the program, whose last unknown is the largest tension.
    """
    r, m = null.shape
    for i in range(m):
        for k in range(r):
            rows[k, i] = null[k, i]
            rows[k, m + i] = -null[k, i]
        rows[r, i] = 0.0
        rows[r, m + i] = 1.0
        for row in range(STRIP_ROWS):
            wide[row, i] = strips[row, i]
        # the largest tension less this one is not negative
        wide[START, m + i], wide[LOW, m + i], wide[HIGH, m + i] = -strips[START, i] - offset[i], 0.0, math.inf
    cost = np.zeros(r + 1)
    cost[r] = 1.0
    found = np.empty(r + 1)
    largest = largest_number(strips)
    outcome = lowest_point(rows, wide, cost, TOLERANCE * largest, basis, found)
    if outcome != LP_SOLVED:
        basis.labels[0] = -1
        return POSE_INFEASIBLE if status_of(outcome) == POSE_INFEASIBLE else POSE_NOT_CONVERGED
    for k in range(r):
        near.point[k] = found[k]
    if not is_tied(basis):
        return POSE_SOLVED
    lower = strips.copy()
    for i in range(m):
        highest = found[r] - offset[i] + 4.0 * TOLERANCE * largest
        lower[HIGH, i] = max(min(strips[HIGH, i], highest), strips[LOW, i])
    nearest = np.empty(r)
    if nearest_point(null, lower, near.reference, TOLERANCE * largest, near.held, nearest):
        near.point[:] = nearest
    return POSE_SOLVED
