"""Dynamic stiffness of cables at their platform ends, and damping."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import check_memory, optional
from sagline.core.arrays import Array, Indices, checked, locked
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.core.fields import NumberFields, rule
from sagline.kernels import codes
from sagline.kernels.dynamics import collocation
from sagline.kernels.dynamics.collocation import dynamic_stiffnesses
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.statics.slopes import cable_slopes
from sagline.statics.strings import Strings, strings_of, undamped


@dataclass(frozen=True, slots=True)
class Damping(NumberFields):
    """Damping of a vibration; none by default.

    Attributes:
        loss_time: Loss time eta of the cables' stretch [s], >= 0 (Kelvin-Voigt model). At the angular frequency omega,
            EA is replaced by EA (1 + i omega eta).
        air_damping: Drag force per length and velocity of a cable [N s/m^2], >= 0.
        modal_damping: Additional damping ratio of every mode, >= 0, < 1.

    Raises:
        InvalidValueError: If a value is out of its range.

    Source:
        docs/vibration.md.
    """

    loss_time: float = field(default=0.0, metadata=rule("s", low=0.0))
    air_damping: float = field(default=0.0, metadata=rule("N s/m^2", low=0.0))
    modal_damping: float = field(default=0.0, metadata=rule(low=0.0))

    def __post_init__(self) -> None:
        """Check the values."""
        NumberFields.__post_init__(self)
        if self.modal_damping >= 1.0:
            step = "Give the ratio, 0.01 for 1 %."
            raise InvalidValueError("modal_damping", f"{self.modal_damping:g}", "< 1", step)


EXACT = 0.45 * np.pi  # largest phase of a transverse wave in an element [rad]
Complex = NDArray[np.complex128]
_BYTES = 400.0  # largest number of elements per cable and frequency


@of_equilibrium
def dynamic_stiffness(state: Equilibrium, frequency: ArrayLike, damping: Damping | None = None) -> Complex:
    """Dynamic stiffness of every cable at its platform end, for vibration about an equilibrium.

    The result is exact for vibrations in the plane of the elastic catenary and normal to it, with any sag. The frame
    end is fixed. With a pulley or dead length, it is elastic, because the cable behind it stretches. At frequency zero
    the result is the cable stiffness of `stiffness`.

    Args:
        state: A single equilibrium; a plan or a solution with a single pose; or a robot and a pose.
        frequency: Frequencies [Hz], >= 0, shape (F,), or a single number.
        damping: Energy losses of the vibration; None: no losses. A modal_damping zeta acts as the loss factor 2 zeta of
            the whole stiffness. Every mode then has the damping ratio zeta.

    Returns:
        Complex array [N/m], shape (F, m, 3, 3), or (m, 3, 3) for a single frequency, world axes; NaN for folded or
        slack cables, which have no linear vibration.

    Raises:
        InvalidValueError: If the state is not a single Equilibrium with lengths and with exact or elastic cables; if a
            frequency is negative, or so high that a cable would have more than 100,000 waves.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
        >>> plan = sl.inverse(sl.load_robot("cogiro"), pose)
        >>> still, moving = sl.dynamic_stiffness(plan.state, [0.0, 4.0])[:, 0]
        >>> print(still[0, 0].real.round(), moving[0, 0].real.round(), "N/m")
        36202.0 47220.0 N/m

    Source:
        docs/model.md, section 11.
    """
    check_model(single_state(state))
    given = checked(frequency, "frequency", "Hz", low=0.0)
    if given.ndim > 1:
        raise InvalidValueError("frequency", f"of shape {given.shape}", "one frequency or a list", "Flatten it.")
    optional(damping, Damping, "damping")
    check_solved(state)
    cables = state.cables.shape[-1]
    check_memory(f"{given.size:,} frequencies", _BYTES * given.size * cables, "Split them into parts.")
    found = moving_stiffness(strings_of(state), given.reshape(-1), damping)
    found += cable_slopes(state).blocks
    return locked(found if given.ndim else found[0])


def single_state(state: Equilibrium) -> Equilibrium:
    """Check that `state` is a single equilibrium, and return it unchanged."""
    if state.pose.shape:
        step = "Select a single pose: state[i]."
        raise InvalidValueError("state", f"a batch of {len(state)}", "a single state", step)
    return state


def check_solved(state: Equilibrium) -> None:
    """Reject `state` if it has no lengths."""
    if np.isnan(state.unstrained_length).any():
        step = "See the status of the plan."
        raise InvalidValueError("state", "a state without lengths", "a state that was solved", step)


def check_model(state: Equilibrium) -> None:
    """Reject cable models without vibrations. Shallow cables have no potential energy, straight cables no stretch."""
    model = state.cables.model
    if model.code not in (codes.CATENARY, codes.ELASTIC):
        step = "Solve the pose with Catenary(), the default."
        raise InvalidValueError("the state's cable model", type(model).__name__, "Catenary, Elastic", step)


def moving_stiffness(strings: Strings, frequency: Array, damping: Damping | None) -> Complex:
    """Difference between dynamic and static stiffness of the cables of one state."""
    # shapes: frequency (F,) [Hz]; returns (F, m, 3, 3) [N/m]
    taut, found, _ = taut_stiffness(strings, 0, frequency, damping, EXACT)
    moving = np.full((frequency.size, strings.taut.shape[1], 3, 3), np.nan, dtype=np.complex128)
    moving[:, taut] = found
    return moving


def taut_stiffness(
    strings: Strings, row: int, frequency: Array, damping: Damping | None, phase: float
) -> tuple[Indices, Complex, Indices]:
    """Indices of taut cables, their dynamic minus static stiffness, and numbers of their modes below `frequency`."""
    # shapes: frequency (F,) [Hz]; phase of a wave in an element [rad]; returns (t,), (F, t, 3, 3) [N/m], (1, F, t, 2)
    waves = undamped(frequency[None]) if damping is None else _waves_of(frequency, damping)
    taut = np.flatnonzero(strings.taut[row])
    table = np.ascontiguousarray(strings.table[row : row + 1, taut])
    found = np.empty((1, frequency.size, taut.size, collocation.FOUND), dtype=waves.dtype)
    counts = np.empty((*found.shape[:-1], 2), dtype=np.int64)
    dynamic_stiffnesses(table, waves, phase, np.empty(collocation.ROOM, dtype=waves.dtype), found, counts)
    _check_counts(counts, frequency)
    return taut, _in_world(found[0], strings.axes[row, taut]), counts


def _check_counts(counts: NDArray[np.int64], frequency: Array) -> None:
    """Reject `frequency` if a cable would need too many elements, or has no solution, at one of its values."""
    # shapes: counts (1, F, m, 2); frequency (F,) [Hz]
    high = np.flatnonzero((counts == collocation.TOO_MANY).any(axis=(0, 2, 3)))
    if high.size:
        value = f"{frequency[high[0]]:g} Hz, at which a cable would have more than {collocation.MOST_ELEMENTS:,} waves"
        raise InvalidValueError("frequency", value, "a lower one", "Give one near the robot's natural frequencies.")
    if (lost := np.flatnonzero((counts < 0).any(axis=(0, 2, 3)))).size:
        text = f"at {frequency[lost[0]]:g} Hz a cable cannot be divided into elements with joints away from its nodes"
        raise SaglineError(f"{text}. Use another frequency, and report the robot and its pose.")


def _in_world(found: NDArray[np.float64] | Complex, axes: Array) -> Complex:
    """Cable stiffness in the plane and normal to the plane, converted to world axes."""
    # shapes: found (F, m, FOUND); axes (m, 3, 3); returns (F, m, 3, 3)
    xx, xz, zz, yy = np.moveaxis(found, -1, 0)[..., None, None]
    level, normal, up = np.moveaxis(axes, 1, 0)
    across = level[:, :, None] * up[:, None, :]
    return np.asarray(
        xx * (level[:, :, None] * level[:, None, :])
        + xz * (across + np.swapaxes(across, -1, -2))
        + zz * (up[:, :, None] * up[:, None, :])
        + yy * (normal[:, :, None] * normal[:, None, :]),
        dtype=np.complex128,
    )


def _waves_of(frequency: Array, damping: Damping | None) -> Complex:
    """Array for the kernels that contains `frequency` and `damping`."""
    # shapes: frequency (F,) [Hz]; returns (1, F, WAVE_COLUMNS)
    waves: Complex = undamped(frequency[None]).astype(np.complex128)
    if damping is not None:
        rate = 1j * waves[..., collocation.OMEGA]
        waves[..., collocation.DRAG] = rate * damping.air_damping
        waves[..., collocation.ACROSS] /= 1.0 + 2j * damping.modal_damping
        waves[..., collocation.ALONG] = waves[..., collocation.ACROSS] / (1.0 + rate * damping.loss_time)
    return waves
