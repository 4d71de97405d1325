"""All cables of one pose at once: lengths and pulls at given chord tensions, and limits as chord tensions."""

from __future__ import annotations

import math

from sagline.arrays import Array, Codes
from sagline.kernels import geometry as g
from sagline.kernels import tables
from sagline.kernels.catenary import is_ordinary, ordinary_length_ratio, ordinary_pull_ratio
from sagline.kernels.codes import CABLE_SOLVED, CATENARY, ELASTIC, STRAIGHT
from sagline.kernels.jit import kernel
from sagline.kernels.models import from_tension

LIMIT_STEPS = 30
LIMIT_PRECISION = 1e-13  # relative


@kernel
def hang_cables(
    code: int,
    k_h: float,
    k_p: float,
    gravity: float,
    cables: Array,
    geometry: Array,
    tensions: Array,
    lengths: Array,
    pulls: Array,
    statuses: Codes,
) -> None:
    """Fill unstrained lengths, pulls T_z - tau sin phi and statuses (m,) of one pose's cables.

    Ordinary catenaries go through loops without branches, which vectorize; the others follow one by one.
    """
    m = tensions.shape[0]
    if code == CATENARY:
        for i in range(m):
            half_weight = 0.5 * gravity * cables[i, tables.DENSITY] * geometry[g.CHORD, i] / tensions[i]
            lengths[i] = ordinary_length_ratio(
                half_weight, geometry[g.SINE, i], geometry[g.COSINE, i], tensions[i] / cables[i, tables.STIFFNESS]
            )
        for i in range(m):
            half_weight = 0.5 * gravity * cables[i, tables.DENSITY] * geometry[g.CHORD, i] / tensions[i]
            pulls[i] = tensions[i] * ordinary_pull_ratio(
                half_weight, geometry[g.SINE, i], tensions[i] / cables[i, tables.STIFFNESS], lengths[i]
            )
    for i in range(m):
        half_weight = 0.5 * gravity * cables[i, tables.DENSITY] * geometry[g.CHORD, i] / tensions[i]
        if code == CATENARY and is_ordinary(half_weight, tensions[i] / cables[i, tables.STIFFNESS]):
            lengths[i] *= geometry[g.CHORD, i]
            statuses[i] = CABLE_SOLVED
        else:
            lengths[i], pulls[i], statuses[i] = from_tension(
                code,
                k_h,
                k_p,
                gravity,
                geometry[g.CHORD, i],
                geometry[g.SINE, i],
                geometry[g.COSINE, i],
                cables[i, tables.DENSITY],
                cables[i, tables.STIFFNESS],
                tensions[i],
            )


@kernel
def chord_tension_at_frame_end(
    code: int,
    k_h: float,
    k_p: float,
    gravity: float,
    chord: float,
    sine: float,
    cosine: float,
    density: float,
    stiffness: float,
    tension: float,
) -> float:
    """Chord tension at which the tension at the frame end has a given value, on the taut side.

    A sagging cable's frame-end tension has a least value, near wD cos(phi)/2; what lies below it is met there.
    Newton's slope is the first-order one, T_A^2 = tau^2 - tau wD sin phi + (wD/2)^2; the value is the model's own.
    """
    weight = density * gravity
    if code == STRAIGHT or code == ELASTIC or weight == 0.0 or tension == math.inf:
        return tension
    along = 0.5 * weight * chord * sine
    across = 0.5 * weight * chord * cosine
    tau = along + math.sqrt(max(tension * tension - across * across, 0.0))
    if tension <= 1.01 * across or tau <= 0.0:
        return max(tau, 0.0)
    for _ in range(LIMIT_STEPS):
        length, pull, _status = from_tension(
            code, k_h, k_p, gravity, chord, sine, cosine, density, stiffness, tau
        )
        value = math.hypot(tau * cosine, tau * sine + pull - weight * length)
        step = (value - tension) * value / (tau - along)
        new = tau - step
        tau = new if new > 0.5 * tau else 0.5 * tau
        if abs(step) <= LIMIT_PRECISION * tau:
            break
    return tau
