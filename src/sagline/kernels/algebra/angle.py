"""The angle of a direction, without branches, so that loops over many vectorize."""

from __future__ import annotations

import math

from sagline.kernels.jit import formula

EIGHTH = 0.25 * math.pi
LESS, MORE = math.sqrt(2.0) - 1.0, math.sqrt(2.0) + 1.0  # tangents of pi/8 and 3 pi/8


@formula
def _arctangent_ratio(y: float) -> float:
    """The ratio atan(t)/t for y = t^2 <= tan(pi/8)^2; a Chebyshev fit, its error below 2e-18."""
    q = y * y
    r = q * q
    a = 1.0 + r * (0.11111110717862655437 + r * 0.058457120303033402825)
    b = -0.3333333333333309862 + r * (-0.090908960306777095597 + r * -0.050298089787819524301)
    c = 0.19999999999935256646 + r * (0.076920314203395218376 + r * 0.037829796593064922401)
    d = -0.14285714278703770676 + r * (-0.066627926691573426279 + r * -0.017656020531304055162)
    return (a + y * b) + q * (c + y * d)


@formula
def angle(sine: float, cosine: float) -> float:
    """The angle [rad] of a direction with sine >= 0, in 0 to pi; both may have any common factor, but not both be 0."""
    level = abs(cosine)
    steep = sine > MORE * level
    middle = sine > LESS * level
    above = sine - level if middle else sine
    beside = sine + level if middle else level
    above = -level if steep else above
    beside = sine if steep else beside
    base = EIGHTH if middle else 0.0
    base = 2.0 * EIGHTH if steep else base
    t = above / beside
    first = base + t * _arctangent_ratio(t * t)
    return math.pi - first if cosine < 0.0 else first
