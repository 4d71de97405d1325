"""One cable of any model: length from tension, and force from length; docs/model.md, sections 2 and 3.

Forces act on the cable at its platform end; z points up. The equations of the elastic catenary (Irvine) are written in
ratios. The ratios stay regular as the weight per length w goes to zero, and are computed without cancellation.

The shallow cable is a straight line of tension tau plus a vertical force b on its platform end. The following equations
apply to the parabolic model (b = wD/2, k = g^2/24, stretching tension tau) and the empirical model (b = k_h rho D, k =
k_p, stretching tension |T|):

    T = tau (cos phi, sin phi) + (0, b)
    L = D (1 + k (rho D cos phi / tau)^2) / (1 + stretching tension/EA)
"""

from __future__ import annotations

import math

import numpy as np

from sagline.kernels import codes
from sagline.kernels.algebra import functions
from sagline.kernels.cable.terms import Chord, Force, Material, Model, PlaneVector
from sagline.kernels.jit import formula, kernel

RANGE = 500.0  # largest X = wD/(2 tau): sinh X overflows above it; practical cables are far below
TAUT_STRAIN = 0.01  # largest e = tau/EA at which two Newton steps reach full precision
ORDINARY_STRAIN = 0.1  # largest e at which three Newton steps reach full precision
CATENARY_STEPS = 80
# Relative steps after which the next step is smaller than the rounding error. Newton's method squares the error;
# Halley's method cubes it.
SMALL_NEWTON_STEP = 1e-9
SMALL_HALLEY_STEP = 1e-6
CLOSE = 0.1  # relative first step up to which two Halley steps are accurate
ORDINARY = 2.0  # largest h at which the polynomials have full precision
SPLIT = 134217729.0  # 2^27 + 1, factor that splits the mantissa of a number into two halves


@kernel
def slack_series(horizontal: float, vertical_a: float, vertical: float, tension_a: float, tension_b: float) -> float:
    """Ratio atanh(u)/u of P1 for any u = (T_zB - T_zA)/(T_A + T_B); infinite for a folded cable (u = 1)."""
    total = tension_a + tension_b
    u = (vertical - vertical_a) / total
    # T_A + T_B times (1 - u), from sums of positive terms instead of a subtraction
    square = horizontal * horizontal
    rest = square / (tension_b + abs(vertical)) + square / (tension_a + abs(vertical_a))
    if vertical * vertical_a > 0.0:
        rest += 2.0 * min(abs(vertical), abs(vertical_a))
    return 0.5 * math.log((1.0 + u) * total / rest) / u if rest > 0.0 else math.inf


