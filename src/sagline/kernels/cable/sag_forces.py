"""Sag forces T_z - tau sin phi of the cables of one pose, as functions of their chord tensions.

If the platform end of a cable is below its frame end, its sag force is not monotone in the tension. The sag force falls
while the sag is deep, rises while the sag becomes shallow, and falls again because of the stretch. On a range of
tensions, the largest and the smallest sag force are at an end of the range or at an extremum. The sag force has at most
two extrema; docs/model.md, section 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes
from sagline.kernels import codes
from sagline.kernels.algebra.factors import copy
from sagline.kernels.cable.models import shallow_sag_force
from sagline.kernels.cable.states import CONTACTS, SAME_EXIT, solve_cable_state, solve_cable_states
from sagline.kernels.cable.terms import Cables, Model, chord_of, material_of, pulley_of
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block

SLOPE_STEP = 1e-4  # relative step of the central difference of the sag force
SHRINKINGS = 30
TURN_ERROR = 1e-10  # bound of the error of the sag force at an extremum, relative to half the cable's weight
SHRINKS = 0.9  # the search ends if a section is longer than this fraction of the previous section
SMALLEST_GAIN = 1e-15  # the search ends if the bound decreases by less than this fraction of the terms of its sum

# Rows of the extrema of the cables' sag forces, (TURN_ROWS, m); NaN if a cable has no such extremum.
LEAST_TENSION, LEAST_SAG_FORCE, MOST_TENSION, MOST_SAG_FORCE = 0, 1, 2, 3
TURN_ROWS = 4


class Curves(NamedTuple):
    """The cables of one pose, whose sag forces are functions of their chord tensions."""

    model: Model  # cable model
    cables: Cables  # the cables; their tensions and sag forces are overwritten
    turns: Array  # extrema of the sag forces, (TURN_ROWS, m)
    statuses: Codes  # status of each cable, (m,)


class Section(NamedTuple):
    """A range of chord tensions of one cable."""

    low: float  # least tension [N]
    high: float  # largest tension [N], may be infinite
    at_low: float  # sag force at the least tension [N]
    at_high: float  # sag force at the largest tension [N]


@glue
def new_curves(model: Model, cables: Cables, statuses: Codes, memory: Memory) -> tuple[Curves, Memory]:
    """Work arrays for the curves of the cables of a pose, and the remaining memory."""
    turns, memory = block(memory, TURN_ROWS, cables.low.size)
    return Curves(model, cables, turns, statuses), memory


@kernel
def sag_forces_at(curves: Curves, tau: Array, sag_force: Array) -> None:
    """Fill the sag forces (m,) at the chord tensions `tau` (m,), and store both in the cables."""
    copy(tau, curves.cables.tau)
    change = 0.0
    for k in range(CONTACTS if curves.cables.machine else 1):
        _gravest, change = solve_cable_states(curves.model, curves.cables, k == 0, False, curves.statuses)
        if change <= SAME_EXIT:
            break
    for i in range(tau.size if change > SAME_EXIT else 0):
        curves.statuses[i] = codes.CABLE_NOT_CONVERGED
    for i in range(tau.size):
        if curves.model.code != codes.CATENARY:  # this model has the same sag force at every tension, including zero
            curves.cables.sag_force[i] = shallow_sag_force(
                curves.model, curves.cables.chord[i], curves.cables.density[i]
            )
        sag_force[i] = curves.cables.sag_force[i]


@kernel
def _sag_forces_beside(curves: Curves, tau: Array, above: Array) -> None:
    """Fill `above` with the sag forces slightly above `tau`, and `curves.cables` with those slightly below `tau`."""
    cables = curves.cables
    for i in range(tau.size):
        cables.last_sag_force[i] = tau[i] * (1.0 + SLOPE_STEP)
    sag_forces_at(curves, cables.last_sag_force, above)
    for i in range(tau.size):
        cables.last_sag_force[i] = tau[i] * (1.0 - SLOPE_STEP)
    sag_forces_at(curves, cables.last_sag_force, cables.sag_force)


@kernel
def slopes_at(curves: Curves, tau: Array, slope: Array, bend: Array) -> None:
    """Fill `slope` (m,) and curvature `bend` (m,) [1/N] of the sag forces over `tau`, by central differences."""
    cables = curves.cables
    if curves.model.code != codes.CATENARY:
        slope[:] = bend[:] = 0.0
        return
    sag_forces_at(curves, tau, bend)
    _sag_forces_beside(curves, tau, slope)
    for i in range(tau.size):
        step = SLOPE_STEP * tau[i]
        above, below, here = slope[i], cables.sag_force[i], bend[i]
        weighs = cables.half_weight[i] > 0.0
        slope[i] = (above - below) / (2.0 * step) if weighs else 0.0
        bend[i] = (above - 2.0 * here + below) / (step * step) if weighs else 0.0


@kernel
def sag_force_at(curves: Curves, i: int, tau: float) -> float:
    """Sag force [N] of cable `i` at the chord tension `tau` [N]; zero at infinite tension, where no length exists."""
    cables = curves.cables
    if curves.model.code != codes.CATENARY:
        return shallow_sag_force(curves.model, cables.chord[i], cables.density[i])
    if tau == math.inf:
        return 0.0
    _length, sag_force, _status = solve_cable_state(
        curves.model, chord_of(cables, i), material_of(cables, i), pulley_of(cables, i), tau
    )
    return sag_force


@glue
def sag_force_range(curves: Curves, i: int, section: Section) -> tuple[float, float]:
    """Least and largest sag force of cable `i` in the range `section` of its chord tensions."""
    turns = curves.turns
    beyond = TURN_ERROR * curves.cables.half_weight[i]
    least, most = min(section.at_low, section.at_high), max(section.at_low, section.at_high)
    if section.low < turns[LEAST_TENSION, i] < section.high:
        least = min(least, turns[LEAST_SAG_FORCE, i] - beyond)
    if section.low < turns[MOST_TENSION, i] < section.high:
        most = max(most, turns[MOST_SAG_FORCE, i] + beyond)
    return least, most


@kernel
def most_along(curves: Curves, i: int, section: Section, along: float, hanging: float) -> float:
    """Upper bound [N] of along * tau - b * sag_force(tau) on a section. The bound is exact if the maximum is at an end.

    The value at one end and the range of the sag force limit how far a better tension can be from this end. The section
    is shortened to that distance, again and again.

    `section`: range of chord tensions, whose upper end may be infinite; `along`, `hanging`: the factors along and b.
    """
    low, high, at_low, at_high = section
    if along > 0.0 and high == math.inf:
        return math.inf
    bound = math.inf
    for _ in range(SHRINKINGS):
        least, most = sag_force_range(curves, i, Section(low, high, at_low, at_high))
        tension, sag_force = (high, at_high) if along > 0.0 else (low, at_low)
        end = along * tension - hanging * sag_force
        bound = min(bound, along * tension - hanging * (least if hanging > 0.0 else most))
        gain = bound - end
        known = SMALLEST_GAIN * (abs(end) + abs(hanging * sag_force))
        if not gain > known or not gain < SHRINKS * abs(along) * (high - low):
            break
        if along > 0.0:
            low = high - gain / along
            at_low = sag_force_at(curves, i, low)
        else:
            high = low - gain / along
            at_high = sag_force_at(curves, i, high)
    return bound


TURN_PRECISION = 1e-4  # relative error of the tension at an extremum; the sag force then has an error of 1e-11 weights
STEPS = 30
PEAK_STEPS = 40
PEAK_PRECISION = 1e-3  # relative error of the tension at which the sag force rises fastest
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
# Start of the search, as a factor of the first-order extrema. The first-order extrema are at X = |sin phi|/cos^2 phi
# and at the tension sqrt(EA wD |sin phi|/6). In 200,000 random cables with X <= 1 and e <= 0.01, the exact extrema were
# at 0.28 to 1.03 times this X and at 0.58 to 1.0 times this tension.
START_OF_LEAST, START_OF_MOST = 1.25, 0.9
# Limit of the growth of the sag force at its first-order peak, relative to the sum of its terms. In all random cables
# of the tests, the growths at this peak and at the exact peak differ by a smaller share. If the growth is below minus
# this limit, it is negative everywhere; otherwise a golden-section search finds the exact peak.
FALLS_FOR_SURE = 0.3
FIRST_ORDER = 1.0  # largest X at which the first order is used; the first-order peak of a steep cable is at a larger X

# Rows of the work array.
A, B, AT_A, AT_B, TENSION, GROWTH, RISEN, LAST = 0, 1, 2, 3, 4, 5, 6, 7
ROWS = 8


@kernel
def _growths(curves: Curves, tau: Array, growth: Array) -> None:
    """Fill the growth of the sag forces (m,) [N]: derivatives with respect to the logarithm of the chord tension."""
    _sag_forces_beside(curves, tau, growth)
    for i in range(tau.size):
        growth[i] = (growth[i] - curves.cables.sag_force[i]) / (2.0 * SLOPE_STEP)


@formula
def _growth_of(curves: Curves, i: int, tau: float) -> float:
    """Growth of the sag force of cable `i` [N]: derivative with respect to the logarithm of its chord tension."""
    above, below = sag_force_at(curves, i, tau * (1.0 + SLOPE_STEP)), sag_force_at(curves, i, tau * (1.0 - SLOPE_STEP))
    return (above - below) / (2.0 * SLOPE_STEP)


@formula
def _first_order_growth(curves: Curves, i: int, tau: float) -> tuple[float, float, float]:
    """The three terms of the first-order growth of one cable's sag force [N]: stretch, slope and depth."""
    cables = curves.cables
    half_weight = cables.half_weight[i]
    x = half_weight / tau
    stretch = half_weight * tau / cables.stiffness[i]
    return stretch, half_weight * x * abs(cables.sine[i]) / 3.0, half_weight * (x * cables.cosine[i]) ** 2 / 3.0


