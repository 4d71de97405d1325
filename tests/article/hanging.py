"""Closed form of the inextensible catenary, for comparison with sampled inextensible cables."""

import numpy as np

from sagline.core.arrays import Array

GRAVITY = 9.81


def length_and_force(span: Array, rise: Array, density: Array, horizontal: Array) -> tuple[Array, Array]:
    """L [m] and T_z at the platform end [N] of an inextensible cable from T_x (textbook)."""
    parameter = horizontal / (density * GRAVITY)
    half = 0.5 * span / parameter
    length = np.hypot(rise, 2.0 * parameter * np.sinh(half))
    return length, 0.5 * density * GRAVITY * (rise / np.tanh(half) + length)


def end_of(horizontal: float, vertical: float, length: float, weight: float, stiffness: float) -> tuple[float, float]:
    """(1) and (2) of the article at s = L, as printed (inaccurate for taut cables)."""
    upper, lower = vertical / horizontal, (vertical - weight * length) / horizontal
    x = horizontal * length / stiffness + horizontal / weight * (np.arcsinh(upper) - np.arcsinh(lower))
    z = vertical * length / stiffness - weight * length**2 / (2.0 * stiffness)
    return x, z + (np.hypot(horizontal, vertical) - np.hypot(horizontal, vertical - weight * length)) / weight