@kernel
def catenary_end(
    horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> tuple[float, float]:
    """P1: position (x, z) of the platform end, on which the force (`horizontal`, `vertical`) acts."""
    vertical_a = vertical - weight * length
    tension_a = math.hypot(horizontal, vertical_a)
    tension_b = math.hypot(horizontal, vertical)
    total = tension_a + tension_b
    if total == 0.0:
        return 0.0, 0.0
    u = weight * length / total
    series = functions.atanhc(u) if u <= 0.5 else slack_series(horizontal, vertical_a, vertical, tension_a, tension_b)
    x = horizontal * length * (1.0 / stiffness + 2.0 / total * series) if horizontal != 0.0 else 0.0
    z = (vertical - 0.5 * weight * length) * length * (1.0 / stiffness + 2.0 / total)
    return x, z


@formula
def catenary_by_weight(
    horizontal: float, vertical: float, length: float, weight: float, stiffness: float
) -> PlaneVector:
    """Motion of the platform end per change of the weight per length, at fixed force [m^2/N]."""
    vertical_a = vertical - weight * length
    tension_a = math.hypot(horizontal, vertical_a)
    total = tension_a + math.hypot(horizontal, vertical)
    u = weight * length / total
    if u <= 0.5:
        excess = functions.atanhc_excess(u)
    else:
        excess = slack_series(horizontal, vertical_a, vertical, tension_a, total - tension_a) - 1.0
    total_w = -length * vertical_a / tension_a
    u_w = (length - u * total_w) / total
    x_w = 0.0
    if horizontal != 0.0:
        bend = (u * u / (1.0 - u * u) - excess) / u if u > 1e-8 else 2.0 / 3.0 * u
        x_w = 2.0 * horizontal * length * (bend * u_w - (1.0 + excess) * total_w / total) / total
    middle = vertical - 0.5 * weight * length
    z_w = -0.5 * length * length * (1.0 / stiffness + 2.0 / total) - 2.0 * middle * length * total_w / (total * total)
    return PlaneVector(x_w, z_w)


@formula
def is_ordinary(half_weight: float, strain: float) -> bool:
    """True if the steps for ordinary cables reach full precision: X <= 2 and e <= 0.1."""
    return half_weight * half_weight <= functions.POLYNOMIAL_LIMIT and strain <= ORDINARY_STRAIN


@formula
def _ordinary_newton_step(ratio: float, square: float, cosine2: float, sine2: float, strain: float) -> float:
    """One Newton step on P3 in its root form; square = X^2."""
    taut = 1.0 - strain * ratio
    y = square * taut * taut
    s = taut * functions.sinhc_polynomial(y)
    c = strain * functions.cosh_polynomial(y)
    inverse = 1.0 / (s + ratio * c)
    sag_force = sine2 * inverse * inverse
    root = math.sqrt(cosine2 + sag_force)
    excess = ratio - s * root
    slope = 1.0 + c * root - sag_force * inverse * (s * s * strain * strain * square * ratio) / root
    return ratio - excess / slope


@formula
def ordinary_length_ratio(half_weight: float, sine: float, cosine: float, strain: float) -> float:
    """L/D from P3 by two Newton steps, for X = wD/(2 tau) <= 2 and e = tau/EA <= 0.01. Up to e = 0.1, add a third step.

    The function has no branches and no inner loops, so that a loop over cables vectorizes.
    """
    cosine2 = cosine * cosine
    sine2 = sine * sine
    square = half_weight * half_weight
    start = functions.sinhc_polynomial(square)
    ratio = math.sqrt(start * start * cosine2 + sine2)  # solution of the inextensible cable
    ratio = ratio / (1.0 + strain * ratio)
    ratio = _ordinary_newton_step(ratio, square, cosine2, sine2, strain)
    return _ordinary_newton_step(ratio, square, cosine2, sine2, strain)


@formula
def ordinary_length_ratio_near(half_weight: float, sine: float, cosine: float, strain: float, ratio: float) -> float:
    """Ratio L/D after one Newton step from `ratio`, which is the ratio at a similar tension or after two steps."""
    return _ordinary_newton_step(ratio, half_weight * half_weight, cosine * cosine, sine * sine, strain)


@kernel
def length_ratio(half_weight: float, sine: float, cosine: float, strain: float) -> tuple[float, int]:
    """L/D and status of any cable from P3, by Newton steps that stay between two bounds of the solution."""
    if is_ordinary(half_weight, strain):
        ratio = ordinary_length_ratio(half_weight, sine, cosine, strain)
        if strain > TAUT_STRAIN:
            ratio = ordinary_length_ratio_near(half_weight, sine, cosine, strain, ratio)
        return ratio, codes.CABLE_SOLVED
    if not half_weight < RANGE:
        return math.nan, codes.CABLE_TOO_SLACK
    cosine2 = cosine * cosine
    sine2 = sine * sine
    square = half_weight * half_weight
    start = functions.sinhc(half_weight)
    high = math.sqrt(start * start * cosine2 + sine2)
    if strain * high > 1.0:
        high = 1.0 / strain
    low = 0.0
    ratio = high / (1.0 + strain * high)
    for _ in range(CATENARY_STEPS):
        taut = 1.0 - strain * ratio
        h = half_weight * taut
        s = taut * functions.sinhc(h)
        c = strain * functions.cosh(h)
        inverse = 1.0 / (s + ratio * c)
        sag_force = sine2 * inverse * inverse
        root = math.sqrt(cosine2 + sag_force)
        excess = ratio - s * root
        slope = 1.0 + c * root - sag_force * inverse * (s * s * strain * strain * square * ratio) / root
        if excess > 0.0:
            high = ratio
        else:
            low = ratio
        new = ratio - excess / slope
        if not low <= new <= high:
            new = 0.5 * (low + high)
        change = abs(new - ratio)
        ratio = new
        if change <= SMALL_NEWTON_STEP * ratio:
            return ratio, codes.CABLE_SOLVED
    return ratio, codes.CABLE_NOT_CONVERGED


@kernel
def sag_force_ratio(half_weight: float, sine: float, strain: float, ratio: float) -> float:
    """Sag force divided by the chord tension: T_z/tau - sin phi."""
    taut = 1.0 - strain * ratio
    h = half_weight * taut
    s = taut * functions.sinhc(h)
    c = functions.cosh(h)
    return half_weight * ratio + sine * (c / (s + strain * ratio * c) - 1.0)


@formula
def ordinary_sag_force_ratio(half_weight: float, sine: float, strain: float, ratio: float) -> float:
    """`sag_force_ratio` of an ordinary cable, without branches."""
    taut = 1.0 - strain * ratio
    y = half_weight * half_weight * taut * taut
    s = taut * functions.sinhc_polynomial(y)
    c = functions.cosh_polynomial(y)
    return half_weight * ratio + sine * (c / (s + strain * ratio * c) - 1.0)


@formula
def _product_error(a: float, product: float) -> float:
    """Exact value of a*a - product, where `product` is a*a after rounding (Dekker)."""
    split = SPLIT * a
    high = split - (split - a)
    low = a - high
    return ((high * high - product) + 2.0 * high * low) + low * low


@formula
def relative_excess(span: float, rise: float, length: float) -> float:
    """Value of (D^2 - L^2)/L^2. The difference is computed without rounding error."""
    x2 = span * span
    z2 = rise * rise
    l2 = length * length
    d2 = x2 + z2
    big = d2 - x2
    tail = (x2 - (d2 - big)) + (z2 - big)
    difference = d2 - l2
    big = difference - d2
    tail += (d2 - (difference - big)) - (l2 + big)
    tail += _product_error(span, x2) + _product_error(rise, z2) - _product_error(length, l2)
    return (difference + tail) / l2


@formula
def _parameter_start(xi: float, zeta: float, kappa: float, excess: float) -> float:
    """Initial value of h: root of xi^2 h^3/3 + excess h = 2 kappa (1 + excess); for deep sag, the asymptote."""
    scale = 3.0 / (xi * xi)
    p = scale * excess
    q = 2.0 * scale * kappa * (1.0 + excess)
    h = math.sqrt(max(-p, 0.0)) + np.cbrt(q)
    if p * h > q:
        h = q / p
    for _ in range(2):  # Newton steps from above on a convex cubic are monotone
        h -= (h * (h * h + p) - q) / (3.0 * h * h + p)
    if h > 1.0:
        steep = zeta / (1.0 + kappa)
        r = 2.0 * math.sqrt(max(1.0 - steep * steep, 1e-30)) / xi
        h = max(1.0, math.log(r * (1.0 + kappa + math.log(max(r, 1.0)))))
    return h


@formula
def _closure_error(
    h: float, functions_of_h: tuple[float, float, float], xi2: float, zeta2: float, kappa: float, excess: float
) -> tuple[float, float, float]:
    """Error of P2 at h, and its first and second derivatives. `functions_of_h`: sinh h, sinh h - h, and cosh h."""
    s, more, c = functions_of_h
    total = 1.0 / (h + kappa)
    lever = 1.0 / (s + kappa * c)
    a = s * total  # 1 + alpha
    alpha = (more - kappa) * total
    alpha1 = (c - a) * total
    alpha2 = (s - 2.0 * alpha1) * total
    e = s * lever  # 1 + eta
    eta = -kappa * c * lever
    eta1 = kappa * lever * lever
    eta2 = -2.0 * eta1 * lever * (c + kappa * s)
    error = excess + xi2 * alpha * (2.0 + alpha) + zeta2 * eta * (2.0 + eta)
    slope = 2.0 * (xi2 * a * alpha1 + zeta2 * e * eta1)
    bend = xi2 * (alpha1 * alpha1 + a * alpha2) + zeta2 * (eta1 * eta1 + e * eta2)
    return error, slope, bend


@formula
def halley_step(h: float, xi2: float, zeta2: float, kappa: float, excess: float) -> float:
    """One Halley step on P2 (docs/model.md, section 2) for h <= 2, without branches."""
    y = h * h
    more = h * y * functions.sinh_excess_polynomial(y)  # sinh h - h
    error, slope, bend = _closure_error(h, (h + more, more, functions.cosh_polynomial(y)), xi2, zeta2, kappa, excess)
    return h - error * slope / (slope * slope - error * bend)


@formula
def _catenary_parameter(xi: float, zeta: float, kappa: float, excess: float) -> tuple[float, int]:
    """P2: h and status of a cable with span/L = xi > 0, rise/L = zeta, kappa = wL/(2EA) and (D^2 - L^2)/L^2."""
    xi2 = xi * xi
    zeta2 = zeta * zeta
    low = 0.0
    high = math.inf
    h = _parameter_start(xi, zeta, kappa, excess)
    for _ in range(CATENARY_STEPS):
        s, more, c = h * functions.sinhc(h), functions.sinh_excess(h), functions.cosh(h)
        error, slope, bend = _closure_error(h, (s, more, c), xi2, zeta2, kappa, excess)
        if error > 0.0:
            high = h
        else:
            low = h
        if error > 1.0:  # the function is nearly exponential here; Newton's method is applied to its logarithm
            new = h - math.log1p(error) * (1.0 + error) / slope
        else:  # Halley
            new = h - error * slope / (slope * slope - error * bend)
        if not low <= new <= high:
            new = 0.5 * (low + high) if high < math.inf else 2.0 * h
        change = abs(new - h)
        h = new
        if change <= SMALL_HALLEY_STEP * (h + kappa):
            return h, codes.CABLE_SOLVED
    return h, codes.CABLE_NOT_CONVERGED


@formula
def _vertical_from_length(rise: float, length: float, weight: float, stiffness: float) -> tuple[float, float, int]:
    """Solution of P2 for a vertical chord, in closed form. Returns vertical force, chord tension and a status."""
    height = abs(rise)
    kappa = 0.5 * weight * length / stiffness
    stretch = (height - length) / length  # exact difference for a taut cable
    if stretch >= kappa:
        sag_force = stiffness * stretch
        vertical = math.copysign(sag_force, rise) + 0.5 * weight * length
        # tanh h = kappa/stretch; a weightless cable has h = 0
        h = math.atanh(kappa / stretch) if stretch > kappa else math.inf
        tension = sag_force if weight == 0.0 else 0.5 * weight * height / (h + kappa)
        return vertical, tension, codes.CABLE_SOLVED if tension > 0.0 else codes.CABLE_SLACK
    return 0.5 * weight * length + 0.5 * weight * rise / (1.0 + kappa), 0.0, codes.CABLE_SLACK


@kernel
def catenary_from_length(span: float, rise: float, length: float, weight: float, stiffness: float) -> tuple[Force, int]:
    """P2: force on the platform end, and a status. `weight` must be > 0."""
    if span == 0.0:
        vertical, tension, status = _vertical_from_length(rise, length, weight, stiffness)
        return Force(0.0, vertical, tension), status
    kappa = 0.5 * weight * length / stiffness
    excess = relative_excess(span, rise, length)
    inverse = 1.0 / length
    h, status = _catenary_parameter(span * inverse, rise * inverse, kappa, excess)
    half = 0.5 * weight / (h + kappa)
    tangent = h * functions.sinhc(h) / functions.cosh(h) if h < 20.0 else 1.0  # tanh h
    vertical = 0.5 * weight * (length + rise / (tangent + kappa))
    return Force(half * span, vertical, half * math.sqrt(span * span + rise * rise)), status


SHALLOW_STEPS = 60


@kernel
def stretching_tension(tension: float, sine: float, cosine: float, sag_force: float) -> float:
    """Magnitude of the force on the platform end [N], equal to the chord tension if `sag_force` is 0."""
    horizontal, vertical = tension * cosine, tension * sine + sag_force
    return math.sqrt(horizontal * horizontal + vertical * vertical)


@kernel
def shallow_length_ratio(
    tension: float, sine: float, cosine: float, sag_force: float, sag: float, stiffness: float
) -> float:
    """Ratio L/D. `sag`: k (rho D cos phi)^2 [N^2]. `sag_force`: b [N] if the stretching tension includes it, else 0."""
    return (1.0 + sag / (tension * tension)) / (1.0 + stretching_tension(tension, sine, cosine, sag_force) / stiffness)


@kernel
def _shallow_tension(
    chord: float, sine: float, cosine: float, sag_force: float, sag: float, stiffness: float, length: float
) -> tuple[float, bool]:
    """Chord tension of a shallow cable of the length `length`, and True if this tension was found."""
    # The first Newton steps solve the cubic equation of the parabolic model, from above its root. The later steps use
    # the length of the cable's own model and stay within two bounds. A cable without sag that is longer than its chord
    # has no tension.
    p = (length - chord) / length * stiffness
    q = stiffness * chord * sag / length
    tension = max(-p, 0.0) + np.cbrt(q)
    if p * tension * tension > q:
        tension = math.sqrt(q / p)
    if tension == 0.0:
        return 0.0, True
    for _ in range(SHALLOW_STEPS):
        new = tension - (tension * tension * (tension + p) - q) / (tension * (3.0 * tension + 2.0 * p))
        if not new < tension:
            break
        tension = new
    if sag_force == 0.0:
        return tension, True
    low = 0.0
    high = math.inf
    for _ in range(SHALLOW_STEPS):
        end = stretching_tension(tension, sine, cosine, sag_force)
        square = tension * tension
        error = length * (1.0 + end / stiffness) - chord * (1.0 + sag / square)
        slope = length * (tension + sag_force * sine) / (end * stiffness) + 2.0 * chord * sag / (square * tension)
        if error > 0.0:
            high = tension
        else:
            low = tension
        new = tension - error / slope
        if not low <= new <= high:
            new = 0.5 * (low + high) if high < math.inf else 2.0 * tension
        change = abs(new - tension)
        tension = new
        if change <= 4e-16 * tension:
            return tension, True
    return tension, change <= 1e-12 * tension


@kernel
def shallow_sag_force(model: Model, chord: float, density: float) -> float:
    """First-order sag force T_z - tau sin phi at the platform end [N]; 0 for weightless models."""
    if model.code == codes.STRAIGHT or model.code == codes.ELASTIC:
        return 0.0
    if model.code == codes.EMPIRICAL:
        return model.k_h * density * chord
    return 0.5 * density * model.gravity * chord


@kernel
def sag_of_shallow(model: Model, line: float) -> float:
    """The product k (rho D cos phi)^2 [N^2] of the shallow models. `line`: rho D cos phi [kg]."""
    k = model.k_p if model.code == codes.EMPIRICAL else model.gravity * model.gravity / 24.0
    return k * line * line


@kernel
def from_tension(model: Model, chord: Chord, material: Material, tension: float) -> tuple[float, float, int]:
    """Unstrained length [m], sag force T_z - tau sin phi [N] and status of a cable at the chord tension `tension`."""
    if model.code == codes.STRAIGHT:
        return chord.length, 0.0, codes.CABLE_SOLVED
    strain = tension / material.stiffness
    if model.code == codes.ELASTIC or material.density * model.gravity == 0.0:
        return chord.length / (1.0 + strain), 0.0, codes.CABLE_SOLVED
    sag_force = shallow_sag_force(model, chord.length, material.density)
    half_weight = 0.5 * material.density * model.gravity * chord.length / tension
    if not half_weight < RANGE:
        return math.nan, math.nan, codes.CABLE_TOO_SLACK
    if model.code == codes.CATENARY:
        ratio, status = length_ratio(half_weight, chord.sine, chord.cosine, strain)
        return chord.length * ratio, tension * sag_force_ratio(half_weight, chord.sine, strain, ratio), status
    sag = sag_of_shallow(model, material.density * chord.length * chord.cosine)
    if model.code == codes.EMPIRICAL:
        status = codes.CABLE_SOLVED if tension * abs(chord.sine) > abs(sag_force) else codes.CABLE_BELOW_VALIDITY
        ratio = shallow_length_ratio(tension, chord.sine, chord.cosine, sag_force, sag, material.stiffness)
        return chord.length * ratio, sag_force, status
    ratio = shallow_length_ratio(tension, chord.sine, chord.cosine, 0.0, sag, material.stiffness)
    return chord.length * ratio, sag_force, codes.CABLE_SOLVED


@kernel
def from_length(model: Model, span: float, rise: float, material: Material, length: float) -> tuple[Force, int]:
    """Force on the platform end of a cable with the unstrained length `length`, and a status."""
    if model.code == codes.STRAIGHT:
        return Force(math.nan, math.nan, math.nan), codes.CABLE_NO_TENSION
    weight = material.density * model.gravity
    if model.code == codes.CATENARY and weight > 0.0:
        return catenary_from_length(span, rise, length, weight, material.stiffness)
    chord = math.hypot(span, rise)
    sine = rise / chord
    cosine = span / chord
    if model.code == codes.ELASTIC or weight == 0.0:
        tension = max(material.stiffness * ((chord - length) / length), 0.0)
        status = codes.CABLE_SOLVED if tension > 0.0 else codes.CABLE_SLACK
        return Force(tension * cosine, tension * sine, tension), status
    sag_force = shallow_sag_force(model, chord, material.density)
    sag = sag_of_shallow(model, material.density * chord * cosine)
    stretch_force = sag_force if model.code == codes.EMPIRICAL else 0.0
    tension, found = _shallow_tension(chord, sine, cosine, stretch_force, sag, material.stiffness, length)
    status = codes.CABLE_SOLVED
    if not found:
        status = codes.CABLE_NOT_CONVERGED
    elif tension == 0.0:
        status = codes.CABLE_SLACK
    elif model.code == codes.EMPIRICAL and tension * abs(sine) <= abs(sag_force):
        status = codes.CABLE_BELOW_VALIDITY
    return Force(tension * cosine, tension * sine + sag_force, tension), status
