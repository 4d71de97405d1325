"""How strongly the platform answers a force, over frequency: on cables with mass, and on massless ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.dynamics.response import FrequencyResponse, frequency_response
from sagline.dynamics.vibration import Vibration
from sagline.dynamics.vibration_status import VibrationStatus
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
    _places(force, motion)
    natural = np.concatenate((vibration.frequency, modes(state).frequency))
    found = frequency_response(state, _grid(natural, vibration.up_to), vibration.damping)
    return drawn_curves(found, force, motion)


def drawn_curves(response: FrequencyResponse, force: str = "x", motion: str | None = None) -> ResponseCurves:
    """One element of what `frequency_response` found, as far as logarithmic axes can show it.

    Args:
        response: The response.
        force: As of `response_curves`.
        motion: As of `response_curves`.

    Returns:
        The curves, without what is at 0 Hz or has no end.

    Raises:
        InvalidValueError: If less than two frequencies are left, or there is no such motion.
    """
    row, column = _places(force, motion)
    answers = np.abs([one[:, row, column] for one in (response.compliance, response.massless_compliance)])
    kept = np.flatnonzero((response.frequency > 0.0) & np.isfinite(answers).all(axis=0))
    kept = kept[np.argsort(response.frequency[kept], kind="stable")]
    if len(kept) < 2:
        step = "Give more, np.geomspace(0.5, 20.0, 500) for instance."
        raise InvalidValueError("frequency", f"{len(kept)} of them above 0 Hz", "two at least", step)
    static = abs(float(stiffness(response.state).compliance[row, column]))
    with_mass, massless = (locked(answer[kept]) for answer in answers)
    return ResponseCurves(locked(response.frequency[kept]), with_mass, massless, static, UNITS[row > 2, column > 2])


def _places(force: str, motion: str | None) -> tuple[int, int]:
    """Row and column of a motion for a force."""
    column = MOTIONS.index(choice(force, "force", MOTIONS))
    return column if motion is None else MOTIONS.index(choice(motion, "motion", MOTIONS)), column


def _grid(natural: Array, highest: float) -> Array:
    """Frequencies evenly in the logarithm, and close to each peak."""
    even = np.geomspace(natural.min() / BELOW, highest, SAMPLES)
    near = (natural[:, None] * (1.0 + BESIDE * NEAR)).ravel()
    return np.unique(np.concatenate((even, near[(near > even[0]) & (near < highest)])))
