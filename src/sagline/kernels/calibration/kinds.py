"""Rows of the table that says which unknown, if any, a number of the robot is: (KIND_ROWS, m), -1 for none.

Single values of the platform or the measuring system are in the column of the first cable.
"""

from __future__ import annotations

FRAME = 0  # frame anchor, world axes, three rows [m]
PLATFORM = 3  # platform anchor, platform frame, three rows [m]
ZERO = 6  # length off the drum at the count's zero, or what lengths are short of [m]
DRUM = 7  # drum radius [m]
DENSITY = 8  # [kg/m]
STIFFNESS = 9  # [N]
RADIUS = 10  # of the pulley [m]
DEAD = 11  # dead length [m]
GAIN = 12  # of the load cell
BIAS = 13  # of the load cell [N]
PER_CABLE = 14
MASS = 14  # [kg]
CENTER = 15  # center of mass, platform frame, three rows [m]
SHIFT = 18  # position of the measuring system in the world, three rows [m]
TURN = 21  # its rotation, by a vector in world axes, three rows [rad]
TARGET = 24  # the measured point, platform frame, three rows [m]
KIND_ROWS = 27
