"""Loads of massless cables on the platform beside their tension, and on frame ends and drums."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.balance.freedom import components_along, motion_along
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable import rows as t
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.dynamics import drives as d
from sagline.kernels.dynamics.massless import Losses
from sagline.kernels.dynamics.wind import wind_across
from sagline.kernels.jit import glue, kernel


@kernel
def add_wind_on_cables(cables: Array, drag: Array, rows: Array, wind: Array, given: Array) -> None:
    """Add half of the wind's force on every cable, as it hangs along its chord, to a wrench (6,)."""
    for i in range(cables.shape[0]):
        x = rows[g.AZIMUTH_X, i] * rows[g.COSINE, i]
        y = rows[g.AZIMUTH_Y, i] * rows[g.COSINE, i]
        z = rows[g.SINE, i]
        along = wind[0] * x + wind[1] * y + wind[2] * z
        fx, fy, fz = wind_across(wind, along, x, y, z, 0.5 * drag[i] * rows[g.CHORD, i])
        _add_at_end(rows, i, fx, fy, fz, given)


@kernel
def _add_at_end(rows: Array, i: int, x: float, y: float, z: float, wrench: Array) -> None:
    """Add a force at the platform end of a cable to a wrench (6,)."""
    rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
    wrench[0] += x
    wrench[1] += y
    wrench[2] += z
    wrench[3] += ry * z - rz * y
    wrench[4] += rz * x - rx * z
    wrench[5] += rx * y - ry * x


@glue
def project_on_freedom(freedom: Array, wrench: Array, part: Array) -> None:
    """Take from a wrench what the platform's guides carry."""
    if freedom.shape[0] < 6:
        components_along(freedom, wrench, part)
        motion_along(freedom, part, wrench)


@kernel
def fill_frame_end_tensions(
    weight_of: float, cables: Array, rows: Array, data: Array, now: Array, behind: bool | None
) -> None:
    """Fill the tensions at frame ends and drums, and H = T + T^2/(2 EA) - w z, which is one number a cable."""
    for i in range(cables.shape[0]):
        weight, stiffness = cables[i, tables.DENSITY] * weight_of, cables[i, tables.STIFFNESS]
        if behind is None:
            x, z = rows[t.HORIZONTAL, i], rows[t.VERTICAL, i] - weight * rows[t.LENGTH, i]
            tension, height = math.sqrt(x * x + z * z), 0.0
        else:
            tension, pulley = rows[t.LEAVING, i], pulley_at(cables, i)
            height = pulley.radius * pulley.entry * rows[t.WRAP_SINE, i]
        whole = tension + 0.5 * tension * tension / stiffness - weight * height
        now[d.AT_FRAME, i] = now[d.PULL, i] = tension
        now[d.WHOLE, i] = whole
        now[d.AT_DRUM, i] = d.tension_at_drum(whole, weight * data[d.BEHIND_RISE, i], stiffness)


@kernel
def damp_cables(
    losses: Losses,
    weight_of: float,
    cables: Array,
    rows: Array,
    turning: Array,
    now: Array,
    wrench: Array,
    behind: bool | None,
) -> float:
    """Fill the wrench (6,) of what damps the cables; returns the power that is lost.

    All of a cable stretches alike, what lies behind the free span with it, and what is let out lengthens the span by
    what it is strained: EA/L times the chord's rate less that. Of this the stretch has the share of its compliance, 1
    in a taut cable, 0 in a slack one. A cable moves in the air as its chord does.

    Args:
        losses: loss_time [s], and air damping [N s/m^2].
        weight_of: Gravity where cables weigh, else 0 [m/s^2].
        cables: Rows of the cable_table.
        rows: Of the cables, after `unbalance`.
        turning: Velocity of the center of mass, and angular velocity, (6,).
        now: Of the drives; what damping adds to the tensions is filled.
        wrench: Filled.
        behind: That of the model, by itself.
    """
    lost = 0.0
    for k in range(6):
        wrench[k] = 0.0
    vx, vy, vz = turning[0], turning[1], turning[2]
    wx, wy, wz = turning[3], turning[4], turning[5]
    for i in range(cables.shape[0]):
        rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
        ux, uy, uz = vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx
        x, y = rows[g.AZIMUTH_X, i] * rows[g.COSINE, i], rows[g.AZIMUTH_Y, i] * rows[g.COSINE, i]
        z, chord, length = rows[g.SINE, i], rows[g.CHORD, i], rows[t.LENGTH, i]
        stiffness, tension = cables[i, tables.STIFFNESS], rows[t.TENSION, i]
        weight = cables[i, tables.DENSITY] * weight_of * chord * rows[g.COSINE, i]
        share = 0.0
        if tension > 0.0:
            share = 1.0 / (1.0 + stiffness * weight * weight * chord / (12.0 * length * tension * tension * tension))
        strained = chord / rows[t.LENGTH if behind is None else t.FREE_LENGTH, i]
        rate = ux * x + uy * y + uz * z - now[d.RATE, i] * strained
        more = max(losses[0] * stiffness / length * share * share * rate, -tension)
        slow = losses[1] * chord / 3.0
        now[d.STRETCHING, i] = more * strained
        now[d.AT_FRAME, i] = max(now[d.PULL, i] + more, 0.0)
        lost += more * rate + slow * (ux * ux + uy * uy + uz * uz)
        _add_at_end(rows, i, -more * x - slow * ux, -more * y - slow * uy, -more * z - slow * uz, wrench)
    return lost
