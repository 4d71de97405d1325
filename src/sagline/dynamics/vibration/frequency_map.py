"""Lowest natural frequency and peak receptance of a robot at many poses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Final, TypeAlias

import numpy as np

from sagline.core.arguments import callback, instance, optional
from sagline.core.arrays import Array, Codes, Progress, blocks, locked, number
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.core.results import Columns, Result, Saved, Tabular
from sagline.dynamics.vibration.dynamic_stiffness import Complex, Damping, check_model
from sagline.dynamics.vibration.response import Receptance
from sagline.dynamics.vibration.robot_modes import StateModes, VibrationModel
from sagline.dynamics.vibration.vibration import UP_TO, WITH_MODES, VibrationStatus, status_of
from sagline.kinematics.inverse import inverse
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.robot import Robot
from sagline.statics.slopes import cable_slopes
from sagline.statics.stiffness import compliance_of
from sagline.tension.method import TensionMethod
from sagline.tension.methods import DEFAULT

BLOCK: Final = 16  # poses per block, about 0.05 s; interrupts are handled between blocks
_ONE_PERCENT: Final = Damping(modal_damping=0.01)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class FrequencyMap(Result, Saved, Tabular):
    """Result of `frequency_map` at N poses.

    Values are numbers for the statuses SOLVED and FOLDED, otherwise NaN. Frequencies are also NaN if no mode is below
    `up_to`.

    Attributes:
        robot: The robot.
        pose: The poses, a batch of N.
        up_to: Upper limit of the mode frequencies [Hz].
        damping: Energy losses.
        status: Codes of `VibrationStatus`, shape (N,).
        frequency: Lowest natural frequency with cable mass [Hz], shape (N,).
        massless_frequency: Lowest natural frequency of the platform with massless cables [Hz], shape (N,).
        platform_share: Platform share of the kinetic energy in the lowest mode with cable mass, shape (N,).
        peak: Largest receptance [m/N], static or near a mode below up_to, shape (N,). The receptance is the
            displacement of the center of mass per force at this point, in the direction of the largest response (see
            `frequency_response`). It is infinite without damping.
        peak_frequency: Frequency of the peak [Hz], shape (N,).
    """

    _columns: ClassVar[Columns] = (
        "pose",
        "frequency",
        "massless_frequency",
        "platform_share",
        "peak",
        "peak_frequency",
        ("status", VibrationStatus),
    )

    robot: Robot
    pose: Pose
    up_to: float
    damping: Damping
    status: Codes
    frequency: Array
    massless_frequency: Array
    platform_share: Array
    peak: Array
    peak_frequency: Array


def frequency_map(
    robot: Robot,
    poses: PoseLike,
    *,
    up_to: float = UP_TO,
    tension: TensionMethod | str = DEFAULT,
    damping: Damping | None = _ONE_PERCENT,
    progress: Progress | None = None,
) -> FrequencyMap:
    """Lowest frequency and largest receptance of a robot at many poses, with cable mass.

    At each pose, all modes below `up_to` are computed as in `vibration`. An exact count confirms the number of modes.

    Args:
        robot: The robot.
        poses: A batch of N.
        up_to: Upper limit of the mode frequencies [Hz], > 0; by default 20 Hz.
        tension: Tension distribution method, as in `inverse`.
        damping: Energy losses, which limit the largest receptance; by default a modal damping of 1 %. None: no losses.
        progress: Function that is called after every few poses with two numbers: finished poses, all poses.

    Returns:
        FrequencyMap.

    Raises:
        InvalidValueError: If an argument has the wrong type. If `up_to` is not positive, or too many modes are below
            it.
        SaglineError: If the number of modes differs from the exact count; the message names the pose.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> poses = sl.Pose.from_euler([[0, 0, 2], [3, 2, 2]], 0, 0, 0)
        >>> found = sl.frequency_map(sl.load_robot("cogiro"), poses, up_to=5.0)
        >>> print(found.frequency.round(2), "Hz with cable mass")
        [3.7  2.25] Hz with cable mass
        >>> print(found.massless_frequency.round(2), "Hz massless")
        [3.85 4.19] Hz massless

    Source:
        docs/model.md, section 11.
    """
    instance(robot, Robot, "robot")
    poses = pose_of(poses, "poses")
    if not poses.shape:
        raise InvalidValueError("poses", "a single pose", "a batch of poses", "For a single pose, use vibration.")
    limit = number(up_to, "up_to", "Hz", above=0.0)
    known = optional(damping, Damping, "damping") or Damping()
    report = callback(progress, "progress")
    state = inverse(robot, poses, tension=tension).state
    check_model(state)
    status = np.full(len(poses), VibrationStatus.NO_LENGTHS, dtype=np.int8)
    found = np.full((5, len(poses)), np.nan)
    for part in blocks(len(poses), BLOCK, report):
        own = state[part]
        model = VibrationModel(own)
        for k in range(len(own)):
            index = part.start + k
            status[index], massless, _ = status_of(model, k)
            if status[index] not in WITH_MODES:
                continue
            try:
                found[:, index] = _numbers_of_pose(own, model, k, limit, known, float(massless[0]))
            except SaglineError as error:
                raise _at_pose(index, error) from None
    return FrequencyMap(robot, poses, limit, known, locked(status), *(locked(row) for row in found))


def _numbers_of_pose(
    state: Equilibrium, model: VibrationModel, row: int, up_to: float, damping: Damping, lowest: float
) -> tuple[float, ...]:
    """Compute the values of one pose, in the order of `FrequencyMap`; `lowest`: lowest massless frequency [Hz]."""
    freedom = model.freedom
    rest = compliance_of(freedom, model.stiffness[row, None])[0, :3, :3]
    found = model.modes(row, up_to)
    if not found.frequency.size:
        return np.nan, lowest, np.nan, float(np.linalg.norm(rest, 2)), 0.0
    first = found.platform[:, 0]
    receptance = _modal_receptance(found, rest, damping.modal_damping)
    if damping.loss_time > 0.0 or damping.air_damping > 0.0:
        exact = Receptance(VibrationModel(state[row]), cable_slopes(state[row]), damping)
        held = exact.fixed_end_modes(up_to)

        def receptance(frequency: Array) -> Complex:
            """Receptance for losses that couple the modes."""
            return exact.by_modes(frequency, held)[0][:, :3, :3]

    shares = found.cable_shares() if damping.air_damping > 0.0 else np.zeros((0, found.frequency.size))
    ratios = found.damping_ratios(state.one_robot.cables.linear_density[: len(shares)], shares, damping)
    peak, at = _peak_receptance(receptance, found.frequency, ratios, damping)
    return float(found.frequency[0]), lowest, float(first @ model.mass[row] @ first), peak, at


def _at_pose(index: int, error: SaglineError) -> SaglineError:
    if isinstance(error, InvalidValueError):
        return InvalidValueError(f"pose {index}: {error.item}", error.value, error.allowed, error.next_step)
    return SaglineError(f"pose {index}: {error}")


_ForceReceptance: TypeAlias = Callable[[Array], Complex]  # displacements per force (F, 3, 3) at frequencies (F,)

# the search omits modes whose response is below this share of the largest response at a mode
LIKELY: Final = 0.4
REFINEMENTS: Final = 2  # number of refinements of the search
CLOSER: Final = 5  # number of new frequencies between two adjacent frequencies
WIDTHS: Final = np.linspace(-3.0, 3.0, 7)  # search points about a mode, in units of half the peak width


def _modal_receptance(found: StateModes, rest: Array, ratio: float) -> _ForceReceptance:
    """Receptance from the modes of a robot. A common loss factor of the whole stiffness does not couple these modes."""
    # shapes: rest (3, 3)
    natural = (2.0 * np.pi * found.frequency) ** 2
    products = (found.platform[:3, None] * found.platform[None, :3]).reshape(9, -1)
    lossy = 1.0 + 2j * ratio
    beyond = (rest - (products @ (1.0 / natural)).reshape(3, 3)) / lossy

    def receptance(frequency: Array) -> Complex:
        terms = 1.0 / (lossy * natural - (2.0 * np.pi * frequency[:, None]) ** 2)
        return np.asarray(beyond + (terms @ products.T).reshape(-1, 3, 3))

    return receptance


def _peak_receptance(
    receptance: _ForceReceptance, natural: Array, ratios: Array, damping: Damping
) -> tuple[float, float]:
    """Largest displacement per force in any direction, static or near a mode."""
    # shapes: natural (K,) [Hz]; ratios (K,); returns [m/N], [Hz]
    if damping == Damping():
        return np.inf, float(natural[0])
    around = np.concatenate(([0.0], natural))
    sizes = np.linalg.norm(receptance(around), axis=(1, 2))
    likely = np.flatnonzero(sizes[1:] >= LIKELY * sizes.max())
    near = natural[likely, None] * (1.0 + ratios[likely, None] * WIDTHS)
    frequency = np.unique(np.concatenate((around[:1], near.ravel())))
    for _ in range(REFINEMENTS):
        found = receptance(frequency)
        norms = np.sqrt(np.linalg.eigvalsh(np.swapaxes(found.conj(), -1, -2) @ found)[:, -1])
        best = int(np.argmax(norms))
        if not 0 < best < norms.size - 1:
            return float(norms[best]), float(frequency[best])
        top, before, after = (frequency[best + k] for k in (0, -1, 1))
        frequency = np.concatenate((np.linspace(before, top, CLOSER), np.linspace(top, after, CLOSER)[1:]))
    return _parabola_peak(np.array((before, top, after)), norms[best - 1 : best + 2])


def _parabola_peak(frequency: Array, norms: Array) -> tuple[float, float]:
    """Height and place of a peak from three values of `norms`, by a parabola through their inverse squares."""
    (before, after), flat = np.diff(frequency), norms**-2.0
    left, right = np.diff(flat) / (before, after)
    bend = (right - left) / (before + after)
    if not bend > 0.0:
        return float(norms[1]), float(frequency[1])
    slope = (left * after + right * before) / (before + after)
    off = -0.5 * slope / bend
    least = flat[1] + 0.5 * slope * off
    return float(least**-0.5), float(frequency[1] + off)
