"""Columns of the arrays that describe a robot in kernels.

A robot is two arrays with a leading axis of 1 (the same robot at every pose) or N (one robot per pose): `cable_table`
(1 or N, m, 14) and `body_table` (1 or N, 5). A pose is a row of seven numbers.
"""

from __future__ import annotations

# cable_table
FRAME_X, FRAME_Y, FRAME_Z = 0, 1, 2  # frame anchor, world axes [m]
PLATFORM_X, PLATFORM_Y, PLATFORM_Z = 3, 4, 5  # platform anchor, platform frame [m]
DENSITY = 6  # [kg/m]
STIFFNESS = 7  # [N]
TENSION_MIN, TENSION_MAX = 8, 9  # [N]
# pulley at the frame anchor, and dead length; all numbers are zero if there is neither pulley nor dead length
PULLEY_RADIUS = 10  # R [m]
ENTRY = 11  # s: +1 if the cable enters the pulley from below, -1 if from above
DEAD_CABLE, DEAD_RISE = 12, 13  # length from drum to pulley, height of the pulley's entry above the drum [m]
CABLE_COLUMNS = 14

# body_table
MASS = 0  # [kg]
GRAVITY = 1  # [m/s^2], downward
CENTER_X, CENTER_Y, CENTER_Z = 2, 3, 4  # center of mass, platform frame [m]
BODY_COLUMNS = 5

# pose row: position of the platform origin [m], unit quaternion, scalar last
POSE_COLUMNS = 7

# rows of the result of one pose, m values each; rows from WRAP on exist only if there are pulleys or dead lengths
SPAN, RISE, LENGTH, HORIZONTAL, VERTICAL, TENSION = 0, 1, 2, 3, 4, 5
WRAP, WRAPPED, DEAD = 6, 7, 8  # wrap angle [rad], unstrained length on the pulley, and dead length [m]
SINE = 9  # sin phi of the chord that touches the pulley
RESULT_ROWS = 10
BARE_ROWS = WRAP  # robots without winches
