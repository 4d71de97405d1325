"""Stiffness dT/dB of one cable, its potential energy, and dT/d(L, rho, EA); docs/model.md, section 6.

In the vertical plane of the cable the stiffness is a 2 x 2 matrix. Normal to the plane, the stiffness is T_x/x_B =
tau/D, which is regular on a vertical chord. For the weightless and the exact cable, the force on the platform end is
the gradient of an energy. The forces of the shallow models are not a gradient. The curl of the parabolic force is as
small as the model's error. A search with a shallow model starts from the equilibrium with the exact cable.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import atanhc_excess
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import across_pulley, energy_over, stiffness_in_series
from sagline.kernels.cable.models import (
    catenary_by_weight,
    sag_of_shallow,
    shallow_sag_force,
    slack_series,
    stretching_tension,
)
from sagline.kernels.cable.pulley import end_by
from sagline.kernels.cable.swivel import stiffness_of_swivel
from sagline.kernels.cable.terms import Force, Material, Model, PlaneStiffness, PlaneVector, Pulley, material_at
from sagline.kernels.jit import formula, kernel


@formula
def force_of(rows: Array, i: int) -> Force:
    """Force on the platform end of cable `i`."""
    return Force(rows[g.HORIZONTAL, i], rows[g.VERTICAL, i], rows[g.TENSION, i])


@formula
def _series_excess(
    horizontal: float, vertical_a: float, vertical: float, tension_a: float, tension_b: float, weight_length: float
) -> float:
    """Value of atanh(u)/u - 1, where u is the argument of the series in P1. Infinite for a folded cable."""
    u = weight_length / (tension_a + tension_b)
    if u <= 0.5:
        return atanhc_excess(u)
    return slack_series(horizontal, vertical_a, vertical, tension_a, tension_b) - 1.0


@formula
def catenary_stiffness(
    horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> PlaneStiffness:
    """In-plane stiffness of the exact cable: the inverse of dB/dT, in a form without cancellation."""
    # Let p, q and c be the coefficients of length/(T_A + T_B) in dx/dT_x, dz/dT_z and -dx/dT_z. Then p + q = 2 and p q
    # = c^2 hold exactly, so that the determinant is a sum of positive terms.
    vertical_a = vertical - weight * length
    square = horizontal * horizontal
    tension_a = math.sqrt(square + vertical_a * vertical_a)
    tension_b = math.sqrt(square + vertical * vertical)
    product = tension_a * tension_b
    excess = _series_excess(horizontal, vertical_a, vertical, tension_a, tension_b, weight * length)
    stretch = 1.0 / stiffness
    turn = 1.0 / (tension_a + tension_b)
    if product == 0.0:  # the force at one end of the cable is zero
        return PlaneStiffness(0.0, 0.0, 0.0, 1.0 / (length * (stretch + turn)))
    c = horizontal * (vertical_a + vertical) / product
    level = (square - vertical_a * vertical) / product
    if level >= 0.0:
        q = 1.0 + level
        p = c * c / q
    else:
        p = 1.0 - level
        q = c * c / p
    zz = stretch + turn * q
    if excess == math.inf:  # a folded cable does not resist small sideways motions
        return PlaneStiffness(0.0, 0.0, 0.0, 1.0 / (length * zz))
    xx = stretch + turn * (2.0 * excess + p)
    determinant = stretch * (stretch + 2.0 * turn * (1.0 + excess)) + 2.0 * turn * turn * q * excess
    inverse = 1.0 / (length * determinant)
    across = c * turn * inverse
    return PlaneStiffness(zz * inverse, across, across, xx * inverse)


@formula
def _elastic_stiffness(span: float, rise: float, length: float, tension: float, stiffness: float) -> PlaneStiffness:
    """In-plane stiffness of the weightless cable. Zero if the cable is slack."""
    if tension == 0.0:
        return PlaneStiffness(0.0, 0.0, 0.0, 0.0)
    chord = math.sqrt(span * span + rise * rise)
    cosine = span / chord
    sine = rise / chord
    along = stiffness / length
    across = tension / chord
    xx = along * cosine * cosine + across * sine * sine
    zz = along * sine * sine + across * cosine * cosine
    mixed = (along - across) * sine * cosine
    return PlaneStiffness(xx, mixed, mixed, zz)


@kernel
def _shallow_slopes(
    model: Model, span: float, rise: float, material: Material, length: float, tension: float
) -> tuple[float, float, float, float, float]:
    """Derivatives of tau of a shallow cable with respect to x_B, z_B [N/m], L [N/m], rho [N m/kg] and EA [1]."""
    # The derivatives follow from L (1 + s/EA) = D (1 + S/tau^2) with S = k (rho x_B)^2 and s = |T| (empirical) or tau
    # (parabolic).
    chord = math.sqrt(span * span + rise * rise)
    cosine = span / chord
    sine = rise / chord
    density, stiffness = material
    sag = sag_of_shallow(model, density * chord * cosine)
    sag_force = shallow_sag_force(model, chord, density) if model.code == codes.EMPIRICAL else 0.0
    stretch = stretching_tension(tension, sine, cosine, sag_force)
    square = tension * tension
    share = sag / square
    by_tension = length * (tension + sag_force * sine) / (stretch * stiffness) + 2.0 * chord * share / tension
    # derivative of s with respect to the chord at fixed tau: sin phi changes, and the sag force, which is proportional
    # to D
    by_sag_force = (sag_force + tension * sine) / stretch
    by_sine = tension * sag_force / stretch
    stretch_x = by_sag_force * sag_force * cosine / chord - by_sine * sine * cosine / chord
    stretch_z = by_sag_force * sag_force * sine / chord + by_sine * cosine * cosine / chord
    sag_x = 2.0 * sag_of_shallow(model, density) * span / square
    slope_x = (cosine * (1.0 + share) + chord * sag_x - length * stretch_x / stiffness) / by_tension
    slope_z = (sine * (1.0 + share) - length * stretch_z / stiffness) / by_tension
    slope_length = -(1.0 + stretch / stiffness) / by_tension
    slope_density = (2.0 * chord * share - length * by_sag_force * sag_force / stiffness) / (density * by_tension)
    slope_stiffness = length * stretch / (stiffness * stiffness * by_tension)
    return slope_x, slope_z, slope_length, slope_density, slope_stiffness


@formula
def _shallow_stiffness(
    model: Model, span: float, rise: float, material: Material, length: float, tension: float
) -> PlaneStiffness:
    """In-plane stiffness of a shallow cable. The matrix is not symmetric, because the forces are not a gradient."""
    by_x, by_z, _by_length, _by_density, _by_stiffness = _shallow_slopes(model, span, rise, material, length, tension)
    chord = math.sqrt(span * span + rise * rise)
    cosine = span / chord
    sine = rise / chord
    across = tension / chord
    unit_sag_force = shallow_sag_force(model, 1.0, material.density)
    return PlaneStiffness(
        by_x * cosine + across * sine * sine,
        by_z * cosine - across * sine * cosine,
        by_x * sine - across * sine * cosine + unit_sag_force * cosine,
        by_z * sine + across * cosine * cosine + unit_sag_force * sine,
    )


@formula
def cable_stiffness(
    model: Model, span: float, rise: float, material: Material, length: float, force: Force
) -> PlaneStiffness:
    """In-plane stiffness of a cable of any model. NaN for the straight cable."""
    if model.code == codes.STRAIGHT:
        return PlaneStiffness(math.nan, math.nan, math.nan, math.nan)
    weight = material.density * model.gravity
    if model.code == codes.CATENARY and weight > 0.0:
        return catenary_stiffness(force.horizontal, force.vertical, length, weight, material.stiffness)
    if model.code in (codes.CATENARY, codes.ELASTIC) or weight == 0.0:
        return _elastic_stiffness(span, rise, length, force.tension, material.stiffness)
    return _shallow_stiffness(model, span, rise, material, length, force.tension)


@formula
def _free_span_at(rows: Array, i: int, behind: bool | None) -> tuple[float, float, float]:
    """Span, rise and unstrained length [m] of the free span of cable `i`."""
    if behind is None:
        return rows[g.SPAN, i], rows[g.RISE, i], rows[g.LENGTH, i]
    return rows[g.FREE_SPAN, i], rows[g.FREE_RISE, i], rows[g.FREE_LENGTH, i]


@formula
def stiffnesses_in_plane(model: Model, cables: Array, rows: Array, behind: bool | None) -> None:
    """Fill the stiffness of every cable of a pose in its plane and normal to it, after `cable_forces`."""
    # With swivel axes of any direction, the stiffness is filled in world axes.
    for i in range(cables.shape[0]):
        if behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
            stiffness_of_swivel(model, cables, rows, i)
            continue
        span, rise, length = _free_span_at(rows, i, behind)
        plane = cable_stiffness(model, span, rise, material_at(cables, i), length, force_of(rows, i))
        rows[g.ACROSS, i] = rows[g.TENSION, i] / rows[g.CHORD, i]
        if behind is not None:
            plane = stiffness_in_series(model, cables, rows, i, plane)
            rows[g.ACROSS, i] = across_pulley(cables, rows, i)
        rows[g.XX, i], rows[g.XZ, i], rows[g.ZX, i], rows[g.ZZ, i] = plane


@formula
def plane_of(rows: Array, i: int) -> PlaneStiffness:
    """In-plane stiffness of cable `i`."""
    return PlaneStiffness(rows[g.XX, i], rows[g.XZ, i], rows[g.ZX, i], rows[g.ZZ, i])


@formula
def catenary_energy(span: float, rise: float, length: float, force: Force, weight: float, stiffness: float) -> float:
    """Strain energy plus potential energy [J] of the exact cable, V = T.B - C(T). The frame end has height 0."""
    horizontal, vertical, _ = force
    weight_length = weight * length
    vertical_a = vertical - weight_length
    square = horizontal * horizontal
    tension_a = math.sqrt(square + vertical_a * vertical_a)
    tension_b = math.sqrt(square + vertical * vertical)
    total = tension_a + tension_b
    half_mean = tension_a + vertical * (2.0 * vertical - weight_length) / total
    if horizontal != 0.0:
        excess = _series_excess(horizontal, vertical_a, vertical, tension_a, tension_b, weight_length)
        half_mean += 2.0 * square / total * (1.0 + excess)
    strain = square + vertical * (vertical - weight_length) + weight_length * weight_length / 3.0
    return horizontal * span + vertical * rise - 0.5 * length * (strain / stiffness + half_mean)


@formula
def elastic_energy(chord: float, length: float, tension: float, stiffness: float) -> float:
    """Strain energy [J] of the weightless cable; zero if it is slack."""
    return 0.5 * tension * (chord - length) if tension > 0.0 else 0.0


@formula
def _cable_energy(model: Model, span: float, rise: float, material: Material, length: float, force: Force) -> float:
    """Energy [J] of a cable with the exact or a weightless model. NaN for other models."""
    weight = material.density * model.gravity
    if model.code == codes.CATENARY and weight > 0.0:
        return catenary_energy(span, rise, length, force, weight, material.stiffness)
    if model.code in (codes.CATENARY, codes.ELASTIC) or weight == 0.0:
        return elastic_energy(math.sqrt(span * span + rise * rise), length, force.tension, material.stiffness)
    return math.nan


@formula
def energy_of_cables(model: Model, cables: Array, rows: Array, behind: bool | None) -> tuple[float, float]:
    """Energy [J] of all cables of a pose, and the sum of the magnitudes of its terms."""
    # `behind` is `Model.behind` as a separate argument. If `behind` is None, the code for pulleys is not compiled.
    energy = 0.0
    size = 0.0
    for i in range(cables.shape[0]):
        span, rise, length = _free_span_at(rows, i, behind)
        force = force_of(rows, i)
        energy += _cable_energy(model, span, rise, material_at(cables, i), length, force)
        size += abs(force.horizontal * span) + abs(force.vertical * rise)
        if behind is not None:
            more = energy_over(model, cables, rows, i)
            energy += more
            size += abs(more)
    return energy, size


class _ForceSlopes(NamedTuple):
    """Derivatives of the force on the platform end with respect to cable parameters, with both ends fixed."""

    by_length: PlaneVector  # dT/dL [N/m]
    by_density: PlaneVector  # dT/d(rho) [N m/kg]
    by_stiffness: PlaneVector  # dT/d(EA) [1]
    by_radius: PlaneVector  # dT/dR of the pulley [N/m]
    by_dead: PlaneVector  # dT/d(dead length) [N/m]


@formula
def force_change(plane: PlaneStiffness, end: PlaneVector) -> PlaneVector:
    """Change of the force on a fixed platform end: -`plane` (stiffness) times `end` (motion of a free end)."""
    return PlaneVector(-(plane.xx * end.x + plane.xz * end.z), -(plane.zx * end.x + plane.zz * end.z))


@formula
def _catenary_by_length(
    horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> PlaneVector:
    """Motion of the platform end per meter of cable that enters at the frame end, at fixed force."""
    vertical_a = vertical - weight * length
    grown = 1.0 / math.sqrt(horizontal * horizontal + vertical_a * vertical_a) + 1.0 / stiffness
    return PlaneVector(grown * horizontal, grown * vertical_a)


@formula
def force_by_length(
    model: Model, span: float, rise: float, material: Material, length: float, force: Force, plane: PlaneStiffness
) -> PlaneVector:
    """dT/dL [N/m] of a cable of the exact or the weightless model. Zero for a slack weightless cable."""
    weight = material.density * model.gravity
    if model.code == codes.CATENARY and weight > 0.0:
        end = _catenary_by_length(force.horizontal, force.vertical, length, weight, material.stiffness)
        return force_change(plane, end)
    if force.tension == 0.0:
        return PlaneVector(0.0, 0.0)
    along = -material.stiffness / (length * length)  # derivative of tau, divided by the parts x and z of the chord
    return PlaneVector(along * span, along * rise)


@formula
def _shallow_force_slopes(
    model: Model, span: float, rise: float, material: Material, length: float, tension: float
) -> _ForceSlopes:
    """Derivatives of the force of a shallow cable with respect to L, rho and EA."""
    _x, _z, by_length, by_density, by_stiffness = _shallow_slopes(model, span, rise, material, length, tension)
    chord = math.hypot(span, rise)
    cosine = span / chord
    sine = rise / chord
    sag_force, none = shallow_sag_force(model, chord, 1.0), PlaneVector(0.0, 0.0)
    return _ForceSlopes(
        PlaneVector(by_length * cosine, by_length * sine),
        PlaneVector(by_density * cosine, by_density * sine + sag_force),
        PlaneVector(by_stiffness * cosine, by_stiffness * sine),
        none,
        none,
    )


@formula
def force_slopes(
    model: Model, span: float, rise: float, material: Material, length: float, force: Force, plane: PlaneStiffness
) -> _ForceSlopes:
    """Derivatives of the force of a cable without pulley, for any model except the straight cable."""
    horizontal, vertical, tension = force
    stiffness, none = material.stiffness, PlaneVector(0.0, 0.0)
    weight = material.density * model.gravity
    if model.code not in (codes.CATENARY, codes.ELASTIC) and weight > 0.0:
        return _shallow_force_slopes(model, span, rise, material, length, tension)
    by_length = force_by_length(model, span, rise, material, length, force, plane)
    if model.code == codes.CATENARY and weight > 0.0:
        by_weight = force_change(plane, catenary_by_weight(horizontal, vertical, length, weight, stiffness))
        by_density = PlaneVector(model.gravity * by_weight.x, model.gravity * by_weight.z)
        soft = -length / (stiffness * stiffness)
        stretched = PlaneVector(soft * horizontal, soft * (vertical - 0.5 * weight * length))
        return _ForceSlopes(by_length, by_density, force_change(plane, stretched), none, none)
    along = tension / (stiffness * math.hypot(span, rise))
    return _ForceSlopes(by_length, none, PlaneVector(along * span, along * rise), none, none)


@formula
def slopes_over(
    model: Model, material: Material, pulley: Pulley, free: float, force: Force, plane: PlaneStiffness
) -> _ForceSlopes:
    """Derivatives of the force of a cable over a pulley, for shallow and exact cables."""
    # `free`: unstrained length of the free span [m].
    weight = 0.0 if model.code == codes.ELASTIC else material.density * model.gravity
    by_weight = none = PlaneVector(0.0, 0.0)
    if weight > 0.0:
        by_weight = catenary_by_weight(force.horizontal, force.vertical, free, weight, material.stiffness)
    if force.horizontal == 0.0 and force.vertical == weight * free:  # the force at the exit point P is zero
        return _ForceSlopes(none, none, none, none, none)
    heavier = model.gravity if weight > 0.0 else 0.0
    length = end_by(pulley, material, weight, force, free, (1.0, 0.0, 0.0, 0.0, 0.0), by_weight)
    density = end_by(pulley, material, weight, force, free, (0.0, heavier, 0.0, 0.0, 0.0), by_weight)
    stiffness = end_by(pulley, material, weight, force, free, (0.0, 0.0, 1.0, 0.0, 0.0), by_weight)
    radius = end_by(pulley, material, weight, force, free, (0.0, 0.0, 0.0, 1.0, 0.0), by_weight)
    dead = end_by(pulley, material, weight, force, free, (0.0, 0.0, 0.0, 0.0, 1.0), by_weight)
    return _ForceSlopes(
        force_change(plane, length),
        force_change(plane, density),
        force_change(plane, stiffness),
        force_change(plane, radius),
        force_change(plane, dead),
    )
