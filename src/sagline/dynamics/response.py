"""How strongly a robot whose cables have mass answers a wrench that oscillates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import optional
from sagline.core.arrays import Array, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.memory import check_memory
from sagline.core.results import Result
from sagline.dynamics.answer import LOWEST, Answer
from sagline.dynamics.cable_dynamics import Complex, check_lengths, one_state
from sagline.dynamics.count import modes_below
from sagline.dynamics.damping import Damping
from sagline.dynamics.reduced import massless, setting_of
from sagline.dynamics.robot_modes import check_number
from sagline.robot.equilibrium import Equilibrium
from sagline.statics.slopes import cable_slopes

CHECKS: Final = 8  # frequencies at which the answer is compared with the exact one
_BYTES: Final = 20_000.0  # a frequency


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse(Result):
    """Result of `frequency_response` at F frequencies.

    Motions are (displacement of the center of mass [m], rotation vector [rad]), wrenches (force [N], moment [N m])
    about it, world axes, both complex amplitudes of what goes with exp(i omega t).

    Attributes:
        state: The state, a single one.
        damping: What takes energy out.
        frequency: [Hz], shape (F,).
        compliance: Motion by wrench with cable mass, shape (F, 6, 6) [m/N, rad/N, ...]; zero in motions that the
            robot's pattern does not have.
        massless_compliance: The same on cables whose mass does not swing, of the same shape.
        checked_frequency: Those at which the compliance was compared with the exact one [Hz], shape (C,).
        deviation: By how much it is off there, of the exact one's norm, shape (C,).
    """

    state: Equilibrium
    damping: Damping
    frequency: Array
    compliance: Complex
    massless_compliance: Complex
    checked_frequency: Array
    deviation: Array


def frequency_response(state: Equilibrium, frequency: ArrayLike, damping: Damping | None = None) -> FrequencyResponse:
    """Motion of the platform for an oscillating wrench, cables with mass; and on massless cables, to compare.

    From the modes of every cable with its ends held; at some of the frequencies the exact stiffness of the cables is
    taken too, and the deviation told.

    Args:
        state: An equilibrium, a single one.
        frequency: [Hz], >= 0, shape (F,).
        damping: What takes energy out; None: nothing, the answer then is infinite at the natural frequencies. Its
            modal_damping is a loss factor twice as large of all stiffness, as in `dynamic_stiffness`.

    Returns:
        FrequencyResponse.

    Raises:
        InvalidValueError: If the state is no single Equilibrium with lengths, of exact or elastic cables; if a
            frequency is negative, or more than 2,000 modes lie below it.

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
    one_state(state)
    given = checked(frequency, "frequency", "Hz", low=0.0)
    if given.ndim != 1 or not given.size:
        raise InvalidValueError("frequency", f"of shape {given.shape}", "a list of frequencies", "Give one or more.")
    check_memory(f"{given.size:,} frequencies", _BYTES * given.size, "Take them in parts.")
    known = optional(damping, Damping, "damping") or Damping()
    setting = setting_of(state)
    check_lengths(state)
    check_number(modes_below(setting, 0, max(float(given.max()), LOWEST)), float(given.max()), "frequency")
    if massless(setting, 0)[1].shape[1]:
        step = "Simulate it; vibration() names the directions in which it leaves."
        raise InvalidValueError("state", "an unstable equilibrium", "a stable one, which has an answer", step)
    slopes = cable_slopes(state)
    answer = Answer(setting, slopes.matrix, slopes.blocks, known)
    compliance, still = answer.by_modes(given, answer.held(float(given.max())))
    some = np.unique(np.linspace(0, given.size - 1, CHECKS).round().astype(np.int64))
    wanted = answer.exactly(given[some])
    off = np.linalg.norm(compliance[some] - wanted, axis=(1, 2)) / np.linalg.norm(wanted, axis=(1, 2))
    return FrequencyResponse(state, known, given, locked(compliance), locked(still), locked(given[some]), locked(off))
