"""Points in the middle of the feasible tensions: centroid, analytic center and deepest point."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array
from sagline.kernels.algebra.cholesky import factor_positive, solve_lower, solve_upper
from sagline.kernels.algebra.linear import LP_EMPTY, LP_SOLVED, limit_rows, lowest_point
from sagline.kernels.jit import kernel
from sagline.kernels.sharing.polygon import TOLERANCE, box_radius, largest_tension
from sagline.kernels.tables import HIGH, LOW, START

THIN = 1e-9  # of the largest tension: a set thinner than this has no inside worth centering in
NEWTON_STEPS = 200
CENTERED = 1e-18  # square of the Newton decrement at which the center is found


@kernel
def centroid(corners: Array, count: int) -> tuple[float, float]:
    """Centroid of a convex polygon; the middle of its corners where it has no area."""
    x0 = corners[0, 0]
    y0 = corners[0, 1]
    area = 0.0
    x = 0.0
    y = 0.0
    size = 0.0
    for k in range(1, count - 1):
        ax = corners[k, 0] - x0
        ay = corners[k, 1] - y0
        bx = corners[k + 1, 0] - x0
        by = corners[k + 1, 1] - y0
        cross = ax * by - ay * bx
        area += cross
        x += cross * (ax + bx)
        y += cross * (ay + by)
        size = max(size, ax * ax + ay * ay, bx * bx + by * by)
    if area > 1e-12 * size:
        return x0 + x / (3.0 * area), y0 + y / (3.0 * area)
    x = 0.0
    y = 0.0
    for k in range(count):
        x += corners[k, 0] / count
        y += corners[k, 1] / count
    return x, y


@kernel
def deepest_point(work: Array, null: Array, point: Array) -> int:
    """Fill the point (r,) whose tensions keep farthest from their nearest limits; returns the LP's outcome."""
    r, m = null.shape
    rows = np.zeros((2 * m + r + 1, r + 1))
    sides = np.empty(2 * m + r + 1)
    labels = np.empty(2 * m, dtype=np.int64)
    count = limit_rows(work, null, rows, sides, labels)
    for k in range(count):
        rows[k, r] = -1.0
    cost = np.zeros(r + 1)
    cost[r] = -1.0
    found = np.empty(r + 1)
    largest = largest_tension(work)
    outcome = lowest_point(
        rows,
        sides,
        count,
        cost,
        box_radius(largest, work),
        TOLERANCE * largest,
        found,
        np.empty((r + 1, r + 1)),
        np.empty(r + 2, dtype=np.int64),
        np.empty(r + 2),
    )
    for k in range(r):
        point[k] = found[k]
    return LP_EMPTY if outcome == LP_SOLVED and found[r] < -TOLERANCE * largest else outcome


@kernel
def analytic_center(work: Array, null: Array, point: Array) -> bool:
    """Move a point inside the feasible set (r,) to the one of largest product of distances to all limits.

    Newton's method with damped steps on the barrier, which is self-concordant; infinite limits do not count. A set
    too thin to have an inside keeps the point it was given.

    Returns:
        Whether the center was found.
    """
    r, m = null.shape
    slope = np.empty(r)
    step = np.empty(r)
    curve = np.empty((r, r))
    largest = largest_tension(work)
    for _ in range(NEWTON_STEPS):
        for k in range(r):
            slope[k] = 0.0
            for j in range(k + 1):
                curve[k, j] = 0.0
        for i in range(m):
            tension = work[START, i]
            for k in range(r):
                tension += null[k, i] * point[k]
            below = tension - work[LOW, i]
            above = work[HIGH, i] - tension
            if not min(below, above) > THIN * largest:
                return True
            push = 1.0 / above - 1.0 / below
            weight = 1.0 / (below * below) + 1.0 / (above * above)
            for k in range(r):
                slope[k] += push * null[k, i]
                for j in range(k + 1):
                    curve[k, j] += weight * null[k, i] * null[j, i]
        if not factor_positive(curve, 0.0, curve):
            return False
        for k in range(r):
            step[k] = -slope[k]
        solve_lower(curve, step)
        decrement = 0.0
        for k in range(r):
            decrement += step[k] * step[k]
        solve_upper(curve, step)
        share = 1.0 if decrement < 0.0625 else 1.0 / (1.0 + math.sqrt(decrement))
        for k in range(r):
            point[k] += share * step[k]
        if decrement < CENTERED:
            return True
    return False
