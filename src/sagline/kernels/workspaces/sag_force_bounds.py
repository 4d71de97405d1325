"""Bounds of the sag forces within the chord tension limits, and of their changes with tension and platform end.

The sag force of an inextensible cable is tau X (L/D) + tau sin phi (X coth X - 1) with X = wD/(2 tau). This module
bounds the slopes of the sag force in closed form. Stretch decreases the slopes with respect to position. Stretch
changes the slope with respect to tension by at most -wD/(2 EA); docs/model.md, section 13.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.cable.sag_forces import Curves, Section, find_extrema, sag_force_range, sag_forces_at
from sagline.kernels.cable.states import LOOSEST
from sagline.kernels.cable.terms import Cables
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory

# Rows of the bands (BAND_ROWS, m).
# smallest and largest admissible chord tension [N]; only for straight cables, the largest tension can be infinite
LOW, HIGH = 0, 1
SAG_FORCE_LOW, SAG_FORCE_HIGH = 2, 3  # sag forces at LOW and HIGH [N]
SLOPE = 4  # slope of the secant of the sag force from LOW to HIGH
UNDER, OVER = 5, 6  # least difference between sag force and secant [N], <= 0, and largest difference, >= 0
BAND_ROWS = 7


@glue
def fill_bands(curves: Curves, bands: Array, memory: Memory) -> bool:
    """Fill the bands of the cables of a pose. False if a cable is too slack at every tension."""
    cables = curves.cables
    m = cables.low.size
    for i in range(m):
        bands[LOW, i] = cables.low[i]
        bands[HIGH, i] = cables.high[i]
        # the first-order sag force, which does not depend on the tension
        bands[SAG_FORCE_LOW, i] = bands[SAG_FORCE_HIGH, i] = cables.sag_force[i]
        bands[SLOPE, i] = bands[UNDER, i] = bands[OVER, i] = 0.0
    if curves.model.code != codes.CATENARY:
        return True
    sag_forces_at(curves, bands[LOW], bands[SAG_FORCE_LOW])
    sag_forces_at(curves, bands[HIGH], bands[SAG_FORCE_HIGH])
    if cables.machine:
        find_extrema(curves, bands[LOW], bands[HIGH], memory)
    hang = True
    for i in range(m):
        low, high, at_low, at_high = bands[LOW, i], bands[HIGH, i], bands[SAG_FORCE_LOW, i], bands[SAG_FORCE_HIGH, i]
        hang = hang and at_low < math.inf and at_high < math.inf
        if low < high:
            bands[SLOPE, i] = (at_high - at_low) / (high - low)
            if cables.machine:
                least, most = sag_force_range(curves, i, Section(low, high, at_low, at_high))
                bands[UNDER, i], bands[OVER, i] = least - max(at_low, at_high), most - min(at_low, at_high)
            else:
                bands[UNDER, i], bands[OVER, i] = _from_secant(cables, i, low, high)
    return hang


@formula
def _from_secant(cables: Cables, i: int, low: float, high: float) -> tuple[float, float]:
    """Lower bound (<= 0) and upper bound (>= 0) [N] of sag force minus secant between the tensions `low`, `high`."""
    # The sag force of an inextensible cable is a sum of convex functions of the tension. Only the term wD/2 sin phi
    # (X/3 - ...) is concave if the platform end is below the frame end. The secant of 1/tau is above 1/tau by at most
    # (1/sqrt(low) - 1/sqrt(high))^2. The bounds held for two million random cables with X <= 10 and e <= 10.
    half_weight = cables.half_weight[i]
    if half_weight == 0.0:
        return 0.0, 0.0
    sine, cosine = cables.sine[i], cables.cosine[i]
    x, y = half_weight / low, half_weight / high
    ratio = _sinh_ratio(x)
    depth = min(cosine, cosine * cosine * ratio) * (ratio - (math.sinh(y) / y if y > SMALL else 1.0))
    root = math.sqrt(x) - math.sqrt(y)
    gap = root * root / 3.0
    stretch = 1.0 / math.sqrt(1.0 + low / cables.stiffness[i]) - 1.0 / math.sqrt(1.0 + high / cables.stiffness[i])
    under = -half_weight * (depth + max(sine, 0.0) * gap + stretch * stretch)
    return under, half_weight * max(-sine, 0.0) * gap


SMALL = 1e-3  # X below which series are used


@formula
def _sinh_ratio(x: float) -> float:
    """Upper bound of sinh(x)/x, exact except for small x."""
    return math.sinh(x) / x if x > SMALL else 1.0 + x * x / 3.0


@formula
def _slack_rate(x: float) -> float:
    """Upper bound of x cosh x - sinh x, exact except for small x."""
    return x * math.cosh(x) - math.sinh(x) if x > 0.1 else 0.34 * x * x * x


@formula
def has_sag(curves: Curves, i: int) -> bool:
    """True if the sag force of cable `i` depends on its tension."""
    return curves.model.code == codes.CATENARY and curves.cables.half_weight[i] > 0.0


@kernel
def sag_force_slope(curves: Curves, i: int, way: float, tension: float) -> float:
    """Largest derivative [N/m] of a sag force by the position of the platform end, at all tensions >= `tension`."""
    # `way`: largest distance of the platform end from its position in `curves` [m]. `tension`: lower bound of the chord
    # tension [N].
    cables = curves.cables
    if curves.model.code != codes.CATENARY:
        return abs(cables.sag_force[i]) / cables.chord[i]
    per_length = cables.half_weight[i] / cables.chord[i]
    if per_length == 0.0:
        return 0.0
    x = per_length * (cables.chord[i] + way) / tension
    if not x < 3.0 * LOOSEST:
        return math.inf
    ratio = _sinh_ratio(x)
    along, across = math.cosh(x) + min(1.0, 2.0 / 3.0 * x), 0.5 * (ratio * ratio - 1.0) + x / 3.0
    return per_length * math.sqrt(along * along + across * across)


@kernel
def largest_sag_force(curves: Curves, i: int, tension: float) -> float:
    """Upper bound of the sag force of cable `i` [N] at all chord tensions >= `tension`."""
    cables = curves.cables
    if not has_sag(curves, i):
        return cables.sag_force[i]
    x = cables.half_weight[i] / tension
    return cables.half_weight[i] * (_sinh_ratio(x) + max(cables.sine[i], 0.0) * min(x / 3.0, 1.0))


@kernel
def fall_rate(curves: Curves, i: int, tension: float) -> float:
    """Largest decrease of the sag force of cable `i` per newton of chord tension, above `tension`."""
    if not has_sag(curves, i):
        return 0.0
    cables = curves.cables
    x = cables.half_weight[i] / tension
    sine = max(cables.sine[i], 0.0)
    return (
        _slack_rate(x) * cables.cosine[i] + sine * min(x * x / 3.0, 1.0) + cables.half_weight[i] / cables.stiffness[i]
    )


@kernel
def rise_rate(curves: Curves, i: int, tension: float) -> float:
    """Largest increase of the sag force of cable `i` per newton of chord tension, above `tension`."""
    if not has_sag(curves, i):
        return 0.0
    x = curves.cables.half_weight[i] / tension
    return max(-curves.cables.sine[i], 0.0) * min(x * x / 3.0, 1.0)


@kernel
def fall(curves: Curves, i: int, low: float, high: float) -> float:
    """Largest decrease [N] of the sag force of cable `i` while its chord tension increases from `low` to `high`."""
    if not has_sag(curves, i):
        return 0.0
    cables = curves.cables
    half = cables.half_weight[i]
    x, y = half / low, half / high
    slack = half * cables.cosine[i] * (_sinh_ratio(x) - math.sinh(y) / y if y > SMALL else _sinh_ratio(x) - 1.0)
    return slack + max(cables.sine[i], 0.0) * half * (x - y) / 3.0 + half / cables.stiffness[i] * (high - low)


@kernel
def rise(curves: Curves, i: int, low: float, high: float) -> float:
    """Largest increase [N] of the sag force of cable `i` while its chord tension increases from `low` to `high`."""
    if not has_sag(curves, i):
        return 0.0
    half = curves.cables.half_weight[i]
    return max(-curves.cables.sine[i], 0.0) * half * (half / low - half / high) / 3.0
