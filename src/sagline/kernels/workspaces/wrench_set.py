"""Support function of a set of loads against a direction: the sum of those of its parts."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block

# as it comes from Python: center (6,), half (6,), segments (S, 6), ellipsoids (E, 6, 6), corners (C, 6), sizes (P,),
# accelerations (2,), inertias (1 or R, 3, 3)
SetTerms = tuple[Array, Array, Array, Array, Array, Indices, Array, Array]


class WrenchSetArrays(NamedTuple):
    """A set of loads at one pose, in world axes about the center of mass.

    Attributes:
        own: Segments of the pose: a box, those of linear acceleration within it, and of angular ones, (9, 6).
        segments: Each adds all between minus and plus itself, (S, 6).
        ellipsoids: Each A adds A^T s for all s no longer than 1, (E, 6, 6).
        corners: Of polytopes, those of one after those of the other, (C, 6).
        sizes: How many corners each polytope has, (P,).
    """

    own: Array
    segments: Array
    ellipsoids: Array
    corners: Array
    sizes: Indices


@glue
def new_set(terms: SetTerms, memory: Memory) -> tuple[WrenchSetArrays, Memory]:
    """Work arrays for what differs from pose to pose, and the memory that is left."""
    own, at = block(memory.numbers, 0, 9, 6)
    wrenches = WrenchSetArrays(own, terms[2], terms[3], terms[4], terms[5])
    return wrenches, Memory(memory.numbers[at:], memory.counters)


@glue
def place_set(terms: SetTerms, body: Array, inertia: Array, rotation: Array, wrenches: WrenchSetArrays) -> None:
    """Fill the box and the loads of accelerations, w = -M a and -Q I Q^T alpha, of a platform in its rotation."""
    own = wrenches.own
    for s in range(9):
        for k in range(6):
            own[s, k] = 0.0
    for k in range(6):
        own[k, k] = terms[1][k] + (body[tables.MASS] * terms[6][0] if k < 3 else 0.0)
    if terms[6][1] > 0.0:
        for j in range(3):
            for k in range(3):
                total = 0.0
                for a in range(3):
                    for b in range(3):
                        total += rotation[j, a] * inertia[a, b] * rotation[k, b]
                own[6 + j, 3 + k] = terms[6][1] * total


@glue
def reach_of_set(
    wrenches: WrenchSetArrays, normals: Array, count: int, work: Array, against: Array, along: Array
) -> None:
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
    _add_segments(wrenches.own, normals, count, work[0], against)
    _add_segments(wrenches.segments, normals, count, work[0], against)
    if wrenches.ellipsoids.shape[0] > 0:
        _add_ellipsoids(wrenches.ellipsoids, normals, count, work, against)
    for b in range(count):
        along[b] = against[b]
    if wrenches.sizes.size > 0:
        _add_polytopes(wrenches.corners, wrenches.sizes, 1.0, normals, count, work, along)
        _add_polytopes(wrenches.corners, wrenches.sizes, -1.0, normals, count, work, against)


@kernel
def _add_segments(segments: Array, normals: Array, count: int, work: Array, total: Array) -> None:
    """Add how far segments (S, 6) reach to either side; those of no length cost nothing."""
    for s in range(segments.shape[0]):
        if _multiply(segments[s], normals, count, work):
            for b in range(count):
                total[b] += abs(work[b])


@kernel
def _add_ellipsoids(ellipsoids: Array, normals: Array, count: int, work: Array, total: Array) -> None:
    """Add how far ellipsoids (E, 6, 6) reach to either side."""
    for e in range(ellipsoids.shape[0]):
        for b in range(count):
            work[1, b] = 0.0
        for j in range(6):
            if _multiply(ellipsoids[e, j], normals, count, work[0]):
                for b in range(count):
                    work[1, b] += work[0, b] * work[0, b]
        for b in range(count):
            total[b] += math.sqrt(work[1, b])


@kernel
def _add_polytopes(
    corners: Array, sizes: Indices, sign: float, normals: Array, count: int, work: Array, total: Array
) -> None:
    """Add how far polytopes reach along the normals, or against them."""
    first = 0
    for p in range(sizes.size):
        for b in range(count):
            work[1, b] = -math.inf
        for c in range(first, first + sizes[p]):
            if not _multiply(corners[c], normals, count, work[0]):
                for b in range(count):
                    work[0, b] = 0.0
            for b in range(count):
                work[1, b] = max(work[1, b], sign * work[0, b])
        for b in range(count):
            total[b] += work[1, b]
        first += sizes[p]


@kernel
def _multiply(wrench: Array, normals: Array, count: int, out: Array) -> bool:
    """Fill the scalar products of a wrench (6,) and normals (6, B); False, and nothing filled, for no wrench."""
    some = False
    for k in range(6):
        part = wrench[k]
        if part != 0.0:
            if some:
                for b in range(count):
                    out[b] += part * normals[k, b]
            else:
                for b in range(count):
                    out[b] = part * normals[k, b]
            some = True
    return some
