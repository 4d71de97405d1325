"""Null space of the structure matrix, the tension loop that acts in it, and parity of the load cells."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, field
from math import isfinite
from typing import Final, NamedTuple

import numpy as np

from sagline.control.link import PERIOD
from sagline.core.arguments import instance, whole_number
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import NumberFields, rule
from sagline.kinematics.plan import Plan
from sagline.robot.batch import first_of
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.robot.robot import Robot
from sagline.statics.slopes import cable_slopes, wrenches_by_length
from sagline.statics.stiffness import stiffness


def finite(values: Array) -> bool:
    """True if all values are finite, shape (m,)."""
    return isfinite(sum(values.tolist()))


def extrema(values: Array) -> tuple[float, float]:
    """Minimum and maximum; NaN if a value is not finite."""
    numbers = values.tolist()
    if not isfinite(sum(numbers)):
        return float(values.min()), float(values.max())
    numbers.sort()
    return numbers[0], numbers[-1]


def largest(values: Array) -> float:
    """Largest absolute value; NaN if a value is not finite."""
    least, most = extrema(values)
    return max(-least, most)


SIGMAS: Final = 5.0  # tolerance of a reading, in standard deviations
OWN_DEVIATION: Final = 1.0  # deviation of a load cell without data [N]
BIAS: Final = 2.0  # bias of a load cell without data [N], 0.1 % of 2 kN
_LIFT: Final = np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
_HIDDEN: Final = 1e-6  # an error is not visible if its visible part is below this share of it


def cell_errors(robot: Robot) -> tuple[Array, Array]:
    """Standard deviations and largest biases of good load cells [N], both of shape (m,)."""
    winches, none = robot.winches, np.zeros(robot.cable_count)
    own, bias = (none, none) if winches is None else (winches.load_cell_deviation, np.abs(winches.load_cell_bias))
    return np.where(own > 0.0, own, OWN_DEVIATION), np.maximum(bias, BIAS)


def _balance_slope(state: Equilibrium) -> Array:
    """Derivatives of the wrench with respect to frame-end tensions if the platform is fixed, (..., n, m) [1, m]."""
    slopes = cable_slopes(state)
    wrench = wrenches_by_length(state, slopes) / slopes.tension_by_length[..., None, :]
    return np.asarray(-first_of(state.robot).freedom @ wrench)  # minus: these forces act on the cable


@of_equilibrium
def parity(state: Equilibrium) -> Array:
    """Parity matrix for the detection of load cell faults. The weight of the load has no effect on it.

    At rest, the measured tensions must give the planned wrench. Only the vertical force may differ, because the weight
    of the load may be unknown. V projects tension errors onto all other changes of the wrench. Row i of the matrix is
    V_i/sqrt(V_ii). The product of row i and the tension errors (measured minus planned) is the visible part of the
    error of cell i that fits best. The cell with the largest product is reported.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments: robot, poses.

    Returns:
        Shape (..., m, m); zero rows for cells whose errors are not visible, NaN if the state has no lengths.

    Raises:
        InvalidValueError: If `state` has another type.

    Examples:
        >>> import sagline as sl
        >>> sl.control.parity(sl.load_robot("cogiro"), (1.0, 0.5, 2.0)).shape
        (8, 8)

    Source:
        docs/model.md, section 12.
    """
    slope = _balance_slope(state)
    lost = np.isnan(slope).any(axis=(-1, -2), keepdims=True)
    slope = np.where(lost, 0.0, slope)
    inverse = np.linalg.pinv(slope)
    load = inverse @ (first_of(state.robot).freedom @ _LIFT)
    size = np.linalg.norm(load, axis=-1, keepdims=True)
    load = load / np.where(size > 0.0, size, 1.0)
    visible = inverse @ slope - load[..., :, None] * load[..., None, :]
    own = np.einsum("...ii->...i", visible)
    scale = np.where(own > _HIDDEN, 1.0 / np.sqrt(np.maximum(own, _HIDDEN)), 0.0)
    return locked(np.where(lost, np.nan, scale[..., None] * visible))


class NullSpace(NamedTuple):
    """Null-space and parity matrices at a pose; N_L is `null_lengths`, and K_A is `tension_sensitivity`.

    Attributes:
        projection: Pi = N_L N_L^T, which projects changes of length onto changes that do not move the platform, shape
            (..., m, m).
        visible: K_A N_L G with G = (K_A N_L)^+, which projects tension errors onto the errors that changes of length in
            N_L can correct, shape (..., m, m).
        correction: N_L G, changes of length that correct these tension errors, shape (..., m, m) [m/N].
        parity: Parity matrix of the load cells, shape (..., m, m): see `parity`.
    """

    projection: Array
    visible: Array
    correction: Array
    parity: Array


@of_equilibrium
def null_space(state: Equilibrium) -> NullSpace:
    """Changes of length that do not move the platform, to first order, and the effect of these changes on the tensions.

    With eight cables, a tension error has eight components. Six of the components correspond to an unplanned wrench,
    for example due to a payload. A correction of an unplanned wrench would move the platform, and is therefore
    excluded.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments (robot,
            poses). The robot has more cables than free motions.

    Returns:
        Matrices for each equilibrium; NaN if the state has no lengths or its stiffness is singular.

    Raises:
        InvalidValueError: If `state` has another type.

    Examples:
        >>> import sagline as sl
        >>> null = sl.control.null_space(sl.load_robot("cogiro"), (1.0, 0.5, 2.0))

    Source:
        docs/model.md, section 12.
    """
    known = stiffness(state)
    basis = known.null_lengths
    slope = known.tension_sensitivity @ basis
    lost = np.isnan(slope).any(axis=(-1, -2), keepdims=True)
    inverse = np.where(lost, np.nan, np.linalg.pinv(np.where(lost, 0.0, slope)))
    projection = basis @ np.swapaxes(basis, -1, -2)
    return NullSpace(locked(projection), locked(slope @ inverse), locked(basis @ inverse), parity(state))


EVERY: Final = 0.5  # time between rows [s]; the platform moves 3 cm at the article's speed


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """Matrices of the tension loop at R poses of a plan.

    Attributes:
        time: Times of the R poses [s], strictly increasing, shape (R,). The time is 0 for a plan of a single pose.
        rows: Matrices at these poses.
    """

    time: Array
    rows: tuple[NullSpace, ...]
    _changes: tuple[float, ...]  # mean values of consecutive times, (R - 1,)

    def at(self, time: float) -> NullSpace:
        """Matrices of the pose whose time is nearest to `time`.

        Args:
            time: Time since the start of the path [s].
        """
        return self.rows[bisect_right(self._changes, time)]


def gains_along(plan: Plan, every: float = EVERY) -> Gains | None:
    """Gains of the tension loop along a plan.

    Args:
        plan: Feasible plan, along a path or of a single pose.
        every: Time between two rows [s], > 0; each row is at the nearest sample of the plan.

    Returns:
        The table. None for a robot without redundancy. The tensions of such a robot depend only on the load, so that it
        has no tension loop.

    Raises:
        InvalidValueError: If `plan` has several poses but no path, or has a pose without lengths.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> path = sl.quintic_path([(0, 0, 1.5), (0.3, 0, 1.5)], speed=0.1)
        >>> gains = sl.control.gains_along(sl.inverse(robot, path))
        >>> print(len(gains.rows), "rows")
        13 rows

    Source:
        docs/model.md, section 12.
    """
    step = number(every, "every", "s", above=0.0)
    state = instance(plan, Plan, "plan").state
    robot = first_of(state.robot)
    if robot.cable_count <= len(robot.freedom):
        return None
    if plan.path is None:
        if state.pose.shape:
            raise InvalidValueError("plan", "of poses without a path", "a plan with times", "Plan a path of the poses.")
        time, row = np.zeros(1), null_space(state)
        spaces = [row]
    else:
        chosen = _nearest(plan.path.time, step)
        time, batch = plan.path.time[chosen], null_space(state[chosen])
        spaces = [NullSpace(*parts) for parts in zip(*batch, strict=True)]
    lost = [i for i, row in enumerate(spaces) if np.isnan(row.correction).any()]
    if lost:
        raise InvalidValueError(
            "plan", f"without lengths or stiffness at {time[lost[0]]:g} s", "a feasible plan", "Change the path."
        )
    changes = tuple((0.5 * (time[1:] + time[:-1])).tolist())
    return Gains(locked(np.array(time)), tuple(spaces), changes)


def _nearest(time: Array, step: float) -> np.ndarray:
    """Indices of samples of `time`: the nearest to multiples of `step`, and the last one."""
    wanted = time[0] + step * np.arange(int((time[-1] - time[0]) / step) + 1)
    after = np.clip(np.searchsorted(time, wanted), 1, max(time.size - 1, 1))
    if time.size == 1:
        return np.zeros(1, dtype=np.int64)
    nearer = np.where(wanted - time[after - 1] <= time[after] - wanted, after - 1, after)
    return np.unique(np.append(nearer, time.size - 1))


MOST_CABLES: Final = 10**6
MOST_GAIN: Final = 0.1  # largest gain per cycle; a loop with a delay of five cycles is unstable above 0.17


@dataclass(frozen=True, slots=True)
class TensionSettings(NumberFields):
    """Settings of the tension loop. At a delay of 5 cycles, the defaults give stability margins of 24 dB and 62°.

    Attributes:
        filter_time: Time constant of the input filter [s], > 0.
        gain: Share of the error that is corrected in each cycle, 0 to 0.1. The value 0 switches the loop off.
        act_above: The loop begins to act if the largest tension error in the null space exceeds this value [N].
        rest_below: The loop stops acting if the largest tension error is below this value [N], >= 0, less than
            `act_above`.
        largest: Largest correction of a length [m], > 0.

    Raises:
        InvalidValueError: If a value is out of its range.
    """

    filter_time: float = field(default=0.5, metadata=rule("s", above=0.0))
    gain: float = field(default=0.01, metadata=rule(low=0.0))
    act_above: float = field(default=3.0, metadata=rule("N", above=0.0))
    rest_below: float = field(default=0.5, metadata=rule("N", low=0.0))
    largest: float = field(default=5e-3, metadata=rule("m", above=0.0))

    def __post_init__(self) -> None:
        """Check the values."""
        super(TensionSettings, self).__post_init__()
        if self.gain > MOST_GAIN:
            step = "Give 0.01; with a larger value, friction in the drives causes oscillations."
            raise InvalidValueError("gain", f"{self.gain:g}", f"0 to {MOST_GAIN:g}", step)
        if self.rest_below >= self.act_above:
            allowed = f"less than act_above, {self.act_above:g} N"
            raise InvalidValueError("rest_below", f"{self.rest_below:g} N", allowed, "Lower rest_below.")


class TensionLoop:
    """Correction of lengths that reduces the tension errors.

    The correction is kept for the whole session, because the errors of the lengths are constant. In each cycle, f <- f
    + h/(tau + h) (T - T_plan - f). While the loop acts, delta <- delta - k N_L G f. See docs/model.md, section 12.

    Attributes:
        settings: Gain, filter and limits.
        acting: True while the loop acts.
    """

    def __init__(self, cable_count: int, settings: TensionSettings | None = None, period: float = PERIOD) -> None:
        """Begin without correction.

        Args:
            cable_count: Number of cables m.
            settings: Settings of the loop.
            period: Period of a cycle [s], > 0.

        Raises:
            InvalidValueError: If an argument has the wrong type or is out of its range.
        """
        m = whole_number(cable_count, "cable_count", 1, MOST_CABLES)
        self.settings = TensionSettings() if settings is None else instance(settings, TensionSettings, "settings")
        cycle = number(period, "period", "s", above=0.0)
        self._share = np.full(m, cycle / (self.settings.filter_time + cycle))  # an array is faster than a number
        self._row: NullSpace | None = None
        self._filtered, self._correction = np.zeros(m), np.zeros(m)
        self._error, self._change = np.empty(m), np.empty(m)
        self.acting = False

    @property
    def correction(self) -> Array:
        """Correction of the lengths of the plan [m], shape (m,)."""
        return self._correction.copy()

    @property
    def error(self) -> float:
        """Largest filtered tension error in the null space [N]; 0 before the first step."""
        return 0.0 if self._row is None else float(np.abs(self._row.visible @ self._filtered).max())

    def step(self, tension: Array, planned: Array, row: NullSpace, *, frozen: bool = False) -> Array:
        """Correction for the next cycle.

        Args:
            tension: T_A, tension measured by the load cells [N], shape (m,).
            planned: Planned tension at the same time [N], shape (m,).
            row: Matrices of the tension loop at this time of the plan.
            frozen: True if the tensions are old or doubtful. Such tensions have no effect; the correction is only
                adapted to the pose.

        Returns:
            Correction of the lengths of the plan [m], shape (m,), an array owned by the caller.
        """
        if row is not self._row:  # a correction from another pose's null space would move the platform
            if self._row is not None:
                np.matmul(row.projection, self._correction, out=self._change)
                self._correction[:] = self._change
            self._row = row
        np.subtract(tension, planned, out=self._error)
        if not frozen and finite(self._error):  # a NaN would remain in the filter forever
            self._learn(row)
        return self._correction.copy()

    def _learn(self, row: NullSpace) -> None:
        """Filter the error, and change the correction if the error is large."""
        settings, change = self.settings, self._change
        self._error -= self._filtered
        self._error *= self._share
        self._filtered += self._error
        row.visible.dot(self._filtered, change)
        self.acting = bool(largest(change) > (settings.rest_below if self.acting else settings.act_above))
        if not self.acting:
            return
        row.correction.dot(self._filtered, change)
        change *= settings.gain
        self._correction -= change
        if (most := largest(self._correction)) > settings.largest:  # a fault rule reports a correction at its limit
            self._correction *= settings.largest / most  # separate limits would move the platform
