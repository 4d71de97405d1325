"""Forces of all cables of one pose at their unstrained lengths.

Most calls are for a pose close to the previous pose. Two Halley steps from the previous parameter h therefore solve
ordinary catenaries. These loops have no branches, so that they vectorize. The cables that have not converged are then
solved one by one, without the previous h.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import cosh_polynomial, sinh_excess_polynomial, sinhc_polynomial
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.catenary import SMALL_HALLEY_STEP, relative_excess
from sagline.kernels.cable.models import from_length
from sagline.kernels.cable.over_pulleys import fill_equivalent_cables, start_passes, update_from_equivalent_cables
from sagline.kernels.cable.terms import Material, Model
from sagline.kernels.jit import formula, glue

CLOSE = 0.1  # relative first step up to which two Halley steps are accurate
ORDINARY = 2.0  # largest h at which the polynomials have full precision
PASSES = 30  # largest number of passes for cables over pulleys; from a nearby pose, one or two are sufficient
MISSED = 1e-13  # largest error of the platform end, relative to the cable's length


@formula
def _halley_step(h: float, xi2: float, zeta2: float, kappa: float, excess: float) -> float:
    """One Halley step on P2 (docs/model.md, section 2) for h <= 2, without branches."""
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
def _square_share(part: float, length: float) -> float:
    """The square of the ratio part/length."""
    ratio = part / length
    return ratio * ratio


class _EquivalentCables(NamedTuple):
    """Data of the cables to solve, m values each: span, rise and unstrained length [m], EA [N]."""

    span: Array
    rise: Array
    length: Array
    stiffness: Array


@glue
def _two_halley_steps(gravity: float, cables: Array, asked: _EquivalentCables, rows: Array) -> None:
    """Two Halley steps for every cable from the stored parameter. The loop has one result, so that it vectorizes."""
    m = cables.shape[0]
    for i in range(m):
        rows[g.KAPPA, i] = 0.5 * cables[i, tables.DENSITY] * gravity * asked.length[i] / asked.stiffness[i]
    for i in range(m):
        rows[g.EXCESS, i] = relative_excess(asked.span[i], asked.rise[i], asked.length[i])
    for i in range(m):
        xi2 = _square_share(asked.span[i], asked.length[i])
        zeta2 = _square_share(asked.rise[i], asked.length[i])
        rows[g.FIRST, i] = _halley_step(rows[g.PARAMETER, i], xi2, zeta2, rows[g.KAPPA, i], rows[g.EXCESS, i])
    for i in range(m):
        xi2 = _square_share(asked.span[i], asked.length[i])
        zeta2 = _square_share(asked.rise[i], asked.length[i])
        rows[g.SECOND, i] = _halley_step(rows[g.FIRST, i], xi2, zeta2, rows[g.KAPPA, i], rows[g.EXCESS, i])


@formula
def _has_converged(rows: Array, i: int) -> bool:
    """True if the second step of cable `i` has full precision. False for NaN."""
    first, second, kappa = rows[g.FIRST, i], rows[g.SECOND, i], rows[g.KAPPA, i]
    near = abs(first - rows[g.PARAMETER, i]) <= CLOSE * (first + kappa)
    return near and abs(second - first) <= SMALL_HALLEY_STEP * (second + kappa) and 0.0 < second < ORDINARY


@formula
def forces_from_lengths(model: Model, cables: Array, rows: Array, behind: bool | None) -> None:
    """Fill T_x, T_z, tau and status of every cable of a pose from its geometry and length.

    A cable over a pulley is replaced by a cable that starts where the chord touches the pulley. Several passes correct
    the replacement; docs/model.md, section 10.

    cables: rows of the cable_table, (m, CABLE_COLUMNS); rows: as in `sagline.kernels.cable.geometry`, (CABLE_ROWS, m);
        behind: `Model.behind` as a separate argument. If no cable has a pulley, it is None, and the code for pulleys is
        not compiled.
    """
    if behind is None:
        bare = _EquivalentCables(rows[g.SPAN], rows[g.RISE], rows[g.LENGTH], cables[:, tables.STIFFNESS])
        _solve_equivalent_cables(model, cables, bare, rows)
    else:
        asked = _EquivalentCables(rows[g.ASKED_SPAN], rows[g.ASKED_RISE], rows[g.ASKED_LENGTH], rows[g.SOFT])
        start_passes(cables, rows)
        missed = math.inf
        for _ in range(PASSES):
            fill_equivalent_cables(model, cables, rows)
            _solve_equivalent_cables(model, cables, asked, rows)
            missed = update_from_equivalent_cables(model, cables, rows)
            if missed <= MISSED:
                break
        if not missed <= MISSED:
            for i in range(cables.shape[0]):
                rows[g.STATUS, i] = codes.CABLE_NOT_CONVERGED


@glue
def _solve_equivalent_cables(model: Model, cables: Array, asked: _EquivalentCables, rows: Array) -> None:
    """Fill T_x, T_z, tau and status of the cables given by `asked`."""
    exact = model.code == codes.CATENARY
    if exact:
        _two_halley_steps(model.gravity, cables, asked, rows)
    for i in range(cables.shape[0]):
        span, rise, length = asked.span[i], asked.rise[i], asked.length[i]
        chord = math.sqrt(span * span + rise * rise)
        density = cables[i, tables.DENSITY]
        weight = density * model.gravity
        if exact and _has_converged(rows, i):
            h, kappa = rows[g.SECOND, i], rows[g.KAPPA, i]
            half = 0.5 * weight / (h + kappa)
            y = h * h
            tangent = h * sinhc_polynomial(y) / cosh_polynomial(y)
            rows[g.HORIZONTAL, i] = half * span
            rows[g.VERTICAL, i] = 0.5 * weight * (length + rise / (tangent + kappa))
            rows[g.TENSION, i] = half * chord
            rows[g.STATUS, i] = codes.CABLE_SOLVED
            rows[g.PARAMETER, i] = h
            continue
        force, status = from_length(model, span, rise, Material(density, asked.stiffness[i]), length)
        rows[g.HORIZONTAL, i] = force.horizontal
        rows[g.VERTICAL, i] = force.vertical
        rows[g.TENSION, i] = force.tension
        rows[g.STATUS, i] = status
        # h from tau = wD/(2 (h + kappa)), for the next pose
        h = 0.5 * weight * chord / force.tension - rows[g.KAPPA, i] if force.tension > 0.0 else math.nan
        rows[g.PARAMETER, i] = h
