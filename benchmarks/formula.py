"""The article's closed form (48) for comparison in the same run: as printed, and in algebraic form."""

from __future__ import annotations

import math

from numba import njit

from sagline.core.arrays import Array

K_H, K_P = 4.845, 4.385


@njit(error_model="numpy")
def as_printed(span: Array, rise: Array, horizontal: Array, density: float, stiffness: float, length: Array) -> None:
    """(26)-(28) and (48) with the angle beta, its tangent and the fourth power of its cosine."""
    for i in range(length.shape[0]):
        d = math.sqrt(span[i] ** 2 + rise[i] ** 2)
        beta = math.atan2(rise[i], span[i])
        t_x = horizontal[i]
        t_z = math.tan(beta) * t_x + K_H * density * d
        sag = K_P * stiffness * density**2 * math.cos(beta) ** 4 * d**3
        length[i] = (sag + stiffness * d * t_x**2) / (t_x**2 * (stiffness + math.sqrt(t_x**2 + t_z**2)))


@njit(error_model="numpy")
def algebraic(span: Array, rise: Array, horizontal: Array, density: float, stiffness: float, length: Array) -> None:
    """Equations (26)-(28) and (48) without an angle: tan = z/x, cos^2 = x^2/D^2."""
    for i in range(length.shape[0]):
        x, z, t_x = span[i], rise[i], horizontal[i]
        d2 = x * x + z * z
        d = math.sqrt(d2)
        t_z = z / x * t_x + K_H * density * d
        ratio = density * x * x / (d * t_x)
        length[i] = d * (1.0 + K_P * ratio * ratio) / (1.0 + math.sqrt(t_x * t_x + t_z * t_z) / stiffness)
