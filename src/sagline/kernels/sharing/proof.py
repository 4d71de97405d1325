"""Proof that no tensions within their limits balance a wrench: a Farkas vector.

A linear program over the null space ends with r + 1 limits at most that contradict each other; their
weights z, one number a cable, lie in the row space of the structure matrix, z = J^T y. Then y . J t has a
bound over all tensions within their limits that y . needed exceeds.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Flags
from sagline.kernels import tables
from sagline.kernels.algebra.linear import LP_EMPTY, limit_rows, lowest_point
from sagline.kernels.jit import kernel
from sagline.kernels.sharing.polygon import box_radius, largest_tension

CERTAIN = 1e-14  # of the largest tension: limits that contradict by less may do so by rounding
SUPPORT = 1e-9  # of the largest weight: cables that weigh less take no part


@kernel
def prove_empty(work: Array, inverse: Array, null: Array, translations: int, balance: Array, blocking: Flags) -> bool:
    """Fill the Farkas vector y (n,) in row FARKAS of balance, and which cables (m,) take part in it.

    y . (needed - J t) > 0 for every t within the limits. Its force part has length 1, so that the gap is in newtons;
    if it has none, its moment part has. NaN, and no cables, where the limits do not contradict beyond rounding.
    """
    r, m = null.shape
    n = inverse.shape[0]
    rows = np.empty((2 * m + r, r))
    sides = np.empty(2 * m + r)
    labels = np.empty(2 * m, dtype=np.int64)
    basis = np.empty(r + 1, dtype=np.int64)
    weights = np.empty(r + 1)
    count = limit_rows(work, null, rows, sides, labels)
    cost = np.zeros(r)
    for k in range(r):
        for i in range(m):
            cost[k] += null[k, i]
    largest = largest_tension(work)
    radius = box_radius(largest, work)
    outcome = lowest_point(
        rows, sides, count, cost, radius, CERTAIN * largest, np.empty(r), np.empty((r, r)), basis, weights
    )
    for k in range(n):
        balance[tables.FARKAS, k] = math.nan
    for i in range(m):
        blocking[i] = False
    if outcome != LP_EMPTY:
        return False
    z = np.zeros(m)
    for j in range(r + 1):
        if basis[j] < count:
            label = labels[basis[j]]
            z[label // 2] += weights[j] if label % 2 == 1 else -weights[j]
    write_vector(z, inverse, translations, balance, blocking)
    return True


@kernel
def write_vector(z: Array, inverse: Array, translations: int, balance: Array, blocking: Flags) -> None:
    """From the cables' weights to the wrench space, scaled."""
    n, m = inverse.shape
    force = 0.0
    moment = 0.0
    for k in range(n):
        total = 0.0
        for i in range(m):
            total += inverse[k, i] * z[i]
        balance[tables.FARKAS, k] = total
        if k < translations:
            force += total * total
        else:
            moment += total * total
    scale = math.sqrt(force) if force > 1e-18 * moment else math.sqrt(moment)
    for k in range(n):
        balance[tables.FARKAS, k] /= scale
    largest = np.abs(z).max()
    for i in range(m):
        blocking[i] = abs(z[i]) > SUPPORT * largest
