"""Bound of the change of a cable's sag force as its chord tension and its platform end change.

For an inextensible cable, X = wD/(2 tau): pull = tau X (L/D) + tau sin phi (X coth X - 1), whose slopes are bounded in
closed form here. Stretch makes those along the position smaller, and lets the pull fall with the tension by wD/(2 EA)
more at most; docs/model.md, section 13.
"""

from __future__ import annotations

import math

from sagline.kernels.cable.sag_forces import LOOSEST, Curves
from sagline.kernels.codes import CATENARY
from sagline.kernels.jit import formula, kernel

SMALL = 1e-3  # X below which series do


@formula
def _sinh_ratio(x: float) -> float:
    """An upper bound of sinh(x)/x, its value but for small x."""
    return math.sinh(x) / x if x > SMALL else 1.0 + x * x / 3.0


@formula
def _slack_rate(x: float) -> float:
    """An upper bound of x cosh x - sinh x, its value but for small x."""
    return x * math.cosh(x) - math.sinh(x) if x > 0.1 else 0.34 * x * x * x


@formula
def has_sag(curves: Curves, i: int) -> bool:
    """True if a cable's sag force depends on its tension."""
    return curves.model.code == CATENARY and curves.cables.half_weight[i] > 0.0


@kernel
def pull_slope(curves: Curves, i: int, way: float, tension: float) -> float:
    """Most that a pull changes with the position of the platform end [N/m], at one chord tension of so much or more.

    Args:
        curves: Of the cables.
        i: Which cable.
        way: How far its platform end may be from where the curves are [m].
        tension: Least chord tension [N].
    """
    cables = curves.cables
    if curves.model.code != CATENARY:
        return abs(cables.pull[i]) / cables.chord[i]
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
def most_pull(curves: Curves, i: int, tension: float) -> float:
    """Upper bound of a pull [N], at a chord tension of so much or more."""
    cables = curves.cables
    if not has_sag(curves, i):
        return cables.pull[i]
    x = cables.half_weight[i] / tension
    return cables.half_weight[i] * (_sinh_ratio(x) + max(cables.sine[i], 0.0) * min(x / 3.0, 1.0))


@kernel
def fall_rate(curves: Curves, i: int, tension: float) -> float:
    """Most by which a pull falls for a newton of chord tension more, above a tension."""
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
    """Most by which a pull rises for a newton of chord tension more, above a tension."""
    if not has_sag(curves, i):
        return 0.0
    x = curves.cables.half_weight[i] / tension
    return max(-curves.cables.sine[i], 0.0) * min(x * x / 3.0, 1.0)


@kernel
def fall(curves: Curves, i: int, low: float, high: float) -> float:
    """Most by which a pull falls from one chord tension to a higher one [N]."""
    if not has_sag(curves, i):
        return 0.0
    cables = curves.cables
    half = cables.half_weight[i]
    x, y = half / low, half / high
    slack = half * cables.cosine[i] * (_sinh_ratio(x) - math.sinh(y) / y if y > SMALL else _sinh_ratio(x) - 1.0)
    return slack + max(cables.sine[i], 0.0) * half * (x - y) / 3.0 + half / cables.stiffness[i] * (high - low)


@kernel
def rise(curves: Curves, i: int, low: float, high: float) -> float:
    """Most by which a pull rises from one chord tension to a higher one [N]."""
    if not has_sag(curves, i):
        return 0.0
    half = curves.cables.half_weight[i]
    return max(-curves.cables.sine[i], 0.0) * half * (half / low - half / high) / 3.0
