"""Cables at chord tensions: length ratios, sag forces, lengths off the drums, and admissible tensions.

The admissible tensions of a cable at a pose form one interval for all tests of feasibility; docs/model.md, section 5.
The ends of the interval follow from the robot's limits, a limit of the sag and a limit of the stretch. Limits of the
frame-end tension are converted to limits of the chord tension. As the chord tension grows, the frame-end tension first
falls and then rises. Usually the interval contains only tensions on the rising side. If no frame-end tension is below
the lower limit, the interval also contains tensions on the falling side.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes
from sagline.kernels import codes
from sagline.kernels.algebra.factors import copy
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable import models
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.pulley import Wrap, behind_cable, exit_after, free_rise, free_span, from_axis, pulley_at
from sagline.kernels.cable.terms import (
    Cables,
    Chord,
    Material,
    Model,
    Pulley,
    Terms,
    chord_at,
    chord_of,
    free_chord_of,
    material_at,
    material_of,
    model_of,
    pulley_of,
)
from sagline.kernels.jit import entry, formula, glue, independent, kernel

# Largest relative change of tension after which one Newton step from the last ratio is sufficient. The relative error
# of the ratio is then 3e-8 at X = 2 and 5e-15 at X = 0.01. The error is proportional to the square of the change, so
# that converged iterations have full precision.
NEAR = 1e-3
CONTACTS = 40  # largest number of passes for the exit point; for a taut cable, three are sufficient
SAME_EXIT = 1e-9  # largest change of the exit direction after convergence; the remaining error is its square
LIMIT_STEPS = 30
LIMIT_PRECISION = 1e-13  # relative
LIMIT_MISS = 1e-6  # relative tolerance, larger than the remaining error of a slack cable after all passes
SECANT = 1e-6  # smallest relative step of a secant; the slope of a shorter secant would be mostly rounding error
TAUT = 1.25  # chord tension in units of wD/2 that is larger than the chord tension with the least frame-end tension


@glue
def _fill_exit_points(model: Model, cables: Cables, fresh: bool) -> float:
    """Fill the free spans and their tensions. The exit points follow from the forces at the pulleys."""
    # The forces are computed from the chord tensions and from the last lengths and sag forces. If `fresh` is true, no
    # lengths and sag forces exist yet, and first-order values are used. Cables of the shallow models leave the pulley
    # along their chord. Returns the largest change of an exit direction.
    # Loops without branches, which vectorize, compute all cables.
    m = cables.tau.size
    change = 0.0
    if fresh or model.code != codes.CATENARY:
        for i in range(m):
            cables.wrap_sine[i] = cables.cosine[i]  # direction of the tangent
            cables.wrap_cosine[i] = cables.entry[i] * cables.sine[i]
    if fresh:
        copy(cables.half_weight, cables.sag_force)
        copy(cables.chord, cables.free_chord)
        cables.ratio[:] = 1.0
    if model.code == codes.CATENARY:
        turned = cables.strain  # changes of the directions; the strains are filled later
        for i in independent(m):
            weight = cables.density[i] * model.gravity
            horizontal = cables.tau[i] * cables.cosine[i]
            hanging = cables.sag_force[i] - weight * cables.ratio[i] * cables.free_chord[i]
            vertical_a = cables.tau[i] * cables.sine[i] + hanging
            before = (cables.wrap_sine[i], cables.wrap_cosine[i])
            sine, cosine = exit_after(
                pulley_of(cables, i), weight, cables.stiffness[i], (horizontal, vertical_a), before
            )
            turned[i] = abs(sine - before[0]) + abs(cosine - before[1])
            cables.wrap_sine[i] = sine
            cables.wrap_cosine[i] = cosine
        for i in range(m):
            change = max(change, turned[i])
    for i in independent(m):
        chord, pulley = chord_of(cables, i), pulley_of(cables, i)
        span, rise = free_span(pulley, chord, cables.wrap_cosine[i]), free_rise(pulley, chord, cables.wrap_sine[i])
        length = math.sqrt(span * span + rise * rise)
        inverse = 1.0 / length
        cables.free_chord[i] = length
        cables.free_sine[i] = rise * inverse
        cables.free_cosine[i] = span * inverse
        cables.free_tau[i] = cables.tau[i] * chord.cosine / span * length
        cables.free_half_weight[i] = 0.5 * cables.density[i] * model.gravity * length
    return change


@glue
def solve_cable_states(model: Model, cables: Cables, fresh: bool, near: bool, statuses: Codes) -> tuple[int, float]:
    """Fill slackness, strain, ratio and sag force of all cables, and the statuses (m,), at their chord tensions."""
    # Loops without branches, which vectorize, solve ordinary catenaries. The cables that are not ordinary are then
    # solved one by one. The exit points follow from the previous lengths and sag forces.
    # `fresh`: True if lengths and sag forces do not exist yet. `near`: True if the tensions have changed by less than
    # NEAR since the last ratios. `statuses`: filled. Returns the most serious status, and the largest change of the
    # direction in which a cable leaves its pulley.
    m = cables.tau.size
    change = _fill_exit_points(model, cables, fresh) if cables.machine else 0.0
    near = near and change < NEAR
    for i in range(m):
        cables.slackness[i] = cables.free_half_weight[i] / cables.free_tau[i]
    for i in range(m):
        cables.strain[i] = cables.free_tau[i] / cables.stiffness[i]
    if model.code == codes.CATENARY:
        stretched = 0
        if not near:
            for i in range(m):
                cables.ratio[i] = models.ordinary_length_ratio(
                    cables.slackness[i], cables.free_sine[i], cables.free_cosine[i], cables.strain[i]
                )
            for i in range(m):
                stretched += 1 if cables.strain[i] > models.TAUT_STRAIN else 0
        if near or stretched > 0:
            for i in range(m):
                cables.ratio[i] = models.ordinary_length_ratio_near(
                    cables.slackness[i], cables.free_sine[i], cables.free_cosine[i], cables.strain[i], cables.ratio[i]
                )
        for i in range(m):
            cables.free_sag_force[i] = cables.free_tau[i] * models.ordinary_sag_force_ratio(
                cables.slackness[i], cables.free_sine[i], cables.strain[i], cables.ratio[i]
            )
    gravest = codes.CABLE_SOLVED
    for i in range(m):
        statuses[i] = codes.CABLE_SOLVED
        if model.code != codes.CATENARY or not models.is_ordinary(cables.slackness[i], cables.strain[i]):
            free = free_chord_of(cables, i)
            length, sag_force, status = models.from_tension(model, free, material_of(cables, i), cables.free_tau[i])
            cables.ratio[i] = length / free.length
            cables.free_sag_force[i] = sag_force
            statuses[i] = status
            gravest = max(gravest, status)
    if cables.machine:
        for i in range(m):
            vertical = cables.free_tau[i] * cables.free_sine[i] + cables.free_sag_force[i]
            cables.sag_force[i] = vertical - cables.tau[i] * cables.sine[i]
    return gravest, change


@kernel
def solve_cable_state(
    model: Model, chord: Chord, material: Material, pulley: Pulley, tau: float
) -> tuple[float, float, int]:
    """Free unstrained length [m], sag force T_z - tau sin phi [N] and status of a cable at the chord tension `tau`."""
    length, sag_force, status = models.from_tension(model, chord, material, tau)
    if pulley.radius > 0.0 and model.code == codes.CATENARY:
        horizontal, weight = tau * chord.cosine, material.density * model.gravity
        sine, cosine = chord.cosine, pulley.entry * chord.sine
        for _ in range(CONTACTS):
            force, before = (horizontal, tau * chord.sine + sag_force - weight * length), (sine, cosine)
            sine, cosine = exit_after(pulley, weight, material.stiffness, force, before)
            span, rise = free_span(pulley, chord, cosine), free_rise(pulley, chord, sine)
            line = math.sqrt(span * span + rise * rise)
            free = Chord(line, rise / line, span / line)
            length, own, status = models.from_tension(model, free, material, horizontal / free.cosine)
            sag_force = horizontal / free.cosine * free.sine + own - tau * chord.sine
            if not abs(sine - before[0]) + abs(cosine - before[1]) > SAME_EXIT:
                break
    return length, sag_force, status


@kernel
def frame_end_tension(model: Model, chord: Chord, material: Material, pulley: Pulley, tau: float) -> float:
    """Tension [N] at the frame end of a cable's free span, at the chord tension `tau`."""
    if model.code == codes.STRAIGHT or model.code == codes.ELASTIC:
        return tau
    length, sag_force, _status = solve_cable_state(model, chord, material, pulley, tau)
    return math.hypot(tau * chord.cosine, tau * chord.sine + sag_force - material.density * model.gravity * length)


