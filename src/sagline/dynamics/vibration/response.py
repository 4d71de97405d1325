"""Receptance of the platform, from component modes or exact, its peak, and its frequency response with curves."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import check_memory, choice, evenly_spaced, instance, optional
from sagline.core.arrays import Array, blocks, checked, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Tabular
from sagline.dynamics.vibration.component_modes import CableComponents, PlaneModes
from sagline.dynamics.vibration.dynamic_stiffness import (
    Complex,
    Damping,
    check_model,
    check_solved,
    moving_stiffness,
    single_state,
)
from sagline.dynamics.vibration.robot_modes import VibrationModel
from sagline.dynamics.vibration.vibration import Vibration, VibrationStatus
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.statics.slopes import CableSlopes, cable_slopes
from sagline.statics.stiffness import modes, stiffness

LOWEST: Final = 1.0  # [Hz], modes up to this frequency are always included
TAKEN: Final = 1.6  # modes up to this factor times the highest frequency are included
# losses couple modes up to this factor times the highest frequency; they damp each higher mode separately
COUPLED: Final = 1.5
BLOCK: Final = 128  # frequencies per block


# component modes of one state, and loss matrices of their stretch (None without loss)
FixedEndModes: TypeAlias = tuple[CableComponents, Array | None]


class Receptance:
    """Model of the platform's receptance."""

    def __init__(self, model: VibrationModel, slopes: CableSlopes, damping: Damping) -> None:
        """Model of one state, with a leading axis 1, and derivatives of its cable forces."""
        self.model, self.damping = model, damping
        # matrix: stiffness of the platform, not symmetric with an external moment, shape (6, 6)
        # cables: stiffness of the cables at their platform ends, shape (m, 3, 3)
        self.matrix, self.cables = slopes.matrix, slopes.blocks

    def fixed_end_modes(self, up_to: float) -> FixedEndModes:
        """Fixed-end modes of the cables up to the frequency `up_to` [Hz]."""
        components = CableComponents(self.model.strings, 0, max(TAKEN * up_to, LOWEST))
        return components, components.stretch_stiffness() if self.damping.loss_time > 0.0 else None

    def by_modes(self, frequency: Array, held: FixedEndModes) -> tuple[Complex, Complex]:
        """Two compliances: with cable mass, computed from the modes of the cables, and with massless cables."""
        # shapes: frequency (F,) [Hz]; returns (F, 6, 6)
        found = np.empty((2, frequency.size, 6, 6), dtype=np.complex128)
        for part in blocks(frequency.size, BLOCK):
            moving, still = self._moving(*held, 2.0 * np.pi * frequency[part])
            found[0, part] = self._compliance(frequency[part], moving)
            found[1, part] = self._compliance(frequency[part], still)
        return found[0], found[1]

    def exact(self, frequency: Array) -> Complex:
        """Compliance (F, 6, 6), computed from the exact dynamic stiffness of the cables; `frequency` (F,) [Hz]."""
        strings = self.model.strings
        moving = moving_stiffness(strings, frequency, self.damping)
        moving -= 2j * self.damping.modal_damping * self.cables  # the whole stiffness already includes modal damping
        moving[:, ~strings.taut[0]] = 0.0
        return self._compliance(frequency, moving)

    def _compliance(self, frequency: Array, moving: Complex) -> Complex:
        """Compliance: inverse of the dynamic stiffness. `moving` (F, m, 3, 3): dynamic part of cables' stiffness."""
        model, omega = self.model, 2.0 * np.pi * frequency[:, None, None]
        ends, freedom = model.ends[0], model.freedom
        on_platform = np.einsum("mai,fmab,mbj->fij", ends, moving, ends, optimize=True)
        whole = (1.0 + 2j * self.damping.modal_damping) * self.matrix + on_platform - omega**2 * model.mass[0]
        with np.errstate(all="ignore"):
            return np.asarray(freedom.T @ np.linalg.inv(freedom @ whole @ freedom.T) @ freedom)

    def _moving(self, components: CableComponents, lost: Array | None, omega: Array) -> tuple[Complex, Complex]:
        """Dynamic part of the cables' stiffness: first with cable mass, then without, (F, m, 3, 3) each."""
        model = self.model
        density = components.density[:, None, None]
        square = omega**2 - 1j * omega * self.damping.air_damping / density[:, 0]  # (t, F)
        loss = 1.0 + 2j * self.damping.modal_damping
        moving = np.zeros((omega.size, model.strings.taut.shape[1], 3, 3), dtype=np.complex128)
        still = np.zeros_like(moving)
        moving[:, components.taut] = -np.swapaxes(square, 0, 1)[..., None, None] * components.still[components.taut]
        aside = _driven_stiffness(components.normal, square, loss)
        if lost is None:
            inside = _driven_stiffness(components.plane, square, loss)
        else:
            scaled = np.asarray(1j * loss * self.damping.loss_time * omega, dtype=np.complex128)
            inside, bare = _driven_stiffness_with_loss(components.plane, square, loss, lost, scaled)
            still[:, components.taut] = _in_world(bare, components.axes[:, ::2])
            inside += bare
        across = _in_world(aside, components.axes[:, 1:2])
        moving[:, components.taut] += _in_world(inside, components.axes[:, ::2]) + across
        return moving, still


