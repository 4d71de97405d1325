"""In-plane derivatives of the force on a platform end with respect to L, rho and EA, with both ends fixed."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.kernels import codes
from sagline.kernels.algebra.functions import atanhc_excess
from sagline.kernels.cable.catenary import slack_series
from sagline.kernels.cable.models import shallow_sag_force
from sagline.kernels.cable.pulley import Change, EndMotion, Pulley, end_by
from sagline.kernels.cable.stiffness import shallow_slopes
from sagline.kernels.cable.terms import Force, Material, Model, PlaneStiffness
from sagline.kernels.jit import formula


class PlaneVector(NamedTuple):
    """Horizontal and vertical part in the cable's plane."""

    x: float
    z: float


class _ForceSlopes(NamedTuple):
    """Derivatives of the force on the platform end: dT/dL [N/m], dT/d(rho) [N m/kg], dT/d(EA) [1]."""

    by_length: PlaneVector
    by_density: PlaneVector
    by_stiffness: PlaneVector


class _MachineSlopes(NamedTuple):
    """Derivatives of the force on the platform end with respect to R and dead length [N/m]."""

    by_radius: PlaneVector
    by_dead: PlaneVector


@formula
def force_change(plane: PlaneStiffness, end: PlaneVector) -> PlaneVector:
    """Change of the force if the platform end is fixed: minus the stiffness `plane` times the free motion `end`."""
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
def _catenary_by_weight(
    horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> PlaneVector:
    """Motion of the platform end per change of the weight per length, at fixed force [m^2/N]."""
    vertical_a = vertical - weight * length
    tension_a = math.hypot(horizontal, vertical_a)
    total = tension_a + math.hypot(horizontal, vertical)
    u = weight * length / total
    if u <= 0.5:
        excess = atanhc_excess(u)
    else:
        excess = slack_series(horizontal, vertical_a, vertical, tension_a, total - tension_a) - 1.0
    total_w = -length * vertical_a / tension_a
    u_w = (length - u * total_w) / total
    x_w = 0.0
    if horizontal != 0.0:
        bend = (u * u / (1.0 - u * u) - excess) / u if u > 1e-8 else 2.0 / 3.0 * u
        x_w = 2.0 * horizontal * length * (bend * u_w - (1.0 + excess) * total_w / total) / total
    middle = vertical - 0.5 * weight * length
    z_w = -0.5 * length * length * (1.0 / stiffness + 2.0 / total) - 2.0 * middle * length * total_w / (total * total)
    return PlaneVector(x_w, z_w)


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
    along = -material.stiffness / (length * length)  # derivative of tau, divided by x and z of the chord
    return PlaneVector(along * span, along * rise)


@formula
def _shallow_force_slopes(
    model: Model, span: float, rise: float, material: Material, length: float, tension: float
) -> _ForceSlopes:
    """Derivatives of the force of a shallow cable with respect to L, rho and EA."""
    slopes = shallow_slopes(model, span, rise, material, length, tension)
    chord = math.hypot(span, rise)
    cosine = span / chord
    sine = rise / chord
    sag_force = shallow_sag_force(model, chord, 1.0)
    return _ForceSlopes(
        PlaneVector(slopes.by_length * cosine, slopes.by_length * sine),
        PlaneVector(slopes.by_density * cosine, slopes.by_density * sine + sag_force),
        PlaneVector(slopes.by_stiffness * cosine, slopes.by_stiffness * sine),
    )


@formula
def force_slopes(
    model: Model, span: float, rise: float, material: Material, length: float, force: Force, plane: PlaneStiffness
) -> _ForceSlopes:
    """Derivatives of the force with respect to L, rho and EA, for any model except the straight cable."""
    horizontal, vertical, tension = force
    stiffness = material.stiffness
    weight = material.density * model.gravity
    if model.code not in (codes.CATENARY, codes.ELASTIC) and weight > 0.0:
        return _shallow_force_slopes(model, span, rise, material, length, tension)
    by_length = force_by_length(model, span, rise, material, length, force, plane)
    if model.code == codes.CATENARY and weight > 0.0:
        by_weight = force_change(plane, _catenary_by_weight(horizontal, vertical, length, weight, stiffness))
        soft = -length / (stiffness * stiffness)
        stretched = PlaneVector(soft * horizontal, soft * (vertical - 0.5 * weight * length))
        return _ForceSlopes(
            by_length,
            PlaneVector(model.gravity * by_weight.x, model.gravity * by_weight.z),
            force_change(plane, stretched),
        )
    along = tension / (stiffness * math.hypot(span, rise))
    return _ForceSlopes(by_length, PlaneVector(0.0, 0.0), PlaneVector(along * span, along * rise))


@formula
def slopes_over(
    model: Model, material: Material, pulley: Pulley, free: float, force: Force, plane: PlaneStiffness
) -> tuple[_ForceSlopes, _MachineSlopes]:
    """Derivatives of the force with respect to L, rho, EA, R and dead length, for shallow and exact cables.

    free: unstrained length of the free span [m].
    """
    weight = 0.0 if model.code == codes.ELASTIC else material.density * model.gravity
    by_weight = EndMotion(0.0, 0.0)
    if weight > 0.0:
        x, z = _catenary_by_weight(force.horizontal, force.vertical, free, weight, material.stiffness)
        by_weight = EndMotion(x, z)
    if force.horizontal == 0.0 and force.vertical == weight * free:  # there is no force at P
        none = PlaneVector(0.0, 0.0)
        return _ForceSlopes(none, none, none), _MachineSlopes(none, none)
    heavier = model.gravity if weight > 0.0 else 0.0
    length = end_by(pulley, material, weight, force, free, Change(1.0, 0.0, 0.0, 0.0, 0.0), by_weight)
    density = end_by(pulley, material, weight, force, free, Change(0.0, heavier, 0.0, 0.0, 0.0), by_weight)
    stiffness = end_by(pulley, material, weight, force, free, Change(0.0, 0.0, 1.0, 0.0, 0.0), by_weight)
    radius = end_by(pulley, material, weight, force, free, Change(0.0, 0.0, 0.0, 1.0, 0.0), by_weight)
    dead = end_by(pulley, material, weight, force, free, Change(0.0, 0.0, 0.0, 0.0, 1.0), by_weight)
    return (
        _ForceSlopes(
            force_change(plane, PlaneVector(length.x, length.z)),
            force_change(plane, PlaneVector(density.x, density.z)),
            force_change(plane, PlaneVector(stiffness.x, stiffness.z)),
        ),
        _MachineSlopes(
            force_change(plane, PlaneVector(radius.x, radius.z)), force_change(plane, PlaneVector(dead.x, dead.z))
        ),
    )
