"""Bounds of the cables' sag forces within the chord tension limits, and for changes of tension and platform end.

For an inextensible cable, X = wD/(2 tau): sag force = tau X (L/D) + tau sin phi (X coth X - 1), whose slopes are
bounded here in closed form. Stretch decreases the slopes by position. It increases the rate at which the sag force
falls with the tension by at most wD/(2 EA); docs/model.md, section 13.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.cable.admissible import LOOSEST, is_limited_by_strain
from sagline.kernels.cable.cables import Cables
from sagline.kernels.cable.sag_forces import Curves, Section, find_extrema, sag_force_range, sag_forces_at
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory

# Validity of the formula of `range_between_ends`, tested on two million random cables.
SLACKEST, STRETCHED = 0.3, 0.15  # largest X and e
BY_STRETCH, BY_SAG = 0.334, 0.023  # coefficients of its remainder, for eX and for X^3
FROM_MOST, BEFORE_MOST = 0.85, 1.8  # relative to X_M: an extremum of the sag force is at 0.89 to 1.72 of it
BEFORE_LEAST, AFTER_LEAST = 0.25, 1.05  # relative to |sin phi|/cos^2 phi: another extremum is at 0.28 to 1.03 of it

# Rows of the bands (BAND_ROWS, m).
LOW, TAUT = 0, 2  # smallest and largest admissible chord tension [N]; the latter is infinite for straight cables only
HIGH = 1  # TAUT, or infinity if the strain limits it
SAG_FORCE_LOW, SAG_FORCE_HIGH = 3, 4  # sag forces at LOW and TAUT [N]
LEAST, MOST = 5, 6  # least and largest sag force between them [N]
BAND_ROWS = 7


@glue
def fill_bands(curves: Curves, bands: Array, memory: Memory) -> bool:
    """Fill the bands of the cables in place; False if a cable is too slack at any tension."""
    cables = curves.cables
    m = cables.low.size
    exact = curves.model.code == codes.CATENARY
    for i in range(m):
        bands[LOW, i] = cables.low[i]
        bands[HIGH, i] = math.inf if is_limited_by_strain(cables, i) else cables.high[i]
        bands[TAUT, i] = cables.high[i]
    if not exact:
        for i in range(m):
            sag_force = cables.sag_force[i]  # first-order sag force, which is the same at every tension
            bands[SAG_FORCE_LOW, i] = bands[SAG_FORCE_HIGH, i] = bands[LEAST, i] = bands[MOST, i] = sag_force
        return True
    sag_forces_at(curves, bands[LOW], bands[SAG_FORCE_LOW])
    sag_forces_at(curves, bands[TAUT], bands[SAG_FORCE_HIGH])
    hang = True
    sought = False
    for i in range(m):
        bands[LEAST, i], bands[MOST, i] = range_between_ends(cables, i, bands)
        sought = sought or not bands[LEAST, i] <= bands[MOST, i]
    if sought:
        find_extrema(curves, bands[LOW], bands[TAUT], memory)
        for i in range(m):
            if not bands[LEAST, i] <= bands[MOST, i]:
                section = Section(bands[LOW, i], bands[TAUT, i], bands[SAG_FORCE_LOW, i], bands[SAG_FORCE_HIGH, i])
                bands[LEAST, i], bands[MOST, i] = sag_force_range(curves, i, section)
            hang = hang and bands[LEAST, i] <= bands[MOST, i]
    return hang


@formula
def range_between_ends(cables: Cables, i: int, bands: Array) -> tuple[float, float]:
    """Least and largest sag force of a cable from those at its ends; NaN if the first order is not decisive.

    With X = wD/(2 tau) and e = tau/EA, sag force/(wD/2) = 1/(1 + e) - X/3 |sin phi|/(1 + e)^2 + X^2/6 cos^2 phi to
    0.334 eX + 0.023 X^3 for a cable below its frame end, e <= 0.15 and X <= 1. It has at most two extrema: a maximum
    near X_M, where e = X/3 |sin phi|, and a minimum at larger X; docs/model.md, section 5.
    """
    half_weight = cables.half_weight[i]
    at_low, at_high = bands[SAG_FORCE_LOW, i], bands[SAG_FORCE_HIGH, i]
    least, most = min(at_low, at_high), max(at_low, at_high)
    s, c2 = -cables.sine[i], cables.cosine[i] * cables.cosine[i]
    x, tautest = half_weight / bands[LOW, i], half_weight / bands[TAUT, i]
    product = half_weight / cables.stiffness[i]  # e X, which does not depend on the tension
    if s <= 0.0 or half_weight == 0.0:
        return least, most
    if x > SLACKEST or product > STRETCHED * tautest or cables.machine:
        return math.nan, math.nan
    peak = math.sqrt(3.0 * product / s)  # X_M
    if x <= FROM_MOST * peak:
        return least, most
    if tautest < BEFORE_MOST * peak:
        beyond = min(x, BEFORE_MOST * peak)
        stretch = 1.0 + product / tautest
        rise = s / (3.0 * stretch * stretch) - beyond * (c2 / 6.0 + BY_SAG * beyond)
        if not rise > 0.0:
            return math.nan, math.nan
        most = max(most, half_weight * (1.0 - 2.0 * math.sqrt(product * rise / stretch) + BY_STRETCH * product))
    if x * c2 > BEFORE_LEAST * s:
        beyond = min(x, AFTER_LEAST * s / c2)
        depth = c2 / 6.0 - BY_SAG * beyond
        flat = s / (6.0 * depth) < beyond and depth > 0.0
        fall = s * s / (36.0 * depth) if flat else beyond * (s / 3.0 - beyond * depth)
        strain = product * c2 / (BEFORE_LEAST * s)
        least = min(least, half_weight * (1.0 - strain - fall - BY_STRETCH * product))
    return least, most


SMALL = 1e-3  # X below which series are used


@formula
def _sinh_ratio(x: float) -> float:
    """Upper bound of sinh(x)/x, equal to it except for small x."""
    return math.sinh(x) / x if x > SMALL else 1.0 + x * x / 3.0


@formula
def _slack_rate(x: float) -> float:
    """Upper bound of x cosh x - sinh x, equal to it except for small x."""
    return x * math.cosh(x) - math.sinh(x) if x > 0.1 else 0.34 * x * x * x


@formula
def has_sag(curves: Curves, i: int) -> bool:
    """True if a cable's sag force depends on its tension."""
    return curves.model.code == codes.CATENARY and curves.cables.half_weight[i] > 0.0


