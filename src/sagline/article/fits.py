"""Least squares, as the article uses them: a line, and a factor of a given shape."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array


class Line(NamedTuple):
    """Lines y = slope x + intercept fitted along the last axis.

    Attributes:
        slope: Shape (...).
        intercept: Shape (...).
        r_squared: Share of the variance of y that the line explains, shape (...).
        deviation: Largest distance of a sample from the line, in the unit of y, shape (...).
    """

    slope: Array
    intercept: Array
    r_squared: Array
    deviation: Array


def fit_line(x: Array, y: Array) -> Line:
    """The line of least squares through samples along the last axis.

    Args:
        x: Shape (..., n), or one that broadcasts with that of y.
        y: Shape (..., n).

    Returns:
        Lines with fields of shape (...).
    """
    x, y = np.broadcast_arrays(x, y)
    away_x = x - x.mean(axis=-1, keepdims=True)
    away_y = y - y.mean(axis=-1, keepdims=True)
    slope = np.sum(away_x * away_y, axis=-1) / np.sum(away_x**2, axis=-1)
    rest = away_y - slope[..., None] * away_x
    explained = 1.0 - np.sum(rest**2, axis=-1) / np.sum(away_y**2, axis=-1)
    intercept = y.mean(axis=-1) - slope * x.mean(axis=-1)
    return Line(slope, intercept, explained, np.abs(rest).max(axis=-1))


def fit_factor(shape: Array, y: Array, axis: int = -1) -> Array:
    """The factor a of least squares in y = a * shape, along one axis.

    Every regression of the article but that of the line is of this form, with the shape 1/T_x^2, D^3,
    cos^4(phi), rho^2, D or rho.

    Args:
        shape: What y is supposed to be proportional to; it broadcasts with y.
        y: Samples.
        axis: Along which the samples are.

    Returns:
        Factors, of the shape of y without that axis.
    """
    shape, y = np.broadcast_arrays(shape, y)
    factor: Array = np.sum(shape * y, axis=axis) / np.sum(shape**2, axis=axis)
    return factor
