"""Extent of a wrench set from its center, for proofs; docs/model.md, section 13."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.jit import formula, kernel


class Loads(NamedTuple):
    """A set of wrenches on the platform, as in `WrenchSet`, whose corners are counted from their mean.

    Attributes:
        center: (6,).
        segments: (S, 6).
        ellipsoids: (E, 6, 6).
        corners: (C, 6).
        sizes: Corners of each polytope, (P,).
    """

    center: Array
    segments: Array
    ellipsoids: Array
    corners: Array
    sizes: Indices


@formula
def dot6(a: Array, b: Array) -> float:
    """Inner product of two wrenches."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]


@formula
def _along_axis(axes: Array, k: int, against: Array) -> float:
    """Inner product of column k of an ellipsoid's matrix (6, 6) and a direction (6,)."""
    along = 0.0
    for a in range(6):
        along += axes[a, k] * against[a]
    return along


@formula
def _reach_of_ellipsoid(axes: Array, against: Array) -> float:
    """Extent of an ellipsoid to either side of its center."""
    square = 0.0
    for k in range(6):
        along = _along_axis(axes, k, against)
        square += along * along
    return math.sqrt(square)


@kernel
def reach_of_loads(loads: Loads, against: Array) -> float:
    """Largest -against . (w - center) over the set."""
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
    """Fill the wrench of the set that goes farthest against a direction, (6,)."""
    for a in range(6):
        wrench[a] = loads.center[a]
    for s in range(loads.segments.shape[0]):
        sign = -1.0 if dot6(loads.segments[s], against) > 0.0 else 1.0
        for a in range(6):
            wrench[a] += sign * loads.segments[s, a]
    for e in range(loads.ellipsoids.shape[0]):
        axes = loads.ellipsoids[e]
        length = _reach_of_ellipsoid(axes, against)
        if length > 0.0:
            for k in range(6):
                share = _along_axis(axes, k, against) / length
                for a in range(6):
                    wrench[a] -= axes[a, k] * share
    first = 0
    for p in range(loads.sizes.size):
        best = first
        for c in range(first, first + loads.sizes[p]):
            if dot6(loads.corners[c], against) < dot6(loads.corners[best], against):
                best = c
        for a in range(6):
            wrench[a] += loads.corners[best, a]
        first += loads.sizes[p]
