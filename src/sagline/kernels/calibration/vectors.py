"""Vectors of three numbers."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.forward.platform import Triple
from sagline.kernels.jit import formula


@formula
def cross(a: Triple, b: Triple) -> Triple:
    """A x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@formula
def unit_vector(axis: int) -> Triple:
    """Of an axis."""
    return 1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0


@formula
def column_of(matrix: Array, k: int) -> Triple:
    """Column of a (3, 3)."""
    return matrix[0, k], matrix[1, k], matrix[2, k]


@formula
def in_axes(axes: Array, vector: Triple) -> Triple:
    """A world vector in the axes that are the columns of a (3, 3)."""
    return (
        axes[0, 0] * vector[0] + axes[1, 0] * vector[1] + axes[2, 0] * vector[2],
        axes[0, 1] * vector[0] + axes[1, 1] * vector[1] + axes[2, 1] * vector[2],
        axes[0, 2] * vector[0] + axes[1, 2] * vector[1] + axes[2, 2] * vector[2],
    )


@formula
def opposite(vector: Triple) -> Triple:
    """The vector the other way."""
    return -vector[0], -vector[1], -vector[2]


@formula
def plus(a: Triple, b: Triple) -> Triple:
    """A + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@formula
def scaled(factor: float, vector: Triple) -> Triple:
    """A multiple of a vector."""
    return factor * vector[0], factor * vector[1], factor * vector[2]