def _in_world(own: Complex, axes: Array) -> Complex:
    """Matrices (F, t, 3, 3) in world axes, converted from matrices (t, F, d, d) along directions (t, d, 3)."""
    return np.asarray(np.einsum("tai,tfab,tbj->ftij", axes, own, axes, optimize=True))


def _driven_stiffness(motions: PlaneModes, square: Complex, loss: complex) -> Complex:
    """Contribution of the fixed-end modes to the platform-end stiffness, with equal or no damping, (t, F, d, d)."""
    with np.errstate(all="ignore"):
        shares = square[..., None] ** 2 / (loss * motions.square[:, None] - square[..., None])
    return np.asarray(-np.einsum("tka,tfk,tkb->tfab", motions.drive, shares, motions.drive, optimize=True))


def _driven_stiffness_with_loss(
    motions: PlaneModes, square: Complex, loss: complex, lost: Array, scaled: Complex
) -> tuple[Complex, Complex]:
    """Contribution of fixed-end modes to the platform-end stiffness, with stretch loss; `lost` (t, d + k, d + k)."""
    d, factor = motions.drive.shape[2], scaled[None, :, None, None]
    by_end = -square[..., None, None] * motions.drive[:, None] + factor * lost[:, None, d:, :d]
    alone = loss * motions.square[:, None] - square[..., None]
    near = int((motions.square < COUPLED**2 * np.abs(square).max()).sum(axis=1).max())  # ascending for each cable
    own = factor * lost[:, None, d : d + near, d : d + near]
    index = np.arange(near)
    own[..., index, index] += alone[..., :near]
    stretched = np.einsum("tkk->tk", lost[:, d:, d:])[:, None, near:]
    far = by_end[..., near:, :] / (alone[..., near:] + factor[..., 0] * stretched)[..., None]
    moved = np.concatenate((np.linalg.solve(own, by_end[..., :near, :]), far), axis=2)
    return -np.swapaxes(by_end, -1, -2) @ moved, factor * lost[:, None, :d, :d]


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
        state: A single equilibrium; a plan or a solution with a single pose; or a robot and a pose.
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
    model = VibrationModel(state)
    check_solved(state)
    highest = float(given.max())
    model.checked_count(0, max(highest, LOWEST), "frequency")
    if model.massless_modes(0)[1].shape[1]:
        step = "Simulate it; vibration() names the unstable directions."
        raise InvalidValueError("state", "an unstable equilibrium", "a stable equilibrium, which has a response", step)
    receptance = Receptance(model, cable_slopes(state), known)
    compliance, still = receptance.by_modes(given, receptance.fixed_end_modes(highest))
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


class ResponseCurves:
    """Response curves with and without cable mass, for the same force."""

    def __init__(self, response: FrequencyResponse, force: str = "x", motion: str | None = None) -> None:
        """Curves of one element of a `FrequencyResponse`, within the range of logarithmic axes."""
        row, column = _places(force, motion)
        answers = np.abs([one[:, row, column] for one in (response.compliance, response.massless_compliance)])
        kept = np.flatnonzero((response.frequency > 0.0) & np.isfinite(answers).all(axis=0))
        kept = kept[np.argsort(response.frequency[kept], kind="stable")]
        if len(kept) < 2:
            step = "Give more frequencies, for instance np.geomspace(0.5, 20.0, 500)."
            raise InvalidValueError("frequency", f"{len(kept)} of them above 0 Hz", "at least two", step)
        self.static = abs(float(stiffness(response.state).compliance[row, column]))  # motion per static force
        # ascending frequencies [Hz], shape (F,), and the unit of all responses
        self.frequency, self.unit = locked(response.frequency[kept]), UNITS[row > 2, column > 2]
        # with_mass: amplitude of motion per force, with cable mass, in `unit`, shape (F,)
        # massless: amplitude with massless cables, shape (F,)
        self.with_mass, self.massless = (locked(receptance[kept]) for receptance in answers)

    @classmethod
    def of_vibration(cls, vibration: Vibration, force: str = "x", motion: str | None = None) -> ResponseCurves:
        """Component `motion` of the motion per `force` at the center of mass, up to the limit of the modes."""
        # Both curves are from `frequency_response`. The massless curve has no air damping, which acts only on cables
        # with mass
        state = instance(vibration, Vibration, "vibration").state
        if vibration.status is not VibrationStatus.SOLVED or not vibration.frequency.size:
            reason = vibration.status.name if vibration.status is not VibrationStatus.SOLVED else "no mode below up_to"
            step = "Use another state or a higher up_to."
            raise InvalidValueError("vibration", reason, "a stable state with modes", step)
        _places(force, motion)
        natural = np.concatenate((vibration.frequency, modes(state).frequency))
        found = frequency_response(state, _grid(natural, vibration.up_to), vibration.damping)
        return cls(found, force, motion)


def _places(force: str, motion: str | None) -> tuple[int, int]:
    """Row and column of the compliance matrix for a motion and a force."""
    column = MOTIONS.index(choice(force, "force", MOTIONS))
    return column if motion is None else MOTIONS.index(choice(motion, "motion", MOTIONS)), column


def _grid(natural: Array, highest: float) -> Array:
    """Frequencies with logarithmic spacing, and additional frequencies close to the peaks at `natural`."""
    even = np.geomspace(natural.min() / BELOW, highest, SAMPLES)
    near = (natural[:, None] * (1.0 + BESIDE * NEAR)).ravel()
    return np.unique(np.concatenate((even, near[(near > even[0]) & (near < highest)])))
