"""Inertia matrices of simple bodies about their center of mass [kg m^2]."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array


def box_inertia(mass: float, x: float, y: float, z: float) -> Array:
    """A solid box of a mass [kg] with edges x, y, z [m] along the platform's axes, shape (3, 3)."""
    return np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * (mass / 12.0)


def cylinder_inertia(mass: float, radius: float, height: float) -> Array:
    """A solid cylinder of a mass [kg], radius and height [m], its axis along the platform's z, shape (3, 3)."""
    across = (3.0 * radius * radius + height * height) / 12.0
    return np.diag([across, across, 0.5 * radius * radius]) * mass
