"""Shapes between which distances are measured: catenaries, straight rods and boxes, each a row of numbers in the world.

A rod is a cable without weight; a capsule is a rod with a radius, a sphere one without length.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable.shape import catenary_point
from sagline.kernels.jit import kernel

# Columns of a row.
KIND = 0
PLACE = 1  # three: where a cable leaves the frame, a rod's start, a box's center [m]
RADIUS = 4  # half the diameter, which is taken off distances [m]
FIRST = 5  # where a cable or rod begins to count, as a share of its unstrained length; and where it ends
LAST = 6
LEVEL = 7  # two: horizontal unit vector toward the platform end
HORIZONTAL = 9  # T_x [N]                          | of a parabola: its span [m]
VERTICAL = 10  # T_z at the platform end [N]       |                its rise [m]
LENGTH = 11  # L [m]                               |                four times its drop in the middle [m]
WEIGHT = 12  # w [N/m]
STIFFNESS = 13  # EA [N]
SPAN, RISE, DROP = HORIZONTAL, VERTICAL, LENGTH
AXES = 5  # nine: the edges' directions of a box as columns of a matrix, row by row
HALF = 14  # three: half its edges [m]
COLUMNS = 17

# Kinds.
HANGING = 0.0
PARABOLA = 1.0
BOX = 2.0

FOLD = 1e-12  # of a cable's length: what is nearer to the place where it turns is there


@kernel
def point(row: Array, share: float) -> tuple[float, float, float]:
    """Point of a cable or rod at a share of its unstrained length [m]."""
    if row[KIND] == HANGING:
        x, z = catenary_point(share, row[HORIZONTAL], row[VERTICAL], row[LENGTH], row[WEIGHT], row[STIFFNESS])
    else:
        x = share * row[SPAN]
        z = share * row[RISE] - row[DROP] * share * (1.0 - share)
    return row[PLACE] + row[LEVEL] * x, row[PLACE + 1] + row[LEVEL + 1] * x, row[PLACE + 2] + z


@kernel
def slopes(row: Array, share: float) -> tuple[float, float, float, float]:
    """First and second derivatives of (x, z) in the cable's plane by the share of its length [m].

    With t the tension: r' = T (1/t + 1/EA), r'' = (-T_x T_z w/t^3, w T_x^2/t^3 + w/EA), by the unstrained length.
    """
    if row[KIND] != HANGING:
        return row[SPAN], row[RISE] - row[DROP] * (1.0 - 2.0 * share), 0.0, 2.0 * row[DROP]
    length, weight, horizontal = row[LENGTH], row[WEIGHT], row[HORIZONTAL]
    vertical = row[VERTICAL] - weight * length * (1.0 - share)
    tension = math.sqrt(horizontal * horizontal + vertical * vertical)
    give = 1.0 / row[STIFFNESS]
    if tension == 0.0:  # the turn of a fold, where there is no direction
        return 0.0, 0.0, 0.0, weight * give * length * length
    inverse = 1.0 / tension
    bend = weight * horizontal * inverse * inverse * inverse * length * length
    along = length * (inverse + give)
    return along * horizontal, along * vertical, -bend * vertical, bend * horizontal + weight * give * length * length


@kernel
def level_point(row: Array) -> float:
    """Position of the level tangent of a catenary as a fraction of its length, possibly beyond its ends."""
    if row[KIND] != HANGING:
        return -1.0
    return 1.0 - row[VERTICAL] / (row[WEIGHT] * row[LENGTH])


@kernel
def bulge(row: Array, first: float, last: float, chord2: float) -> float:
    """Largest distance of a piece's points from its chord [m]; the square of the chord is given.

    The lesser of |r''| (s1 - s0)^2/8 with the least tension on the piece, and of what a cable of the piece's length
    leaves between its ends, which holds for folds too.
    """
    width = last - first
    if row[KIND] != HANGING:
        return abs(row[DROP]) * width * width * 0.25
    weight, horizontal, give = row[WEIGHT], row[HORIZONTAL], 1.0 / row[STIFFNESS]
    part = row[LENGTH] * width
    v0 = row[VERTICAL] - weight * row[LENGTH] * (1.0 - first)
    v1 = v0 + weight * part
    slack = FOLD * weight * row[LENGTH]
    horizontal2 = horizontal * horizontal
    least2 = horizontal2 if v0 < -slack and v1 > slack else horizontal2 + min(v0 * v0, v1 * v1)
    most2 = horizontal2 + max(v0 * v0, v1 * v1)
    bend = 0.0
    if horizontal > 0.0:
        bend = weight * horizontal / least2
    elif v0 < -slack and v1 > slack:
        bend = math.inf
    by_curvature = 0.125 * part * part * (bend + weight * give)
    if by_curvature * by_curvature < 1e-4 * chord2:  # shallow: the other bound is no better
        return by_curvature
    arc = part * (1.0 + math.sqrt(most2) * give)
    by_length = 0.5 * math.sqrt(max(arc * arc - chord2, 0.0))
    return min(by_curvature, by_length)
