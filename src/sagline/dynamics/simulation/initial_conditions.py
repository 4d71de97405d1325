"""Initial conditions of a simulation, and its inputs as time tables."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.core.arguments import optional
from sagline.core.arrays import Array, checked, exactly, locked, number
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes
from sagline.kernels.dynamics.progress import CubicTableArrays
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.motion.anchors import AnchorMotion
from sagline.motion.path import checked_time
from sagline.robot.batch import dead_cable
from sagline.robot.drum import drum_tension
from sagline.robot.equilibrium import Equilibrium, equilibrium_of
from sagline.robot.pose import Pose, PoseLike
from sagline.robot.robot import Robot
from sagline.robot.routing import differs
from sagline.statics.balance import inertial_wrench

TableInTime = ArrayLike | tuple[ArrayLike, ArrayLike]  # one row, or times and one row per time


@dataclass(frozen=True, slots=True, eq=False)
class TimeTable:
    """Time table of n numbers: cubic between instants with given values and rates, constant outside its range."""

    time: Array  # instants [s], shape (K,), increasing
    value: Array  # shape (K, n)
    begin: Array  # rates at the start of each interval, shape (K - 1, n)
    end: Array  # rates at the end of each interval, shape (K - 1, n)

    @classmethod
    def constant(cls, value: Array) -> TimeTable:
        """Time table of the constant numbers `value` (n,)."""
        none = np.empty((0, value.size))
        return cls(np.zeros(1), np.array(value[None]), none, none)

    @classmethod
    def linear(cls, time: Array, value: Array) -> TimeTable:
        """Time table with linear interpolation between the rows of `value` (K, n)."""
        slope = np.diff(value, axis=0) / np.diff(time)[:, None]
        return cls(time, value, slope, slope)

    @classmethod
    def cubic(cls, time: Array, value: Array, rate: Array) -> TimeTable:
        """Time table with cubic interpolation between the rows of `value` (K, n), whose rates are `rate`."""
        return cls(time, value, np.ascontiguousarray(rate[:-1]), np.ascontiguousarray(rate[1:]))

    @classmethod
    def of(cls, given: Any, item: str, unit: str, columns: int, begin: float) -> TimeTable:
        """Convert `given` to a time table. It is one constant row, or times and rows with linear interpolation."""
        # shapes: given (n,) [s]; begin [s]
        if not (isinstance(given, tuple | list) and len(given) == 2):
            return cls.constant(exactly(given, item, unit, (columns,)))
        try:
            time = checked_time(given[0])
        except InvalidValueError as error:
            raise InvalidValueError(f"{item}: {error.item}", error.value, error.allowed, error.next_step) from None
        rows = checked(given[1], item, unit, shape=(None, columns))
        if rows.shape != (time.size, columns):
            allowed, step = f"shape ({time.size}, {columns})", "Give one row per time, or a single row."
            raise InvalidValueError(item, f"of shape {rows.shape}", allowed, step)
        if time[0] > begin:
            allowed, step = f"a time <= {begin:g} s, the start", "Start the table at the start of the simulation."
            raise InvalidValueError(f"{item}: time[0]", f"{time[0]:g} s", allowed, step)
        return cls.linear(time, rows) if time.size > 1 else cls.constant(rows[0])

    @property
    def arrays(self) -> CubicTableArrays:
        """Read-only, C-contiguous arrays for kernels."""
        given = self.time, self.value, self.begin, self.end
        time, value, begin, end = (locked(np.ascontiguousarray(part, dtype=np.float64).view()) for part in given)
        return time, value, begin, end

    def check_lengths(self, robot: Robot) -> None:
        """Reject lengths [m] that do not exceed the dead lengths of `robot`."""
        checked(self.value, "unstrained_length", "m")
        least, dead = self.value.min(axis=0), dead_cable(robot)
        if (short := least <= dead).any():
            i = int(np.argmax(short))
            allowed, step = f"> {dead[i]:g} m" + (", its dead length" if dead[i] else ""), "Give longer ones."
            raise InvalidValueError(f"unstrained_length: cable {i}", f"{least[i]:g} m", allowed, step)

    def columns(self, columns: Any) -> TimeTable:
        """Time table with only the numbers that `columns` selects."""
        return TimeTable(self.time, self.value[:, columns], self.begin[:, columns], self.end[:, columns])

    def joined_columns(self, other: TimeTable) -> TimeTable:
        """Append the numbers of `other`, a time table with the same instants."""
        pairs = ((self.value, other.value), (self.begin, other.begin), (self.end, other.end))
        return TimeTable(self.time, *(np.concatenate(pair, axis=1) for pair in pairs))

    def at(self, time: float | Array) -> tuple[Array, Array]:
        """Values and rates (..., n) at the times `time` (...). At a jump of a rate, the later rate is returned."""
        at = np.asarray(time)
        if len(self.time) == 1:
            value = np.zeros((*at.shape, 1)) + self.value[0]
            return value, np.zeros_like(value)
        k = np.clip(np.searchsorted(self.time, at, side="right") - 1, 0, len(self.time) - 2)
        whole = (self.time[k + 1] - self.time[k])[..., None]
        x = np.clip((at - self.time[k])[..., None] / whole, 0.0, 1.0)
        low, high = self.value[k], self.value[k + 1]
        slope = (high - low) / whole
        begin, end = self.begin[k] - slope, self.end[k] - slope
        bend = (1.0 - x) * begin - x * end
        value = (1.0 - x) * low + x * high + whole * x * (1.0 - x) * bend
        rate = slope + (1.0 - 2.0 * x) * bend - x * (1.0 - x) * (begin + end)
        within = (at >= self.time[0]) & (at < self.time[-1])
        return value, np.where(within[..., None], rate, 0.0)

    def with_instant(self, time: float) -> TimeTable:
        """Insert the instant `time` into the time table."""
        if time in self.time:
            return self
        k = int(np.searchsorted(self.time, time))
        value, rate = self.at(time)
        times, values = np.insert(self.time, k, time), np.insert(self.value, k, value, axis=0)
        if 0 < k < len(self.time):
            begin, end = np.insert(self.begin, k, rate, axis=0), np.insert(self.end, k - 1, rate, axis=0)
        else:  # before the first or after the last time, values are constant
            begin, end = (np.insert(rates, min(k, len(rates)), 0.0, axis=0) for rates in (self.begin, self.end))
        return TimeTable(times, values, begin, end)

    def with_stop(self, time: float, duration: float, columns: Any) -> TimeTable:
        """Reduce the rates of `columns` linearly to zero, from `time` on, within `duration` [s]."""
        table = self.with_instant(time).with_instant(time + duration)
        (start, rate), stop = table.at(time), time + duration
        later = np.flatnonzero(table.time >= time)
        passed = np.minimum(table.time[later] - time, duration)[:, None]
        value, begin, end = table.value.copy(), table.begin.copy(), table.end.copy()
        whole = (start + rate * passed * (1.0 - 0.5 * passed / duration))[:, columns]
        left = (rate * (1.0 - passed / duration))[:, columns]
        value[np.ix_(later, columns)] = whole
        inner = later[later < len(begin)]
        begin[np.ix_(inner, columns)] = left[: len(inner)]
        end[np.ix_(later[1:] - 1, columns)] = left[1:]
        assert stop in table.time
        return TimeTable(table.time, value, begin, end)


FIXED = TimeTable.constant(np.zeros(0))  # positions of anchors that do not move
SAME_PLACE = 1e-6  # positions of anchors count as equal up to this distance [m]
ROUNDING = 1e-12  # forces and moments below this share of the largest force and moment count as zero


@dataclass(frozen=True, slots=True, eq=False)
class InitialConditions:
    """Initial state of a robot, and its inputs."""

    robot: Robot
    model: CableModel  # cable model
    state: Equilibrium  # initial state, single
    poses: Pose  # poses along the motion, a batch
    twist: Array  # initial velocity of the platform's origin and angular velocity, world axes, (6,)
    rate: Array  # initial dL/dt [m/s], (m,), of a plan; otherwise zero
    lengths: TimeTable  # set points of the unstrained lengths [m]
    tensions: TimeTable  # expected tensions at the drums [N], at the same instants
    wrench: TimeTable  # external wrench on the platform
    begin: float  # first time [s]
    end: float  # last time of the inputs [s]
    frames: Array  # frame anchors [m] along the motion, at `poses`: (m, 3) or (P, m, 3)
    anchors: AnchorMotion | None  # motion of the frame anchors

    @property
    def places(self) -> TimeTable:
        """Time table of the positions of moving anchors (K, 3 m); no columns for fixed anchors."""
        if (moved := self.anchors) is None:
            return FIXED
        value, rate = (array(moved.time).reshape(moved.time.size, -1) for array in (moved.at, moved.velocity))
        span = moved.time[-1] - moved.time[0]  # beyond the end of its table, it would have no velocity
        time, last = np.append(moved.time, moved.time[-1] + span), value[-1:] + span * rate[-1:]
        return TimeTable.cubic(time, np.concatenate((value, last)), np.concatenate((rate, rate[-1:])))


def initial_conditions(
    start: Any,
    unstrained_length: Any,
    wrench: Any,
    duration: Any,
    pose: PoseLike | None = None,
    anchors: AnchorMotion | None = None,
) -> InitialConditions:
    """Check the initial conditions and inputs of `simulate`; `duration` in s."""
    moved = optional(anchors, AnchorMotion, "anchors")
    if moved is not None and isinstance(start, Robot) and pose is not None:
        start = start.replace(frame_anchors=moved._of(start, 0.0))
    if isinstance(start, Plan) and (start.path is not None or start.state.pose.shape):
        if unstrained_length is not None:
            step = "Give plan.state[0] to simulate lengths that differ from the plan."
            raise InvalidValueError("unstrained_length", "given with a plan", "None", step)
        initial = _from_plan(start)
    else:
        initial = _from_equilibrium(equilibrium_of(start, pose, "start"), unstrained_length)
    _check_robot(initial.robot, initial.model)
    end = initial.end
    if duration is not None:
        end = initial.begin + number(duration, "duration", "s", above=0.0)
    elif not end > initial.begin:
        step = "Give for instance duration=10.0."
        raise InvalidValueError("duration", "not given", "> 0 s for a robot at rest", step)
    table = initial.wrench
    if wrench is not None:
        table = TimeTable.of(wrench, "wrench", "N or N m", 6, initial.begin)
    initial.lengths.check_lengths(initial.robot)
    moved = initial.anchors if moved is None else moved
    if moved is not None:
        _check_anchors(initial.robot, moved, initial.begin, end)
    return replace(initial, wrench=table, end=end, anchors=moved)


def _check_anchors(robot: Robot, anchors: AnchorMotion, begin: float, end: float) -> None:
    """Refuse anchors that are not known until the end, or begin elsewhere than those of the robot at the start."""
    away = np.abs(anchors._of(robot, [begin, end])[0] - robot.frame_anchors).max()
    if away > SAME_PLACE:
        value, allowed = f"{away:.4g} m from those of the start, at {begin:g} s", "the same positions there"
        step = "Plan with these anchors, or start with robot.replace(frame_anchors=anchors.at(0.0)) and a pose."
        raise InvalidValueError("anchors", value, allowed, step)


def _from_plan(plan: Plan) -> InitialConditions:
    """Initial conditions for a plan along a path: they include the initial speed of the path."""
    path, rate = plan.path, plan.length_rate
    if path is None or rate is None:
        step = "Plan along a Path, or give plan.state and a duration."
        raise InvalidValueError("start", "a plan of poses without times", "a plan along a path", step)
    robot = plan.robot
    lost = np.flatnonzero(~plan.feasible)
    if lost.size:
        k = int(lost[0])
        why = PoseStatus(plan.status[k]).text
        step = "Plan a path on which all poses are feasible."
        raise InvalidValueError(f"start: sample {k}, {path.time[k]:g} s", f"without a solution ({why})", "solved", step)
    if plan.state.contact is not None and differs(robot, plan.state.contact.winding):
        step = "Plan without winding, because a simulation neglects the friction of pulleys."
        raise InvalidValueError("start: winding", "given", "None", step)
    inertial = inertial_wrench(robot, path.pose, path.twist, path.twist_rate)
    given = plan.state.wrench - inertial
    given[np.abs(given) <= ROUNDING * np.abs(inertial).max()] = 0.0
    some = np.unique(np.linspace(0, len(path) - 1, 16).astype(np.int64))
    tension = drum_tension(plan.state)
    return InitialConditions(
        robot=robot,
        model=plan.state.cables.model,
        state=plan.state[0],
        poses=path.pose[some],
        twist=path.twist[0],
        rate=rate[0],
        lengths=TimeTable.cubic(path.time, plan.unstrained_length, rate),
        tensions=TimeTable.linear(path.time, tension),
        wrench=TimeTable.linear(path.time, given) if given.any() else TimeTable.constant(np.zeros(6)),
        begin=float(path.time[0]),
        end=float(path.time[-1]),
        frames=robot.frame_anchors if plan.anchors is None else plan.anchors.at(path.time[some]),
        anchors=plan.anchors,
    )


def _from_equilibrium(state: Equilibrium, table: Any) -> InitialConditions:
    """Initial conditions for a robot at rest."""
    if state.pose.shape:
        item = f"a batch of {len(state)} equilibria"
        raise InvalidValueError("start", item, "a single equilibrium, or a plan", "Give one of them: state[0].")
    robot, length = state.one_robot, state.unstrained_length
    if np.isnan(length).any():
        step = "Give a feasible pose."
        raise InvalidValueError("start", "a state without lengths", "a state with a solution", step)
    tension, end = TimeTable.constant(np.nan_to_num(drum_tension(state))), 0.0
    lengths = TimeTable.constant(length)
    if table is not None:
        lengths = TimeTable.of(table, "unstrained_length", "m", robot.cable_count, 0.0)
        tension = TimeTable.linear(lengths.time, np.repeat(tension.value, lengths.time.size, axis=0))
        end = float(lengths.time[-1])
    return InitialConditions(
        robot=robot,
        model=state.cables.model,
        state=state,
        poses=Pose._adopt(state.pose.position[None], state.pose.quaternion[None]),
        twist=np.zeros(6),
        rate=np.zeros(robot.cable_count),
        lengths=lengths,
        tensions=tension,
        wrench=TimeTable.constant(state.wrench),
        begin=0.0,
        end=end,
        frames=robot.frame_anchors,
        anchors=None,
    )


def _check_robot(robot: Robot, model: CableModel) -> None:
    without_guides(robot, "simulate", "forward")
    if model.code not in (codes.CATENARY, codes.ELASTIC):
        step = "Plan with Catenary() or Elastic(), whose forces have an energy."
        raise InvalidValueError("start: model", f"{type(model).__name__}()", "Catenary() or Elastic()", step)
