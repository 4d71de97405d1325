"""Proof that no tensions within their limits balance a wrench: a Farkas vector.

A linear program over the null space ends with r + 1 limits at most that contradict each other; their
weights z, one number a cable, lie in the row space of the structure matrix, z = J^T y. Then y . J t has a
bound over all tensions within their limits that y . needed exceeds.
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Flags
from sagline.kernels.algebra.linear_program import LP_EMPTY, lowest_point, new_basis
from sagline.kernels.algebra.strips import largest_number
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block

CERTAIN = 1e-14  # of the largest tension: limits that contradict by less may do so by rounding
SUPPORT = 1e-9  # of the largest weight: cables that weigh less take no part


@kernel
def prove_empty(
    strips: Array, inverse: Array, null: Array, translations: int, memory: Memory, farkas: Array, blocking: Flags
) -> None:
    """Fill the Farkas vector y (n,) and which cables (m,) take part in it.

    y . (needed - J t) > 0 for every t within the limits. Its force part has length 1, so that the gap is in newtons;
    if it has none, its moment part has. NaN, and no cables, where the limits do not contradict beyond rounding.
    """
    r, m = null.shape
    basis, rest = new_basis(memory, r)
    vectors, at = block(rest.numbers, 0, 2, r)
    weights, at = block(rest.numbers, at, 1, m)
    cost, point, z = vectors[0], vectors[1], weights[0]
    for k in range(r):
        cost[k] = 0.0
        for i in range(m):
            cost[k] += null[k, i]
    basis.labels[0] = -1
    outcome = lowest_point(null, strips, cost, CERTAIN * largest_number(strips), basis, point)
    for k in range(farkas.size):
        farkas[k] = math.nan
    for i in range(m):
        blocking[i] = False
    if outcome != LP_EMPTY:
        return
    for i in range(m):
        z[i] = 0.0
    for j in range(r + 1):
        label = basis.labels[j]
        if label < 2 * m:
            z[label // 2] += basis.weights[j] if label % 2 == 1 else -basis.weights[j]
    write_vector(z, inverse, translations, farkas, blocking)


@glue
def write_vector(z: Array, inverse: Array, translations: int, farkas: Array, blocking: Flags) -> None:
    """From the cables' weights to the wrench space, scaled."""
    n, m = inverse.shape
    force = 0.0
    moment = 0.0
    for k in range(n):
        total = 0.0
        for i in range(m):
            total += inverse[k, i] * z[i]
        farkas[k] = total
        if k < translations:
            force += total * total
        else:
            moment += total * total
    scale = math.sqrt(force) if force > 1e-18 * moment else math.sqrt(moment)
    for k in range(n):
        farkas[k] /= scale
    largest = 0.0
    for i in range(m):
        largest = max(largest, abs(z[i]))
    for i in range(m):
        blocking[i] = abs(z[i]) > SUPPORT * largest
