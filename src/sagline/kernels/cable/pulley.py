"""A cable over the pulley at its frame anchor, and the cable between drum and pulley; docs/model.md, section 10.

The cable enters the pulley at the anchor A. The pulley swivels about the vertical axis through A, and is therefore in
the cable's vertical plane. The cable leaves the pulley at the point P in the direction of the force F_A = (T_x, T_zA)
at P. The position of P depends only on F_A. The model has no friction. H = T + T^2/(2 EA) - w z is therefore constant
along the whole cable. The derivative of the cable's energy with respect to its length is -H. With beta = w R/EA and E_A
= 1 + T_A/EA, the neglected terms on the pulley are of the order R beta^2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable.terms import Chord, Force, Material, Model, PlaneVector, Pulley
from sagline.kernels.jit import formula, kernel

# changes of a cable's parameters, in this order: L [m], w [N/m], EA [N], R [m], dead length [m]
Change = tuple[float, float, float, float, float]

LEAST_TURNED = -0.8  # smallest derivative in a Newton step; a derivative near -1 would turn the cable too far
LARGE = 0.5  # cosine of the largest step that is not halved: 60 degrees
VERTICAL = -0.999  # cosine of a step between the two directions of a vertical cable, which is not halved


class Wrap(NamedTuple):
    """Wrap of a cable on its pulley: angle psi [rad], its sine and its cosine."""

    sine: float
    cosine: float
    angle: float


@formula
def pulley_at(cables: Array, i: int) -> Pulley:
    """Pulley and dead length of cable `i` of the cable_table."""
    dead, rise = cables[i, tables.DEAD_CABLE], cables[i, tables.DEAD_RISE]
    return Pulley(cables[i, tables.PULLEY_RADIUS], cables[i, tables.ENTRY], dead, rise)


@formula
def is_aboard(cables: Array, i: int) -> bool:
    """True if the pulley of cable `i` of a cable_table with swivel axes is on the platform."""
    return cables[i, tables.ENTRY] == 0.0


@kernel
def robots_have_machine(robots: Array) -> bool:
    """True if a cable of any robot (1 or N, m, CABLE_COLUMNS) has a pulley or dead length."""
    for p in range(robots.shape[0]):
        for i in range(robots.shape[1]):
            if robots[p, i, tables.PULLEY_RADIUS] + robots[p, i, tables.DEAD_CABLE] > 0.0:
                return True
    return False


@formula
def free_span(pulley: Pulley, chord: Chord, cosine: float) -> float:
    """Horizontal distance [m] from exit point to platform end. `chord`: tangent to the pulley. `cosine`: cos psi."""
    return chord.length * chord.cosine + pulley.radius * (cosine - pulley.entry * chord.sine)


@formula
def free_rise(pulley: Pulley, chord: Chord, sine: float) -> float:
    """Height of the platform end above the exit point [m]. `sine`: sin psi."""
    return chord.length * chord.sine + pulley.radius * (pulley.entry * (chord.cosine - sine))


@formula
def exit_after(
    pulley: Pulley, weight: float, stiffness: float, force: tuple[float, float], before: tuple[float, float]
) -> tuple[float, float]:
    """Sine and cosine of the wrap angle after one Newton step."""
    # If the wrap angle grows by d, the free span becomes shorter by R d/E_A, and T_zA grows by the weight of this
    # length. Large steps are halved, because the exit point of a slack cable could otherwise move back and forth
    # without end.
    # force: T_x and T_zA of the cable at the wrap angle before the step.
    # The formula has no branches, so that loops over cables vectorize.
    horizontal, vertical_a = force
    tension = math.sqrt(horizontal * horizontal + vertical_a * vertical_a)
    inverse = 1.0 / tension
    # minus the derivative of the force's angle with respect to the wrap angle
    turned = pulley.entry * before[0] * weight * pulley.radius * inverse / (1.0 + tension / stiffness)
    share = 1.0 / (1.0 + max(turned, LEAST_TURNED))
    sine = before[0] + share * (horizontal * inverse - before[0])
    cosine = before[1] + share * (pulley.entry * vertical_a * inverse - before[1])
    inverse = 1.0 / math.sqrt(sine * sine + cosine * cosine)
    sine, cosine = sine * inverse, cosine * inverse
    turn = sine * before[0] + cosine * before[1]  # cosine of the angle of the step
    whole = turn >= LARGE or turn <= VERTICAL
    inverse = 1.0 / math.sqrt(2.0 + 2.0 * turn)
    sine = sine if whole else (before[0] + sine) * inverse
    cosine = cosine if whole else (before[1] + cosine) * inverse
    # false for a weightless cable without tension, or with a rounding error of it
    directed = tension > 0.0 and horizontal >= 0.0
    return sine if directed else before[0], cosine if directed else before[1]


@formula
def straight_behind(pulley: Pulley, chord: Chord) -> float:
    """Length of an unstrained cable [m] between the drum and the point where the chord touches the pulley."""
    return pulley.radius * angle(chord.cosine, pulley.entry * chord.sine) + pulley.dead


@formula
def from_axis(pulley: Pulley, chord: Chord) -> float:
    """Horizontal distance of the platform end from the swivel axis [m]."""
    return chord.length * chord.cosine + pulley.radius * (1.0 - pulley.entry * chord.sine)


@formula
def _strains(
    pulley: Pulley, weight: float, stiffness: float, tension: float, sine: float
) -> tuple[float, float, float]:
    """Stretch E = 1 + e (e: strain) at exit point, at the pulley's entry, and at the drum. `sine`: sin psi."""
    leaving = 1.0 + tension / stiffness
    entering = math.sqrt(leaving * leaving - 2.0 * pulley.entry * weight * pulley.radius / stiffness * sine)
    return leaving, entering, math.sqrt(entering * entering - 2.0 * weight * pulley.rise / stiffness)