@kernel
def chord_tension_at_frame_end(model: Model, chord: Chord, material: Material, pulley: Pulley, tension: float) -> float:
    """Chord tension at which the tension at the frame end is `tension`, on the taut side."""
    # If every frame-end tension is larger, the result is the chord tension at which a parabola has its least frame-end
    # tension.
    loosest = 0.5 * material.density * model.gravity * chord.length * chord.sine
    return taut_at_frame_end(model, chord, material, pulley, tension, max(loosest, 0.0))


@kernel
def taut_at_frame_end(
    model: Model, chord: Chord, material: Material, pulley: Pulley, tension: float, otherwise: float
) -> float:
    """Chord tension at which the tension at the frame end is `tension`, on the taut side."""
    # The frame-end tension of a sagging cable has a least value, at most 3/4 wD cos(phi). The frame-end tension is a
    # convex function of the chord tension, with a slope of at most 1 + wD/EA. Secant steps from the taut side therefore
    # descend to the root, or to the least frame-end tension.
    # `tension`: frame-end tension [N]. `otherwise`: value to return if every frame-end tension is larger.
    weight = material.density * model.gravity
    if model.code == codes.STRAIGHT or model.code == codes.ELASTIC or weight == 0.0 or tension == math.inf:
        return tension
    half = 0.5 * weight * chord.length
    along, across = half * chord.sine, half * chord.cosine
    tau = max(along + math.sqrt(max(tension * tension - across * across, 0.0)), TAUT * half)
    before, before_value, slope = 0.0, 0.0, 1.0 + 2.0 * half / material.stiffness
    miss = math.inf
    for k in range(LIMIT_STEPS):
        value = frame_end_tension(model, chord, material, pulley, tau)
        if k > 0 and abs(tau - before) > SECANT * tau:
            slope = (value - before_value) / (tau - before)
        if not slope > 0.0:
            break
        before, before_value, miss = tau, value, value - tension
        tau = max(tau - miss / slope, 0.5 * tau)
        if abs(tau - before) <= LIMIT_PRECISION * tau:
            break
    return before if abs(miss) <= LIMIT_MISS * tension else otherwise


