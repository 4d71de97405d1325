"""Frequency response of a platform on cables with mass, and response curves for diagrams."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import choice, instance, optional
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.indices import evenly_spaced
from sagline.core.memory import check_memory
from sagline.core.results import Result
from sagline.core.table import Columns, Tabular
from sagline.dynamics.vibration.dynamic_stiffness import Complex, Damping, check_model, check_solved, single_state
from sagline.dynamics.vibration.receptance import LOWEST, Receptance
from sagline.dynamics.vibration.robot_modes import check_mode_count, massless_modes, modes_below, vibration_model
from sagline.dynamics.vibration.vibration import Vibration, VibrationStatus
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import modes, stiffness

CHECKS: Final = 8  # number of frequencies for the comparison with the exact response
_BYTES: Final = 20_000.0  # bytes per frequency


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencyResponse(Result, Tabular):
    """Result of `frequency_response` at F frequencies.

    A motion is (displacement of the center of mass [m], rotation vector [rad]). A wrench is (force [N], moment [N m])
    about the center of mass. Both are in world axes, as complex amplitudes with the time factor exp(i omega t).

    Attributes:
        state: The state, a single one.
        damping: Energy losses.
        frequency: Frequencies [Hz], shape (F,).
        compliance: Motion per wrench with cable mass, shape (F, 6, 6) [m/N, rad/N, ...]; zero for motions that the
            robot's motion pattern excludes.
        massless_compliance: Motion per wrench with massless cables, of the same shape.
        checked_frequency: Frequencies at which the compliance was compared with the exact one [Hz], shape (C,).
        deviation: Norm of the error of the compliance at these frequencies, relative to the norm of the exact
            compliance, shape (C,).
    """

    _columns: ClassVar[Columns] = ("frequency", *(f"{name}=compliance.{k}.{k} [m/N]" for k, name in enumerate("xyz")))

    state: Equilibrium
    damping: Damping
    frequency: Array
    compliance: Complex
    massless_compliance: Complex
    checked_frequency: Array
    deviation: Array


@of_equilibrium
def frequency_response(state: Equilibrium, frequency: ArrayLike, damping: Damping | None = None) -> FrequencyResponse:
    """Motion of the platform due to a harmonic wrench, with cable mass, and with massless cables for comparison.

    The response is computed from the fixed-end modes of every cable. At some of the frequencies it is compared with the
    response that follows from the exact dynamic stiffness of the cables.

    Args:
        state: A single equilibrium; a plan or a solution of one; or a robot and a pose.
        frequency: Frequencies [Hz], >= 0, shape (F,).
        damping: Energy losses. None: no losses, and an infinite response at the natural frequencies. A modal_damping
            zeta acts as the loss factor 2 zeta of the whole stiffness, as in `dynamic_stiffness`.

    Returns:
        FrequencyResponse.

    Raises:
        InvalidValueError: If the state is not a single Equilibrium with lengths and with exact or elastic cables. If a
            frequency is negative, or more than 2,000 modes are below it.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
        >>> state = sl.inverse(sl.load_robot("cogiro"), pose).state
        >>> damping = sl.Damping(modal_damping=0.01)
        >>> found = sl.frequency_response(state, [0.0, 4.4], damping)
        >>> for compliance in found.compliance, found.massless_compliance:
        ...     print((1e6 * np.abs(compliance[:, 0, 0])).round(1), "um/N")
        [4.  5.4] um/N
        [4. 6.] um/N

    Source:
        docs/model.md, section 11.
    """
    check_model(single_state(state))
    given = checked(frequency, "frequency", "Hz", low=0.0)
    if given.ndim != 1 or not given.size:
        raise InvalidValueError("frequency", f"of shape {given.shape}", "a list of frequencies", "Give at least one.")
    check_memory(f"{given.size:,} frequencies", _BYTES * given.size, "Split them into parts.")
    known = optional(damping, Damping, "damping") or Damping()
    model = vibration_model(state)
    check_solved(state)
    check_mode_count(modes_below(model, 0, max(float(given.max()), LOWEST)), float(given.max()), "frequency")
    if massless_modes(model, 0)[1].shape[1]:
        step = "Simulate it; vibration() names the unstable directions."
        raise InvalidValueError("state", "an unstable equilibrium", "a stable equilibrium, which has a response", step)
    slopes = cable_slopes(state)
    receptance = Receptance(model, slopes.matrix, slopes.blocks, known)
    compliance, still = receptance.by_modes(given, receptance.fixed_end_modes(float(given.max())))
    some = evenly_spaced(given.size, CHECKS)
    wanted = receptance.exact(given[some])
    off = np.linalg.norm(compliance[some] - wanted, axis=(1, 2)) / np.linalg.norm(wanted, axis=(1, 2))
    return FrequencyResponse(state, known, given, locked(compliance), locked(still), locked(given[some]), locked(off))


MOTIONS = ("x", "y", "z", "about x", "about y", "about z")
UNITS = {(False, False): "m/N", (False, True): "1/N", (True, False): "1/N", (True, True): "rad/(N m)"}
SAMPLES = 900  # number of logarithmically spaced frequencies
NEAR = np.sinh(np.linspace(-8.0, 8.0, 33)) / np.sinh(8.0)  # frequencies about a peak, denser close to it
BESIDE = 0.03  # range of these frequencies, divided by the frequency of the peak
BELOW = 6.0  # ratio of the lowest mode frequency to the start of the curves


class ResponseCurves(NamedTuple):
    """Response curves with and without cable mass, for the same force."""

    frequency: Array  # [Hz], ascending, shape (F,)
    with_mass: Array  # amplitude of motion per force, with cable mass, in `unit`, shape (F,)
    massless: Array  # amplitude with massless cables, shape (F,)
    static: float  # motion per static force
    unit: str  # unit of all responses


def response_curves(vibration: Vibration, force: str = "x", motion: str | None = None) -> ResponseCurves:
    """Component `motion` of the platform's motion per `force` at the center of mass, up to the limit of the modes."""
    # Both curves are from `frequency_response`. The massless curve has no air damping, which acts only on cables with
    # mass
    state = instance(vibration, Vibration, "vibration").state
    if vibration.status is not VibrationStatus.SOLVED or not vibration.frequency.size:
        reason = vibration.status.name if vibration.status is not VibrationStatus.SOLVED else "no mode below up_to"
        raise InvalidValueError(
            "vibration", reason, "a stable state with modes", "Use another state or a higher up_to."
        )
    _places(force, motion)
    natural = np.concatenate((vibration.frequency, modes(state).frequency))
    found = frequency_response(state, _grid(natural, vibration.up_to), vibration.damping)
    return curves_of_response(found, force, motion)


