"""All modes of a robot with cable mass below a frequency, their list, and the frequencies that a path excites most."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Final, NamedTuple

import numpy as np

from sagline.core.arguments import brief, instance, optional
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Columns, Result, Status, Tabular
from sagline.dynamics.trajectories.segments import RestToRestSegment, segments_of
from sagline.dynamics.vibration.dynamic_stiffness import Damping, check_model, single_state
from sagline.dynamics.vibration.flexibility import stretch_losses
from sagline.dynamics.vibration.robot_modes import VibrationModel
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.robot.robot import Robot
from sagline.statics.balance import inertial_wrench
from sagline.statics.stiffness import Modes, modes


class VibrationStatus(Status):
    """Status of a vibration: type of the equilibrium and of its cables."""

    SOLVED = 0, "all modes up to the requested frequency are found"
    UNSTABLE = 1, "the equilibrium is unstable along its negative_directions; simulate the motion"
    NO_LENGTHS = 2, "the pose has no solution: see the status of the plan"
    FOLDED = (
        3,
        "a cable is folded or slack and has no linear vibration: its index is in slack_cables; the modes belong to the "
        "platform and the other cables",
    )


WITH_MODES: Final = (VibrationStatus.SOLVED, VibrationStatus.FOLDED)


def status_of(model: VibrationModel, row: int) -> tuple[VibrationStatus, Array, Array]:
    """Status of the state `row`, its frequencies with massless cables (n,) [Hz], and its unstable directions (6, d)."""
    if np.isnan(model.stiffness[row]).any():
        return VibrationStatus.NO_LENGTHS, np.full(len(model.freedom), np.nan), np.empty((6, 0))
    frequency, unstable = model.massless_modes(row)
    if unstable.shape[1]:
        return VibrationStatus.UNSTABLE, frequency, unstable
    taut = model.strings.taut[row].all()
    return VibrationStatus.SOLVED if taut else VibrationStatus.FOLDED, frequency, unstable


_NEAR: Final = 3.0  # a second frequency is reported if its excitation times this factor exceeds the largest
_INSTANTS: Final = 2000  # number of instants of a segment for its inertial wrench


def _most_excited(state: Equilibrium, frequency: Array, shape: Array, path: Path) -> Array:
    """One or two natural frequencies that `path` excites most, as in `to_shape`."""
    # shapes: frequency (K,) [Hz]; shape (6, K); returns (1,) or (2,) [Hz]
    segments = [segment for segment in segments_of(instance(path, Path, "path")) if segment.curve is not None]
    known = np.flatnonzero(frequency > 0.0)
    if not (segments and known.size):
        item, value = ("path", "without motion") if not segments else ("modes", "without a frequency")
        raise InvalidValueError(item, value, "a motion, and modes that it can excite", "Use another path or state.")
    if np.isnan(frequency).any():
        step = "Use a stable state: this platform falls."
        raise InvalidValueError("modes", "of an unstable state", "of a stable state", step)
    frequency, shape = frequency[known], shape[:, known]
    excited = np.max([excitation(state.one_robot, segment, frequency, shape) for segment in segments], axis=0)
    order = np.argsort(-excited, kind="stable")[:2]
    return locked(frequency[order[excited[order] * _NEAR >= excited[order[0]]]])


def excitation(robot: Robot, segment: RestToRestSegment, frequency: Array, shape: Array) -> Array:
    """Excitation of each mode by `segment`, times the size of the platform motion in the mode."""
    # shapes: frequency (K,) [Hz]; shape (6, K); returns (K,)
    time = np.linspace(0.0, segment.duration, _INSTANTS + 1)
    assert segment.curve is not None
    motion = segment.rates(time)
    jet = segment.curve.at(motion[0])
    twist, twist_rate, _ = jet.twists(motion)
    force = inertial_wrench(robot, jet.pose, twist, twist_rate) @ shape  # modal force of each mode over time
    turning = 2.0 * np.pi * frequency
    transform = np.trapezoid(force * np.exp(-1j * np.outer(time, turning)), time, axis=0)
    return np.asarray(np.abs(transform) * np.linalg.norm(shape, axis=0) / turning)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Vibration(Result, Tabular):
    """Result of `vibration`: all modes of platform and cables below a frequency.

    Modes have unit modal mass. Their shapes are therefore in m/sqrt(kg). K is the number of modes.

    Attributes:
        state: The state, a single one.
        up_to: Upper limit of the mode frequencies [Hz].
        damping: Energy losses of the modes.
        status: Status: type of the equilibrium, and existence of linear vibrations.
        frequency: Natural frequencies with cable mass [Hz], ascending, shape (K,).
        shape: Motion of the platform (displacement of the center of mass, rotation vector, world axes), one mode per
            column, shape (6, K) [m/sqrt(kg), rad/(sqrt(kg) m)].
        platform_share: Platform share of the kinetic energy, shape (K,).
        cable_share: Share of each cable in the kinetic energy, shape (m, K). In each mode, all shares add up to 1.
        cable_shape: Displacement of the cables at equally spaced material points, frame end first, world axes, shape
            (K, m, P, 3) [m/sqrt(kg)].
        loss: Damping ratio of each mode, to first order in the damping, shape (K,).
        massless_frequency: Natural frequencies of the platform with massless cables [Hz], as in `modes`, shape (n,).
        count: Number of modes below `up_to`, from the exact count. The count does not use the computed modes. It is K
            if all modes are found.
        negative_directions: Unstable motions of the platform, one per column, shape (6, d); d = 0 at a stable
            equilibrium.
        slack_cables: Indices of the cables without linear vibrations.
    """

    _columns: ClassVar[Columns] = ("frequency", "platform_share", "loss")

    state: Equilibrium
    up_to: float
    damping: Damping
    status: VibrationStatus
    frequency: Array
    shape: Array
    platform_share: Array
    cable_share: Array
    cable_shape: Array
    loss: Array
    massless_frequency: Array
    count: int
    negative_directions: Array
    slack_cables: tuple[int, ...]

    @property
    def complete(self) -> bool:
        """True if the number of modes equals the exact count."""
        return self.status is VibrationStatus.SOLVED and self.count == self.frequency.size

    def to_shape(self, path: Path) -> Array:
        """Natural frequencies that `path` excites most, as input for a shaper; see `sagline.to_shape`.

        Args:
            path: Path from rest to rest. It preferably ends at the pose at which the modes were computed.

        Returns:
            Frequencies [Hz], shape (1,) or (2,), in order of decreasing excitation.

        Raises:
            InvalidValueError: In the cases listed for `sagline.to_shape`.
        """
        return _most_excited(self.state, self.frequency, self.shape, path)


UP_TO: Final = 20.0  # default upper limit of the mode frequencies [Hz]
POINTS: Final = 41  # number of points of a cable's shape


@of_equilibrium
def vibration(state: Equilibrium, *, up_to: float = UP_TO, damping: Damping | None = None) -> Vibration:
    """All modes of a robot with cable mass below a frequency.

    Platform and cables vibrate together. Each cable is a string that vibrates about its catenary, in the plane of the
    cable and normal to the plane. An independent exact count checks the number of modes.

    Args:
        state: A single equilibrium; a plan or a solution with a single pose; or a robot and a pose.
        up_to: Upper limit of the mode frequencies [Hz], > 0; by default 20 Hz.
        damping: Energy losses of the vibration, for `loss`; None: no losses.

    Returns:
        Vibration. Its status reports an unstable equilibrium, and folded or slack cables. Folded and slack cables have
        no linear vibrations; the modes do not include them.

    Raises:
        InvalidValueError: If the state is not a single Equilibrium with exact or elastic cables. If `up_to` is not
            positive, or more than 2,000 modes are below it.
        SaglineError: If the number of modes differs from the exact count.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
        >>> state = sl.inverse(sl.load_robot("cogiro"), pose).state
        >>> found = sl.vibration(state, up_to=5.0)
        >>> print(found.frequency[:3].round(3), "Hz with cable mass")
        [3.018 3.031 3.159] Hz with cable mass
        >>> print(found.massless_frequency[0].round(3), "Hz massless")
        4.382 Hz massless

    Source:
        docs/model.md, section 11.
    """
    check_model(single_state(state))
    limit = number(up_to, "up_to", "Hz", above=0.0)
    given = optional(damping, Damping, "damping") or Damping()
    model = VibrationModel(state)
    status, massless, unstable = status_of(model, 0)
    cables, none, count = state.cables.shape[-1], np.empty(0), 0
    arrays = {  # without modes
        **{"massless_frequency": massless, "negative_directions": unstable},
        **{"frequency": none, "platform_share": none, "loss": none, "shape": np.empty((6, 0))},
        **{"cable_share": np.empty((cables, 0)), "cable_shape": np.empty((0, cables, POINTS, 3))},
    }
    if status in WITH_MODES:
        found = model.modes(0, limit)
        shares, count = found.cable_shares(), found.frequency.size
        arrays |= {
            "frequency": found.frequency,
            "shape": found.platform,
            "platform_share": np.asarray(1.0 - shares.sum(axis=0)),
            "cable_share": shares,
            "cable_shape": found.components.shapes(found.ends, found.amplitudes, POINTS),
            "loss": found.damping_ratios(state.one_robot.cables.linear_density, shares, given),
        }
    slack = () if status is VibrationStatus.NO_LENGTHS else np.flatnonzero(~model.strings.taut[0]).tolist()
    kept = {name: locked(array) for name, array in arrays.items()}
    return Vibration(
        state=state, up_to=limit, damping=given, status=status, count=count, slack_cables=tuple(slack), **kept
    )


def to_shape(modes: Modes | Vibration, path: Path) -> Array:
    """Natural frequencies that a path excites most: one, or two if the second excitation is at least 1/3 of the first.

    The measure of the excitation is |phi . M d| |phi| |A(w)|/w. phi is the shape of the mode, d the direction of the
    motion, and A the Fourier transform of the acceleration along d. The measure combines the force on the mode at its
    frequency with the resulting platform motion. It is plausible, but not proved. Use it to choose the frequencies of a
    shaper, not to estimate the residual vibration.

    Args:
        modes: Modes at a single state, preferably the end of the path: `modes(plan.state[-1])` for massless cables, or
            `vibration(plan.state[-1])` for cables with mass.
        path: Path from rest to rest. The excitation of a mode is the largest excitation by any segment of the path.

    Returns:
        Frequencies [Hz], shape (1,) or (2,), in order of decreasing excitation.

    Raises:
        InvalidValueError: If the modes are of several states, or no mode has a frequency. If the path is in motion at
            an end, or does not move.

    Source:
        docs/howto/without-vibration.md.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> path = sl.quintic_path([(0, 0, 1.5), (3, 0, 1.5)], durations=2.0)
        >>> plan = sl.inverse(robot, path, tension=sl.MinimumNorm())
        >>> print(sl.to_shape(sl.modes(plan.state[-1]), path).round(2), "Hz")
        [2.75 1.84] Hz
    """
    given: object = modes
    if not isinstance(given, Modes | Vibration):
        step = "Create them: modes(plan.state[-1]), or vibration(plan.state[-1])."
        raise InvalidValueError("modes", brief(given), "a Modes or a Vibration", step)
    state = modes.state
    if state.pose.shape:
        value = f"of {len(state.pose)} states"
        raise InvalidValueError("modes", value, "of a single state", "Use the last pose: modes(plan.state[-1]).")
    return _most_excited(state, modes.frequency, modes.shape, path)


WITH_MASS, MASSLESS = "with cable mass", "massless"
EQUAL: Final = 1e-6  # energy shares with a smaller relative difference count as equal


class ListedMode(NamedTuple):
    """One mode."""

    number: int  # number of the mode within its kind, starting at 1
    kind: str  # "with cable mass" or "massless"
    frequency: float  # [Hz]
    platform_share: float  # platform share of the kinetic energy
    cable: int | None  # cable with the largest share of the energy; None if no cable has a share
    cable_share: float  # share of this cable
    loss: float  # damping ratio

    @property
    def name(self) -> str:
        """Name for the selection: "1", "massless 1"."""
        return f"{self.number}" if self.kind == WITH_MASS else f"{MASSLESS} {self.number}"

    @property
    def swings(self) -> str:
        """Name of the platform or cable with the largest share of the kinetic energy."""
        if self.cable is None or self.platform_share >= self.cable_share:
            return "platform"
        return f"cable {self.cable}"


def listed_modes(vibration: Vibration) -> list[ListedMode]:
    """All modes with cable mass, then all massless modes, each in ascending order."""
    share = vibration.cable_share
    # the first one if several cables are equal except for rounding
    most = np.argmax(share >= (1.0 - EQUAL) * share.max(axis=0), axis=0) if vibration.frequency.size else ()
    rows = zip(vibration.frequency, vibration.platform_share, most, vibration.loss, strict=True)
    swinging = [
        ListedMode(k + 1, WITH_MASS, float(frequency), float(own), int(cable), float(share[cable, k]), float(loss))
        for k, (frequency, own, cable, loss) in enumerate(rows)
    ]
    damping, platform = vibration.damping, modes(vibration.state)
    losses = damping.modal_damping + stretch_losses(vibration.state, platform, damping.loss_time)
    return swinging + [
        ListedMode(k + 1, MASSLESS, float(frequency), 1.0, None, 0.0, float(losses[k]))
        for k, frequency in enumerate(platform.frequency)
        if np.isfinite(frequency)
    ]


def mode_correlation(vibration: Vibration) -> Array:
    """Similarity of each massless mode to each mode with cable mass (a share from 0 to 1), shape (n, K)."""
    # A share is the squared mass-weighted product of the platform motions of both modes. The sum of the shares of a
    # massless mode over all modes, including modes above `up_to`, is less than 1 because of the motion of the cables
    massless = modes(vibration.state).shape
    mass = np.linalg.pinv(massless @ massless.T)
    return np.asarray((massless.T @ mass @ vibration.shape) ** 2)
