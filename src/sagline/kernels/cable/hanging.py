"""All cables of one pose at once: ratios and pulls at given chord tensions, and limits as chord tensions."""

from __future__ import annotations

import math

from sagline.arrays import Codes
from sagline.kernels.cable.cables import Cables, chord_of, material_of
from sagline.kernels.cable.catenary import (
    TAUT_STRAIN,
    is_ordinary,
    ordinary_length_ratio,
    ordinary_length_ratio_near,
    ordinary_pull_ratio,
)
from sagline.kernels.cable.models import from_tension
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.codes import CABLE_SOLVED, CATENARY, ELASTIC, STRAIGHT
from sagline.kernels.jit import glue, kernel

# Relative change of tension within which one Newton step from the last ratio will do: it leaves 3e-8 of the ratio at
# X = 2, 5e-15 at X = 0.01, and the square of a smaller change, so that rounds which stand still end in the last digit.
NEAR = 1e-3
LIMIT_STEPS = 30
LIMIT_PRECISION = 1e-13  # relative


@glue
def hang_cables(model: Model, cables: Cables, near: bool, statuses: Codes) -> int:
    """Fill slackness, strain, ratio and pull of all cables, and the statuses (m,), at their chord tensions.

    Ordinary catenaries go through loops without branches, which vectorize; the others follow one by one.

    Args:
        model: Cable model.
        cables: The cables of one pose.
        near: Whether their ratios are the answer at tensions less than NEAR away.
        statuses: Filled.

    Returns:
        The gravest status.
    """
    m = cables.tau.size
    for i in range(m):
        cables.slackness[i] = cables.half_weight[i] / cables.tau[i]
    for i in range(m):
        cables.strain[i] = cables.tau[i] / cables.stiffness[i]
    if model.code == CATENARY:
        stretched = 0
        if not near:
            for i in range(m):
                cables.ratio[i] = ordinary_length_ratio(
                    cables.slackness[i], cables.sine[i], cables.cosine[i], cables.strain[i]
                )
            for i in range(m):
                stretched += 1 if cables.strain[i] > TAUT_STRAIN else 0
        if near or stretched > 0:
            for i in range(m):
                cables.ratio[i] = ordinary_length_ratio_near(
                    cables.slackness[i], cables.sine[i], cables.cosine[i], cables.strain[i], cables.ratio[i]
                )
        for i in range(m):
            cables.pull[i] = cables.tau[i] * ordinary_pull_ratio(
                cables.slackness[i], cables.sine[i], cables.strain[i], cables.ratio[i]
            )
    gravest = CABLE_SOLVED
    for i in range(m):
        statuses[i] = CABLE_SOLVED
        if model.code != CATENARY or not is_ordinary(cables.slackness[i], cables.strain[i]):
            length, pull, status = from_tension(model, chord_of(cables, i), material_of(cables, i), cables.tau[i])
            cables.ratio[i] = length / cables.chord[i]
            cables.pull[i] = pull
            statuses[i] = status
            gravest = max(gravest, status)
    return gravest


@kernel
def frame_end_tension(model: Model, chord: Chord, material: Material, tau: float) -> float:
    """Tension at the frame end of a cable at a chord tension [N]."""
    if model.code == STRAIGHT or model.code == ELASTIC:
        return tau
    length, pull, _status = from_tension(model, chord, material, tau)
    return math.hypot(tau * chord.cosine, tau * chord.sine + pull - material.density * model.gravity * length)


@kernel
def chord_tension_at_frame_end(model: Model, chord: Chord, material: Material, tension: float) -> float:
    """Chord tension at which the tension at the frame end has a given value, on the taut side.

    A sagging cable's frame-end tension has a least value, near wD cos(phi)/2; what lies below it is met there.
    Newton's slope is the first-order one, T_A^2 = tau^2 - tau wD sin phi + (wD/2)^2; the value is the model's own.
    """
    weight = material.density * model.gravity
    if model.code == STRAIGHT or model.code == ELASTIC or weight == 0.0 or tension == math.inf:
        return tension
    along = 0.5 * weight * chord.length * chord.sine
    across = 0.5 * weight * chord.length * chord.cosine
    tau = along + math.sqrt(max(tension * tension - across * across, 0.0))
    if tension <= 1.01 * across or tau <= 0.0:
        return max(tau, 0.0)
    for _ in range(LIMIT_STEPS):
        value = frame_end_tension(model, chord, material, tau)
        step = (value - tension) * value / (tau - along)
        new = tau - step
        tau = new if new > 0.5 * tau else 0.5 * tau
        if abs(step) <= LIMIT_PRECISION * tau:
            break
    return tau