@formula
def behind(pulley: Pulley, weight: float, stiffness: float, tension: float, wrap: Wrap) -> tuple[float, float]:
    """Unstrained lengths on the pulley and between drum and pulley. `tension`: at P [N]. `weight`: per length [N/m]."""
    strained, first, last = _strains(pulley, weight, stiffness, tension, wrap.sine)
    beta = weight * pulley.radius / stiffness
    falls = pulley.entry * beta * (1.0 - wrap.cosine - wrap.angle * wrap.sine)
    wrapped = pulley.radius * (wrap.angle - falls / (strained * strained)) / strained
    return wrapped, 2.0 * pulley.dead / (first + last)


@formula
def behind_cable(model: Model, material: Material, pulley: Pulley, tension: float, wrap: Wrap) -> tuple[float, float]:
    """`behind` for any model. Between P and drum, only an exact cable has weight. A straight cable does not stretch."""
    if model.code == codes.STRAIGHT:
        return pulley.radius * wrap.angle, pulley.dead
    weight = material.density * model.gravity if model.code == codes.CATENARY else 0.0
    return behind(pulley, weight, material.stiffness, tension, wrap)


@formula
def softness(pulley: Pulley, weight: float, stiffness: float, tension: float, wrap: Wrap) -> float:
    """Compliance S [m/N] of the cable between P and drum: length released per newton of H. P moves by E_A^2 S."""
    strained, first, last = _strains(pulley, weight, stiffness, tension, wrap.sine)
    on_pulley = pulley.radius * wrap.angle / (strained * strained * strained)
    return (on_pulley + 2.0 * pulley.dead / ((first + last) * first * last)) / stiffness


@formula
def energy_behind(pulley: Pulley, weight: float, stiffness: float, tension: float, wrap: Wrap, free: float) -> float:
    """Energy [J] of the cable between P and drum, plus energy to lift the free span (unstrained length `free`) to P."""
    radius, entry, dead, _rise = pulley
    strained, entering, drawn = _strains(pulley, weight, stiffness, tension, wrap.sine)
    first, last = entering - 1.0, drawn - 1.0
    height = entry * radius * wrap.sine
    whole = tension + 0.5 * tension * tension / stiffness - weight * height  # H
    wrapped, run = behind(pulley, weight, stiffness, tension, wrap)
    on_pulley = tension * wrap.angle + entry * weight * radius * (1.0 - wrap.cosine - wrap.angle * wrap.sine) / strained
    total = first + last
    on_run = total + total + total + 2.0 * (first * first + first * last + last * last)
    return (
        weight * free * height
        + radius * on_pulley
        + stiffness * dead * on_run / (3.0 * (2.0 + total))
        - whole * (wrapped + run)
    )


