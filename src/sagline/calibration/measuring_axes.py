"""Axes of a measuring system that differ from the stated ones: sentences with the evidence from measured positions."""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.calibration.log import WinchLog
from sagline.core.arrays import Array, Indices
from sagline.core.numbers import n

FEWEST: Final = 4  # number of measured points that show a reflection
CLEARLY: Final = 0.2  # largest ratio of the distances after and before an explanation
FLAT: Final = 0.05  # points are coplanar if their extent along an axis is a smaller share of the largest extent


class Alignment(NamedTuple):
    """Best rigid motion between two sets of points.

    Attributes:
        matrix: Rotation, or rotation with a reflection, (3, 3).
        distance: Root mean square distance of the points after the motion [m].
    """

    matrix: Array
    distance: float


def aligned(there: Array, measured: Array, *, reflected: bool) -> Alignment:
    """Motion of measured points (N, 3) onto other points with the smallest distances (Kabsch 1976)."""
    first, other = there - there.mean(axis=0), measured - measured.mean(axis=0)
    left, _, right = np.linalg.svd(first.T @ other)
    sign = np.sign(np.linalg.det(left @ right)) * (-1.0 if reflected else 1.0)
    matrix = left @ np.diag([1.0, 1.0, sign]) @ right
    distance = float(np.sqrt(np.mean(np.sum((first - other @ matrix.T) ** 2, axis=1))))
    return Alignment(matrix, distance)


def left_handed(there: Array, measured: Array) -> str | None:
    """Sentence about left-handed axes, if only a reflection maps the measured points (N, 3) to the expected ones."""
    if len(there) < FEWEST or (extent := _extents(there))[2] < FLAT * extent[0]:
        return None
    plain, mirrored = (aligned(there, measured, reflected=reflected) for reflected in (False, True))
    if mirrored.distance > CLEARLY * plain.distance:
        return None
    signs = np.diag(mirrored.matrix)
    axes = [axis for axis, sign in zip("xyz", signs, strict=True) if sign < 0.0]
    which = f"column {axes[0]}" if len(axes) == 1 and np.abs(signs).min() > 0.9 else "one column, or exchange two"
    return (
        f"the axes of the measured positions seem to be left-handed: with a reflection they agree to "
        f"{n(mirrored.distance, '.2g', 'm')}, without to {n(plain.distance, '.2g', 'm')}; change the sign of {which}"
    )


def other_axes(there: Array, measured: Array) -> str | None:
    """Text of the motion that explains the measured points (N, 3); None if no motion explains them."""
    if len(there) < 3 or _extents(there)[1] < FLAT * _extents(there)[0]:
        return None
    before = float(np.sqrt(np.mean(np.sum((there - measured) ** 2, axis=1))))
    found = aligned(there, measured, reflected=False)
    if found.distance > CLEARLY * before:
        return None
    turn = n(np.degrees(Rotation.from_matrix(found.matrix).magnitude()), ".2g", "°")
    return f"by {n(before, '.2g', 'm')}, in other axes (turned by {turn}) by {n(found.distance, '.2g', 'm')}"


def _extents(points: Array) -> Array:
    """Extents of points (N, 3) along their principal axes [m], decreasing."""
    return np.asarray(np.linalg.svd(points - points.mean(axis=0), compute_uv=False))


def frame_mismatch(log: WinchLog, left_out: Indices, asked: Collection[str], points: tuple[Array, Array]) -> str | None:
    """Sentence about measured poses (rows `left_out`) that disagree with the lengths while all other readings fit.

    points: expected and measured positions, each (N, 3) [m].
    """
    measured = np.zeros(len(log), dtype=np.bool_)
    for read in (log.position, log.rotation):
        if read is not None:
            measured |= ~np.isnan(read).all(axis=1)
    lost, count = int(np.count_nonzero(measured[left_out])), int(np.count_nonzero(measured))
    if 2 * lost <= count:
        return None
    what = f"{lost} of {count} measured poses disagree with the lengths"
    unknowns = [name for name in ("measuring_frame", "target") if name not in asked and (log.position is not None)]
    more = " and ".join(unknowns or ["measuring_frame"] * ("measuring_frame" not in asked))
    step = f"{f'add the unknowns {more}' if more else 'correct them'}, or write '# frame: ...' above the columns"
    evidence = other_axes(*points)
    if evidence is not None:
        return f"{what} {evidence}; {step}"
    return f"{what}, the cause is not known; {step}, or leave the measured poses out"
