"""Admissible chord tensions of a cable at a pose, for all tests of feasibility; docs/model.md, section 5.

The admissible tensions of a cable form one interval. Its ends follow from the robot's limits, a limit of the sag and a
limit of the stretch. Limits of the frame-end tension are converted to limits of the chord tension. As the chord tension
grows, the frame-end tension first falls and then rises. Usually the interval contains only tensions on the rising side.
If no frame-end tension is below the lower limit, it also contains tensions on the falling side.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.kernels import codes
from sagline.kernels.cable.cables import Cables, chord_of, material_of, pulley_of
from sagline.kernels.cable.pulley import Pulley
from sagline.kernels.cable.states import frame_end_tension, taut_at_frame_end
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.jit import formula, glue, kernel

LOOSEST = 5.0  # largest X = wD/(2 tau): a cable that is fifteen times as long as its chord and almost without tension
# Largest strain, at which a cable is twice as long as without tension. It applies if the robot has no upper limit.
LARGEST_STRAIN = 1.0
SMALLEST = 1e-100  # smallest chord tension of a catenary without weight [N]; the equations divide by the tension
SECTIONS = 80  # steps of the search for the smallest admissible tension of a slack cable
GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)
PRECISION = 1e-14  # relative


class TensionLimits(NamedTuple):
    """Limits of the tensions."""

    quantity: int  # code of the tension to which the robot's limits apply
    # T_adj [N] of the article's bound (54), T_x > w D/(2 |tan phi|) + T_adj; NaN if the bound does not apply
    validity: float


@formula
def sags(model: Model, half_weight: float) -> bool:
    """True if a cable sags. Its length is then infinite at zero tension. `half_weight`: wD/2 [N]."""
    return half_weight > 0.0 and model.code != codes.STRAIGHT and model.code != codes.ELASTIC


@formula
def least_of_sag(model: Model, half_weight: float) -> float:
    """Smallest chord tension that the limit of the sag admits [N]."""
    if sags(model, half_weight):
        return half_weight / LOOSEST
    return SMALLEST if model.code == codes.CATENARY else 0.0


@formula
def largest_of_strain(model: Model, stiffness: float) -> float:
    """Largest chord tension of a cable without an upper limit [N]."""
    return LARGEST_STRAIN * stiffness if model.code != codes.STRAIGHT else math.inf


@formula
def is_limited_by_strain(cables: Cables, i: int) -> bool:
    """True if the largest strain determines the largest admissible tension of cable `i`."""
    return cables.high[i] == LARGEST_STRAIN * cables.stiffness[i]


@glue
def cable_without_tension(cables: Cables) -> int:
    """Index of the first cable without admissible tensions; -1 if all cables have admissible tensions.

    With the article's bound (54), a horizontal cable has no admissible tension.
    """
    for i in range(cables.low.size):
        if not (cables.low[i] <= cables.high[i] and cables.low[i] < math.inf):
            return i
    return -1


@glue
def fill_admissible_tensions(
    model: Model, limits: TensionLimits, low: float, high: float, cables: Cables, i: int
) -> None:
    """Fill the smallest and largest admissible chord tension of cable `i`. If none is admissible: smallest > largest.

    low, high: limits of the robot [N]; the upper limit may be infinite.
    """
    half_weight = cables.half_weight[i]
    # the free span of a slack cable over a pulley can be longer than the tangent by one diameter
    floor = least_of_sag(model, half_weight + cables.density[i] * model.gravity * cables.radius[i])
    if limits.quantity == codes.LIMITS_OF_FRAME_END and sags(model, half_weight):
        chord, material, pulley = chord_of(cables, i), material_of(cables, i), pulley_of(cables, i)
        low, high = _limits_at_chord(model, chord, material, pulley, low, high, floor)
    if high == math.inf:
        high = largest_of_strain(model, cables.stiffness[i])
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
    """Limits of the chord tension [N] that follow from limits of the frame-end tension.

    Returns infinity and zero if the frame-end tension is above its upper limit at every chord tension.
    """
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
    """Smallest chord tension [N] of the range in which the frame-end tension is at most `tension`.

    Golden sections find a chord tension inside the range, and then its smallest chord tension.

    floor: lower bound of the result [N]; taut: largest chord tension of the range, on the rising side [N].
    """
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
