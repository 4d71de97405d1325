"""How much more load a pose can take: its distance to the faces of the wrenches that the limits allow.

The wrenches of all tensions within their limits fill a zonotope. Each of its faces is parallel to n - 1
columns of the structure matrix; the distance to it along the force part of its normal is the extra force
that reaches it, whatever its direction.

Source:
    Bouchard, Gosselin & Moore 2010, "On the ability of a cable-driven robot to generate a prescribed set of
    wrenches"; Guay, Cardou, Cruz-Ruiz & Caro 2014, "Measuring how well a structure supports varying external
    wrenches" (the capacity margin).
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Indices
from sagline.kernels.jit import kernel
from sagline.kernels.memory import Memory, block

MOST_FACES = 1 << 40  # more than there can be
RANK = 1e-10  # a pivot below this share of the largest entry says that columns are parallel


@kernel
def next_choice(chosen: Indices, m: int) -> bool:
    """The next combination in order, in place; False after the last."""
    count = chosen.size
    for k in range(count - 1, -1, -1):
        if chosen[k] < m - count + k:
            chosen[k] += 1
            for j in range(k + 1, count):
                chosen[j] = chosen[j - 1] + 1
            return True
    return False


@kernel
def normal_of(matrix: Array, chosen: Indices, rows: Array, order: Indices, normal: Array) -> bool:
    """Fill the vector (n,) perpendicular to n - 1 columns, by elimination; False where they are dependent."""
    n = matrix.shape[0]
    for k in range(n):
        order[k] = k
        for c in range(n - 1):
            rows[c, k] = matrix[k, chosen[c]]
    for c in range(n - 1):
        best = 0.0
        at_row = c
        at_column = c
        for b in range(c, n - 1):
            for k in range(c, n):
                if abs(rows[b, k]) > best:
                    best = abs(rows[b, k])
                    at_row = b
                    at_column = k
        if best < RANK:
            return False
        for k in range(n):
            rows[c, k], rows[at_row, k] = rows[at_row, k], rows[c, k]
        for b in range(n - 1):
            rows[b, c], rows[b, at_column] = rows[b, at_column], rows[b, c]
        order[c], order[at_column] = order[at_column], order[c]
        for b in range(c + 1, n - 1):
            share = rows[b, c] / rows[c, c]
            for k in range(c, n):
                rows[b, k] -= share * rows[c, k]
    normal[order[n - 1]] = 1.0
    for c in range(n - 2, -1, -1):
        total = rows[c, n - 1]
        for k in range(c + 1, n - 1):
            total += rows[c, k] * normal[order[k]]
        normal[order[c]] = -total / rows[c, c]
    return True


@kernel
def support(matrix: Array, low: Array, high: Array, normal: Array, sign: float) -> float:
    """The largest sign normal . J t over all t within their limits; may be infinite."""
    n, m = matrix.shape
    total = 0.0
    size = 0.0
    for k in range(n):
        size += abs(normal[k])
    for i in range(m):
        along = 0.0
        for k in range(n):
            along += normal[k] * matrix[k, i]
        along *= sign
        if along > 1e-13 * size:
            total += along * high[i]
        else:
            total += along * low[i]
    return total


@kernel
def capacity_margin(matrix: Array, needed: Array, low: Array, high: Array, translations: int, memory: Memory) -> float:
    """Largest force [N] in any direction that can be added to the needed wrench; negative where it is not feasible.

    Args:
        matrix: Structure matrix along the free motions, translations first, (n, m).
        needed: Wrench to supply, in the same rows, (n,).
        low: Least tensions (m,).
        high: Largest tensions (m,), may be infinite.
        translations: How many of the rows are forces.
        memory: To work in.
    """
    n, m = matrix.shape
    rows, at = block(memory.numbers, 0, n, n)
    normal = memory.numbers[at : at + n]
    chosen = memory.counters[: n - 1]
    order = memory.counters[n : 2 * n]
    for c in range(n - 1):
        chosen[c] = c
    least = math.inf
    for _ in range(MOST_FACES):
        if normal_of(matrix, chosen, rows, order, normal):
            force = 0.0
            along = 0.0
            size = 0.0
            for k in range(n):
                along += normal[k] * needed[k]
                size += normal[k] * normal[k]
                if k < translations:
                    force += normal[k] * normal[k]
            if force > 1e-18 * size:
                force = math.sqrt(force)
                least = min(least, (support(matrix, low, high, normal, 1.0) - along) / force)
                least = min(least, (support(matrix, low, high, normal, -1.0) + along) / force)
        if not next_choice(chosen, m):
            break
    return least
