"""Linear programs with few unknowns and with bounds, solved by the dual simplex method.

The method visits points that are optimal for their active sides. It ends at a point that satisfies all bounds. It also
ends if a side contradicts the active sides, which proves infeasibility. If only the limits change, the sides of the
last solution are still optimal, and the next search starts from them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import TOLERANCE, box_radius, inward, largest_bound, most_violated_bound, side_of
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters, vector

LP_SOLVED, LP_EMPTY, LP_UNBOUNDED, LP_GAVE_UP = 0, 1, 2, 3
PIVOTS = 2000
CAREFUL = 60  # number of pivots after which ties are decided by label (Bland's rule), so that the search cannot cycle
ROUNDING = 4e-16  # relative to the largest coordinate of a point
PIVOT = 1e-11  # smallest pivot, relative to the largest entry of the row


class Basis(NamedTuple):
    """The active sides of an optimal point, from which the next program with the same rows and cost can start.

    A finite limit must stay finite in the next program, because a side at infinity cannot be active.
    """

    # labels of the active sides, (d + 1,). If the bounds have no common point, the last entry is the side that
    # contradicts the others. labels[0] is -1 if there is no basis. Labels from 2k on are sides of a box that replaces
    # infinity.
    labels: Indices
    weights: Array  # multipliers of the infeasibility proof, (d + 1,), >= 0
    inverse: Array  # inverse of the matrix of the sides' normals, (d, d)


@glue
def new_basis(memory: Memory, d: int) -> tuple[Basis, Memory]:
    """Work arrays for d unknowns, and the remaining memory."""
    weights, memory = vector(memory, d + 1)
    inverse, memory = block(memory, d, d)
    labels, memory = counters(memory, d + 1)
    return Basis(labels, weights, inverse), memory


@formula
def _growth_along_edge(rows: Array, label: int, inverse: Array, j: int) -> float:
    """Growth of normal . x along edge `j` of the present basis, for the normal of the side `label`."""
    total = 0.0
    for i in range(inverse.shape[0]):
        total += rows[i, label // 2] * inverse[i, j]
    return inward(label) * total


@formula
def _violation(rows: Array, bounds: Array, label: int, radius: float, cost: Array, point: Array) -> float:
    """Violation of the side `label` by `point`. Labels from 2k on are sides of the box."""
    box = label - 2 * rows.shape[1]
    if box >= 0:
        return -radius - (point[box] if cost[box] >= 0.0 else -point[box])
    miss = side_of(bounds, label)
    for i in range(point.size):
        miss -= inward(label) * rows[i, label // 2] * point[i]
    return miss


@glue
def _start_at_box_corner(rows: Array, cost: Array, radius: float, basis: Basis, point: Array) -> None:
    """Start at the corner of the box with the least cost."""
    labels, weights, inverse = basis
    d = cost.size
    for k in range(d):
        sign = 1.0 if cost[k] >= 0.0 else -1.0
        for j in range(d):
            inverse[k, j] = 0.0
        inverse[k, k] = sign
        labels[k] = 2 * rows.shape[1] + k
        weights[k] = abs(cost[k])
        point[k] = -radius * sign


@glue
def _exchange_sides(rows: Array, entering: int, leaving: int, miss: float, basis: Basis, point: Array) -> None:
    """Replace the side `leaving` of the basis by `entering`, which the point violates, and move to the new point."""
    labels, weights, inverse = basis
    d = point.size
    pivot = _growth_along_edge(rows, entering, inverse, leaving)
    ratio = weights[leaving] / pivot
    for i in range(d):
        point[i] += inverse[i, leaving] * (miss / pivot)
    for j in range(d):
        if j != leaving:
            share = _growth_along_edge(rows, entering, inverse, j)
            weights[j] = max(weights[j] - ratio * share, 0.0)
            for i in range(d):
                inverse[i, j] -= share / pivot * inverse[i, leaving]
    for i in range(d):
        inverse[i, leaving] /= pivot
    weights[leaving] = max(ratio, 0.0)
    labels[leaving] = entering


@glue
def _move_to_vertex(rows: Array, bounds: Array, cost: Array, radius: float, basis: Basis, point: Array) -> None:
    """Move `point` to the intersection of the sides of the basis, with two steps of iterative refinement."""
    d = point.size
    for _ in range(3):
        for j in range(d):
            miss = _violation(rows, bounds, basis.labels[j], radius, cost, point)
            for i in range(d):
                point[i] += basis.inverse[i, j] * miss


@kernel
def lowest_point(rows: Array, bounds: Array, cost: Array, slack: float, basis: Basis, point: Array) -> int:
    """Fill `point` (d,) with the point of least cost . x within all bounds. Returns the outcome.

    Bounds may be violated by `slack`; 0 means the usual tolerance. A program with a solution on the box is unbounded.
    """
    labels, weights, inverse = basis
    d = cost.size
    largest = largest_bound(bounds)
    radius = box_radius(largest, bounds)
    if slack == 0.0:
        slack = TOLERANCE * largest
    if labels[0] < 0:
        _start_at_box_corner(rows, cost, radius, basis, point)
    else:
        for k in range(d):
            point[k] = 0.0
        _move_to_vertex(rows, bounds, cost, radius, basis, point)
    for pivots in range(PIVOTS):
        careful = pivots > CAREFUL
        far = 0.0
        for k in range(d):
            far = max(far, abs(point[k]))
        seen = max(slack, ROUNDING * d * far)  # far from the origin, a rounding error can exceed the slack
        entering = most_violated_bound(rows, bounds, point, seen, careful)
        if entering < 0:
            _move_to_vertex(rows, bounds, cost, radius, basis, point)  # removes the rounding errors of many pivots
            entering = most_violated_bound(rows, bounds, point, seen, careful)
        if entering < 0:
            outcome = LP_SOLVED
            for j in range(d):
                if labels[j] >= 2 * rows.shape[1] and weights[j] > 0.0:
                    outcome = LP_UNBOUNDED
            return outcome
        largest_share = 0.0
        for j in range(d):
            largest_share = max(largest_share, abs(_growth_along_edge(rows, entering, inverse, j)))
        leaving = -1
        pivot = 0.0
        least = math.inf
        for j in range(d):
            share = _growth_along_edge(rows, entering, inverse, j)
            if share > PIVOT * largest_share:
                ratio = weights[j] / share
                tied = leaving >= 0 and ratio == least
                if ratio < least or (tied and (labels[j] < labels[leaving] if careful else share > pivot)):
                    least, leaving, pivot = ratio, j, share
        if leaving < 0:
            for j in range(d):
                weights[j] = max(-_growth_along_edge(rows, entering, inverse, j), 0.0)
            labels[d] = entering
            weights[d] = 1.0
            return LP_EMPTY
        _exchange_sides(rows, entering, leaving, _violation(rows, bounds, entering, radius, cost, point), basis, point)
    return LP_GAVE_UP
