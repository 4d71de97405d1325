"""The one switch between cable models: an integer code and two parameters, in both directions."""

from __future__ import annotations

import math

from sagline.kernels.cable.catenary import RANGE, catenary_from_length, length_ratio, pull_ratio
from sagline.kernels.cable.shallow import shallow_length_ratio, shallow_tension
from sagline.kernels.codes import (
    CABLE_BELOW_VALIDITY,
    CABLE_NO_TENSION,
    CABLE_NOT_CONVERGED,
    CABLE_SLACK,
    CABLE_SOLVED,
    CABLE_TOO_SLACK,
    CATENARY,
    ELASTIC,
    EMPIRICAL,
    STRAIGHT,
)
from sagline.kernels.jit import kernel


@kernel
def pull_of_shallow(code: int, k_h: float, chord: float, density: float, gravity: float) -> float:
    """First-order pull T_z - tau sin phi of the weight on the platform end [N]; 0 for weightless models."""
    if code == STRAIGHT or code == ELASTIC:
        return 0.0
    if code == EMPIRICAL:
        return k_h * density * chord
    return 0.5 * density * gravity * chord


@kernel
def sag_of_shallow(code: int, k_p: float, chord: float, cosine: float, density: float, gravity: float) -> float:
    """The product k (rho D cos phi)^2 [N^2] of the shallow models."""
    line = density * chord * cosine
    k = k_p if code == EMPIRICAL else gravity * gravity / 24.0
    return k * line * line


@kernel
def from_tension(
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
) -> tuple[float, float, int]:
    """Unstrained length [m], pull T_z - tau sin phi [N] and status of a cable at a chord tension."""
    if code == STRAIGHT:
        return chord, 0.0, CABLE_SOLVED
    strain = tension / stiffness
    if code == ELASTIC or density * gravity == 0.0:
        return chord / (1.0 + strain), 0.0, CABLE_SOLVED
    pull = pull_of_shallow(code, k_h, chord, density, gravity)
    half_weight = 0.5 * density * gravity * chord / tension
    if not half_weight < RANGE:
        return math.nan, math.nan, CABLE_TOO_SLACK
    if code == CATENARY:
        ratio, status = length_ratio(half_weight, sine, cosine, strain)
        return chord * ratio, tension * pull_ratio(half_weight, sine, strain, ratio), status
    sag = sag_of_shallow(code, k_p, chord, cosine, density, gravity)
    if code == EMPIRICAL:
        status = CABLE_SOLVED if tension * abs(sine) > abs(pull) else CABLE_BELOW_VALIDITY
        return chord * shallow_length_ratio(tension, sine, cosine, pull, sag, stiffness), pull, status
    return chord * shallow_length_ratio(tension, sine, cosine, 0.0, sag, stiffness), pull, CABLE_SOLVED


@kernel
def from_length(
    code: int,
    k_h: float,
    k_p: float,
    gravity: float,
    span: float,
    rise: float,
    density: float,
    stiffness: float,
    length: float,
) -> tuple[float, float, float, int]:
    """Horizontal and vertical force on the platform end [N], chord tension [N] and status of a cable of a length."""
    if code == STRAIGHT:
        return math.nan, math.nan, math.nan, CABLE_NO_TENSION
    if code == CATENARY and density * gravity > 0.0:
        return catenary_from_length(span, rise, length, density * gravity, stiffness)
    chord = math.hypot(span, rise)
    sine = rise / chord
    cosine = span / chord
    if code == ELASTIC or density * gravity == 0.0:
        tension = max(stiffness * ((chord - length) / length), 0.0)
        status = CABLE_SOLVED if tension > 0.0 else CABLE_SLACK
        return tension * cosine, tension * sine, tension, status
    pull = pull_of_shallow(code, k_h, chord, density, gravity)
    sag = sag_of_shallow(code, k_p, chord, cosine, density, gravity)
    stretch_pull = pull if code == EMPIRICAL else 0.0
    tension, found = shallow_tension(chord, sine, cosine, stretch_pull, sag, stiffness, length)
    status = CABLE_SOLVED
    if not found:
        status = CABLE_NOT_CONVERGED
    elif tension == 0.0:
        status = CABLE_SLACK
    elif code == EMPIRICAL and tension * abs(sine) <= abs(pull):
        status = CABLE_BELOW_VALIDITY
    return tension * cosine, tension * sine + pull, tension, status