@kernel
def _rising_tension_between(curves: Curves, i: int, low: float, high: float) -> float:
    """Chord tension between `low` and `high` at which the sag force rises; it falls at both. NaN if it never rises."""
    # The growth of the sag force has one peak. Golden-section search finds it.
    a, b = math.log(low), math.log(high)
    c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    at_c, at_d = _growth_of(curves, i, math.exp(c)), _growth_of(curves, i, math.exp(d))
    for _ in range(PEAK_STEPS):
        if at_c > 0.0 or at_d > 0.0 or b - a < PEAK_PRECISION:
            break
        if at_c > at_d:
            b, d, at_d = d, c, at_c
            c = b - GOLDEN * (b - a)
            at_c = _growth_of(curves, i, math.exp(c))
        else:
            a, c, at_c = c, d, at_d
            d = a + GOLDEN * (b - a)
            at_d = _growth_of(curves, i, math.exp(d))
    if at_c > 0.0:
        return math.exp(c)
    return math.exp(d) if at_d > 0.0 else math.nan


@glue
def _find_rises(curves: Curves, work: Array) -> None:
    """Fill row RISEN with a tension between A and B at which the sag force of a cable rises. NaN if it never rises."""
    cables = curves.cables
    for i in range(work.shape[1]):
        best = 1.5 * cables.half_weight[i] * cables.cosine[i] * cables.cosine[i] / abs(cables.sine[i])
        best = max(best, cables.half_weight[i] / FIRST_ORDER)
        work[TENSION, i] = min(max(best, work[A, i]), work[B, i])
    _growths(curves, work[A], work[AT_A])
    _growths(curves, work[B], work[AT_B])
    _growths(curves, work[TENSION], work[GROWTH])
    for i in range(work.shape[1]):
        risen = math.nan
        if cables.sine[i] < 0.0 and cables.half_weight[i] > 0.0 and work[A, i] < work[B, i]:
            stretch, slope, depth = _first_order_growth(curves, i, work[TENSION, i])
            if work[AT_A, i] > 0.0:
                risen = work[A, i]
            elif work[AT_B, i] > 0.0:
                risen = work[B, i]
            elif work[GROWTH, i] > 0.0:
                risen = work[TENSION, i]
            elif (
                work[GROWTH, i] > -FALLS_FOR_SURE * (stretch + slope + depth)
                or cables.half_weight[i] > FIRST_ORDER * work[TENSION, i]
            ):
                risen = _rising_tension_between(curves, i, work[A, i], work[B, i])
        work[RISEN, i] = risen


