"""Exit points of cables with swivel axes of any direction, during a tension distribution; docs/model.md, section 10.10.

Each cable is a cable from an eyelet at its exit point, which moves with the tensions. The structure matrix remains that
of the first exit points, so that one factorization is sufficient. The needed wrench contains the forces of the chords,
minus those of chords in the first directions.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, statics, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.swivel import lengths_behind, next_exit, swivel_at
from sagline.kernels.cable.terms import Cables, Model
from sagline.kernels.jit import glue, independent

SAME_EXIT = 2e-12  # change of an exit point after which the next change is a rounding error, relative to the free span
NEXT_EXIT = 1e-14  # expected next change of an exit point that is left out
# rows of the work array: motion of the exit point [m] and its size relative to the free span; for the last force, psi,
# its sine and cosine, z of e_r, and e_s
LENGTH, SAG = 0, 1  # before the motions are known
MOTION, SIZE, WRAP, SINE, COSINE, UP, SIDE = 0, 3, 4, 5, 6, 7, 8
ROWS = 11


class Exits(NamedTuple):
    """Pulleys of one pose. The exit points are the frame anchors of the platform's cable_table."""

    swivels: Array  # rows of a cable_table with swivel axes, (m, SWIVEL_COLUMNS)
    limits: TensionLimits
    work: Array  # (ROWS, m)


@glue
def start_at_tangents(exits: Exits, platform: statics.Platform, balance: statics.Balance) -> None:
    """Set the frame anchors of the platform's cables to the exit points of straight cables."""
    rows, anchors, turn, pose = balance.geometry, platform.robot, balance.rotation, platform.pose
    cable_geometry(exits.swivels, platform.body, pose, turn, rows)
    for i in range(rows.shape[1]):
        x, y, z = anchors[i, tables.PLATFORM_X], anchors[i, tables.PLATFORM_Y], anchors[i, tables.PLATFORM_Z]
        tangent = rows[g.SPAN, i] * rows[g.AZIMUTH_X, i], rows[g.SPAN, i] * rows[g.AZIMUTH_Y, i], rows[g.RISE, i]
        anchors[i, tables.FRAME_X] = pose[0] + turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z - tangent[0]
        anchors[i, tables.FRAME_Y] = pose[1] + turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z - tangent[1]
        anchors[i, tables.FRAME_Z] = pose[2] + turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z - tangent[2]