@kernel
def hold_cable(
    model: Model, chord: Chord, material: Material, pulley: Pulley, tau: float
) -> tuple[float, float, float]:
    """Length off the drum [m], sag force [N] and frame-end tension [N] of a cable at the chord tension `tau`."""
    weightless = model.code == codes.STRAIGHT or model.code == codes.ELASTIC
    weight = 0.0 if weightless else material.density * model.gravity
    length, sag_force, _status = solve_cable_state(model, chord, material, pulley, tau)
    horizontal, vertical = tau * chord.cosine, tau * chord.sine + sag_force - weight * length
    tension = math.sqrt(horizontal * horizontal + vertical * vertical)
    # in the shallow models, a cable leaves its pulley along the chord, and has the chord tension between chord and drum
    sine, cosine, there = chord.cosine, pulley.entry * chord.sine, tau
    if model.code == codes.CATENARY:
        there = tension
        sine, cosine = horizontal / there, pulley.entry * vertical / there
    wrapped, dead = behind_cable(model, material, pulley, there, Wrap(sine, cosine, angle(sine, cosine)))
    return length + (wrapped + dead), sag_force, tension


@entry
def lengths_at_frame_ends(
    terms: Terms,
    cables: Array,
    body: Array,
    pose: Array,
    tension: Array,
    tension_out: Array,
    length_out: Array,
    rotation: Array,
    geometry: Array,
) -> None:
    """Unstrained lengths off the drums [m] of cables at a pose; each cable is computed separately."""
    # `tension`: tensions at the frame ends [N], (m,). `tension_out`: filled with the frame-end tensions at the found
    # lengths [N], (m,). If a given tension is below the least possible tension, the result differs from it.
    # `length_out`: filled with the lengths [m], (m,). `rotation`, `geometry`: work arrays, (3, 3) and (GEOMETRY_ROWS,
    # m).
    model = model_of(terms)
    cable_geometry(cables, body, pose, rotation, geometry)
    for i in range(tension.size):
        chord, material, pulley = chord_at(geometry, i), material_at(cables, i), pulley_at(cables, i)
        tau = chord_tension_at_frame_end(model, chord, material, pulley, tension[i])
        length_out[i], _sag_force, tension_out[i] = hold_cable(model, chord, material, pulley, tau)


