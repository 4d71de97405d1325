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
SOFT = LENGTH + 14  # EA that `cable_forces` computes with [N]
# Of cables over pulleys. What a cable without one is asked for in its stead: span and rise [m], length [m]; and what is
# added to them so that the answer is that of the cable, kept from pose to pose.
ASKED_SPAN, ASKED_RISE, ASKED_LENGTH = LENGTH + 15, LENGTH + 16, LENGTH + 17
OFF_X, OFF_Z, OFF_LENGTH = LENGTH + 18, LENGTH + 19, LENGTH + 20
FREE_SPAN, FREE_RISE, FREE_LENGTH = LENGTH + 21, LENGTH + 22, LENGTH + 23  # of the free span [m]
WRAP, WRAP_SINE, WRAP_COSINE = LENGTH + 24, LENGTH + 25, LENGTH + 26  # psi [rad]
LEAVING, TOTAL = LENGTH + 27, LENGTH + 28  # tension where it leaves, T_A, and T_A + T_B [N]
BEHIND, END_X, END_Z = LENGTH + 29, LENGTH + 30, LENGTH + 31  # straight cable behind the chord; where the span ends [m]
ACROSS = LENGTH + 32  # stiffness normal to the plane [N/m]
CABLE_ROWS = LENGTH + 33
