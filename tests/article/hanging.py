"""The inextensible catenary in closed form: what the sampled cables, which do not stretch, are checked against."""

import numpy as np

from sagline.core.arrays import Array

GRAVITY = 9.81


def length_and_force(span: Array, rise: Array, density: Array, horizontal: Array) -> tuple[Array, Array]:
    """L [m] and T_z at the platform end [N] of a cable that does not stretch, from T_x (textbook)."""
    parameter = horizontal / (density * GRAVITY)
    half = 0.5 * span / parameter
    length = np.hypot(rise, 2.0 * parameter * np.sinh(half))
    return length, 0.5 * density * GRAVITY * (rise / np.tanh(half) + length)


def end_of(horizontal: float, vertical: float, length: float, weight: float, stiffness: float) -> tuple[float, float]:
    """The article's (1) and (2) at s = L, as printed (loses digits for taut cables)."""
    upper, lower = vertical / horizontal, (vertical - weight * length) / horizontal
    x = horizontal * length / stiffness + horizontal / weight * (np.arcsinh(upper) - np.arcsinh(lower))
    z = vertical * length / stiffness - weight * length**2 / (2.0 * stiffness)
    return x, z + (np.hypot(horizontal, vertical) - np.hypot(horizontal, vertical - weight * length)) / weight
