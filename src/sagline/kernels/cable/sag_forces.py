"""The cables of one pose as curves: how their pulls T_z - tau sin phi run with their chord tensions.

Weight makes the pull of a cable that hangs below its frame end rise and fall with the tension: it falls while the sag
is deep, rises while the sag grows shallow, and falls again by stretch. On a range of tensions it is therefore within
its ends and at most two turns between them; docs/model.md, section 5.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes
from sagline.kernels.cable.cables import Cables, chord_of, material_of, pulley_of
from sagline.kernels.cable.models import pull_of_shallow
from sagline.kernels.cable.states import solve_cable_state, solve_cable_states
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CATENARY
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block

LOOSEST = 5.0  # largest X = wD/(2 tau): a cable fifteen times as long as its chord, which no winch pulls on
SLOPE_STEP = 1e-4  # relative step of the central difference of the pull
EXITS = 4  # passes over pulleys: for X up to 1 the pull is then known to 1e-9 of the tension
SHRINKINGS = 30
TURN_ERROR = 1e-10  # of half the cable's weight: the pull at a turn is better known
SHRINKS = 0.9  # of the section before: what shrinks less does not shrink
SMALLEST_GAIN = 1e-15  # of the numbers at hand

# Rows of the turns of the cables' pulls, (TURN_ROWS, m): NaN where there is none.
LEAST_TENSION, LEAST_PULL, MOST_TENSION, MOST_PULL = 0, 1, 2, 3
TURN_ROWS = 4


class Curves(NamedTuple):
    """The cables of one pose, whose pulls run with their chord tensions.

    Attributes:
        model: Cable model.
        cables: The cables; what they carry is working space.
        turns: Of their pulls, (TURN_ROWS, m).
        statuses: How each cable's calculation ended, (m,).
    """

    model: Model
    cables: Cables
    turns: Array
    statuses: Codes


class Section(NamedTuple):
    """A range of chord tensions of one cable.

    Attributes:
        low: Least tension [N].
        high: Largest tension [N], may be infinite.
        at_low: Pull at the least tension [N].
        at_high: Pull at the largest tension [N].
    """

    low: float
    high: float
    at_low: float
    at_high: float


@glue
def new_curves(model: Model, cables: Cables, statuses: Codes, memory: Memory) -> tuple[Curves, Memory]:
    """Work arrays for the curves of cables in place, and the memory that is left."""
    turns, at = block(memory.numbers, 0, TURN_ROWS, cables.low.size)
    return Curves(model, cables, turns, statuses), Memory(memory.numbers[at:], memory.counters)


@kernel
def sag_forces_at(curves: Curves, tau: Array, pull: Array) -> None:
    """Fill the pulls (m,) at chord tensions (m,), and let the cables carry them."""
    for i in range(tau.size):
        curves.cables.tau[i] = tau[i]
    for k in range(EXITS if curves.cables.machine else 1):
        solve_cable_states(curves.model, curves.cables, k == 0, False, curves.statuses)
    for i in range(tau.size):
        if curves.model.code != CATENARY:  # the same at every tension, one of zero included
            curves.cables.pull[i] = pull_of_shallow(curves.model, curves.cables.chord[i], curves.cables.density[i])
        pull[i] = curves.cables.pull[i]


@kernel
def slopes_at(curves: Curves, tau: Array, slope: Array, bend: Array) -> None:
    """Fill how the pulls grow with the chord tensions, (m,), and how the slopes do [1/N], by central differences."""
    cables = curves.cables
    if curves.model.code != CATENARY:
        for i in range(tau.size):
            slope[i] = bend[i] = 0.0
        return
    for i in range(tau.size):
        cables.last_pull[i] = tau[i] * (1.0 + SLOPE_STEP)
    sag_forces_at(curves, cables.last_pull, slope)
    sag_forces_at(curves, tau, bend)
    for i in range(tau.size):
        cables.last_pull[i] = tau[i] * (1.0 - SLOPE_STEP)
    sag_forces_at(curves, cables.last_pull, cables.pull)
    for i in range(tau.size):
        step = SLOPE_STEP * tau[i]
        above, below, here = slope[i], cables.pull[i], bend[i]
        weighs = cables.half_weight[i] > 0.0
        slope[i] = (above - below) / (2.0 * step) if weighs else 0.0
        bend[i] = (above - 2.0 * here + below) / (step * step) if weighs else 0.0


@kernel
def sag_force_at(curves: Curves, i: int, tau: float) -> float:
    """Pull of one cable at a chord tension [N]; zero at an infinite one, which leaves no cable to weigh."""
    cables = curves.cables
    if curves.model.code != CATENARY:
        return pull_of_shallow(curves.model, cables.chord[i], cables.density[i])
    if tau == math.inf:
        return 0.0
    _length, pull, _status = solve_cable_state(
        curves.model, chord_of(cables, i), material_of(cables, i), pulley_of(cables, i), tau
    )
    return pull


@glue
def sag_force_range(curves: Curves, i: int, section: Section) -> tuple[float, float]:
    """Least and largest pull of cable i on a section of its chord tensions."""
    turns = curves.turns
    beyond = TURN_ERROR * curves.cables.half_weight[i]
    least, most = min(section.at_low, section.at_high), max(section.at_low, section.at_high)
    if section.low < turns[LEAST_TENSION, i] < section.high:
        least = min(least, turns[LEAST_PULL, i] - beyond)
    if section.low < turns[MOST_TENSION, i] < section.high:
        most = max(most, turns[MOST_PULL, i] + beyond)
    return least, most


@kernel
def most_along(curves: Curves, i: int, section: Section, along: float, hanging: float) -> float:
    """Upper bound of along tau - hanging pull(tau) on a section [N]; exact where the better end is the answer.

    That end, and the range of the pull, say how far from it anything better can be; so the section shrinks.

    Args:
        curves: Of all cables.
        i: Which cable.
        section: Of its chord tensions; the upper end may be infinite.
        along: What a newton of chord tension counts.
        hanging: What a newton of pull takes away.
    """
    low, high, at_low, at_high = section
    if along > 0.0 and high == math.inf:
        return math.inf
    bound = math.inf
    for _ in range(SHRINKINGS):
        least, most = sag_force_range(curves, i, Section(low, high, at_low, at_high))
        tension, pull = (high, at_high) if along > 0.0 else (low, at_low)
        end = along * tension - hanging * pull
        bound = min(bound, along * tension - hanging * (least if hanging > 0.0 else most))
        gain = bound - end
        known = SMALLEST_GAIN * (abs(end) + abs(hanging * pull))
        if not gain > known or not gain < SHRINKS * abs(along) * (high - low):
            break
        if along > 0.0:
            low = high - gain / along
            at_low = sag_force_at(curves, i, low)
        else:
            high = low - gain / along
            at_high = sag_force_at(curves, i, high)
    return bound
