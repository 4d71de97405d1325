"""Wrench sets as a person reads them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sagline.core.arrays import Array
from sagline.core.numbers import n


def in_words(center: Array, segments: Array, ellipsoids: int, polytopes: Sequence[Array], accelerations: Array) -> str:
    """A wrench set in a line.

    Args:
        center: A wrench, shape (6,).
        segments: Shape (S, 6).
        ellipsoids: How many.
        polytopes: Corners of each, shape (c, 6).
        accelerations: Largest linear and angular one, shape (2,).

    Returns:
        What it consists of, "±100 N, ±20 N m" for instance.
    """
    parts = []
    if center.any():
        parts.append(_wrench(center))
    parts += [_segments(segments)] if segments.any() else []
    parts += ["an ellipsoid"] * ellipsoids
    for corners in polytopes:
        parts.append(f"a polytope of {len(corners)} corners" if len(corners) > 1 else _wrench(corners[0]))
    linear, angular = accelerations
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
