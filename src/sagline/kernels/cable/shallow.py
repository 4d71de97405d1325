"""The shallow cable: a straight line of tension tau plus a pull b on its platform end.

docs/model.md, section 3. One pair of equations serves the parabolic model (b = wD/2, k = g^2/24,
stretched by tau) and the article's empirical one (b = k_h rho D, k = k_p, stretched by |T|):

    T = tau (cos phi, sin phi) + (0, b)
    L = D (1 + k (rho D cos phi / tau)^2) / (1 + stretching tension/EA)
"""

from __future__ import annotations

import math

import numpy as np

from sagline.kernels.jit import kernel

STEPS = 60


@kernel
def stretching_tension(tension: float, sine: float, cosine: float, pull: float) -> float:
    """Magnitude of the force on the platform end [N]; the chord tension itself where pull is 0."""
    return math.hypot(tension * cosine, tension * sine + pull)


@kernel
def shallow_length_ratio(
    tension: float, sine: float, cosine: float, pull: float, sag: float, stiffness: float
) -> float:
    """L/D; sag = k (rho D cos phi)^2 [N^2], pull = b [N] where the stretch includes it."""
    return (1.0 + sag / (tension * tension)) / (1.0 + stretching_tension(tension, sine, cosine, pull) / stiffness)


@kernel
def shallow_tension(
    chord: float, sine: float, cosine: float, pull: float, sag: float, stiffness: float, length: float
) -> tuple[float, bool]:
    """Chord tension at which the shallow cable has the given length, and whether it was found.

    Newton from above on the cubic of the parabolic model, then on the model's own length, bracketed.
    A cable without sag that is longer than its chord carries nothing: 0.
    """
    p = (length - chord) / length * stiffness
    q = stiffness * chord * sag / length
    tension = max(-p, 0.0) + np.cbrt(q)
    if p * tension * tension > q:
        tension = math.sqrt(q / p)
    if tension == 0.0:
        return 0.0, True
    for _ in range(STEPS):
        new = tension - (tension * tension * (tension + p) - q) / (tension * (3.0 * tension + 2.0 * p))
        if not new < tension:
            break
        tension = new
    if pull == 0.0:
        return tension, True
    low = 0.0
    high = math.inf
    for _ in range(STEPS):
        end = stretching_tension(tension, sine, cosine, pull)
        square = tension * tension
        error = length * (1.0 + end / stiffness) - chord * (1.0 + sag / square)
        slope = length * (tension + pull * sine) / (end * stiffness) + 2.0 * chord * sag / (square * tension)
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
