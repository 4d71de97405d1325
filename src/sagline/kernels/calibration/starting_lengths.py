"""Initial lengths from a pose and measured tensions; the tensions are first corrected to balance the platform."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.factors import factor_positive, solve_lower, solve_upper
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import GEOMETRY_ROWS, cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.states import chord_tension_at_frame_end, hold_cable
from sagline.kernels.cable.terms import Terms, chord_at, material_at, model_of
from sagline.kernels.jit import entry
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import components_along

ITERATIONS = 3  # iterations of balancing; a few are sufficient, because the sag forces depend weakly on the tensions
LEAST = 0.2  # smallest ratio of a corrected tension to its measured value


@entry
def starting_lengths(
    terms: Terms,
    freedom: Array,
    cables: Array,
    body: Array,
    poses: Array,
    tension: Array,
    memory: tuple[Array, Indices],
    length_out: Array,
) -> None:
    """Fill the unstrained lengths off the drums [m] of cables that balance the platform near the given tensions.

    The change of the chord tensions is the smallest change that balances the platform.

    Args:
        terms: Terms of the cable model.
        freedom: Rows that select the free motions, (n, 6).
        cables: Row of the cable_table, (m, CABLE_COLUMNS).
        body: Row of the body_table.
        poses: Pose rows (N, POSE_COLUMNS).
        tension: Tensions at the frame ends [N], (N, m).
        memory: Work arrays from `memory_for`, for the number of cables.
        length_out: Filled, (N, m).
    """
    model = model_of(terms)
    count, m = tension.shape
    n = freedom.shape[0]
    rest = Memory(*memory)
    rotation, rest = block(rest, 3, 3)
    geometry, rest = block(rest, GEOMETRY_ROWS, m)
    along, rest = block(rest, m, n)
    matrix, rest = block(rest, n, n)
    factor, rest = block(rest, n, n)
    wide, rest = block(rest, 3, m)
    six, rest = vector(rest, 6)
    part, rest = vector(rest, n)
    tau, sag_force, least = wide[0], wide[1], wide[2]
    for p in range(count):
        cable_geometry(cables, body, poses[p], rotation, geometry)
        for i in range(m):
            chord, material = chord_at(geometry, i), material_at(cables, i)
            tau[i] = chord_tension_at_frame_end(model, chord, material, pulley_at(cables, i), tension[p, i])
            least[i] = LEAST * max(tau[i], 0.5 * material.density * model.gravity * chord.length)
            tau[i] = max(tau[i], least[i])
            x, y = geometry[g.AZIMUTH_X, i] * chord.cosine, geometry[g.AZIMUTH_Y, i] * chord.cosine
            rx, ry, rz = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
            six[0], six[1], six[2] = x, y, chord.sine
            six[3], six[4], six[5] = ry * chord.sine - rz * y, rz * x - rx * chord.sine, rx * y - ry * x
            components_along(freedom, six, along[i])
        for j in range(n):
            for k in range(n):
                matrix[j, k] = 0.0
                for i in range(m):
                    matrix[j, k] += along[i, j] * along[i, k]
        positive = factor_positive(matrix, 0.0, factor)
        for _ in range(ITERATIONS):
            for k in range(6):
                six[k] = 0.0
            six[2] = body[tables.MASS] * model.gravity
            for i in range(m):
                chord, material, pulley = chord_at(geometry, i), material_at(cables, i), pulley_at(cables, i)
                length_out[p, i], sag_force[i], _tension = hold_cable(model, chord, material, pulley, tau[i])
                six[2] += sag_force[i]
                six[3] += geometry[g.LEVER_Y, i] * sag_force[i]
                six[4] -= geometry[g.LEVER_X, i] * sag_force[i]
            components_along(freedom, six, part)
            for i in range(m):
                for j in range(n):
                    part[j] += along[i, j] * tau[i]
            if not positive:
                break
            solve_lower(factor, part)
            solve_upper(factor, part)
            for i in range(m):
                change = 0.0
                for j in range(n):
                    change += along[i, j] * part[j]
                tau[i] = max(tau[i] - change, least[i])
        for i in range(m):
            chord, material, pulley = chord_at(geometry, i), material_at(cables, i), pulley_at(cables, i)
            length_out[p, i] = hold_cable(model, chord, material, pulley, tau[i])[0]
            if not length_out[p, i] > 0.0:
                length_out[p, i] = math.nan
