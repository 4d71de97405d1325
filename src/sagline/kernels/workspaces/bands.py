"""Bands of the cables of one pose: their chord tensions, and bounds of their sag forces T_z - tau sin phi."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels.cable.cables import Cables
from sagline.kernels.cable.sag_force_extrema import find_extrema
from sagline.kernels.cable.sag_forces import LOOSEST, Curves, Section, sag_force_range, sag_forces_at
from sagline.kernels.codes import CATENARY
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory

# What the formula of `range_between_ends` is good for, on two million random cables.
SLACKEST, STRETCHED = 0.3, 0.15  # largest X and e
BY_STRETCH, BY_SAG = 0.334, 0.023  # its remainder, of eX and of X^3
FROM_MOST, BEFORE_MOST = 0.85, 1.8  # of X_M: the pull turns at 0.89 to 1.72 of it
BEFORE_LEAST, AFTER_LEAST = 0.25, 1.05  # of |sin phi|/cos^2 phi: and turns again at 0.28 to 1.03 of that

# Rows of the bands (BAND_ROWS, m).
LOW, HIGH = 0, 1  # chord tensions [N]; the upper one may be infinite
TAUT = 2  # the largest one that sagging cables are looked at: where there is no limit they are stretched to twice
PULL_LOW, PULL_HIGH = 3, 4  # pulls at LOW and TAUT [N]
LEAST, MOST = 5, 6  # least and largest pull between them [N]
BAND_ROWS = 7


@glue
def fill_bands(curves: Curves, bands: Array, memory: Memory) -> bool:
    """Fill the bands of the cables in place; False where one is too slack to hang, whatever its tension.

    Tensions below which a cable's X = wD/(2 tau) is above LOOSEST are left out: with a least tension of zero the pull
    has no largest value.
    """
    cables = curves.cables
    m = cables.low.size
    exact = curves.model.code == CATENARY
    for i in range(m):
        bands[LOW, i] = cables.low[i]
        bands[HIGH, i] = cables.high[i]
        bands[TAUT, i] = cables.high[i]
        if exact:
            if cables.high[i] == math.inf:
                bands[TAUT, i] = max(cables.low[i], cables.stiffness[i])
            bands[LOW, i] = min(max(cables.low[i], cables.half_weight[i] / LOOSEST), bands[TAUT, i])
    if not exact:
        for i in range(m):
            pull = cables.pull[i]  # of first order, and the same at every tension
            bands[PULL_LOW, i] = bands[PULL_HIGH, i] = bands[LEAST, i] = bands[MOST, i] = pull
        return True
    sag_forces_at(curves, bands[LOW], bands[PULL_LOW])
    sag_forces_at(curves, bands[TAUT], bands[PULL_HIGH])
    hang = True
    sought = False
    for i in range(m):
        bands[LEAST, i], bands[MOST, i] = range_between_ends(cables, i, bands)
        sought = sought or not bands[LEAST, i] <= bands[MOST, i]
    if sought:
        find_extrema(curves, bands[LOW], bands[TAUT], memory)
        for i in range(m):
            if not bands[LEAST, i] <= bands[MOST, i]:
                section = Section(bands[LOW, i], bands[TAUT, i], bands[PULL_LOW, i], bands[PULL_HIGH, i])
                bands[LEAST, i], bands[MOST, i] = sag_force_range(curves, i, section)
            hang = hang and bands[LEAST, i] <= bands[MOST, i]
    return hang


@formula
def range_between_ends(cables: Cables, i: int, bands: Array) -> tuple[float, float]:
    """Least and largest pull of a cable from those at its ends, where first order tells; else NaN, to look for turns.

    With X = wD/(2 tau) and e = tau/EA, pull/(wD/2) = 1/(1 + e) - X/3 |sin phi|/(1 + e)^2 + X^2/6 cos^2 phi to
    0.334 eX + 0.023 X^3 for a cable below its frame end, e <= 0.15 and X <= 1. It turns twice at most: there is a
    largest value near X_M, where e = X/3 |sin phi|, and at larger X a least one; docs/model.md, section 5.
    """
    half_weight = cables.half_weight[i]
    at_low, at_high = bands[PULL_LOW, i], bands[PULL_HIGH, i]
    least, most = min(at_low, at_high), max(at_low, at_high)
    s, c2 = -cables.sine[i], cables.cosine[i] * cables.cosine[i]
    x, tautest = half_weight / bands[LOW, i], half_weight / bands[TAUT, i]
    product = half_weight / cables.stiffness[i]  # e X, whatever the tension
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
