"""The one switch between cable models: an integer code and two parameters, in both directions."""

from __future__ import annotations

import math

from sagline.kernels.cable.catenary import RANGE, catenary_from_length, length_ratio, pull_ratio
from sagline.kernels.cable.shallow import shallow_length_ratio, shallow_tension
from sagline.kernels.cable.terms import Chord, Force, Material, Model
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
def pull_of_shallow(model: Model, chord: float, density: float) -> float:
    """First-order pull T_z - tau sin phi of the weight on the platform end [N]; 0 for weightless models."""
    if model.code == STRAIGHT or model.code == ELASTIC:
        return 0.0
    if model.code == EMPIRICAL:
        return model.k_h * density * chord
    return 0.5 * density * model.gravity * chord


@kernel
def sag_of_shallow(model: Model, line: float) -> float:
    """The product k (rho D cos phi)^2 [N^2] of the shallow models, from rho D cos phi [kg]."""
    k = model.k_p if model.code == EMPIRICAL else model.gravity * model.gravity / 24.0
    return k * line * line


@kernel
def from_tension(model: Model, chord: Chord, material: Material, tension: float) -> tuple[float, float, int]:
    """Unstrained length [m], pull T_z - tau sin phi [N] and status of a cable at a chord tension."""
    if model.code == STRAIGHT:
        return chord.length, 0.0, CABLE_SOLVED
    strain = tension / material.stiffness
    if model.code == ELASTIC or material.density * model.gravity == 0.0:
        return chord.length / (1.0 + strain), 0.0, CABLE_SOLVED
    pull = pull_of_shallow(model, chord.length, material.density)
    half_weight = 0.5 * material.density * model.gravity * chord.length / tension
    if not half_weight < RANGE:
        return math.nan, math.nan, CABLE_TOO_SLACK
    if model.code == CATENARY:
        ratio, status = length_ratio(half_weight, chord.sine, chord.cosine, strain)
        return chord.length * ratio, tension * pull_ratio(half_weight, chord.sine, strain, ratio), status
    sag = sag_of_shallow(model, material.density * chord.length * chord.cosine)
    if model.code == EMPIRICAL:
        status = CABLE_SOLVED if tension * abs(chord.sine) > abs(pull) else CABLE_BELOW_VALIDITY
        ratio = shallow_length_ratio(tension, chord.sine, chord.cosine, pull, sag, material.stiffness)
        return chord.length * ratio, pull, status
    ratio = shallow_length_ratio(tension, chord.sine, chord.cosine, 0.0, sag, material.stiffness)
    return chord.length * ratio, pull, CABLE_SOLVED


@kernel
def from_length(model: Model, span: float, rise: float, material: Material, length: float) -> tuple[Force, int]:
    """Force on the platform end and status of a cable of a length."""
    if model.code == STRAIGHT:
        return Force(math.nan, math.nan, math.nan), CABLE_NO_TENSION
    weight = material.density * model.gravity
    if model.code == CATENARY and weight > 0.0:
        return catenary_from_length(span, rise, length, weight, material.stiffness)
    chord = math.hypot(span, rise)
    sine = rise / chord
    cosine = span / chord
    if model.code == ELASTIC or weight == 0.0:
        tension = max(material.stiffness * ((chord - length) / length), 0.0)
        status = CABLE_SOLVED if tension > 0.0 else CABLE_SLACK
        return Force(tension * cosine, tension * sine, tension), status
    pull = pull_of_shallow(model, chord, material.density)
    sag = sag_of_shallow(model, material.density * chord * cosine)
    stretch_pull = pull if model.code == EMPIRICAL else 0.0
    tension, found = shallow_tension(chord, sine, cosine, stretch_pull, sag, material.stiffness, length)
    status = CABLE_SOLVED
    if not found:
        status = CABLE_NOT_CONVERGED
    elif tension == 0.0:
        status = CABLE_SLACK
    elif model.code == EMPIRICAL and tension * abs(sine) <= abs(pull):
        status = CABLE_BELOW_VALIDITY
    return Force(tension * cosine, tension * sine + pull, tension), status
