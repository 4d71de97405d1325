"""Rows of the array that holds all cables of one pose, (CABLE_ROWS, m): geometry first, so that it is one too.

What `cable_geometry` fills is named in `sagline.kernels.cable.geometry`.
"""

from __future__ import annotations

from sagline.kernels.cable.geometry import GEOMETRY_ROWS

LENGTH = GEOMETRY_ROWS  # unstrained length [m]
HORIZONTAL, VERTICAL, TENSION = LENGTH + 1, LENGTH + 2, LENGTH + 3  # T_x, T_z, tau [N]
STATUS = LENGTH + 4  # how the cable's calculation ended
# of `cable_forces`; PARAMETER is h, kept from pose to pose, NaN where there was none
PARAMETER, KAPPA, EXCESS, FIRST, SECOND = LENGTH + 5, LENGTH + 6, LENGTH + 7, LENGTH + 8, LENGTH + 9
XX, XZ, ZX, ZZ = LENGTH + 10, LENGTH + 11, LENGTH + 12, LENGTH + 13  # in-plane stiffness [N/m]
CABLE_ROWS = LENGTH + 14
