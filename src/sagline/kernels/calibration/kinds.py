"""Rows of the table of unknowns (KIND_ROWS, m): index of the unknown of each parameter, or -1 if it is known.

Rows for the platform or the measuring system use only the column of the first cable.
"""

from __future__ import annotations

FRAME = 0  # frame anchor, world axes, three rows [m]
PLATFORM = 3  # platform anchor, platform frame, three rows [m]
ZERO = 6  # length off the drum at count_zero (length_zero), or a constant offset of the lengths [m]
DRUM = 7  # drum radius [m]
DENSITY = 8  # [kg/m]
STIFFNESS = 9  # [N]
RADIUS = 10  # pulley radius [m]
DEAD = 11  # dead length [m]
GAIN = 12  # load cell gain
BIAS = 13  # load cell bias [N]
PER_CABLE = 14  # the rows before this one, and SCALE, CLOCK and SWIVEL, have a value for each cable
MASS = 14  # [kg]
CENTER = 15  # center of mass, platform frame, three rows [m]
SHIFT = 18  # position of the measuring system in the world, three rows [m]
TURN = 21  # rotation vector of the measuring system in world axes, three rows [rad]
TARGET = 24  # the measured point, platform frame, three rows [m]
SCALE = 27  # scale of the reported lengths of a cable
CLOCK = 28  # time by which the reported length of a cable is late [s]
SWIVEL = 29  # swivel angle at which a sensor reads zero [rad]
INERTIA = 30  # logarithms of factors of the second moments of the mass, platform frame, three rows
KIND_ROWS = 33
