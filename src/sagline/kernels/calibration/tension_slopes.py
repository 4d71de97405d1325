"""Derivatives of the tension at a cable's frame end by the force on its platform end and by its own data."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.over_pulleys import material_at
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import formula


class _FrameEndSlopes(NamedTuple):
    """The tension at the frame end, and its derivatives while the force on the platform end stays, unless named."""

    tension: float  # T_A [N]
    along: float  # by the horizontal part of the force on the platform end, in the cable's plane
    up: float  # by its vertical part
    by_height: float  # by the height of the platform end over the frame anchor [N/m]
    by_length: float  # by the length [N/m]
    by_density: float  # [N m/kg]
    by_stiffness: float  # by EA
    by_radius: float  # by that of the pulley [N/m]
    by_dead: float  # by the dead length [N/m]


@formula
def frame_end_slopes(model: Model, cables: Array, rows: Array, i: int) -> _FrameEndSlopes:
    """Those of cable i, after its forces; zero without a force there."""
    material = material_at(cables, i)
    gravity = model.gravity if model.code == codes.CATENARY else 0.0
    weight = material.density * gravity
    x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
    if model.behind is None:
        length = rows[g.LENGTH, i]
        at_frame = z - weight * length
        tension = math.sqrt(x * x + at_frame * at_frame)
        share = 1.0 / tension if tension > 0.0 else 0.0
        along, up = x * share, at_frame * share
        return _FrameEndSlopes(tension, along, up, 0.0, -up * weight, -up * gravity * length, 0.0, 0.0, 0.0)
    # T + T^2/(2 EA) - w z is one number from the platform end to the pulley's exit P, which moves on the pulley
    stiffness, pulley = material.stiffness, pulley_at(cables, i)
    leaving, free = rows[g.LEAVING, i], rows[g.FREE_LENGTH, i]
    end = math.sqrt(x * x + z * z)
    if not (leaving > 0.0 and end > 0.0):
        return _FrameEndSlopes(leaving, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sine, cosine, entry = rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i], pulley.entry
    strained = 1.0 + leaving / stiffness
    share = 1.0 / strained
    grown = (1.0 + end / stiffness) / end * share
    lifted = weight * pulley.radius * entry * cosine * share  # by the wrap angle
    turned_x, turned_z = cosine / leaving, -entry * sine / leaving  # the wrap angle by the force at P
    rise = rows[g.FREE_RISE, i]
    return _FrameEndSlopes(
        leaving,
        grown * x + lifted * turned_x,
        grown * z + lifted * turned_z,
        -weight * share,
        -lifted * turned_z * weight,
        -(rise * share + lifted * turned_z * free) * gravity,
        0.5 * (leaving * leaving - end * end) / (stiffness * stiffness) * share,
        weight * entry * sine * share + lifted * turned_z * weight * rows[g.WRAP, i] / strained,
        lifted * turned_z * weight / strained,
    )


@formula
def in_world_axes(rows: Array, i: int, along: float, up: float) -> tuple[float, float, float]:
    """Derivatives by the force on the platform end in world axes."""
    return along * rows[g.AZIMUTH_X, i], along * rows[g.AZIMUTH_Y, i], up
