"""The wind's force on a line."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.jit import formula


@formula
def wind_across(wind: Array, along: float, x: float, y: float, z: float, drag: float) -> tuple[float, float, float]:
    """Force of a wind (3,) across a line [N].

    Args:
        wind: Velocity of the air [m/s], (3,).
        along: What of it is along the line, by the length of (x, y, z).
        x: Of the line's direction.
        y: Of the same.
        z: Of the same.
        drag: Force by the square of the speed across [N s^2/m^2].
    """
    nx, ny, nz = wind[0] - along * x, wind[1] - along * y, wind[2] - along * z
    size = drag * math.sqrt(nx * nx + ny * ny + nz * nz)
    return size * nx, size * ny, size * nz
