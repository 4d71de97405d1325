"""Executions on a machine: data and events of all cycles; position and tension errors."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any, ClassVar

import numpy as np

from sagline.control.link import Sample
from sagline.control.null_space import TensionSettings, gains_along
from sagline.control.recording import CycleTable, Event
from sagline.control.states import State
from sagline.core.arguments import instance, whole_number
from sagline.core.arrays import Array, Codes, Flags, Indices, locked, number
from sagline.core.results import Columns, Result, Saved, Status, Tabular
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


class ExecutionStatus(Status):
    """Status at the end of the execution of a plan."""

    DONE = 0, "the plan was executed to its end"
    PAUSED = 1, "the platform is on the path; resume() continues"
    STOPPED = 2, "the operator stopped the motion; plan again from the pose of the platform"
    FAULT = 3, "a fault stopped the motion: read the events, repair the cause, acknowledge"
    EMERGENCY = 4, "the drums are locked: read the events, unlock them at the machine, connect and home again"
    UNKNOWN = 5, "the record ends before the motion; check the machine"
    RUNNING = 6, "the motion is running"


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Samples(Result):
    """N samples of a machine. The fields have the meanings and units of the fields of `Sample`.

    The shape of `time` is (N,); that of the values of winches, `length` to `winch_fault`, (N, m); that of the values of
    groups, all others, (N, G). The lengths do not include the offset from homing. In cycles without a sample, floats
    are NaN, and integers are 0.
    """

    time: Array
    age: Array
    counter: Indices
    plc_time: Array
    owner: Indices
    echo: Indices
    status: Indices
    fault: Indices
    length: Array
    rate: Array
    torque: Array
    tension: Array
    filtered: Array
    counts: Indices
    state: Indices
    winch_fault: Indices
    discarded: Indices

    def __len__(self) -> int:
        """Number of samples N."""
        return len(self.time)

    def at(self, index: int) -> Sample:
        """One sample, with copied arrays and without the reasons of discarded blocks.

        Args:
            index: Index of the sample, from 0.

        Raises:
            InvalidValueError: If the sample does not exist.
        """
        row = whole_number(index, "index", 0, len(self) - 1)
        values = {f.name: getattr(self, f.name)[row] for f in fields(self)}
        return Sample(**{name: value.copy() for name, value in values.items()} | {"time": float(values["time"])})


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Execution(Result, Saved, Tabular):
    """Execution of a plan on a machine with m winches, in N cycles.

    In each cycle, a command is sent and a sample is received at the same time. The command therefore has no effect on
    this sample.

    Attributes:
        robot: Robot of the controller.
        plan: Whole plan; None without a plan, for example for a jog.
        status: Status at the end of the execution.
        reason: Reason for the end in one line.
        period: Period of a cycle [s].
        zero: Offset from homing that is added to the lengths of samples [m], shape (m,).
        events: Events during the motion.
        time: Time on the link's clock [s], shape (N,).
        answered: True for cycles with a sample, shape (N,).
        state: Codes of `State` at the end of each cycle, shape (N,).
        late: Delay of the start of each cycle [s], shape (N,).
        clock: Time since the start of the plan [s], shape (N,); NaN in cycles outside the plan.
        samples: Samples of the machine.
        position: Position of the platform's origin, estimated from the encoders [m], shape (N, 3).
        quaternion: Rotation platform -> world, estimated from the encoders, scalar last, shape (N, 4).
        estimate: Codes of `ForwardStatus` of the estimates, -1 without an estimate, shape (N,).
        mode: Codes of `Mode` of the commands, -1 without a command, shape (N,).
        set_length: Set points of the unstrained lengths, including the offset from homing [m], shape (N, m).
        set_rate: Set points of the length rates [m/s], shape (N, m).
        set_tension: Set points of the tensions at the drums [N], shape (N, m).
        planned_tension: Planned T_A at the time of each sample [N], shape (N, m); NaN without a plan.
        correction: Correction by the tension loop [m], which the set points include, shape (N, m).
    """

    _columns: ClassVar[Columns] = (
        "time",
        "@=position",
        *(f"q{axis}=quaternion.{k}" for k, axis in enumerate("xyzw")),
        "L#=length",
        "T#=tension",
        "planned T#=planned_tension",
        ("state", State),
    )

    robot: Robot
    plan: Plan | None
    status: ExecutionStatus
    reason: str
    period: float
    zero: Array
    events: tuple[Event, ...]
    time: Array
    answered: Flags
    state: Codes
    late: Array
    clock: Array
    samples: Samples
    position: Array
    quaternion: Array
    estimate: Codes
    mode: Codes
    set_length: Array
    set_rate: Array
    set_tension: Array
    planned_tension: Array
    correction: Array

    def __len__(self) -> int:
        """Number of cycles."""
        return len(self.time)

    @property
    def length(self) -> Array:
        """Unstrained lengths off the drums [m], shape (N, m), from the encoders and the offset from homing."""
        return locked(self.samples.length + self.zero)

    @property
    def tension(self) -> Array:
        """T_A measured by the load cells [N], shape (N, m)."""
        return self.samples.tension

    @property
    def pose(self) -> Pose:
        """N poses, estimated from the encoders; NaN without an estimate."""
        return Pose._adopt(self.position, self.quaternion)


def execution_of(
    table: CycleTable,
    robot: Robot,
    plan: Plan | None,
    status: ExecutionStatus,
    reason: str,
    period: float,
    zero: Array,
    events: tuple[Event, ...],
) -> Execution:
    """Create an execution from the cycles in `table`; `period` [s]; `zero` [m], (m,)."""
    rows: Any = table.rows
    names, sample = rows.dtype.names, rows["sample"]
    samples = Samples(locked(rows["time"]), **{name: locked(sample[name]) for name in sample.dtype.names})
    cycles = {name: locked(rows[name]) for name in names if name != "sample"}
    return Execution(robot, plan, status, reason, period, locked(zero.copy()), events, samples=samples, **cycles)


def planned_position(execution: Execution) -> Array:
    """Planned position of the platform's origin.

    Args:
        execution: N cycles.

    Returns:
        Positions [m], shape (N, 3); NaN outside the plan.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> position = sl.control.planned_position(done)  # doctest: +SKIP
    """
    done = instance(execution, Execution, "execution")
    plan = done.plan
    if plan is None or plan.path is None:
        still = np.full((len(done), 3), np.nan)
        if plan is not None and not plan.state.pose.shape:
            still[np.isfinite(done.clock)] = plan.state.pose.position
        return locked(still)
    clock, time = done.clock + plan.path.time[0], plan.path.time
    return locked(np.stack([np.interp(clock, time, course) for course in plan.path.pose.position.T], axis=1))


def position_error(execution: Execution) -> Array:
    """Estimated minus planned position of the platform's origin.

    Args:
        execution: N cycles.

    Returns:
        Errors along the world axes [m], shape (N, 3); NaN outside the plan and without an estimate.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> error = sl.control.position_error(done)  # doctest: +SKIP
    """
    planned = planned_position(execution)
    return locked(execution.position - planned)


def null_space_error(execution: Execution, filter_time: float | None = None) -> Array:
    """Tension errors in the null space of the structure matrix, computed as in the tension loop.

    Args:
        execution: N cycles.
        filter_time: Time constant of the input filter [s]; None for the default of the tension loop.

    Returns:
        e_N = K_A N_L G f [N], shape (N, m), with f = filtered T_A - planned T_A. NaN outside the plan, and for a robot
        without redundancy.

    Examples:
        >>> import sagline as sl
        >>> done = sl.load_execution("run.mcap")  # doctest: +SKIP
        >>> error = sl.control.null_space_error(done)  # doctest: +SKIP

    Source:
        docs/model.md, section 12.
    """
    done = instance(execution, Execution, "execution")
    time = TensionSettings().filter_time if filter_time is None else number(filter_time, "filter_time", "s", low=0.0)
    plan, error = done.plan, np.full(done.tension.shape, np.nan)
    gains = None if plan is None else gains_along(plan)
    if plan is None or gains is None:
        return locked(error)
    start = 0.0 if plan.path is None else float(plan.path.time[0])
    share = done.period / (time + done.period)
    filtered = np.zeros(done.tension.shape[1:])
    clock = (done.clock + start).tolist()
    away = done.tension - done.planned_tension
    known = np.isfinite(away.sum(axis=1)).tolist()
    for k, at in enumerate(clock):
        if known[k]:
            filtered += share * (away[k] - filtered)
        if at == at:
            error[k] = gains.at(at).visible @ filtered
    return locked(error)
