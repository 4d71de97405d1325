"""Wrench sets as a person reads them."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.numbers import n
from sagline.workspaces.wrench_sets import WrenchSet


def in_words(wrenches: WrenchSet) -> str:
    """A wrench set in a line.

    Args:
        wrenches: The set.

    Returns:
        What it consists of, "±100 N, ±20 N m" for instance.
    """
    parts = []
    if wrenches.center.any():
        parts.append(_wrench(wrenches.center))
    parts += [_segments(wrenches.segments)] if wrenches.segments.any() else []
    parts += ["an ellipsoid"] * len(wrenches.ellipsoids)
    ends = np.cumsum(wrenches.sizes)
    for size, end in zip(wrenches.sizes, ends, strict=True):
        parts.append(f"a polytope of {size} corners" if size > 1 else _wrench(wrenches.corners[end - 1]))
    linear, angular = wrenches.accelerations
    if linear > 0.0 or angular > 0.0:
        limits = ((linear, "m/s²"), (angular, "rad/s²"))
        parts.append("accelerations " + ", ".join(f"±{n(size, unit=unit)}" for size, unit in limits if size > 0.0))
    return " + ".join(parts) or "its weight alone"


def _wrench(wrench: Array) -> str:
    """One wrench, without what is zero of it."""
    halves = ((wrench[:3], "N"), (wrench[3:], "N m"))
    return ", ".join(f"({', '.join(n(value) for value in half)}) {unit}" for half, unit in halves if half.any())


def _segments(segments: Array) -> str:
    """Those along the axes by their sizes, all others as so many."""
    along = np.count_nonzero(segments, axis=1) == 1
    sizes = np.abs(segments[along]).sum(axis=0)
    parts = [f"±{_each(own, unit)}" for own, unit in ((sizes[:3], "N"), (sizes[3:], "N m")) if own.any()]
    rest = int(np.count_nonzero(~along & segments.any(axis=1)))
    return ", ".join(parts + [f"{rest} oblique segments"] * (rest > 0))


def _each(values: Array, unit: str) -> str:
    """Three numbers, or one where they are the same."""
    if np.ptp(values) == 0.0:
        return n(values[0], unit=unit)
    return f"({', '.join(n(value) for value in values)}) {unit}"
