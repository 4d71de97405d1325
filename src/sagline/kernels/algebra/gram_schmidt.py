"""Orthonormal frames, row by row: Gram and Schmidt, each time twice, which leaves nothing but rounding."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula


@formula
def orthogonalize_row(frame: Array, count: int, triangle: Array) -> float:
    """Take the first rows of an orthonormal frame (.., d), count of them, out of the row that follows them.

    Fills column count of the triangle above its diagonal with the shares taken out; returns the square of what is left.
    """
    d = frame.shape[1]
    for b in range(count):
        triangle[b, count] = 0.0
    for _ in range(2):
        for b in range(count):
            share = 0.0
            for k in range(d):
                share += frame[b, k] * frame[count, k]
            triangle[b, count] += share
            for k in range(d):
                frame[count, k] -= share * frame[b, k]
    square = 0.0
    for k in range(d):
        square += frame[count, k] * frame[count, k]
    return square


@formula
def normalize_row(frame: Array, count: int, triangle: Array, square: float) -> None:
    """Make what `orthogonalize_row` left in row count, of a given square, a row of the frame."""
    length = math.sqrt(square)
    triangle[count, count] = length
    for k in range(frame.shape[1]):
        frame[count, k] /= length