@formula
def _length_behind_by(
    pulley: Pulley, weight: float, stiffness: float, force: Force, free: float, change: Change, grown: float
) -> tuple[float, float]:
    """Changes of psi and of the unstrained length between P and drum, at a fixed force on the platform end."""
    # `weight`: weight per length [N/m]. `stiffness`: EA [N]. `free`: unstrained length of the free span [m]. `change`:
    # changes of the parameters (the length has no effect here). `grown`: increase of the free span's unstrained length.
    radius, entry, dead, rise = pulley
    _length, weight_by, stiffness_by, radius_by, dead_change = change
    vertical_a = force.vertical - weight * free
    tension = math.sqrt(force.horizontal * force.horizontal + vertical_a * vertical_a)
    sine, cosine = force.horizontal / tension, entry * vertical_a / tension
    wrapped = angle(sine, cosine)
    strained, first, last = _strains(pulley, weight, stiffness, tension, sine)
    cube = strained * strained * strained
    beta = weight * radius / stiffness
    vertical_by = -(free * weight_by + weight * grown)
    angle_by = -entry * sine / tension * vertical_by
    strained_by = (entry * cosine * vertical_by - (strained - 1.0) * stiffness_by) / stiffness
    beta_by = (weight_by * radius + weight * radius_by - beta * stiffness_by) / stiffness
    falls = 1.0 - cosine - wrapped * sine
    per_radius = wrapped / strained - entry * beta * falls / cube
    wrapped_by = radius_by * per_radius + radius * (
        angle_by * (1.0 / strained + entry * beta * wrapped * cosine / cube)
        - strained_by * (wrapped / (strained * strained) - 3.0 * entry * beta * falls / (cube * strained))
        - entry * falls * beta_by / cube
    )
    first_by = (strained * strained_by - entry * (beta_by * sine + beta * cosine * angle_by)) / first
    last_by = (first * first_by - rise * (weight_by - weight * stiffness_by / stiffness) / stiffness) / last
    total = first + last
    dead_by = 2.0 * (dead_change - dead * (first_by + last_by) / total) / total
    return angle_by, wrapped_by + dead_by


@kernel
def end_by(
    pulley: Pulley, material: Material, weight: float, force: Force, free: float, change: Change, by_weight: PlaneVector
) -> PlaneVector:
    """Motion of the platform end due to a change of cable data, at a fixed force on the end; docs/model.md, section 10.

    `by_weight`: motion per change of w at a fixed free length [m^2/N].
    """
    length_by, weight_by, stiffness_by, radius_by, _dead = change
    vertical_a = force.vertical - weight * free
    tension = math.sqrt(force.horizontal * force.horizontal + vertical_a * vertical_a)
    along_x, along_z = force.horizontal / tension, vertical_a / tension
    strained = 1.0 + tension / material.stiffness
    still = _length_behind_by(pulley, weight, material.stiffness, force, free, change, 0.0)[1]
    more = _length_behind_by(pulley, weight, material.stiffness, force, free, change, 1.0)[1] - still
    grown = (length_by - still) / (1.0 + more)
    turned = _length_behind_by(pulley, weight, material.stiffness, force, free, change, grown)[0]
    # cable enters the free span at P with the stretch E_A, and P moves along the tangent
    feed = strained * grown + pulley.radius * turned
    softer = -free * stiffness_by / (material.stiffness * material.stiffness)
    x = softer * force.horizontal + by_weight.x * weight_by
    z = softer * (force.vertical - 0.5 * weight * free) + by_weight.z * weight_by
    return PlaneVector(
        x + feed * along_x + radius_by * (1.0 - pulley.entry * along_z),
        z + feed * along_z + radius_by * pulley.entry * along_x,
    )