LOOSEST = 5.0  # largest X = wD/(2 tau): a cable that is fifteen times as long as its chord and almost without tension
# Largest strain: the cable is twice as long as without tension. It applies if the robot has no upper limit.
LARGEST_STRAIN = 1.0
SMALLEST = 1e-100  # smallest chord tension of a catenary without weight [N]; the equations divide by this tension
SECTIONS = 80  # steps of the search for the smallest admissible tension of a slack cable
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
PRECISION = 1e-14  # relative


class TensionLimits(NamedTuple):
    """Limits of the tensions."""

    quantity: int  # code of the tension to which the robot's limits apply
    # T_adj [N] of the article's bound (54), T_x > w D/(2 |tan phi|) + T_adj; NaN if the bound does not apply
    validity: float


@formula
def _sags(model: Model, half_weight: float) -> bool:
    """True if a cable sags, which means an infinite length at zero tension. `half_weight`: wD/2 [N]."""
    return half_weight > 0.0 and model.code != codes.STRAIGHT and model.code != codes.ELASTIC


@formula
def least_of_sag(model: Model, half_weight: float) -> float:
    """Smallest chord tension that the limit of the sag admits [N]."""
    if _sags(model, half_weight):
        return half_weight / LOOSEST
    return SMALLEST if model.code == codes.CATENARY else 0.0


@formula
def _largest_of_strain(model: Model, stiffness: float) -> float:
    """Largest chord tension of a cable without an upper limit [N]."""
    return LARGEST_STRAIN * stiffness if model.code != codes.STRAIGHT else math.inf


@formula
def is_limited_by_strain(cables: Cables, i: int) -> bool:
    """True if the largest strain determines the largest admissible tension of cable `i`."""
    return cables.high[i] == LARGEST_STRAIN * cables.stiffness[i]


@glue
def cable_without_tension(cables: Cables) -> int:
    """Index of the first cable without admissible tensions; -1 if all cables have admissible tensions."""
    # With the article's bound (54), a horizontal cable has no admissible tension.
    for i in range(cables.low.size):
        if not (cables.low[i] <= cables.high[i] and cables.low[i] < math.inf):
            return i
    return -1


@formula
def _slackness_beside_axis(chord: Chord, pulley: Pulley) -> float:
    """Smallest 1/X of a cable whose platform end is above the pulley and nearer to the swivel axis than its diameter.

    A slack cable leaves the pulley farther from the axis than a taut one, and cannot leave it beyond the platform end.
    To first order, this bound keeps half the horizontal distance between the two ends. It is zero for other cables.
    """
    span = chord.length * chord.cosine
    away = max(from_axis(pulley, chord) - 0.5 * span, SAME_EXIT * pulley.radius)
    if not (min(pulley.entry, chord.sine) > 0.0 and away < 2.0 * pulley.radius):
        return 0.0
    cosine = 1.0 - away / pulley.radius
    sine = math.sqrt(1.0 - cosine * cosine)
    return sine / (chord.sine * sine - chord.cosine * cosine)


