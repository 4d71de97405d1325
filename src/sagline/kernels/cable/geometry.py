"""Span, rise and azimuth of each cable from anchors and pose, and the rows of the arrays for a pose.

No other module computes span, rise and azimuth; docs/model.md, section 1.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.jit import entry, formula, kernel

# docs/model.md, section 1. Rows of a geometry array, each of m values.
SPAN, RISE, CHORD, SINE, COSINE = 0, 1, 2, 3, 4  # x_B, z_B, D, sin phi, cos phi of the chord
AZIMUTH_X, AZIMUTH_Y = 5, 6  # horizontal unit vector from frame end to platform end: cos theta, sin theta
LEVER_X, LEVER_Y, LEVER_Z = 7, 8, 9  # r, from the center of mass to the platform end, world axes
AXIS_X, AXIS_Y, AXIS_Z, DRUM_RISE = 10, 11, 12, 13  # swivel axis of any direction, world axes; rise of the anchor [m]
GEOMETRY_ROWS = 14


@formula
def _rotation_matrix(pose: Array, rotation: Array) -> None:
    """Fill `rotation` (3, 3), platform -> world, of the pose row `pose`."""
    x, y, z, w = pose[3], pose[4], pose[5], pose[6]
    rotation[0, 0] = 1.0 - 2.0 * (y * y + z * z)
    rotation[0, 1] = 2.0 * (x * y - z * w)
    rotation[0, 2] = 2.0 * (x * z + y * w)
    rotation[1, 0] = 2.0 * (x * y + z * w)
    rotation[1, 1] = 1.0 - 2.0 * (x * x + z * z)
    rotation[1, 2] = 2.0 * (y * z - x * w)
    rotation[2, 0] = 2.0 * (x * z - y * w)
    rotation[2, 1] = 2.0 * (y * z + x * w)
    rotation[2, 2] = 1.0 - 2.0 * (x * x + y * y)


@formula
def tangent(radius: float, entry: float, span: float, rise: float) -> tuple[float, float, float]:
    """Length, sin phi and cos phi of the tangent from a pulley to a point. NaN if no tangent exists."""
    # The pulley is in the cable's vertical plane. Span and rise are measured from the point where the cable enters the
    # pulley. `entry` is +1 for a cable that enters from below. A point inside the pulley or on its near side has no
    # tangent. After half a turn on the pulley, the cable is vertical, and exit and entry are two radii apart. The point
    # is then exactly below the exit, or above the exit if the cable enters from above.
    across = span - radius
    along = entry * rise
    square = across * across + along * along
    length2 = square - radius * radius
    length = math.sqrt(length2) if length2 > 0.0 else math.nan
    cosine = (radius * along + length * across) / square  # sin psi
    sine = entry * (length * along - radius * across) / square  # s cos psi
    return (length, sine, cosine) if cosine > 0.0 else (math.nan, math.nan, math.nan)


@kernel
def _tangent_about(
    cables: Array, rotation: Array, geometry: Array, i: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Vector from the pulley of cable `i` along the tangent to the other end of the cable. Fills axis and rise.

    NaN if no tangent exists. The pulley swivels about the axis of the table, and is in the plane of axis and other end.
    (`x`, `y`, `z`) is the platform anchor relative to the frame anchor. One of them is the anchor of the pulley.
    """
    nx, ny, nz = cables[i, tables.AXIS_X], cables[i, tables.AXIS_Y], cables[i, tables.AXIS_Z]
    geometry[DRUM_RISE, i] = cables[i, tables.DEAD_RISE]
    if cables[i, tables.ENTRY] == 0.0:
        x, y, z = -x, -y, -z
        nx, ny, nz = (
            rotation[0, 0] * nx + rotation[0, 1] * ny + rotation[0, 2] * nz,
            rotation[1, 0] * nx + rotation[1, 1] * ny + rotation[1, 2] * nz,
            rotation[2, 0] * nx + rotation[2, 1] * ny + rotation[2, 2] * nz,
        )
        geometry[DRUM_RISE, i] = cables[i, tables.DEAD_CABLE] * nz
    geometry[AXIS_X, i], geometry[AXIS_Y, i], geometry[AXIS_Z, i] = nx, ny, nz
    radius = cables[i, tables.PULLEY_RADIUS]
    if radius == 0.0:
        return x, y, z
    along = x * nx + y * ny + z * nz
    rx, ry, rz = x - along * nx, y - along * ny, z - along * nz
    across = math.sqrt(rx * rx + ry * ry + rz * rz)
    length, up, out = tangent(radius, 1.0, across, along)
    up, out = length * up, length * out / across if across > 0.0 else math.nan
    return out * rx + up * nx, out * ry + up * ny, out * rz + up * nz


