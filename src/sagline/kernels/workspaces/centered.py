"""Tensions well inside their limits that balance a demand, or come as near to it as limits allow.

They make sum over cables of -log(tau - low) - log(high - tau), times a smoothing, plus half the square of what is left
of the demand, least. Where the demand can be balanced they are near the analytic center; where not, what is left points
along the direction that separates the demand from all that the cables give, but for the square root of the smoothing.
Primal-dual Newton steps, each one system of as many unknowns as the platform has free motions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.algebra.cholesky import factor_positive, solve_lower, solve_upper
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block

STEPS = 40
REDUCTION = 0.1  # of the smoothing, at most, with each step
TO_LIMIT = 0.95  # share of the way to a limit that a step may go
CENTERED = 0.2  # relative error of slack times push at which the center is found: nothing depends on it but luck
FARTHEST = 50.0  # of all forces at hand: where there is no limit, tensions are sought up to so much


class Centered(NamedTuple):
    """The search, for m cables and n rows.

    Attributes:
        low: Limits of the tensions [N], (m,).
        high: (m,), finite.
        tau: Tensions, strictly inside, (m,).
        below: What the lower limits push with [N], (m,), > 0.
        above: What the upper ones do, (m,), > 0.
        give: Inverse of how stiffly the limits hold each tension, (m,).
        right: What the chord tensions have to supply [N], (n,).
        left: What they leave of it, (n,).
        normal: Working space, (n, n).
        vector: Working space, (n,).
    """

    low: Array
    high: Array
    tau: Array
    below: Array
    above: Array
    give: Array
    right: Array
    left: Array
    normal: Array
    vector: Array


@glue
def new_centered(memory: Memory, m: int, n: int) -> tuple[Centered, Memory]:
    """Work arrays for m cables and n rows, and the memory that is left; the tensions are not known yet."""
    wide, at = block(memory.numbers, 0, 6, m)
    thin, at = block(memory.numbers, at, 3 + n, n)
    centered = Centered(wide[0], wide[1], wide[2], wide[3], wide[4], wide[5], thin[0], thin[1], thin[3:], thin[2])
    centered.tau[0] = math.nan
    return centered, Memory(memory.numbers[at:], memory.counters)


@kernel
def fill_imbalance(matrix: Array, centered: Centered) -> float:
    """Fill what the tensions leave of the right side; returns the square of its length [N^2]."""
    n, m = matrix.shape
    square = 0.0
    for k in range(n):
        centered.left[k] = centered.right[k]
        for i in range(m):
            centered.left[k] -= matrix[k, i] * centered.tau[i]
        square += centered.left[k] * centered.left[k]
    return square


@kernel
def _start_centering(matrix: Array, smoothing: float, centered: Centered) -> None:
    """Start from the tensions of the search before, where they fit between the limits, else from the middle."""
    m = centered.tau.size
    known = not math.isnan(centered.tau[0])
    for i in range(m):
        room = centered.high[i] - centered.low[i]
        slack = 0.01 * room
        if not known or not centered.low[i] + slack < centered.tau[i] < centered.high[i] - slack:
            centered.tau[i] = min(max(centered.tau[i], centered.low[i] + slack), centered.high[i] - slack)
            if not known:
                centered.tau[i] = centered.low[i] + 0.5 * room
    square = max(fill_imbalance(matrix, centered) / m, smoothing)
    for i in range(m):
        centered.below[i] = square / (centered.tau[i] - centered.low[i])
        centered.above[i] = square / (centered.high[i] - centered.tau[i])


@kernel
def factor_normal(matrix: Array, give: Array, unit: float, normal: Array) -> bool:
    """Fill the factor of unit times 1 + matrix give matrix^T, (n, n); False where it is not positive definite."""
    n, m = matrix.shape
    for k in range(n):
        for j in range(k + 1):
            total = unit if j == k else 0.0
            for i in range(m):
                total += matrix[k, i] * give[i] * matrix[j, i]
            normal[k, j] = total
    return factor_positive(normal, 0.0, normal)


@kernel
def find_center(matrix: Array, smoothing: float, centered: Centered) -> float:
    """Let the tensions come to the smoothed center; returns the square of what they leave [N^2].

    Args:
        matrix: Structure matrix, all rows in newtons, (n, m).
        smoothing: [N^2], > 0.
        centered: Limits and right side; the rest is filled.
    """
    n, m = matrix.shape
    tau, low, high, below, above = centered.tau, centered.low, centered.high, centered.below, centered.above
    _start_centering(matrix, smoothing, centered)
    square = fill_imbalance(matrix, centered)
    for _ in range(STEPS):
        present = 0.0
        worst = 0.0
        for i in range(m):
            down, up = below[i] * (tau[i] - low[i]), above[i] * (high[i] - tau[i])
            present += (down + up) / (2 * m)
            worst = max(worst, abs(down - smoothing), abs(up - smoothing))
        unbalanced = 0.0
        for i in range(m):
            push = below[i] - above[i]
            for k in range(n):
                push += matrix[k, i] * centered.left[k]
            unbalanced = max(unbalanced, abs(push) / (below[i] + above[i]))
        if worst <= CENTERED * smoothing and unbalanced <= CENTERED:
            break
        goal = max(smoothing, REDUCTION * present) if present > smoothing else smoothing
        for i in range(m):
            centered.give[i] = 1.0 / (below[i] / (tau[i] - low[i]) + above[i] / (high[i] - tau[i]))
        if not factor_normal(matrix, centered.give, 1.0, centered.normal):
            break
        for k in range(n):
            centered.vector[k] = centered.left[k]
            for i in range(m):
                force = goal / (tau[i] - low[i]) - goal / (high[i] - tau[i])
                centered.vector[k] -= matrix[k, i] * centered.give[i] * force
        solve_lower(centered.normal, centered.vector)
        solve_upper(centered.normal, centered.vector)
        share = 1.0
        dual_share = 1.0
        for i in range(m):
            down, up = tau[i] - low[i], high[i] - tau[i]
            step = goal / down - goal / up
            for k in range(n):
                step += matrix[k, i] * centered.vector[k]
            step *= centered.give[i]
            centered.give[i] = step
            if step < 0.0:
                share = min(share, -TO_LIMIT * down / step)
            elif step > 0.0:
                share = min(share, TO_LIMIT * up / step)
            fall = below[i] * (1.0 + step / down) - goal / down
            if fall > 0.0:
                dual_share = min(dual_share, TO_LIMIT * below[i] / fall)
            fall = above[i] * (1.0 - step / up) - goal / up
            if fall > 0.0:
                dual_share = min(dual_share, TO_LIMIT * above[i] / fall)
        for i in range(m):
            down, up, step = tau[i] - low[i], high[i] - tau[i], centered.give[i]
            below[i] += dual_share * (goal / down - below[i] * (1.0 + step / down))
            above[i] += dual_share * (goal / up - above[i] * (1.0 - step / up))
            tau[i] += share * step
        square = fill_imbalance(matrix, centered)
    return square
