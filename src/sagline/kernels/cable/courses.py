"""Points of the cables of one pose, for drawings."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable.batch import catenary_point
from sagline.kernels.cable.geometry import AZIMUTH_X, AZIMUTH_Y, CHORD, COSINE, SINE, cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.states import solve_cable_state
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.jit import entry, glue


@entry
def cable_courses(
    cables: Array, body: Array, pose: Array, tension: Array, wraps: int, rotation: Array, geometry: Array, points: Array
) -> None:
    """Points of exact cables from their frame anchors over their pulleys to their platform ends.

    A cable without a tension is drawn along its chord. A cable without a chord is drawn as a line between its ends.

    Args:
        cables: Row of the cable_table, (m, CABLE_COLUMNS).
        body: Row of the body_table.
        pose: Pose row.
        tension: Chord tensions [N], (m,); NaN for a cable without a tension.
        wraps: Number of points on each pulley, 0 or at least 2. Without a pulley, all are at the frame anchor.
        rotation: Work array, (3, 3).
        geometry: Work array, (GEOMETRY_ROWS, m).
        points: Filled with the points in world axes [m], (m, points, 3).
    """
    gravity = body[tables.GRAVITY]
    model = Model(codes.CATENARY, 0.0, 0.0, gravity, None)
    cable_geometry(cables, body, pose, rotation, geometry)
    free = points.shape[1] - wraps - 1
    for i in range(tension.size):
        pulley, material = pulley_at(cables, i), Material(cables[i, tables.DENSITY], cables[i, tables.STIFFNESS])
        chord, tau, weight = Chord(geometry[CHORD, i], geometry[SINE, i], geometry[COSINE, i]), tension[i], 0.0
        sine, cosine = chord.cosine, pulley.entry * chord.sine  # sine and cosine of the wrap angle of a straight cable
        length, horizontal, vertical = 0.0, 0.0, 0.0
        if tau > 0.0:
            weight = material.density * gravity
            length, sag_force, _status = solve_cable_state(model, chord, material, pulley, tau)
            horizontal, vertical = tau * chord.cosine, tau * chord.sine + sag_force
            sine, cosine = horizontal, pulley.entry * (vertical - weight * length)
        wrapped = angle(sine, cosine) if pulley.radius > 0.0 and chord.length > 0.0 else 0.0
        x, z = 0.0, 0.0
        for k in range(wraps):
            part = wrapped * k / (wraps - 1)
            x, z = pulley.radius * (1.0 - math.cos(part)), pulley.radius * pulley.entry * math.sin(part)
            _write_point(cables, geometry, i, x, z, points, k)
        bx, by, bz = cables[i, tables.PLATFORM_X], cables[i, tables.PLATFORM_Y], cables[i, tables.PLATFORM_Z]
        dx = pose[0] + rotation[0, 0] * bx + rotation[0, 1] * by + rotation[0, 2] * bz - cables[i, tables.FRAME_X]
        dy = pose[1] + rotation[1, 0] * bx + rotation[1, 1] * by + rotation[1, 2] * bz - cables[i, tables.FRAME_Y]
        rise = pose[2] + rotation[2, 0] * bx + rotation[2, 1] * by + rotation[2, 2] * bz - cables[i, tables.FRAME_Z]
        span = math.sqrt(dx * dx + dy * dy)
        for k in range(free + 1):
            fraction = k / free
            along, up = (span - x) * fraction, (rise - z) * fraction
            if weight > 0.0:
                along, up = catenary_point(fraction, horizontal, vertical, length, weight, material.stiffness)
            _write_point(cables, geometry, i, x + along, z + up, points, wraps + k)


@glue
def _write_point(cables: Array, geometry: Array, i: int, x: float, z: float, points: Array, k: int) -> None:
    """Write point `k` of cable `i` in world axes [m]; `x`, `z`: position in its plane, relative to the frame anchor."""
    points[i, k, 0] = cables[i, tables.FRAME_X] + geometry[AZIMUTH_X, i] * x
    points[i, k, 1] = cables[i, tables.FRAME_Y] + geometry[AZIMUTH_Y, i] * x
    points[i, k, 2] = cables[i, tables.FRAME_Z] + z