def curves_of_response(response: FrequencyResponse, force: str = "x", motion: str | None = None) -> ResponseCurves:
    """Curves of one element of a `FrequencyResponse`, within the range of logarithmic axes."""
    row, column = _places(force, motion)
    answers = np.abs([one[:, row, column] for one in (response.compliance, response.massless_compliance)])
    kept = np.flatnonzero((response.frequency > 0.0) & np.isfinite(answers).all(axis=0))
    kept = kept[np.argsort(response.frequency[kept], kind="stable")]
    if len(kept) < 2:
        step = "Give more frequencies, for instance np.geomspace(0.5, 20.0, 500)."
        raise InvalidValueError("frequency", f"{len(kept)} of them above 0 Hz", "at least two", step)
    static = abs(float(stiffness(response.state).compliance[row, column]))
    with_mass, massless = (locked(receptance[kept]) for receptance in answers)
    return ResponseCurves(locked(response.frequency[kept]), with_mass, massless, static, UNITS[row > 2, column > 2])


def _places(force: str, motion: str | None) -> tuple[int, int]:
    """Row and column of the compliance matrix for a motion and a force."""
    column = MOTIONS.index(choice(force, "force", MOTIONS))
    return column if motion is None else MOTIONS.index(choice(motion, "motion", MOTIONS)), column


def _grid(natural: Array, highest: float) -> Array:
    """Frequencies with logarithmic spacing, and additional frequencies close to the peaks at `natural`."""
    even = np.geomspace(natural.min() / BELOW, highest, SAMPLES)
    near = (natural[:, None] * (1.0 + BESIDE * NEAR)).ravel()
    return np.unique(np.concatenate((even, near[(near > even[0]) & (near < highest)])))