@kernel
def sag_force_slope(curves: Curves, i: int, way: float, tension: float) -> float:
    """Largest derivative of a sag force by the platform end's position [N/m], at or above a chord tension.

    way: largest distance of the platform end from its position in `curves` [m]; tension: least chord tension [N].
    """
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
    """Upper bound of a sag force [N], at or above a chord tension."""
    cables = curves.cables
    if not has_sag(curves, i):
        return cables.sag_force[i]
    x = cables.half_weight[i] / tension
    return cables.half_weight[i] * (_sinh_ratio(x) + max(cables.sine[i], 0.0) * min(x / 3.0, 1.0))


@kernel
def fall_rate(curves: Curves, i: int, tension: float) -> float:
    """Largest decrease of a sag force per newton of chord tension, above a given tension."""
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
    """Largest increase of a sag force per newton of chord tension, above a given tension."""
    if not has_sag(curves, i):
        return 0.0
    x = curves.cables.half_weight[i] / tension
    return max(-curves.cables.sine[i], 0.0) * min(x * x / 3.0, 1.0)


@kernel
def fall(curves: Curves, i: int, low: float, high: float) -> float:
    """Largest decrease of a sag force from one chord tension to a higher one [N]."""
    if not has_sag(curves, i):
        return 0.0
    cables = curves.cables
    half = cables.half_weight[i]
    x, y = half / low, half / high
    slack = half * cables.cosine[i] * (_sinh_ratio(x) - math.sinh(y) / y if y > SMALL else _sinh_ratio(x) - 1.0)
    return slack + max(cables.sine[i], 0.0) * half * (x - y) / 3.0 + half / cables.stiffness[i] * (high - low)


@kernel
def rise(curves: Curves, i: int, low: float, high: float) -> float:
    """Largest increase of a sag force from one chord tension to a higher one [N]."""
    if not has_sag(curves, i):
        return 0.0
    half = curves.cables.half_weight[i]
    return max(-curves.cables.sine[i], 0.0) * half * (half / low - half / high) / 3.0
