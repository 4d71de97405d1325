"""How strongly the platform answers a force, over frequency: on cables with mass, and on massless ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arguments import choice, instance
from sagline.arrays import Array, locked
from sagline.dynamics.response import frequency_response
from sagline.dynamics.vibration import Vibration
from sagline.dynamics.vibration_status import VibrationStatus
from sagline.errors import InvalidValueError
from sagline.statics.stiffness import modes, stiffness

MOTIONS = ("x", "y", "z", "about x", "about y", "about z")
UNITS = {(False, False): "m/N", (False, True): "1/N", (True, False): "1/N", (True, True): "rad/(N m)"}
SAMPLES = 900  # evenly in the logarithm
NEAR = np.sinh(np.linspace(-8.0, 8.0, 33)) / np.sinh(8.0)  # about a peak: the denser the nearer
BESIDE = 0.03  # of a peak's frequency: how far these reach
BELOW = 6.0  # lowest frequency of a mode over that at which the curves begin


class ResponseCurves(NamedTuple):
    """Two answers to the same force.

    Attributes:
        frequency: [Hz], ascending, shape (F,).
        with_mass: Amplitude of the motion over that of the force, cables with mass, in `unit`, shape (F,).
        massless: The same on cables whose mass does not swing, shape (F,).
        static: The same at rest.
        unit: Of all of them.
    """

    frequency: Array
    with_mass: Array
    massless: Array
    static: float
    unit: str


def response_curves(vibration: Vibration, force: str = "x", motion: str | None = None) -> ResponseCurves:
    """The platform's motion for a force at its center of mass, over frequency, up to where all modes are known.

    Both are of `frequency_response`; air damping, which only swinging cables feel, has no part in the massless one.

    Args:
        vibration: Of a stable state.
        force: "x", "y", "z": a force along it; "about x", ...: a moment. World axes.
        motion: In the same words, the displacement of the center of mass or the rotation; None for that of the force.

    Returns:
        The curves.

    Raises:
        InvalidValueError: If the vibration has no modes, or there is no such motion.
    """
    state = instance(vibration, Vibration, "vibration").state
    if vibration.status is not VibrationStatus.SOLVED or not vibration.frequency.size:
        reason = vibration.status.name if vibration.status is not VibrationStatus.SOLVED else "no mode below up_to"
        raise InvalidValueError("vibration", reason, "a stable state with modes", "Ask for another state, or higher.")
    column = MOTIONS.index(choice(force, "force", MOTIONS))
    row = column if motion is None else MOTIONS.index(choice(motion, "motion", MOTIONS))
    natural = np.concatenate((vibration.frequency, modes(state).frequency))
    found = frequency_response(state, _grid(natural, vibration.up_to), vibration.damping)
    with_mass, massless = (np.abs(one[:, row, column]) for one in (found.compliance, found.massless_compliance))
    static = abs(float(stiffness(state).compliance[row, column]))
    return ResponseCurves(found.frequency, locked(with_mass), locked(massless), static, UNITS[row > 2, column > 2])


def _grid(natural: Array, highest: float) -> Array:
    """Frequencies evenly in the logarithm, and close to each peak."""
    even = np.geomspace(natural.min() / BELOW, highest, SAMPLES)
    near = (natural[:, None] * (1.0 + BESIDE * NEAR)).ravel()
    return np.unique(np.concatenate((even, near[(near > even[0]) & (near < highest)])))
