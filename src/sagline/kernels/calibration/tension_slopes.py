"""Derivatives of a cable's frame-end tension with respect to the force on its platform end and its parameters."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model, material_at
from sagline.kernels.jit import formula


class _FrameEndSlopes(NamedTuple):
    """Frame-end tension and its derivatives. Except for `along` and `up`, the force on the platform end is constant."""

    tension: float  # T_A [N]
    along: float  # derivative with respect to the horizontal part of the platform-end force, in the cable's plane
    up: float  # derivative with respect to the vertical part of this force
    by_height: float  # derivative with respect to the height of the platform end above the frame anchor [N/m]
    by_length: float  # derivative with respect to the length [N/m]
    by_density: float  # derivative with respect to the density [N m/kg]
    by_stiffness: float  # derivative with respect to EA
    by_radius: float  # derivative with respect to the pulley radius [N/m]
    by_dead: float  # derivative with respect to the dead length [N/m]


@formula
def frame_end_slopes(model: Model, cables: Array, rows: Array, i: int) -> _FrameEndSlopes:
    """Slopes of cable `i`, whose forces must be known. They are zero if the force at the frame end is zero."""
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
    # T + T^2/(2 EA) - w z is equal at the platform end and at the exit point P, which moves on the pulley
    stiffness, pulley = material.stiffness, pulley_at(cables, i)
    leaving, free = rows[g.LEAVING, i], rows[g.FREE_LENGTH, i]
    end = math.sqrt(x * x + z * z)
    if not (leaving > 0.0 and end > 0.0):
        return _FrameEndSlopes(leaving, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sine, cosine, entry = rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i], pulley.entry
    strained = 1.0 + leaving / stiffness
    share = 1.0 / strained
    grown = (1.0 + end / stiffness) / end * share
    lifted = weight * pulley.radius * entry * cosine * share  # derivative with respect to the wrap angle
    turned_x, turned_z = cosine / leaving, -entry * sine / leaving  # derivative of psi with respect to the force at P
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
    """Derivatives with respect to the force on the platform end, in world axes."""
    return along * rows[g.AZIMUTH_X, i], along * rows[g.AZIMUTH_Y, i], up