@formula
def cable_geometry(cables: Array, body: Array, pose: Array, rotation: Array, geometry: Array) -> None:
    """Fill the geometry rows (GEOMETRY_ROWS, m) of one pose. A vertical cable gets azimuth 0."""
    # The chord of a cable over a pulley is the tangent from its platform end to the pulley. NaN if no tangent exists.
    _rotation_matrix(pose, rotation)
    for i in range(cables.shape[0]):
        bx = cables[i, tables.PLATFORM_X]
        by = cables[i, tables.PLATFORM_Y]
        bz = cables[i, tables.PLATFORM_Z]
        dx = pose[0] + rotation[0, 0] * bx + rotation[0, 1] * by + rotation[0, 2] * bz - cables[i, tables.FRAME_X]
        dy = pose[1] + rotation[1, 0] * bx + rotation[1, 1] * by + rotation[1, 2] * bz - cables[i, tables.FRAME_Y]
        dz = pose[2] + rotation[2, 0] * bx + rotation[2, 1] * by + rotation[2, 2] * bz - cables[i, tables.FRAME_Z]
        span = math.sqrt(dx * dx + dy * dy)
        geometry[AZIMUTH_X, i] = dx / span if span > 0.0 else 1.0
        geometry[AZIMUTH_Y, i] = dy / span if span > 0.0 else 0.0
        if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
            dx, dy, dz = _tangent_about(cables, rotation, geometry, i, dx, dy, dz)
            span = math.sqrt(dx * dx + dy * dy)
            chord = math.sqrt(span * span + dz * dz)
            sine, cosine = dz / chord, span / chord
            geometry[AZIMUTH_X, i] = dx / span if span > 0.0 else 1.0
            geometry[AZIMUTH_Y, i] = dy / span if span > 0.0 else 0.0
        elif cables[i, tables.PULLEY_RADIUS] > 0.0:
            chord, sine, cosine = tangent(cables[i, tables.PULLEY_RADIUS], cables[i, tables.ENTRY], span, dz)
            span, dz = chord * cosine, chord * sine
        else:
            chord = math.sqrt(span * span + dz * dz)
            sine, cosine = dz / chord, span / chord
        geometry[SPAN, i], geometry[RISE, i] = span, dz
        geometry[CHORD, i], geometry[SINE, i], geometry[COSINE, i] = chord, sine, cosine
        bx -= body[tables.CENTER_X]
        by -= body[tables.CENTER_Y]
        bz -= body[tables.CENTER_Z]
        geometry[LEVER_X, i] = rotation[0, 0] * bx + rotation[0, 1] * by + rotation[0, 2] * bz
        geometry[LEVER_Y, i] = rotation[1, 0] * bx + rotation[1, 1] * by + rotation[1, 2] * bz
        geometry[LEVER_Z, i] = rotation[2, 0] * bx + rotation[2, 1] * by + rotation[2, 2] * bz


@entry
def cable_geometries(robots: Array, bodies: Array, poses: Array, rotation: Array, geometries: Array) -> None:
    """Fill the geometry rows of N poses, (N, GEOMETRY_ROWS, m). `rotation`: work array, (3, 3)."""
    for p in range(poses.shape[0]):
        robot = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        cable_geometry(robot, body, poses[p], rotation, geometries[p])


LENGTH = GEOMETRY_ROWS  # unstrained length [m]
HORIZONTAL, VERTICAL, TENSION = LENGTH + 1, LENGTH + 2, LENGTH + 3  # T_x, T_z, tau [N]
STATUS = LENGTH + 4  # status of each cable from `cable_forces`, and h at the previous pose (NaN if there is none)
PARAMETER, KAPPA, EXCESS, FIRST, SECOND = LENGTH + 5, LENGTH + 6, LENGTH + 7, LENGTH + 8, LENGTH + 9
XX, XZ, ZX, ZZ = LENGTH + 10, LENGTH + 11, LENGTH + 12, LENGTH + 13  # in-plane stiffness [N/m]
SOFT = LENGTH + 14  # EA of the cable in the equations of `cable_forces` [N]
# Rows of cables over pulleys. The ASKED rows contain span, rise and length [m] of an equivalent cable without a pulley.
# The OFF rows contain corrections [m] of span, rise and length. With them, the equivalent cable has the forces of the
# real cable. The next pose starts with these corrections.
ASKED_SPAN, ASKED_RISE, ASKED_LENGTH = LENGTH + 15, LENGTH + 16, LENGTH + 17
OFF_X, OFF_Z, OFF_LENGTH = LENGTH + 18, LENGTH + 19, LENGTH + 20
FREE_SPAN, FREE_RISE, FREE_LENGTH = LENGTH + 21, LENGTH + 22, LENGTH + 23  # of the free span [m]
WRAP, WRAP_SINE, WRAP_COSINE = LENGTH + 24, LENGTH + 25, LENGTH + 26  # psi [rad]
LEAVING, TOTAL = LENGTH + 27, LENGTH + 28  # tension T_A at the exit point, and T_A + T_B [N]
BEHIND, END_X, END_Z = LENGTH + 29, LENGTH + 30, LENGTH + 31  # length between chord and drum; end of the free span [m]
ACROSS = LENGTH + 32  # stiffness normal to the plane [N/m]
# Swivel axes of any direction: platform end relative to the frame anchor [m]; length between tangent and drum [m];
# errors of the platform end in the last pass and after it, relative to the length; atanh(u)/u of the free span
END_AT_X, END_AT_Y, END_AT_Z = LENGTH + 33, LENGTH + 34, LENGTH + 35
TO_DRUM, MISS, LEFT, SERIES = LENGTH + 36, LENGTH + 37, LENGTH + 38, ACROSS
CABLE_ROWS = LENGTH + 39
# Cables with a swivel axis of any direction use rows of the passes, which they do not need, for numbers in world axes:
# stiffness [N/m]; dT/dL [N/m]; force at the platform end [N]; correction of the tangent, as in the OFF rows [m]; unit
# vector from the axis to the center of the pulley; unstrained length on the pulley [m].
W_XX, W_XY, W_XZ, W_YY, W_YZ, W_ZZ = ASKED_SPAN, ASKED_RISE, ASKED_LENGTH, OFF_X, OFF_Z, OFF_LENGTH
LONGER_X, LONGER_Y, LONGER_Z = KAPPA, EXCESS, FIRST
FORCE_X, FORCE_Y, FORCE_Z = SECOND, END_X, END_Z
AWAY_X, AWAY_Y, AWAY_Z = XX, XZ, ZX
CENTER_X, CENTER_Y, CENTER_Z = ZZ, SOFT, TOTAL
WRAPPED = BEHIND