@glue
def _find_extremum(curves: Curves, rising: bool, work: Array, tensions: Array, sag_forces: Array) -> None:
    """Fill tension and sag force at the extremum between A and B, for the cables whose tension is not NaN.

    The steps start at the tensions in row TENSION and stay between the tensions in rows A and B. The first step uses
    the first-order slope. Each later step uses the slope between the last two points.

    rising: True if the sag forces rise at A and fall at B, False for the opposite; tensions: filled, (m,); a cable with
        NaN is skipped; sag forces: filled, (m,).
    """
    m = tensions.size
    for step in range(STEPS):
        _growths(curves, work[TENSION], work[GROWTH])
        largest = 0.0
        for i in range(m):
            if not math.isnan(tensions[i]):
                tau, growth = work[TENSION, i], work[GROWTH, i]
                side = A if (growth > 0.0) == rising else B
                work[side, i] = tau
                stretch, slope, depth = _first_order_growth(curves, i, tau)
                bend = 2.0 * depth - slope - stretch
                if step > 0 and tau != tensions[i] and growth != work[LAST, i]:
                    bend = (growth - work[LAST, i]) / math.log(tau / tensions[i])
                new = tau * math.exp(min(max(-growth / bend, -1.0), 1.0))
                if not work[A, i] < new < work[B, i]:
                    new = math.sqrt(work[A, i] * work[B, i])
                largest = max(largest, abs(new - tau) / tau)
                tensions[i] = tau
                work[LAST, i] = growth
                work[TENSION, i] = new
        if largest <= TURN_PRECISION:
            break
    sag_forces_at(curves, work[TENSION], sag_forces)
    for i in range(m):
        if math.isnan(tensions[i]):
            sag_forces[i] = math.nan
        else:
            tensions[i] = work[TENSION, i]


