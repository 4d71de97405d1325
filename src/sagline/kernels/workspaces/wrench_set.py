"""How far a set of loads reaches against a direction: its support function, the sum of those of its parts."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block

# as it comes from Python: center (6,), half (6,), segments (S, 6), ellipsoids (E, 6, 6), corners (C, 6), sizes (P,),
# accelerations (2,), inertias (1 or R, 3, 3)
SetTerms = tuple[Array, Array, Array, Array, Array, Indices, Array, Array]


class WrenchSet(NamedTuple):
    """A set of loads at one pose, in world axes about the center of mass.

    Attributes:
        half: Largest difference in each component [N, N m], (6,).
        spin: Rows whose scalar products with the moment part of a direction count by their size [N m], (3, 3).
        spins: Whether there are any.
        segments: Each adds all between minus and plus itself, (S, 6).
        ellipsoids: Each A adds A s for all s no longer than 1, (E, 6, 6).
        corners: Of polytopes, those of one after those of the other, (C, 6).
        sizes: How many corners each polytope has, (P,).
    """

    half: Array
    spin: Array
    spins: bool
    segments: Array
    ellipsoids: Array
    corners: Array
    sizes: Indices


@glue
def new_set(terms: SetTerms, memory: Memory) -> tuple[WrenchSet, Memory]:
    """Room for what differs from pose to pose, and the memory that is left."""
    half, at = block(memory.numbers, 0, 1, 6)
    spin, at = block(memory.numbers, at, 3, 3)
    wrenches = WrenchSet(half[0], spin, terms[6][1] > 0.0, terms[2], terms[3], terms[4], terms[5])
    return wrenches, Memory(memory.numbers[at:], memory.counters)


@glue
def place_set(terms: SetTerms, body: Array, inertia: Array, rotation: Array, wrenches: WrenchSet) -> None:
    """Fill the loads of accelerations, w = -M a and -Q I Q^T alpha, of a platform in its rotation (3, 3)."""
    for k in range(6):
        wrenches.half[k] = terms[1][k] + (body[tables.MASS] * terms[6][0] if k < 3 else 0.0)
    if wrenches.spins:
        for j in range(3):
            for k in range(3):
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += rotation[j, a] * inertia[a, b] * rotation[k, b]
                wrenches.spin[j, k] = terms[6][1] * total


@glue
def reach(wrenches: WrenchSet, normals: Array, count: int, work: Array, against: Array, along: Array) -> None:
    """Fill the largest -y . w and the largest y . w [N] of the first so many normals.

    Args:
        wrenches: The set.
        normals: y, (6, B).
        count: How many.
        work: To work in, (2, B).
        against: Filled, (B,).
        along: Filled, (B,).
    """
    for b in range(count):
        against[b] = 0.0
    for k in range(6):
        if wrenches.half[k] > 0.0:
            for b in range(count):
                against[b] += wrenches.half[k] * abs(normals[k, b])
    if wrenches.spins:
        for j in range(3):
            x, y, z = wrenches.spin[j, 0], wrenches.spin[j, 1], wrenches.spin[j, 2]
            for b in range(count):
                against[b] += abs(x * normals[3, b] + y * normals[4, b] + z * normals[5, b])
    for s in range(wrenches.segments.shape[0]):
        products(wrenches.segments[s], normals, count, work[0])
        for b in range(count):
            against[b] += abs(work[0, b])
    for e in range(wrenches.ellipsoids.shape[0]):
        for b in range(count):
            work[1, b] = 0.0
        for j in range(6):
            products(wrenches.ellipsoids[e, :, j], normals, count, work[0])
            for b in range(count):
                work[1, b] += work[0, b] * work[0, b]
        for b in range(count):
            against[b] += math.sqrt(work[1, b])
    for b in range(count):
        along[b] = against[b]
    first = 0
    for p in range(wrenches.sizes.size):
        for b in range(count):
            work[1, b] = -math.inf
        for c in range(first, first + wrenches.sizes[p]):
            products(wrenches.corners[c], normals, count, work[0])
            for b in range(count):
                work[1, b] = max(work[1, b], -work[0, b])
        for b in range(count):
            against[b] += work[1, b]
            work[1, b] = -math.inf
        for c in range(first, first + wrenches.sizes[p]):
            products(wrenches.corners[c], normals, count, work[0])
            for b in range(count):
                work[1, b] = max(work[1, b], work[0, b])
        for b in range(count):
            along[b] += work[1, b]
        first += wrenches.sizes[p]


@kernel
def products(wrench: Array, normals: Array, count: int, out: Array) -> None:
    """Fill the scalar products of a wrench (6,) and normals (6, B)."""
    for b in range(count):
        out[b] = wrench[0] * normals[0, b]
    for k in range(1, 6):
        for b in range(count):
            out[b] += wrench[k] * normals[k, b]
