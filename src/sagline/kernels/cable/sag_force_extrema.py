"""Extrema of the sag forces of one pose between the tension limits; docs/model.md, section 5.

For a cable below its frame end, X = wD/(2 tau) and e = tau/EA, the pull grows in first order by
wD/2 (-e + X/3 |sin phi| - X^2/3 cos^2 phi) with the logarithm of the tension: it falls, rises and falls, or only falls.
All cables are looked at together, because their loops vectorize.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable.sag_forces import (
    LEAST_PULL,
    LEAST_TENSION,
    MOST_PULL,
    MOST_TENSION,
    SLOPE_STEP,
    Curves,
    sag_force_at,
    sag_forces_at,
)
from sagline.kernels.codes import CATENARY
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block

TURN_PRECISION = 1e-4  # relative, of a turn's tension: its pull, flat there, is known to 1e-11 of the weight
STEPS = 30
PEAK_STEPS = 40
PEAK_PRECISION = 1e-3  # relative, of the tension where the pull rises fastest
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
# Where the search begins: the first-order turns are at X = |sin phi|/cos^2 phi and at sqrt(EA wD |sin phi|/6), the true
# ones, on 200,000 random cables with X <= 1 and e <= 0.01, at 0.28 to 1.03 of that X and 0.58 to 1.0 of that tension.
START_OF_LEAST, START_OF_MOST = 1.25, 0.9
# A growth that is this share of its parts below zero where first order has its peak is so everywhere: between there and
# the true peak it changes by less, in all random cables of the tests. Nearer to zero golden sections look for the peak.
FALLS_FOR_SURE = 0.3

# Rows to work in.
A, B, AT_A, AT_B, TENSION, GROWTH, RISEN, LAST = 0, 1, 2, 3, 4, 5, 6, 7
ROWS = 8


@kernel
def _growths(curves: Curves, tau: Array, growth: Array) -> None:
    """Fill the growth of the pulls with the logarithm of the chord tensions [N], (m,)."""
    cables = curves.cables
    for i in range(tau.size):
        cables.last_pull[i] = tau[i] * (1.0 + SLOPE_STEP)
    sag_forces_at(curves, cables.last_pull, growth)
    for i in range(tau.size):
        cables.last_pull[i] = tau[i] * (1.0 - SLOPE_STEP)
    sag_forces_at(curves, cables.last_pull, cables.pull)
    for i in range(tau.size):
        growth[i] = (growth[i] - cables.pull[i]) / (2.0 * SLOPE_STEP)


@formula
def _growth_of(curves: Curves, i: int, tau: float) -> float:
    """The same of one cable."""
    above, below = sag_force_at(curves, i, tau * (1.0 + SLOPE_STEP)), sag_force_at(curves, i, tau * (1.0 - SLOPE_STEP))
    return (above - below) / (2.0 * SLOPE_STEP)


@formula
def _first_order_growth(curves: Curves, i: int, tau: float) -> tuple[float, float, float]:
    """Stretch, slope and depth of the first-order growth of one cable's pull [N]."""
    cables = curves.cables
    half_weight = cables.half_weight[i]
    x = half_weight / tau
    stretch = half_weight * tau / cables.stiffness[i]
    return stretch, half_weight * x * abs(cables.sine[i]) / 3.0, half_weight * (x * cables.cosine[i]) ** 2 / 3.0


@kernel
def _rising_tension_between(curves: Curves, i: int, low: float, high: float) -> float:
    """A chord tension between two at which the pull rises, where it falls at both; NaN where it never rises.

    Its growth has one peak, which golden sections find.
    """
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
    """Fill for each cable a tension between A and B at which its pull rises: RISEN, NaN where it never does."""
    cables = curves.cables
    for i in range(work.shape[1]):
        best = 1.5 * cables.half_weight[i] * cables.cosine[i] * cables.cosine[i] / abs(cables.sine[i])
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
            elif work[GROWTH, i] > -FALLS_FOR_SURE * (stretch + slope + depth):
                risen = _rising_tension_between(curves, i, work[A, i], work[B, i])
        work[RISEN, i] = risen


@glue
def _find_extremum(curves: Curves, rising: bool, work: Array, tensions: Array, pulls: Array) -> None:
    """Fill where and how far the pulls turn between A and B, of the cables whose tension is not NaN.

    Newton steps from TENSION on, with the slope of first order, then with that of the last two points, within what is
    left of A to B.

    Args:
        curves: The cables.
        rising: Whether the pulls rise at A and fall at B, or the other way round.
        work: To work in.
        tensions: Anything, or NaN for no turn, (m,); filled.
        pulls: Filled, (m,).
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
    sag_forces_at(curves, work[TENSION], pulls)
    for i in range(m):
        if math.isnan(tensions[i]):
            pulls[i] = math.nan
        else:
            tensions[i] = work[TENSION, i]


@kernel
def find_extrema(curves: Curves, low: Array, high: Array, memory: Memory) -> None:
    """Fill the turns of the cables' pulls between chord tensions (m,), which are finite."""
    cables, turns = curves.cables, curves.turns
    m = cables.low.size
    work, _ = block(memory.numbers, 0, ROWS, m)
    for i in range(m):
        turns[LEAST_TENSION, i] = turns[LEAST_PULL, i] = turns[MOST_TENSION, i] = turns[MOST_PULL, i] = math.nan
        work[A, i] = low[i]
        work[B, i] = high[i]
    if curves.model.code != CATENARY:
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
        _find_extremum(curves, True, work, turns[MOST_TENSION], turns[MOST_PULL])
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
        _find_extremum(curves, False, work, turns[LEAST_TENSION], turns[LEAST_PULL])