@kernel
def find_extrema(curves: Curves, low: Array, high: Array, memory: Memory) -> None:
    """Fill the extrema of the cables' sag forces between the finite chord tensions `low` and `high`, (m,) each."""
    cables, turns = curves.cables, curves.turns
    m = cables.low.size
    work, memory = block(memory, ROWS, m)
    turns[:] = math.nan
    copy(low, work[A])
    copy(high, work[B])
    if curves.model.code != codes.CATENARY:
        return
    _find_rises(curves, work)
    sought = False
    for i in range(m):
        risen = work[RISEN, i]
        if risen < work[B, i] and not work[AT_B, i] > 0.0:
            guess = START_OF_MOST * math.sqrt(cables.stiffness[i] * cables.half_weight[i] * abs(cables.sine[i]) / 3.0)
            work[A, i] = turns[MOST_TENSION, i] = risen
            work[TENSION, i] = min(max(guess, risen), work[B, i])
            sought = True
    if sought:
        _find_extremum(curves, True, work, turns[MOST_TENSION], turns[MOST_SAG_FORCE])
    sought = False
    for i in range(m):
        risen = work[RISEN, i]
        if risen > low[i] and not work[AT_A, i] > 0.0:
            guess = START_OF_LEAST * cables.half_weight[i] * cables.cosine[i] * cables.cosine[i] / abs(cables.sine[i])
            work[A, i] = low[i]
            work[B, i] = turns[LEAST_TENSION, i] = risen
            work[TENSION, i] = min(max(guess, low[i]), risen)
            sought = True
    if sought:
        _find_extremum(curves, False, work, turns[LEAST_TENSION], turns[LEAST_SAG_FORCE])
