"""Sets of wrenches on the platform: support function for margins, and extent relative to the center for proofs.

docs/model.md, section 13.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.factors import copy
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block


class Loads(NamedTuple):
    """A set of wrenches on the platform, as in `WrenchSet`, with corners relative to their mean."""

    center: Array  # center, (6,)
    segments: Array  # segments, (S, 6)
    ellipsoids: Array  # matrices; each matrix A adds all wrenches A^T s with |s| <= 1, (E, 6, 6)
    corners: Array  # corners of polytopes, (C, 6)
    sizes: Indices  # corners of each polytope, (P,)


@formula
def dot6(a: Array, b: Array) -> float:
    """Inner product of two wrenches."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@formula
def _reach_of_ellipsoid(axes: Array, against: Array) -> float:
    """Distance from the center of an ellipsoid to its farthest point along the direction `against`."""
    square = 0.0
    for k in range(6):
        along = dot6(axes[k], against)
        square += along * along
    return math.sqrt(square)


@kernel
def reach_of_loads(loads: Loads, against: Array) -> float:
    """Largest value of -`against` . (w - center) for the wrenches w of the set."""
    most = 0.0
    for s in range(loads.segments.shape[0]):
        most += abs(dot6(loads.segments[s], against))
    for e in range(loads.ellipsoids.shape[0]):
        most += _reach_of_ellipsoid(loads.ellipsoids[e], against)
    first = 0
    for p in range(loads.sizes.size):
        best = -math.inf
        for c in range(first, first + loads.sizes[p]):
            best = max(best, -dot6(loads.corners[c], against))
        most += best
        first += loads.sizes[p]
    return most


@kernel
def farthest(loads: Loads, against: Array, wrench: Array) -> None:
    """Fill `wrench` (6,), the wrench of the set with the largest component opposite to the direction `against`."""
    copy(loads.center, wrench)
    for s in range(loads.segments.shape[0]):
        sign = -1.0 if dot6(loads.segments[s], against) > 0.0 else 1.0
        for a in range(6):
            wrench[a] += sign * loads.segments[s, a]
    for e in range(loads.ellipsoids.shape[0]):
        axes = loads.ellipsoids[e]
        length = _reach_of_ellipsoid(axes, against)
        if length > 0.0:
            for k in range(6):
                share = dot6(axes[k], against) / length
                for a in range(6):
                    wrench[a] -= axes[k, a] * share
    first = 0
    for p in range(loads.sizes.size):
        best = first
        for c in range(first, first + loads.sizes[p]):
            if dot6(loads.corners[c], against) < dot6(loads.corners[best], against):
                best = c
        for a in range(6):
            wrench[a] += loads.corners[best, a]
        first += loads.sizes[p]


# as passed from Python: center (6,), half (6,), segments (S, 6), ellipsoids (E, 6, 6), corners (C, 6), sizes (P,),
# accelerations (2,), inertias (1 or R, 3, 3)
SetTerms = tuple[Array, Array, Array, Array, Array, Indices, Array, Array]


class WrenchSetArrays(NamedTuple):
    """A set of loads at one pose, in world axes about the center of mass."""

    own: Array  # segments of the pose: box, linear accelerations, angular accelerations, (9, 6)
    segments: Array  # segments, each from -row to +row, (S, 6)
    ellipsoids: Array  # ellipsoids; each matrix A adds all wrenches A^T s with |s| <= 1, (E, 6, 6)
    corners: Array  # corners of all polytopes, one polytope after the other, (C, 6)
    sizes: Indices  # number of corners of each polytope, (P,)


@glue
def new_set(terms: SetTerms, memory: Memory) -> tuple[WrenchSetArrays, Memory]:
    """Work arrays for the parts that depend on the pose, and the remaining memory."""
    own, memory = block(memory, 9, 6)
    wrenches = WrenchSetArrays(own, terms[2], terms[3], terms[4], terms[5])
    return wrenches, memory


@glue
def place_set(terms: SetTerms, body: Array, inertia: Array, rotation: Array, wrenches: WrenchSetArrays) -> None:
    """Fill the segments of box and accelerations: forces -M a, moments -Q I Q^T alpha of a platform with rotation Q."""
    own = wrenches.own
    own[:] = 0.0
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
    """Fill the largest -y . w and the largest y . w [N] of the set for the first `count` normals y."""
    # `normals`: y, (6, B). `work`: work array, (2, B). `against`: filled, (B,). `along`: filled, (B,).
    against[:count] = 0.0
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
    """Add the extent of `segments` (S, 6) along each normal to `total`. Segments of zero length are skipped."""
    for s in range(segments.shape[0]):
        if _multiply(segments[s], normals, count, work):
            for b in range(count):
                total[b] += abs(work[b])


@kernel
def _add_ellipsoids(ellipsoids: Array, normals: Array, count: int, work: Array, total: Array) -> None:
    """Add the extent of `ellipsoids` (E, 6, 6) along each normal to `total`."""
    for e in range(ellipsoids.shape[0]):
        work[1, :count] = 0.0
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
    """Add the extent of polytopes to `total`, along the normals or, if `sign` is -1, opposite to them."""
    first = 0
    for p in range(sizes.size):
        work[1, :count] = -math.inf
        for c in range(first, first + sizes[p]):
            if not _multiply(corners[c], normals, count, work[0]):
                work[0, :count] = 0.0
            for b in range(count):
                work[1, b] = max(work[1, b], sign * work[0, b])
        for b in range(count):
            total[b] += work[1, b]
        first += sizes[p]


@kernel
def _multiply(wrench: Array, normals: Array, count: int, out: Array) -> bool:
    """Fill the scalar products of `wrench` (6,) and `normals` (6, B). False, without filling, for a zero `wrench`."""
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


@kernel
def worst_wrench(center: Array, wrenches: WrenchSetArrays, direction: Array, wrench: Array) -> bool:
    """Fill `wrench` (6,), the wrench w of the set with the largest -`direction` . w. True if no other wrench exists."""
    farthest(Loads(center, wrenches.segments, wrenches.ellipsoids, wrenches.corners, wrenches.sizes), direction, wrench)
    single = wrenches.segments.shape[0] == 0 and wrenches.ellipsoids.shape[0] == 0
    for p in range(wrenches.sizes.size):
        single = single and wrenches.sizes[p] == 1
    for s in range(9):
        sign = -1.0 if dot6(wrenches.own[s], direction) > 0.0 else 1.0
        for k in range(6):
            wrench[k] += sign * wrenches.own[s, k]
            single = single and wrenches.own[s, k] == 0.0
    return single
