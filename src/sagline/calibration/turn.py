"""How a rotation follows its vector."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array

_SMALL = 1e-4  # rad: below it the first terms of the series are exact


def left_jacobian(vector: Array) -> Array:
    """J with exp(v + dv) = exp(J dv) exp(v), for a rotation vector [rad] of shape (3,)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < _SMALL:
        first, second = 0.5, 1.0 / 6.0
    else:
        first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    jacobian: Array = np.eye(3) + first * cross + second * cross @ cross
    return jacobian
