"""Hyperbolic functions without cancellation.

For h^2 <= 4, the functions are Taylor polynomials in h^2, which the compiler can vectorize. Terms below 1e-18 are
omitted. Each polynomial is the sum of four independent chains, because in a single chain each product would wait for
the previous product.
"""

from __future__ import annotations

import math

from sagline.kernels.jit import formula

POLYNOMIAL_LIMIT = 4.0  # largest h^2
EXCESS_LIMIT = 0.0625  # largest u^2


@formula
def sinhc_polynomial(y: float) -> float:
    """The ratio sinh(h)/h for y = h^2 <= 4."""
    q = y * y
    r = q * q
    a = 1.0 + r * (1 / 362880 + r * (1 / 355687428096000))
    b = 1 / 6 + r * (1 / 39916800 + r * (1 / 121645100408832000))
    c = 1 / 120 + r * (1 / 6227020800 + r * (1 / 51090942171709440000))
    d = 1 / 5040 + r * (1 / 1307674368000 + r * (1 / 25852016738884976640000))
    return (a + y * b) + q * (c + y * d)


@formula
def cosh_polynomial(y: float) -> float:
    """Hyperbolic cosine of h for y = h^2 <= 4."""
    q = y * y
    r = q * q
    a = 1.0 + r * (1 / 40320 + r * (1 / 20922789888000 + r * (1 / 620448401733239439360000)))
    b = 1 / 2 + r * (1 / 3628800 + r * (1 / 6402373705728000))
    c = 1 / 24 + r * (1 / 479001600 + r * (1 / 2432902008176640000))
    d = 1 / 720 + r * (1 / 87178291200 + r * (1 / 1124000727777607680000))
    return (a + y * b) + q * (c + y * d)


@formula
def sinh_excess_polynomial(y: float) -> float:
    """The ratio (sinh(h) - h)/h^3 for y = h^2 <= 4."""
    q = y * y
    r = q * q
    a = 1 / 6 + r * (1 / 39916800 + r * (1 / 121645100408832000))
    b = 1 / 120 + r * (1 / 6227020800 + r * (1 / 51090942171709440000))
    c = 1 / 5040 + r * (1 / 1307674368000 + r * (1 / 25852016738884976640000))
    d = 1 / 362880 + r * (1 / 355687428096000)
    return (a + y * b) + q * (c + y * d)


@formula
def sinhc(h: float) -> float:
    """The ratio sinh(h)/h for any h below 700."""
    y = h * h
    if y <= POLYNOMIAL_LIMIT:
        return sinhc_polynomial(y)
    return math.sinh(h) / h


@formula
def cosh(h: float) -> float:
    """Hyperbolic cosine of any h below 700."""
    y = h * h
    if y <= POLYNOMIAL_LIMIT:
        return cosh_polynomial(y)
    return math.cosh(h)


@formula
def sinh_excess(h: float) -> float:
    """The difference sinh(h) - h for any h below 700, with full relative precision."""
    y = h * h
    if y <= POLYNOMIAL_LIMIT:
        return h * y * sinh_excess_polynomial(y)
    return math.sinh(h) - h


@formula
def atanhc(u: float) -> float:
    """The ratio atanh(u)/u for 0 <= u <= 0.5."""
    y = u * u
    if y < 0.01:  # ten terms of the series; the omitted terms are below 1e-20
        s = 1 / 21
        s = s * y + 1 / 19
        s = s * y + 1 / 17
        s = s * y + 1 / 15
        s = s * y + 1 / 13
        s = s * y + 1 / 11
        s = s * y + 1 / 9
        s = s * y + 1 / 7
        s = s * y + 1 / 5
        s = s * y + 1 / 3
        return s * y + 1.0
    return math.atanh(u) / u


@formula
def atanhc_excess_polynomial(y: float) -> float:
    """The difference atanh(u)/u - 1 for y = u^2 <= 0.0625: sixteen terms; omitted terms are below 1e-19."""
    q = y * y
    r = q * q
    a = 1 / 3 + r * (1 / 11 + r * (1 / 19 + r * (1 / 27)))
    b = 1 / 5 + r * (1 / 13 + r * (1 / 21 + r * (1 / 29)))
    c = 1 / 7 + r * (1 / 15 + r * (1 / 23 + r * (1 / 31)))
    d = 1 / 9 + r * (1 / 17 + r * (1 / 25 + r * (1 / 33)))
    return y * ((a + y * b) + q * (c + y * d))


@formula
def atanhc_excess(u: float) -> float:
    """Value of atanh(u)/u - 1 for 0 <= u < 1. The relative error is below rounding for u <= 0.25, and 1e-14 above."""
    y = u * u
    if y <= EXCESS_LIMIT:
        return atanhc_excess_polynomial(y)
    return math.atanh(u) / u - 1.0


EIGHTH = 0.25 * math.pi
LESS, MORE = math.sqrt(2.0) - 1.0, math.sqrt(2.0) + 1.0  # tangents of pi/8 and 3 pi/8


@formula
def _arctangent_ratio(y: float) -> float:
    """The ratio atan(t)/t for y = t^2 <= tan(pi/8)^2; a Chebyshev fit with an error below 2e-18."""
    q = y * y
    r = q * q
    a = 1.0 + r * (0.11111110717862655437 + r * 0.058457120303033402825)
    b = -0.3333333333333309862 + r * (-0.090908960306777095597 + r * -0.050298089787819524301)
    c = 0.19999999999935256646 + r * (0.076920314203395218376 + r * 0.037829796593064922401)
    d = -0.14285714278703770676 + r * (-0.066627926691573426279 + r * -0.017656020531304055162)
    return (a + y * b) + q * (c + y * d)


@formula
def angle(sine: float, cosine: float) -> float:
    """Angle from 0 to pi [rad] from `sine` >= 0 and `cosine`. Sine and cosine may have a common positive factor."""
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
