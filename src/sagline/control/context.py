"""Shared context of the controller's states: link, commands, estimate, fault rules, events, and the running motion."""

from __future__ import annotations

import gc
from collections.abc import Callable
from math import nan
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.control.checks import Motion
from sagline.control.commands import Sender, disagreement
from sagline.control.evidence import Cycle, Fault, Reaction
from sagline.control.execution import Execution, ExecutionStatus, execution_of
from sagline.control.faults import faults_of
from sagline.control.link import PERIOD, Link, Sample
from sagline.control.null_space import TensionLoop, TensionSettings
from sagline.control.real_time import Pace
from sagline.control.recording import CycleTable, Event, EventKind, Journal, Recorded, Recorder
from sagline.control.set_points import Along, Standing, standing_at
from sagline.control.states import MOTION, RefusedError, State, check_transition
from sagline.core.arguments import brief, flag, instance, optional, whole_number
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.kinematics.forward_solver import ForwardSolver
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.drum import drum_lever
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import DEFAULT, method_of

MOST_SEED: Final = 2**128
SAME: Final = 1e-9  # largest deviation of the period, as a share of the period
MARGIN: Final = 500  # number of cycles in the table in addition to the plan, for ramps and pauses


class _Estimator:
    """Forward kinematics of each sample. Each search starts at the previous pose."""

    def __init__(self, robot: Robot, model: CableModel) -> None:
        self._solver = ForwardSolver(robot, model)
        self.forget()

    @property
    def pose(self) -> Pose | None:
        """Pose of the platform; None if unknown."""
        return Pose.from_quaternion(self.position, self.quaternion) if self.status in STABLE else None

    def forget(self) -> None:
        """Forget the pose."""
        # position: position of the platform's origin [m], shape (3,); NaN if it was never known
        # quaternion: rotation platform -> world, scalar last, shape (4,)
        # status: code of the `ForwardStatus`; -1 without an estimate
        self.position, self.quaternion, self.status = np.full(3, np.nan), np.full(4, np.nan), -1

    def begin_at(self, pose: Pose) -> None:
        self._solver.reset(pose)
        self.position, self.quaternion, self.status = pose.position, pose.quaternion, int(ForwardStatus.SOLVED)

    def locate(self, length: Array, wrench: Array | None) -> ForwardStatus | None:
        """Estimate the pose from `length` [m] and `wrench` (or None). Returns the status if the pose is newly lost."""
        position, quaternion = np.empty(3), np.empty(4)
        status = self._solver.step_into(length, position, quaternion, wrench)
        lost = status not in STABLE and self.status in STABLE
        self.position, self.quaternion, self.status = position, quaternion, int(status)
        return status if lost else None


class _Run:
    """The present motion with its record; if the robot is at rest, the last motion."""

    def __init__(self) -> None:
        self.motion: Motion | None = None  # planned motion; None for a jog of the platform, and before the first motion
        self.paused: Along | None = None
        # status: final status; RUNNING before the end of the motion
        # reason: reason of the status in one line
        self.status, self.reason = ExecutionStatus.RUNNING, ""
        self.first_event = 0
        self.table: CycleTable | None = None
        # recording: True if cycles are added to the table
        # announced: True between the messages to the recorder about the start and the end of the plan
        self.recording = self.announced = False


