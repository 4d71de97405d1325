"""The feasible tensions of least p-norm: Newton steps, each projected onto the feasible set in its own metric."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array
from sagline.kernels.algebra.cholesky import factor_positive, solve_lower, solve_upper
from sagline.kernels.algebra.linear import limit_rows
from sagline.kernels.algebra.projection import project
from sagline.kernels.jit import kernel
from sagline.kernels.sharing.polygon import TOLERANCE, largest_tension, nearest_point
from sagline.kernels.tables import HIGH, LOW, OFFSET, START

STEPS = 200
HALVINGS = 40
CLOSE = 1e-2  # of the largest tension: a step shorter than this lets the exponent grow
STILL = 1e-12  # of the largest tension: a step shorter than this ends the search


@kernel
def tension_at(work: Array, null: Array, point: Array, i: int) -> float:
    """Tension of cable i at a point of the null space, in the sharing's variable without its offset."""
    tension = work[START, i]
    for k in range(point.size):
        tension += null[k, i] * point[k]
    return tension


@kernel
def size_of(work: Array, null: Array, point: Array, p: float, scale: float) -> float:
    """Sum of the p-th powers of the tensions over a scale."""
    total = 0.0
    for i in range(null.shape[1]):
        total += abs((tension_at(work, null, point, i) + work[OFFSET, i]) / scale) ** p
    return total


@kernel
def newton_target(
    work: Array, null: Array, point: Array, p: float, scale: float, slope: Array, curve: Array, target: Array
) -> None:
    """Fill slope, Cholesky factor of the curvature, and the point that Newton's step leads to without limits."""
    r, m = null.shape
    for k in range(r):
        slope[k] = 0.0
        for j in range(k + 1):
            curve[k, j] = 0.0
    for i in range(m):
        size = abs(tension_at(work, null, point, i) + work[OFFSET, i]) / scale
        power = max(size, 1e-9) ** (p - 2.0)
        for k in range(r):
            slope[k] += power * size * null[k, i] * scale
            for j in range(k + 1):
                curve[k, j] += (p - 1.0) * power * null[k, i] * null[j, i]
    largest = 0.0
    for k in range(r):
        largest = max(largest, curve[k, k])
    for k in range(r):
        curve[k, k] += 1e-13 * largest
    factor_positive(curve, 0.0, curve)
    for k in range(r):
        target[k] = -slope[k]
    solve_lower(curve, target)
    solve_upper(curve, target)
    for k in range(r):
        target[k] += point[k]


@kernel
def keeps_limits(work: Array, null: Array, point: Array) -> bool:
    """Whether the tensions at a point are within their limits."""
    for i in range(null.shape[1]):
        if not work[LOW, i] <= tension_at(work, null, point, i) <= work[HIGH, i]:
            return False
    return True


@kernel
def project_on_corners(corners: Array, count: int, curve: Array, target: Array, turned: Array) -> None:
    """Replace the target by the polygon's point nearest to it in the metric L L^T, for r = 1 or 2."""
    r = target.size
    across = curve[1, 0] if r == 2 else 0.0
    second = curve[1, 1] if r == 2 else 1.0
    for k in range(count):
        turned[k, 0] = curve[0, 0] * corners[k, 0] + across * corners[k, 1]
        turned[k, 1] = second * corners[k, 1]
    y = target[1] if r == 2 else 0.0
    u, v = nearest_point(turned, count, curve[0, 0] * target[0] + across * y, second * y)
    if r == 2:
        target[1] = v / second
        target[0] = (u - across * target[1]) / curve[0, 0]
    else:
        target[0] = u / curve[0, 0]


@kernel
def project_on_rows(work: Array, null: Array, curve: Array, target: Array, point: Array) -> bool:
    """Replace the target by the feasible point nearest to it in the metric L L^T, for any r."""
    r, m = null.shape
    rows = np.empty((2 * m, r))
    sides = np.empty(2 * m)
    count = limit_rows(work, null, rows, sides, np.empty(2 * m, dtype=np.int64))
    size = math.sqrt(curve[0, 0])
    for k in range(count):
        solve_lower(curve, rows[k])
    turned = np.zeros(r)
    for k in range(r):
        for j in range(k, r):
            turned[k] += curve[j, k] * target[j]
    if not project(rows, sides, count, turned, TOLERANCE * largest_tension(work) * max(size, 1.0), target):
        return False
    solve_upper(curve, target)
    for k in range(r):
        if not math.isfinite(target[k]):
            target[k] = point[k]
    return True


@kernel
def lowest_p_norm(work: Array, null: Array, p: float, corners: Array, count: int, point: Array) -> bool:
    """Move a feasible point (r,), best that of least 2-norm, to the feasible one of least p-norm.

    The exponent doubles from 4 as the steps become short until it is p, so that Newton starts near. corners and count
    are those of the feasible polygon or interval, for r <= 2.

    Returns:
        Whether it was found.
    """
    r, m = null.shape
    slope = np.empty(r)
    target = np.empty(r)
    trial = np.empty(r)
    curve = np.empty((r, r))
    turned = np.empty_like(corners)
    largest = largest_tension(work)
    exponent = min(4.0, p)
    for _ in range(STEPS):
        scale = 0.0
        for i in range(m):
            scale = max(scale, abs(tension_at(work, null, point, i) + work[OFFSET, i]))
        if scale == 0.0:
            return True
        newton_target(work, null, point, exponent, scale, slope, curve, target)
        if not keeps_limits(work, null, target):
            if r <= 2:
                project_on_corners(corners, count, curve, target, turned)
            elif not project_on_rows(work, null, curve, target, point):
                return False
        length = 0.0
        gain = 0.0
        for k in range(r):
            length = max(length, abs(target[k] - point[k]))
            gain -= slope[k] * (target[k] - point[k])
        before = size_of(work, null, point, exponent, scale)
        share = 1.0
        for _half in range(HALVINGS):
            for k in range(r):
                trial[k] = point[k] + share * (target[k] - point[k])
            after = size_of(work, null, trial, exponent, scale)
            least_gain = 1e-4 * share * exponent * gain / (scale * scale)
            if after <= before - least_gain + 1e-15 * before:
                break
            share *= 0.5
        for k in range(r):
            point[k] = trial[k]
        still = length <= STILL * largest or exponent * gain <= 1e-16 * scale * scale * before
        if exponent == p and still:
            return True
        if length <= CLOSE * largest:
            exponent = min(2.0 * exponent, p)
    return False