@glue
def fill_admissible_tensions(
    model: Model, limits: TensionLimits, low: float, high: float, cables: Cables, i: int
) -> None:
    """Fill the smallest and largest admissible chord tension of cable `i`; smallest > largest if none is admissible."""
    # `low`, `high`: limits of the robot [N]; the upper limit may be infinite.
    half_weight = cables.half_weight[i]
    # the free span of a slack cable over a pulley can be longer than the tangent by one diameter
    floor = least_of_sag(model, half_weight + cables.density[i] * model.gravity * cables.radius[i])
    chord, material, pulley = chord_of(cables, i), material_of(cables, i), pulley_of(cables, i)
    if _sags(model, half_weight):
        floor = max(floor, half_weight * _slackness_beside_axis(chord, pulley))
    if limits.quantity == codes.LIMITS_OF_FRAME_END and _sags(model, half_weight):
        low, high = _limits_at_chord(model, chord, material, pulley, low, high, floor)
    if high == math.inf:
        high = _largest_of_strain(model, cables.stiffness[i])
    if not math.isnan(limits.validity):
        # the horizontal tension T_x of a vertical cable is zero, which also satisfies a T_adj of zero
        margin = limits.validity / cables.cosine[i] if limits.validity > 0.0 else 0.0
        low = max(low, half_weight / abs(cables.sine[i]) + margin)
    cables.low[i] = max(low, floor)
    cables.high[i] = high


@kernel
def _limits_at_chord(
    model: Model, chord: Chord, material: Material, pulley: Pulley, low: float, high: float, floor: float
) -> tuple[float, float]:
    """Convert limits of the frame-end tension to limits of the chord tension [N]."""
    # Returns infinity and zero if the frame-end tension is above its upper limit at every chord tension.
    largest = taut_at_frame_end(model, chord, material, pulley, high, -1.0)
    if largest < 0.0:
        return math.inf, 0.0
    least = taut_at_frame_end(model, chord, material, pulley, low, -1.0) if low > 0.0 else -1.0
    if least < 0.0:
        least = _slackest_at_frame_end(model, chord, material, pulley, high, floor, largest)
    return least, largest


@kernel
def _slackest_at_frame_end(
    model: Model, chord: Chord, material: Material, pulley: Pulley, tension: float, floor: float, taut: float
) -> float:
    """Smallest chord tension [N] of the range in which the frame-end tension is at most `tension`."""
    # A golden-section search finds a chord tension inside the range. A second search finds the range's lower end.
    # `floor`: lower bound of the result [N]. `taut`: largest chord tension of the range, on the rising side [N].
    if tension == math.inf or frame_end_tension(model, chord, material, pulley, floor) <= tension:
        return min(floor, taut)
    low, high = math.log(floor), math.log(taut)
    a, b = low, high
    c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    at_c = frame_end_tension(model, chord, material, pulley, math.exp(c))
    at_d = frame_end_tension(model, chord, material, pulley, math.exp(d))
    for _ in range(SECTIONS):
        if at_c < tension or at_d < tension or not b - a > PRECISION:
            break
        if at_c < at_d:
            b, d, at_d = d, c, at_c
            c = b - GOLDEN * (b - a)
            at_c = frame_end_tension(model, chord, material, pulley, math.exp(c))
        else:
            a, c, at_c = c, d, at_d
            d = a + GOLDEN * (b - a)
            at_d = frame_end_tension(model, chord, material, pulley, math.exp(d))
    if not (at_c < tension or at_d < tension):
        return taut
    high = c if at_c < tension else d
    for _ in range(SECTIONS):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        if frame_end_tension(model, chord, material, pulley, math.exp(middle)) > tension:
            low = middle
        else:
            high = middle
    return math.exp(high)