class Context:
    """Data and services that the states of a controller share."""

    def __init__(
        self,
        robot: Robot,
        link: Link,
        pace: Pace | None,
        model: CableModel | str | None,
        method: TensionMethod | str | None,
        settings: TensionSettings | None,
        record: Recorder | None,
        shadow: bool,
        seed: int | None,
    ) -> None:
        """Check the arguments of `Controller`; nothing is sent."""
        self.robot = instance(robot, Robot, "robot")
        m = robot.cable_count
        _check_link(link)
        drum_lever(robot, np.ones(m))  # raises an error if data of the winches are missing
        if sorted(winch for group in link.groups for winch in group) != list(range(m)):
            count = sum(map(len, link.groups))
            raise InvalidValueError("link", f"of {count} winches", f"{m}, as {robot.name} has", "Check the link.")
        self.link, self.pace = link, optional(pace, Pace, "pace")
        self.period = PERIOD if pace is None else pace.period
        _check_period(link, self.period)
        self.model = Catenary() if model is None else model_of(model)
        self.method = method_of(DEFAULT if method is None else method)
        self.settings = optional(settings, TensionSettings, "loop") or TensionSettings()
        self.shadow = flag(shadow, "shadow")
        self.random = np.random.default_rng(None if seed is None else whole_number(seed, "seed", 0, MOST_SEED))
        self.sender = Sender(m, self.random)
        self.estimator = _Estimator(robot, self.model)
        self.journal = Journal(record)
        self._uncollected = False  # True while a motion has switched garbage collection off
        self.state = State.OFF
        self.sample: Sample | None = None  # newest sample; None before the first
        # zero: offset from homing, added to lengths of samples [m], shape (m,)
        # homed: True if the pose of the platform is known
        self.zero, self.homed = np.zeros(m), False
        self.unknown = np.full(m, nan)
        # number: index of the cycle, from 0
        # time: time on the link's clock [s]
        self.number, self.time = 0, 0.0
        self.run = _Run()
        # previous_plan: plan at whose end the platform rests, so that the next plan can continue it; None otherwise
        self.previous_plan: Plan | None = None
        self.clear_faults()
        self.reset_tension_loop()

    # events

    def say(self, kind: EventKind, name: str, text: str) -> None:
        """Add an event."""
        if line := self.journal.add(Event(self.time, self.number, kind, name, self.state, text)):
            self.say(EventKind.FAULT, "recording stopped", line)

    def tell(self, what: Callable[[Recorder], object]) -> None:
        """Call a method of the recorder if there is a recorder."""
        if line := self.journal.tell(what):
            self.say(EventKind.FAULT, "recording stopped", line)

    def enter(self, state: State, text: str) -> None:
        """Change to `state`; raise an error if the table of transitions does not allow this change."""
        check_transition(self.state, state, state.name)
        self.state = state
        self.say(EventKind.STATE, state.name, text)

    # samples, faults and estimate

    def check_agreement(self, what: str) -> Sample:
        """Newest sample of the machine. If a group does not agree, the error names the refused request `what`."""
        if self.sample is None:
            raise RefusedError(what, "no group has answered", "Connect first.")
        why, _ = disagreement(self.sample, self.sender.owner, self.sender.counter, self.link.groups, self.period)
        if why is not None:
            raise RefusedError(what, *why)
        return self.sample

    def locate(self, sample: Sample, wrench: Array | None) -> str:
        """Estimate the pose, without the correction of the tension loop. Returns a message if the pose is lost."""
        length = sample.length + self.zero
        length -= self.correction
        lost = self.estimator.locate(length, wrench)
        if lost is None:
            return ""
        line = f"the pose of the platform is lost: {lost.text}. Check its position, acknowledge, and home again."
        self.say(EventKind.FAULT, "estimate", line)
        return line

    def find_faults(self, cycle: Cycle) -> tuple[Reaction, str]:
        """Check all fault rules. Returns the strongest reaction, and the message of the first fault requiring it."""
        reaction, first, homing = Reaction.EVENT, "", False
        for fault in self.faults:
            line = fault.look(cycle)
            if line is None:
                continue
            self.say(EventKind.FAULT, fault.name, line)
            homing |= fault.homing
            if fault.reaction > reaction:
                reaction, first = fault.reaction, line
        self.degraded = any([fault.present for fault in self.degrading])  # noqa: C419 takes a third of the time
        if homing:
            self.homed = False
        return reaction, first

    def clear_faults(self) -> None:
        """Start with a new set of fault rules."""
        self.faults: tuple[Fault, ...] = faults_of(
            self.robot, self.period, groups=self.link.groups, largest_correction=self.settings.largest
        )
        self.degraded = False
        self.degrading: list[Fault] = [fault for fault in self.faults if fault.reaction is Reaction.DEGRADED]

    def reset_tension_loop(self) -> None:
        """Create a tension loop with zero correction; None for a robot without redundancy."""
        m, n = self.robot.cable_count, self.robot.degrees_of_freedom
        self.tension_loop = TensionLoop(m, self.settings, self.period) if m > n else None
        self.correction = np.zeros(m)  # lengths that the tension loop adds to the lengths of the plan [m]

    def find_equilibrium(self, length: Array) -> Standing | ForwardStatus:
        """Equilibrium at `length` [m], (m,). The search takes 1 ms, or up to 10 ms if the pose is unknown."""
        return standing_at(self.robot, length, self.estimator.pose, self.model)

    # the running motion

    def begin_run(self, motion: Motion | None) -> None:
        """Begin the record of a motion."""
        run = self.run
        run.motion, run.paused = motion, None
        count = MARGIN + (0 if motion is None else len(motion))
        run.table = CycleTable(self.robot.cable_count, len(self.link.groups), count)
        run.first_event = len(self.journal.events)
        if run.announced:
            self._announce_end()  # the record of a paused plan ends here
        plan = None if motion is None else motion.plan
        if self.journal.watched and plan is not None:
            run.announced = True
            self.tell(lambda record: record.begins(plan))

    def continue_run(self) -> None:
        """Record cycles from this cycle on, and disable garbage collection."""
        run = self.run
        run.recording, run.status, run.reason = True, ExecutionStatus.RUNNING, ExecutionStatus.RUNNING.text
        if gc.isenabled():  # it can take longer than a cycle
            self._uncollected = True
            gc.disable()

    def collect_garbage(self) -> None:
        """Enable garbage collection again, if a motion has disabled it."""
        if self._uncollected:
            self._uncollected = False
            gc.enable()

    def end_run(self, status: ExecutionStatus, reason: str) -> None:
        """End the record of the motion with its final status, and enable garbage collection again."""
        self.run.status, self.run.reason = status, reason
        self.collect_garbage()

    def keep(self, cycle: Recorded) -> None:
        """Add a cycle to the table of the motion, and pass it to the recorder."""
        run = self.run
        if run.recording and run.table is not None:
            run.table.add(cycle)
            run.recording = self.state in MOTION
        self.tell(lambda record: record.cycle(cycle))
        if run.announced and not run.recording and run.paused is None:
            self._announce_end()

    def _announce_end(self) -> None:
        self.run.announced = False
        self.tell(lambda record: record.ends(self.run.status, self.run.reason))

    def execution(self) -> Execution | None:
        """Record of the last motion up to now; None before the first motion."""
        run = self.run
        if run.table is None:
            return None
        plan, events = None if run.motion is None else run.motion.plan, tuple(self.journal.events[run.first_event :])
        return execution_of(run.table, self.robot, plan, run.status, run.reason, self.period, self.zero, events)


def _check_link(link: object) -> None:
    """Reject an object that is not a link."""
    has = all(hasattr(link, name) for name in ("groups", "period")) and callable(getattr(link, "exchange", None))
    if isinstance(link, type) or not has:
        step = "Give machine.link() of a machine, or sl.plc.S7Link(addresses, robot)."
        raise InvalidValueError("link", brief(link), "a Link", step)


def _check_period(link: Link, period: float) -> None:
    """Reject PLCs whose period is not `period`, the period of the controller."""
    own = number(link.period, "link.period", "s", above=0.0)
    if abs(own - period) > SAME * period:
        step = f"Give the machine period={period:g}, or the controller pace=Pace({own:g})."
        allowed = f"{1e3 * period:g} ms, as the controller"
        raise InvalidValueError("link", f"of PLCs with a period of {1e3 * own:g} ms", allowed, step)
