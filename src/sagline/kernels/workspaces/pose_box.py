"""The cables in a box of poses: geometry at the middle, and bounds of its change in the box.

Along each axis, a position in a box is at most half an edge from the middle of the box. At each position, the box
contains all orientations that differ from the orientation at the middle by a rotation up to a given angle. If the angle
is zero, all poses have the same orientation.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.cable import geometry as g
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import fill_structure_matrix, is_rotation, rows_along_freedom

BEND = 0.57735027  # half of 2/sqrt(3), rounded up; 2/sqrt(3) is the largest second derivative of x/|x|, times |x|^2
MOTIONS = 6  # number of motions: three translations and three rotations


class PoseRange(NamedTuple):
    """A box of poses."""

    half: Array  # half edges [m], (3,)
    turn: float  # largest rotation from the orientation at the middle [rad]


class CablesInBox(NamedTuple):
    """Cables at the middle of a box of poses, and bounds of their changes in the box."""

    rows: Array  # free motions, with rotations per lever arm, so that all components are in newtons, (n, 6)
    full: Array  # structure matrix, (6, m)
    matrix: Array  # components of the structure matrix along the free motions, (n, m)
    lever: Array  # levers from center of mass to platform end, world axes [m], (3, m)
    slopes: Array  # derivatives of the structure matrix with respect to each motion, (MOTIONS, 6 * m)
    way: Array  # largest displacement of a platform end [m], (m,)
    turned: Array  # largest change of a unit vector, (m,)
    bent: Array  # largest deviation of a unit vector from the linear prediction, (m,)
    swung: Array  # largest change of a lever [m], (m,)
    curled: Array  # largest deviation of a lever from the linear prediction [m], (m,)


@glue
def new_cables_in_box(memory: Memory, m: int, n: int) -> tuple[CablesInBox, Memory]:
    """Work arrays for m cables and n free motions, and the remaining memory."""
    rows, memory = block(memory, n, 6)
    wide, memory = block(memory, 6 + n + 3 + 5, m)
    slopes, memory = block(memory, MOTIONS, 6 * m)
    spans = wide[9 + n :]
    place = CablesInBox(
        rows, wide[:6], wide[6 : 6 + n], wide[6 + n : 9 + n], slopes, spans[0], spans[1], spans[2], spans[3], spans[4]
    )
    return place, memory


@kernel
def set_cables_in_box(
    freedom: Array, geometry: Array, rotation: Array, center: Array, box: PoseRange, place: CablesInBox
) -> bool:
    """Fill `place` from the geometry of the cables. False if a platform end may meet its frame end in the box."""
    # `freedom`: rows that select the free motions, (n, 6). `geometry`: rows of `cable_geometry` at the middle,
    # (GEOMETRY_ROWS, m). `rotation`: platform -> world at the middle, (3, 3). `center`: center of mass in the platform
    # frame [m], (3,). `place`: filled.
    n, m = place.matrix.shape
    fill_structure_matrix(geometry, place.full)
    mean = 0.0
    for i in range(m):
        for k in range(3):
            place.lever[k, i] = geometry[g.LEVER_X + k, i]
        mean += norm3(place.lever[0, i], place.lever[1, i], place.lever[2, i]) / m
    for k in range(n):
        unit = 1.0 / mean if is_rotation(freedom, k) and mean > 0.0 else 1.0
        for a in range(6):
            place.rows[k, a] = freedom[k, a] * unit
    rows_along_freedom(place.rows, place.full, place.matrix)
    if n == 6:
        for k in range(6):
            for i in range(m):
                place.matrix[k, i] = place.rows[k, k] * place.full[k, i]
    straight = norm3(box.half[0], box.half[1], box.half[2])
    possible = True
    for i in range(m):
        arm = 0.0
        for k in range(3):
            offset = place.lever[k, i]
            for j in range(3):
                offset += rotation[k, j] * center[j]
            arm += offset * offset
        lever = norm3(place.lever[0, i], place.lever[1, i], place.lever[2, i])
        chord = geometry[g.CHORD, i]
        way = straight + box.turn * math.sqrt(arm)
        least = chord - way
        possible = possible and least > 0.0
        share = min(way / chord, 1.0)
        place.way[i] = way
        place.turned[i] = share / math.sqrt(0.5 + 0.5 * math.sqrt(1.0 - share * share))
        place.bent[i] = BEND * way * way / (least * least) + 0.5 * box.turn * box.turn * math.sqrt(arm) / chord
        place.swung[i] = box.turn * lever
        place.curled[i] = 0.5 * box.turn * box.turn * lever
    if possible:
        _set_slopes(geometry, rotation, center, box, place)
    return possible


@kernel
def _set_slopes(geometry: Array, rotation: Array, center: Array, box: PoseRange, place: CablesInBox) -> None:
    """Fill the derivatives of the structure matrix with respect to the motions."""
    m = place.way.size
    for motion in range(MOTIONS if box.turn > 0.0 else 3):
        slopes = place.slopes[motion].reshape((6, m))
        for i in range(m):
            x, y, z = place.full[0, i], place.full[1, i], place.full[2, i]
            rx, ry, rz = place.lever[0, i], place.lever[1, i], place.lever[2, i]
            bx = by = bz = 0.0  # displacement of the platform end
            sx = sy = sz = 0.0  # displacement of the end of the lever
            if motion == 0:
                bx = 1.0
            elif motion == 1:
                by = 1.0
            elif motion == 2:
                bz = 1.0
            else:
                ax = rx + rotation[0, 0] * center[0] + rotation[0, 1] * center[1] + rotation[0, 2] * center[2]
                ay = ry + rotation[1, 0] * center[0] + rotation[1, 1] * center[1] + rotation[1, 2] * center[2]
                az = rz + rotation[2, 0] * center[0] + rotation[2, 1] * center[1] + rotation[2, 2] * center[2]
                if motion == 3:
                    by, bz, sy, sz = -az, ay, -rz, ry
                elif motion == 4:
                    bx, bz, sx, sz = az, -ax, rz, -rx
                else:
                    bx, by, sx, sy = -ay, ax, -ry, rx
            along = x * bx + y * by + z * bz
            chord = geometry[g.CHORD, i]
            dx, dy, dz = (x * along - bx) / chord, (y * along - by) / chord, (z * along - bz) / chord
            slopes[0, i] = dx
            slopes[1, i] = dy
            slopes[2, i] = dz
            slopes[3, i] = ry * dz - rz * dy + sy * z - sz * y
            slopes[4, i] = rz * dx - rx * dz + sz * x - sx * z
            slopes[5, i] = rx * dy - ry * dx + sx * y - sy * x


@formula
def norm3(x: float, y: float, z: float) -> float:
    """Length of the vector (x, y, z)."""
    return math.sqrt(x * x + y * y + z * z)


@formula
def most_of_linear(box: PoseRange, slopes: Array) -> float:
    """Largest value in `box` of a linear function that is zero at the middle and has the slopes `slopes` (MOTIONS,)."""
    most = abs(slopes[0]) * box.half[0] + abs(slopes[1]) * box.half[1] + abs(slopes[2]) * box.half[2]
    if box.turn > 0.0:
        most += box.turn * norm3(slopes[3], slopes[4], slopes[5])
    return most
