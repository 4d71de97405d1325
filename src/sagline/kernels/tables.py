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
MOVES = True  # False in exported C sources, whose frame anchors are fixed
SWIVELS = True  # False in exported C sources, which are for vertical swivel axes only
# A table with these columns as well has swivel axes of any direction: unit vector along the cable where it enters the
# pulley. ENTRY is then NaN for an axis that is not vertical, and 0 for a pulley on the platform at PLATFORM_X, whose
# axis is in the platform frame, and whose cable ends at FRAME_X.
AXIS_X, AXIS_Y, AXIS_Z = 14, 15, 16
SWIVEL_COLUMNS = 17

# body_table
MASS = 0  # [kg]
GRAVITY = 1  # [m/s^2], downward
CENTER_X, CENTER_Y, CENTER_Z = 2, 3, 4  # center of mass, platform frame [m]
BODY_COLUMNS = 5

# pose row: position of the platform origin [m], unit quaternion, scalar last
POSE_COLUMNS = 7

# rows of the result of one pose, m values each; without pulleys and dead lengths, the rows from WRAP on are missing
SPAN, RISE, LENGTH, HORIZONTAL, VERTICAL, TENSION = 0, 1, 2, 3, 4, 5
WRAP, WRAPPED, DEAD = 6, 7, 8  # wrap angle [rad], unstrained length on the pulley, and dead length [m]
SINE = 9  # sin phi of the chord that touches the pulley
RESULT_ROWS = 10
AZIMUTH = 10  # azimuth of the free span's plane [rad], if the table has swivel axes of any direction
SWIVEL_ROWS = 11
BARE_ROWS = WRAP  # robots without winches, as two tables

# columns of the numbers of one solution of the forward kinematics
ENERGY, FORCE_RESIDUAL, MOMENT_RESIDUAL, STIFFNESS_MIN, ITERATIONS = 0, 1, 2, 3, 4
FORWARD_NUMBERS = 5

# columns of the state of a chain of samples: pose, then wrench
LAST_WRENCH = POSE_COLUMNS
LAST_COLUMNS = LAST_WRENCH + 6

PROVED, ENOUGH = 0, 1  # columns of the brackets of `decide_poses`
SHORTEST_CHORD = 1e-9  # shortest chord [m]

CHUNK = 256  # cables per chunk of a batch; buffers of this length fit into the fastest cache of the processor
BUFFERS = 11  # number of these buffers
