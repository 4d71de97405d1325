"""Forces of all cables of one pose at their unstrained lengths.

Most calls come from a pose close by. Ordinary catenaries therefore take two Halley steps from the parameter h they
had there, in loops without branches, which vectorize; whoever is not settled by them is solved alone, from scratch.
"""

from __future__ import annotations

import math

from sagline.arrays import Array, Codes
from sagline.kernels import tables
from sagline.kernels.algebra.hyperbolic import cosh_polynomial, sinh_excess_polynomial, sinhc_polynomial
from sagline.kernels.balance import geometry as g
from sagline.kernels.cable.catenary import SMALL_HALLEY_STEP, relative_excess
from sagline.kernels.cable.models import from_length
from sagline.kernels.cable.terms import Material, Model
from sagline.kernels.codes import CABLE_SOLVED, CATENARY
from sagline.kernels.jit import formula, kernel

CLOSE = 0.1  # relative first step within which two Halley steps are trusted
ORDINARY = 2.0  # of h: up to here the polynomials are exact

# rows of the working memory, (FORCE_ROWS, m); PARAMETER is kept from pose to pose
PARAMETER, KAPPA, EXCESS, FIRST, SECOND = 0, 1, 2, 3, 4
FORCE_ROWS = 5


@formula
def halley_step(h: float, xi2: float, zeta2: float, kappa: float, excess: float) -> float:
    """One Halley step on P2 (docs/model.md, section 2) for h <= 2, free of branches."""
    y = h * h
    more = h * y * sinh_excess_polynomial(y)  # sinh h - h
    s = h + more
    c = cosh_polynomial(y)
    total = 1.0 / (h + kappa)
    lever = 1.0 / (s + kappa * c)
    a = s * total
    alpha = (more - kappa) * total
    alpha1 = (c - a) * total
    alpha2 = (s - 2.0 * alpha1) * total
    e = s * lever
    eta = -kappa * c * lever
    eta1 = kappa * lever * lever
    eta2 = -2.0 * eta1 * lever * (c + kappa * s)
    error = excess + xi2 * alpha * (2.0 + alpha) + zeta2 * eta * (2.0 + eta)
    slope = 2.0 * (xi2 * a * alpha1 + zeta2 * e * eta1)
    bend = xi2 * (alpha1 * alpha1 + a * alpha2) + zeta2 * (eta1 * eta1 + e * eta2)
    return h - error * slope / (slope * slope - error * bend)


@formula
def share(part: float, length: float) -> float:
    """(part/length)^2."""
    ratio = part / length
    return ratio * ratio


@kernel
def settle(gravity: float, cables: Array, lengths: Array, geometry: Array, memory: Array) -> None:
    """Two Halley steps for every cable from the remembered parameter; one result a loop, so that each vectorizes."""
    m = lengths.shape[0]
    for i in range(m):
        memory[KAPPA, i] = 0.5 * cables[i, tables.DENSITY] * gravity * lengths[i] / cables[i, tables.STIFFNESS]
    for i in range(m):
        memory[EXCESS, i] = relative_excess(geometry[g.SPAN, i], geometry[g.RISE, i], lengths[i])
    for i in range(m):
        xi2 = share(geometry[g.SPAN, i], lengths[i])
        zeta2 = share(geometry[g.RISE, i], lengths[i])
        memory[FIRST, i] = halley_step(memory[PARAMETER, i], xi2, zeta2, memory[KAPPA, i], memory[EXCESS, i])
    for i in range(m):
        xi2 = share(geometry[g.SPAN, i], lengths[i])
        zeta2 = share(geometry[g.RISE, i], lengths[i])
        memory[SECOND, i] = halley_step(memory[FIRST, i], xi2, zeta2, memory[KAPPA, i], memory[EXCESS, i])


@kernel
def is_settled(before: float, first: float, second: float, kappa: float) -> bool:
    """Whether the second step's answer is exact; false for NaN."""
    near = abs(first - before) <= CLOSE * (first + kappa)
    return near and abs(second - first) <= SMALL_HALLEY_STEP * (second + kappa) and 0.0 < second < ORDINARY


@kernel
def cable_forces(
    model: Model,
    cables: Array,
    lengths: Array,
    geometry: Array,
    memory: Array,
    result: Array,
    statuses: Codes,
) -> None:
    """Fill the rows T_x, T_z and tau of the result and the statuses (m,) after `cable_geometry`."""
    m = lengths.shape[0]
    if model.code == CATENARY:
        settle(model.gravity, cables, lengths, geometry, memory)
    for i in range(m):
        kappa = memory[KAPPA, i]
        h = memory[SECOND, i]
        span, rise, chord = geometry[g.SPAN, i], geometry[g.RISE, i], geometry[g.CHORD, i]
        density = cables[i, tables.DENSITY]
        weight = density * model.gravity
        if model.code == CATENARY and is_settled(memory[PARAMETER, i], memory[FIRST, i], h, kappa):
            half = 0.5 * weight / (h + kappa)
            y = h * h
            tangent = h * sinhc_polynomial(y) / cosh_polynomial(y)
            result[tables.HORIZONTAL, i] = half * span
            result[tables.VERTICAL, i] = 0.5 * weight * (lengths[i] + rise / (tangent + kappa))
            result[tables.TENSION, i] = half * chord
            statuses[i] = CABLE_SOLVED
            memory[PARAMETER, i] = h
            continue
        material = Material(density, cables[i, tables.STIFFNESS])
        force, status = from_length(model, span, rise, material, lengths[i])
        tension = force.tension
        result[tables.HORIZONTAL, i] = force.horizontal
        result[tables.VERTICAL, i] = force.vertical
        result[tables.TENSION, i] = tension
        statuses[i] = status
        # h back from tau = wD/(2 (h + kappa)), for the next pose
        memory[PARAMETER, i] = 0.5 * weight * chord / tension - kappa if tension > 0.0 else math.nan
