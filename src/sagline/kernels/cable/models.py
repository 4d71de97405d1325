"""Selection of the cable model, and the shallow cable: length from tension, and tension from length.

The shallow cable is a straight line of tension tau plus a vertical force b on its platform end; docs/model.md, section
3. The same equations are used for the parabolic model (b = wD/2, k = g^2/24, stretching tension tau) and the empirical
model (b = k_h rho D, k = k_p, stretching tension |T|):

    T = tau (cos phi, sin phi) + (0, b)
    L = D (1 + k (rho D cos phi / tau)^2) / (1 + stretching tension/EA)
"""

from __future__ import annotations

import math

import numpy as np

from sagline.kernels import codes
from sagline.kernels.cable.catenary import RANGE, catenary_from_length, length_ratio, sag_force_ratio
from sagline.kernels.cable.terms import Chord, Force, Material, Model
from sagline.kernels.jit import kernel

STEPS = 60


@kernel
def stretching_tension(tension: float, sine: float, cosine: float, sag_force: float) -> float:
    """Magnitude of the force on the platform end [N]. If `sag_force` is 0, this is the chord tension."""
    return math.hypot(tension * cosine, tension * sine + sag_force)


@kernel
def shallow_length_ratio(
    tension: float, sine: float, cosine: float, sag_force: float, sag: float, stiffness: float
) -> float:
    """Ratio L/D. `sag`: k (rho D cos phi)^2 [N^2]; `sag_force`: b [N] if it is part of the stretching tension, or 0."""
    return (1.0 + sag / (tension * tension)) / (1.0 + stretching_tension(tension, sine, cosine, sag_force) / stiffness)


@kernel
def shallow_tension(
    chord: float, sine: float, cosine: float, sag_force: float, sag: float, stiffness: float, length: float
) -> tuple[float, bool]:
    """Chord tension of a shallow cable of the length `length`, and True if this tension was found.

    The first Newton steps use the cubic equation of the parabolic model and start above its root. The other steps use
    the length of the cable model and stay within two bounds. A cable without sag that is longer than its chord has no
    tension.
    """
    p = (length - chord) / length * stiffness
    q = stiffness * chord * sag / length
    tension = max(-p, 0.0) + np.cbrt(q)
    if p * tension * tension > q:
        tension = math.sqrt(q / p)
    if tension == 0.0:
        return 0.0, True
    for _ in range(STEPS):
        new = tension - (tension * tension * (tension + p) - q) / (tension * (3.0 * tension + 2.0 * p))
        if not new < tension:
            break
        tension = new
    if sag_force == 0.0:
        return tension, True
    low = 0.0
    high = math.inf
    for _ in range(STEPS):
        end = stretching_tension(tension, sine, cosine, sag_force)
        square = tension * tension
        error = length * (1.0 + end / stiffness) - chord * (1.0 + sag / square)
        slope = length * (tension + sag_force * sine) / (end * stiffness) + 2.0 * chord * sag / (square * tension)
        if error > 0.0:
            high = tension
        else:
            low = tension
        new = tension - error / slope
        if not low <= new <= high:
            new = 0.5 * (low + high) if high < math.inf else 2.0 * tension
        change = abs(new - tension)
        tension = new
        if change <= 4e-16 * tension:
            return tension, True
    return tension, change <= 1e-12 * tension


@kernel
def shallow_sag_force(model: Model, chord: float, density: float) -> float:
    """First-order sag force T_z - tau sin phi at the platform end [N]; 0 for weightless models."""
    if model.code == codes.STRAIGHT or model.code == codes.ELASTIC:
        return 0.0
    if model.code == codes.EMPIRICAL:
        return model.k_h * density * chord
    return 0.5 * density * model.gravity * chord


@kernel
def sag_of_shallow(model: Model, line: float) -> float:
    """The product k (rho D cos phi)^2 [N^2] of the shallow models; `line`: rho D cos phi [kg]."""
    k = model.k_p if model.code == codes.EMPIRICAL else model.gravity * model.gravity / 24.0
    return k * line * line


@kernel
def from_tension(model: Model, chord: Chord, material: Material, tension: float) -> tuple[float, float, int]:
    """Unstrained length [m], sag force T_z - tau sin phi [N] and status of a cable at the chord tension `tension`."""
    if model.code == codes.STRAIGHT:
        return chord.length, 0.0, codes.CABLE_SOLVED
    strain = tension / material.stiffness
    if model.code == codes.ELASTIC or material.density * model.gravity == 0.0:
        return chord.length / (1.0 + strain), 0.0, codes.CABLE_SOLVED
    sag_force = shallow_sag_force(model, chord.length, material.density)
    half_weight = 0.5 * material.density * model.gravity * chord.length / tension
    if not half_weight < RANGE:
        return math.nan, math.nan, codes.CABLE_TOO_SLACK
    if model.code == codes.CATENARY:
        ratio, status = length_ratio(half_weight, chord.sine, chord.cosine, strain)
        return chord.length * ratio, tension * sag_force_ratio(half_weight, chord.sine, strain, ratio), status
    sag = sag_of_shallow(model, material.density * chord.length * chord.cosine)
    if model.code == codes.EMPIRICAL:
        status = codes.CABLE_SOLVED if tension * abs(chord.sine) > abs(sag_force) else codes.CABLE_BELOW_VALIDITY
        ratio = shallow_length_ratio(tension, chord.sine, chord.cosine, sag_force, sag, material.stiffness)
        return chord.length * ratio, sag_force, status
    ratio = shallow_length_ratio(tension, chord.sine, chord.cosine, 0.0, sag, material.stiffness)
    return chord.length * ratio, sag_force, codes.CABLE_SOLVED


@kernel
def from_length(model: Model, span: float, rise: float, material: Material, length: float) -> tuple[Force, int]:
    """Force on the platform end, and status, of a cable of the length `length`."""
    if model.code == codes.STRAIGHT:
        return Force(math.nan, math.nan, math.nan), codes.CABLE_NO_TENSION
    weight = material.density * model.gravity
    if model.code == codes.CATENARY and weight > 0.0:
        return catenary_from_length(span, rise, length, weight, material.stiffness)
    chord = math.hypot(span, rise)
    sine = rise / chord
    cosine = span / chord
    if model.code == codes.ELASTIC or weight == 0.0:
        tension = max(material.stiffness * ((chord - length) / length), 0.0)
        status = codes.CABLE_SOLVED if tension > 0.0 else codes.CABLE_SLACK
        return Force(tension * cosine, tension * sine, tension), status
    sag_force = shallow_sag_force(model, chord, material.density)
    sag = sag_of_shallow(model, material.density * chord * cosine)
    stretch_force = sag_force if model.code == codes.EMPIRICAL else 0.0
    tension, found = shallow_tension(chord, sine, cosine, stretch_force, sag, material.stiffness, length)
    status = codes.CABLE_SOLVED
    if not found:
        status = codes.CABLE_NOT_CONVERGED
    elif tension == 0.0:
        status = codes.CABLE_SLACK
    elif model.code == codes.EMPIRICAL and tension * abs(sine) <= abs(sag_force):
        status = codes.CABLE_BELOW_VALIDITY
    return Force(tension * cosine, tension * sine + sag_force, tension), status