@glue
def move_exits(
    model: Model, exits: Exits, platform: statics.Platform, cables: Cables, balance: statics.Balance, fresh: bool
) -> float:
    """Move the exit points to those of the present forces. Returns the largest change, relative to the free span."""
    # Chords and limits follow the exit points. `fresh`: True if lengths and sag forces do not exist yet; at the exit
    # point, a free span then carries half of its weight.
    m, rows, anchors, new = cables.tau.size, balance.geometry, platform.robot, exits.work
    gravity = model.gravity if model.code == codes.CATENARY else 0.0
    for i in range(m):
        new[LENGTH, i] = 0.5 * cables.chord[i] if fresh else cables.ratio[i] * cables.chord[i]
        new[SAG, i] = 0.0 if fresh else cables.sag_force[i]
    for i in independent(m):
        swivel, chord = swivel_at(exits.swivels, i, gravity), cables.chord[i]
        cx, cy, level = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i], cables.tau[i] * cables.cosine[i]
        up = cables.tau[i] * cables.sine[i] + new[SAG, i] - swivel.weight * new[LENGTH, i]
        (x, y, z), at = next_exit(swivel, exits.swivels, i, (level * cx, level * cy, up), anchors, chord)
        x, y, z = x - anchors[i, tables.FRAME_X], y - anchors[i, tables.FRAME_Y], z - anchors[i, tables.FRAME_Z]
        new[0, i], new[1, i], new[2, i], new[SIZE, i] = x, y, z, (abs(x) + abs(y) + abs(z)) / chord
        new[WRAP, i], new[SINE, i], new[COSINE, i], new[UP, i] = at.wrap, at.sine, at.cosine, at.rz
        new[SIDE, i], new[SIDE + 1, i], new[SIDE + 2, i] = at.sx, at.sy, at.sz
        x, y, z = rows[g.SPAN, i] * cx - x, rows[g.SPAN, i] * cy - y, rows[g.RISE, i] - z
        span = math.sqrt(x * x + y * y)
        chord = math.sqrt(span * span + z * z)
        inverse, across = 1.0 / chord, 1.0 / span if span > 0.0 else 0.0
        rows[g.AZIMUTH_X, i] = x * across if span > 0.0 else cx
        rows[g.AZIMUTH_Y, i] = y * across if span > 0.0 else cy
        rows[g.SPAN, i], rows[g.RISE, i] = span, z
        rows[g.CHORD, i], rows[g.SINE, i], rows[g.COSINE, i] = chord, z * inverse, span * inverse
    change = 0.0
    for i in range(m):
        change = max(change, new[SIZE, i])
        for k in range(3):
            anchors[i, tables.FRAME_X + k] += new[MOTION + k, i]
    for i in range(m):
        cables.chord[i], cables.sine[i], cables.cosine[i] = rows[g.CHORD, i], rows[g.SINE, i], rows[g.COSINE, i]
        cables.half_weight[i] = 0.5 * cables.density[i] * model.gravity * cables.chord[i]
    if exits.limits.quantity != codes.LIMITS_OF_FRAME_END and math.isnan(exits.limits.validity):
        return change
    possible = statics.place_cables(model, exits.limits, anchors, rows, cables)
    for i in range(m):
        statics.scale_limits(cables, balance, i)
    return change if possible else math.inf


@glue
def fill_needed_wrench(
    exits: Exits | None, platform: statics.Platform, cables: Cables, balance: statics.Balance
) -> None:
    """`statics.fill_needed_wrench`, with the moved exit points of `exits`."""
    statics.fill_needed_wrench(platform, cables, balance)
    if exits is None:
        return
    rows, full, needed = balance.geometry, balance.full, balance.needed
    for i in range(cables.tau.size):
        tau = cables.tau[i]
        x = tau * (cables.cosine[i] * rows[g.AZIMUTH_X, i] + full[0, i])
        y = tau * (cables.cosine[i] * rows[g.AZIMUTH_Y, i] + full[1, i])
        z = tau * (cables.sine[i] + full[2, i])
        statics.add_world_force(rows, i, (x, y, z), needed)
    statics.along_freedom(platform.freedom, needed, balance.right)


@glue
def write_behind(model: Model, exits: Exits, cables: Cables, balance: statics.Balance, results: Array, p: int) -> None:
    """Write the rows for pulleys and dead lengths of a solved pose. Its lengths do not include them yet."""
    rows, known, gravity = balance.geometry, exits.work, model.gravity if model.code == codes.CATENARY else 0.0
    for i in independent(cables.tau.size):
        swivel, x = swivel_at(exits.swivels, i, gravity), cables.tau[i] * cables.cosine[i]
        z = cables.tau[i] * cables.sine[i] + cables.sag_force[i] - swivel.weight * (cables.ratio[i] * cables.chord[i])
        turn, tension = (known[SINE, i], known[COSINE, i]), math.sqrt(x * x + z * z)
        wrapped, dead = lengths_behind(swivel, known[UP, i], turn, known[WRAP, i], tension)
        results[tables.WRAP, p, i], results[tables.WRAPPED, p, i] = known[WRAP, i], wrapped
        results[tables.DEAD, p, i], results[tables.SINE, p, i] = dead, cables.sine[i]
    for i in range(cables.tau.size):
        results[tables.AZIMUTH, p, i] = math.atan2(rows[g.AZIMUTH_Y, i], rows[g.AZIMUTH_X, i])
