"""Linear programs in few unknowns: the dual simplex method, and the limits of tensions as its rows.

A row k says rows[k] . x >= sides[k]. The method walks over points that are optimal for some of the rows until it
meets one that keeps them all, or a row that contradicts those it stands on: the proof that there is none.
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.jit import kernel
from sagline.kernels.tables import HIGH, LOW, START

LP_SOLVED, LP_EMPTY, LP_UNBOUNDED, LP_GAVE_UP = 0, 1, 2, 3
PIVOTS = 2000
CAREFUL = 60  # pivots after which ties are broken by index (Bland), which cannot cycle
ROUNDING = 4e-16  # of a point's largest coordinate
PIVOT = 1e-11  # smallest pivot, of the row's largest


@kernel
def limit_rows(work: Array, null: Array, rows: Array, sides: Array, labels: Indices) -> int:
    """Fill the limits as rows on null-space coordinates, labeled 2i (lower) or 2i + 1 (upper); returns how many."""
    r, m = null.shape
    count = 0
    for i in range(m):
        for k in range(r):
            rows[count, k] = null[k, i]
        sides[count] = work[LOW, i] - work[START, i]
        labels[count] = 2 * i
        count += 1
        if work[HIGH, i] < math.inf:
            for k in range(r):
                rows[count, k] = -null[k, i]
            sides[count] = work[START, i] - work[HIGH, i]
            labels[count] = 2 * i + 1
            count += 1
    return count


@kernel
def most_violated(rows: Array, sides: Array, count: int, point: Array, slack: float, careful: bool) -> int:
    """The row that the point misses most (or, if careful, the first that it misses); -1 where it keeps all."""
    worst = slack
    chosen = -1
    for k in range(count):
        miss = sides[k]
        for j in range(point.size):
            miss -= rows[k, j] * point[j]
        if miss > worst and not (careful and chosen >= 0):
            worst = miss
            chosen = k
    return chosen


@kernel
def lowest_point(
    rows: Array,
    sides: Array,
    count: int,
    cost: Array,
    radius: float,
    slack: float,
    point: Array,
    inverse: Array,
    basis: Indices,
    weights: Array,
) -> int:
    """Fill the point (d,) of least cost . x that keeps every row, up to a slack.

    The last rows of the arrays, from count on, are working space for a box of the given radius, d of them.

    Args:
        rows: (count + d, d).
        sides: (count + d,).
        count: Number of rows that count.
        cost: (d,).
        radius: Where the search starts; a solution that far out is infinitely far.
        slack: By which a row may be missed.
        point: Filled, (d,).
        inverse: Working space, (d, d).
        basis: Filled with the rows that the point stands on, (d + 1,); if there is none, and the last contradicts them.
        weights: Filled with what each of them weighs in the combination that proves it, (d + 1,), >= 0.
    """
    d = cost.size
    for k in range(d):
        sign = 1.0 if cost[k] >= 0.0 else -1.0
        for j in range(d):
            rows[count + k, j] = 0.0
            inverse[k, j] = 0.0
        rows[count + k, k] = sign
        sides[count + k] = -radius
        inverse[k, k] = sign
        basis[k] = count + k
        weights[k] = abs(cost[k])
        point[k] = -radius * sign
    for pivots in range(PIVOTS):
        careful = pivots > CAREFUL
        far = 0.0
        for k in range(d):
            far = max(far, abs(point[k]))
        seen = max(slack, ROUNDING * d * far)  # far out, rounding hides more than the slack
        entering = most_violated(rows, sides, count, point, seen, careful)
        if entering < 0:
            refine(rows, sides, basis, inverse, point)
            entering = most_violated(rows, sides, count, point, seen, careful)
        if entering < 0:
            for j in range(d):
                if basis[j] >= count and weights[j] > 0.0:
                    return LP_UNBOUNDED
            return LP_SOLVED
        largest = 0.0
        for j in range(d):
            largest = max(largest, abs(along(rows, entering, inverse, j)))
        leaving = -1
        pivot = 0.0
        least = math.inf
        for j in range(d):
            share = along(rows, entering, inverse, j)
            if share > PIVOT * largest:
                ratio = weights[j] / share
                first = leaving >= 0 and ratio == least and (basis[j] < basis[leaving] if careful else share > pivot)
                if ratio < least or first:
                    least, leaving, pivot = ratio, j, share
        if leaving < 0:
            for j in range(d):
                weights[j] = max(-along(rows, entering, inverse, j), 0.0)
            basis[d] = entering
            weights[d] = 1.0
            return LP_EMPTY
        exchange(rows, sides, entering, leaving, pivot, least, inverse, basis, weights, point)
    return LP_GAVE_UP


@kernel
def along(rows: Array, row: int, inverse: Array, j: int) -> float:
    """How fast a row's value grows along edge j of the present basis."""
    total = 0.0
    for i in range(inverse.shape[0]):
        total += rows[row, i] * inverse[i, j]
    return total


@kernel
def exchange(
    rows: Array,
    sides: Array,
    entering: int,
    leaving: int,
    pivot: float,
    ratio: float,
    inverse: Array,
    basis: Indices,
    weights: Array,
    point: Array,
) -> None:
    """Let a row enter the basis in place of another, and move to the new point."""
    d = point.size
    miss = sides[entering]
    for i in range(d):
        miss -= rows[entering, i] * point[i]
    for j in range(d):  # all shares first: the columns change below
        weights[j] = weights[j] - ratio * along(rows, entering, inverse, j) if j != leaving else ratio
        weights[j] = max(weights[j], 0.0)
    for i in range(d):
        point[i] += inverse[i, leaving] * (miss / pivot)
    for j in range(d):
        if j != leaving:
            share = along(rows, entering, inverse, j) / pivot
            for i in range(d):
                inverse[i, j] -= share * inverse[i, leaving]
    for i in range(d):
        inverse[i, leaving] /= pivot
    basis[leaving] = entering


@kernel
def refine(rows: Array, sides: Array, basis: Indices, inverse: Array, point: Array) -> None:
    """Take the rounding of many pivots out of the point: two corrections by what its own rows still miss."""
    d = point.size
    for _ in range(2):
        for j in range(d):
            miss = sides[basis[j]]
            for i in range(d):
                miss -= rows[basis[j], i] * point[i]
            for i in range(d):
                point[i] += inverse[i, j] * miss
