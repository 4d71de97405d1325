"""The loop of the controller: what a cycle sends, and what follows from what comes back."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from functools import partial
from math import nan
from typing import Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary
from sagline.control.checks import Motion
from sagline.control.connecting import FRESH, Claim, Trouble, trouble
from sagline.control.estimator import Estimator
from sagline.control.evidence import Cycle, Fault, Reaction
from sagline.control.execution import Execution, ExecutionStatus, execution_of
from sagline.control.faults import faults_of
from sagline.control.homing import Homing
from sagline.control.jogging import PlatformJog
from sagline.control.link import PERIOD, Command, Link, Missing, Mode, Sample
from sagline.control.preloading import load_all
from sagline.control.real_time import Garbage, Pace, aside
from sagline.control.recording import Event, EventKind, Journal, Recorded, Recorder, Tape
from sagline.control.sender import Sender
from sagline.control.set_points import Along, Course, Ramp, SetPoint, Standing, standing_at
from sagline.control.states import HOLDS_GRANT, MOTION, RefusedError, State, check_transition
from sagline.control.tension_loop import TensionLoop, TensionSettings
from sagline.core.arguments import brief, instance, optional, whole_number
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import ForwardStatus
from sagline.robot.drum import drum_lever
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod
from sagline.tension.methods import Closest

LEAVING: Final = 0.3  # s, at most, until all grants are given back
MOST_SEED: Final = 2**128
SAME: Final = 1e-9  # of a period
ROOM: Final = 500  # cycles beside the plan's: ramps, pauses
FOLLOWING: Final = frozenset({State.IDLE, State.MOVING, State.JOGGING, State.PAUSING, State.STOPPING})
LOOP_ON: Final = frozenset({State.IDLE, State.MOVING, State.PAUSING})
UNWATCHED: Final = frozenset({State.OFF, State.CONNECTING})
STOPPED: Final = frozenset({State.STOPPING, State.FAULT, State.EMERGENCY})


class Loop:
    """One cycle after the other; `Controller` is what an operator has of it."""

    def __init__(
        self,
        robot: Robot,
        link: Link,
        pace: Pace | None,
        model: CableModel | None,
        method: TensionMethod | None,
        settings: TensionSettings | None,
        record: Recorder | None,
        shadow: bool,
        seed: int | None,
    ) -> None:
        """Prepare everything; the arguments are those of `Controller`."""
        self.robot = instance(robot, Robot, "robot")
        m = robot.cable_count
        _check_link(link)
        drum_lever(robot, np.ones(m))  # what is missing is told now
        if sorted(winch for group in link.groups for winch in group) != list(range(m)):
            count = sum(map(len, link.groups))
            raise InvalidValueError("link", f"of {count} winches", f"{m}, as {robot.name} has", "Check its addresses.")
        self._link, self._pace = link, optional(pace, Pace, "pace")
        self.period = PERIOD if pace is None else pace.period
        _check_period(link, self.period)
        self._model = optional(model, CableModel, "model") or Catenary()
        self._method = optional(method, TensionMethod, "tension") or Closest()
        self._settings = optional(settings, TensionSettings, "loop") or TensionSettings()
        self._shadow = shadow
        self._random = np.random.default_rng(None if seed is None else whole_number(seed, "seed", 0, MOST_SEED))
        self._sender = Sender(m, self._random)
        self._estimator = Estimator(robot, self._model)
        self._journal = Journal(record)
        self._garbage = Garbage()
        self.state = State.OFF
        self.sample: Sample | None = None
        self.zero, self.homed = np.zeros(m), False
        self._unknown = np.full(m, nan)
        self._number, self._time = 0, 0.0
        self._begin_without_motion()
        self._degrading: list[Fault] = []
        self._clear_faults()
        self._new_loop()
        if pace is not None:
            load_all(robot, self.period, self._model, self._method)

    def _begin_without_motion(self) -> None:
        """What there is before anything is sent."""
        self._claim: Claim | None = None
        self._refused: Trouble | None = None  # why the last claim was
        self._standing: Future[Standing | ForwardStatus] | None = None  # where it stands, while that is worked out
        self._homing: Homing | None = None
        self._most_tension: Array | None = None  # while a winch is jogged in homing
        self._course: Course | None = None
        self._paused: Along | None = None
        self._motion: Motion | None = None
        self._held: Plan | None = None  # what the next plan goes on from
        self._tape: Tape | None = None
        self._taping, self._told, self._told_of_plan = False, 0, False
        self._status, self._reason = ExecutionStatus.RUNNING, ""
        self._after, self._stop_asked, self._leaving = State.IDLE, False, 0
        self._point: SetPoint | None = None  # of the command that goes out next, where it has one

    @property
    def owner(self) -> int:
        """The controller's id."""
        return self._sender.owner

    @property
    def degraded(self) -> bool:
        """Whether tensions are not to be believed: the tension loop keeps what it has added, and learns nothing."""
        return self._is_degraded

    @property
    def events(self) -> tuple[Event, ...]:
        """What happened so far."""
        return tuple(self._journal.events)

    def events_from(self, first: int) -> list[Event]:
        """The events from one of them on.

        Args:
            first: How many there were when somebody looked last.
        """
        return self._journal.events[first:]

    @property
    def pace(self) -> Pace | None:
        """Real time; None on a lockstep clock."""
        return self._pace

    @property
    def clock(self) -> tuple[float, float] | None:
        """Where on the path it is, and how long that takes [s]; None beside one."""
        course = self._course
        if not isinstance(course, Along):
            return None
        return course.clock, self.period * (len(course.motion) - 1)

    @property
    def execution(self) -> Execution | None:
        """What became of the last motion, or has so far; None before the first."""
        if self._tape is None:
            return None
        plan, events = None if self._motion is None else self._motion.plan, tuple(self.events_from(self._told))
        how = (self._status, self._reason, self.period, self.zero, events)
        return execution_of(self._tape, self.robot, plan, *how)

    def cycle(self) -> None:
        """Do one cycle: send and take, estimate, look for faults, and prepare what goes out next.

        Whatever is raised within stops the winches: it is told, a command to hold is sent, and it is raised again.
        """
        try:
            self._cycle()
        except BaseException as error:
            self._break_off(error)
            raise

    def _cycle(self) -> None:
        """What `cycle` does."""
        late = 0.0 if self._pace is None else self._pace.wait()
        command, point, correction = self._sender.command, self._point, self._correction
        answer = self._link.exchange(command)
        self._time = answer.time
        sample = answer if isinstance(answer, Sample) else _aged(self.sample, answer)
        if sample is not None:
            before, self.sample = self.sample, sample
            planned = self._unknown if point is None else point.tension
            if self.homed or self._shadow:
                self._locate(sample, None if point is None else point.wrench)
            elif self._estimator.status >= 0:
                self._estimator.forget()
            if self._shadow or self.state not in UNWATCHED:
                row = None if point is None else point.row
                self._look(Cycle(sample, before, command, planned, row, correction, late, self._recording))
        if self._stop_asked:
            self._stop_now()
        self._prepare(answer)
        if self._taping or self._journal.watched:
            self._keep(command, answer, point, correction, late)
        self._number += 1

    def _break_off(self, error: BaseException) -> None:
        """Have the PLCs lead the rates to zero, whatever was raised: nobody may call the next cycle."""
        self._garbage.go_on()
        line = f"a cycle ended with {type(error).__name__}: {' '.join(str(error).split())[:160]}. The drives hold."
        self._say(EventKind.FAULT, "cycle broken off", line)
        if self.state is State.CONNECTING:
            self._leave(line)
            self._send_leave(None)
        elif self.state in HOLDS_GRANT and self.state is not State.EMERGENCY:
            self._end(ExecutionStatus.FAULT, line)
            self._sender.stand_at(self.sample)
            self._course, self._paused, self._homing = None, None, None
            if self.state is not State.FAULT:
                if self.state is not State.STOPPING:
                    self._enter(State.STOPPING, line)
                self._enter(State.FAULT, line)
            self._rest_now(Mode.HOLD, enabled=True)
        with suppress(Exception):  # the link itself may be what raises
            self._link.exchange(self._sender.command)

    @property
    def _recording(self) -> str:
        found: list[str] = []
        self._tell(lambda record: found.append(record.stopped))
        return found[0] if found else ""

    def _tell(self, what: Callable[[Recorder], object]) -> None:
        """Tell the one who looks on."""
        if line := self._journal.tell(what):
            self._say(EventKind.FAULT, "recording stopped", line)

    def _keep(
        self,
        command: Command | None,
        answer: Sample | Missing,
        point: SetPoint | None,
        correction: Array,
        late: float,
    ) -> None:
        """Hand the cycle to those who keep it."""
        clock, planned = (nan, self._unknown) if point is None else (point.clock, point.tension)
        cycle = Recorded(
            self._number, self.state, self.degraded, late, clock, command, answer, self._estimator.position,
            self._estimator.quaternion, self._estimator.status, self.zero, planned, correction,
        )  # fmt: skip
        if self._taping and self._tape is not None:
            self._tape.add(cycle)
            self._taping = self.state in MOTION
        self._tell(lambda record: record.cycle(cycle))
        if self._told_of_plan and not self._taping and self._paused is None:
            self._tell_end()

    def _tell_end(self) -> None:
        """Tell the one who looks on how the plan ended."""
        self._told_of_plan = False
        self._tell(lambda record: record.ends(self._status, self._reason))

    # what comes back

    def _locate(self, sample: Sample, wrench: Array | None) -> None:
        """Where the platform is by the encoders; what the tension loop added is taken for an error of theirs."""
        length = sample.length + self.zero
        length -= self._correction
        lost = self._estimator.locate(length, wrench)
        if lost is not None:
            line = f"the platform's place is lost: {lost.text}. Look where it is, acknowledge, and home again."
            self._say(EventKind.FAULT, "estimate", line)
            if self.state in FOLLOWING:
                self._react(Reaction.STOPPING, line)

    def _look(self, cycle: Cycle) -> None:
        """Let every rule look at the cycle, and do what follows."""
        reaction, first, homing = Reaction.EVENT, "", False
        for fault in self._faults:
            line = fault.look(cycle)
            if line is None:
                continue
            self._say(EventKind.FAULT, fault.name, line)
            homing |= fault.homing
            if fault.reaction > reaction:
                reaction, first = fault.reaction, line
        self._is_degraded = any([fault.present for fault in self._degrading])  # noqa: C419 a third of the time
        if first:
            self._react(reaction, first)
        if homing:
            self.homed = False

    def _react(self, reaction: Reaction, line: str) -> None:
        """Do what a fault asks for."""
        if self._shadow or reaction <= Reaction.DEGRADED:
            return
        if reaction is Reaction.EMERGENCY:
            if self.state is not State.EMERGENCY:
                self._end(ExecutionStatus.EMERGENCY, line)
                self.homed = False
                self._enter(State.EMERGENCY, line)
        elif self.state is State.STOPPING:
            self._after, self._status, self._reason = State.FAULT, ExecutionStatus.FAULT, line
        elif self.state not in STOPPED:
            self._begin_stop(State.FAULT, ExecutionStatus.FAULT, line)

    def _stop_now(self) -> None:
        """The operator asked for it."""
        self._stop_asked = False
        if self.state is State.CONNECTING:
            self._leave("the operator stopped")
        elif self.state in MOTION and self.state is not State.STOPPING:
            after = State.READY if self.state is State.HOMING else State.IDLE
            self._begin_stop(after, ExecutionStatus.STOPPED, "the operator stopped")

    def _begin_stop(self, after: State, status: ExecutionStatus, reason: str) -> None:
        """Lead the rates to zero from the set points that were sent last."""
        self._after, self._status, self._reason, self._paused = after, status, reason, None
        if self._point is not None:
            self._point = self._point._replace(done=False)
            self._course = Ramp(self._point, self.period)
        self._enter(State.STOPPING, reason)

    # what goes out

    def _prepare(self, answer: Sample | Missing) -> None:
        """The command of the next cycle."""
        state = self.state
        if state in FOLLOWING:
            if state in MOTION and (self._point is None or self._point.done):
                self._finish()
            if self.state in FOLLOWING and self._course is not None:
                self._follow(self._course)
                return
        state, sample = self.state, self.sample
        if state is State.CONNECTING and self._claim is not None:
            self._connect(self._claim, answer)
        elif state is State.HOMING and self._homing is not None and sample is not None:
            self._go_on_homing(self._homing, sample)
        elif state is State.OFF:
            self._send_leave(sample)
        elif state is State.EMERGENCY:
            self._rest_now(Mode.LOCK, enabled=False)
        else:
            self._rest_now(Mode.HOLD, enabled=True)

    def _follow(self, course: Course) -> None:
        """The next set point of a course, with what the tension loop adds."""
        due, point = self._point, course.step()
        row, sample = point.row, self.sample
        if self._loop is not None and row is not None and sample is not None and self.state in LOOP_ON:
            planned = point.tension if due is None else due.tension
            leads = point.leading or (due is not None and due.leading)  # tensions differ because they are meant to
            self._correction = self._loop.step(sample.tension, planned, row, frozen=self.degraded or leads)
        length = point.length + self._correction
        length -= self.zero
        self._point = point
        self._sender.follow(length, point.rate, point.drum_tension, point.enable)

    def _rest_now(self, mode: Mode, *, enabled: bool) -> None:
        self._point = None
        self._sender.rest(mode, enabled=enabled, claims=self.state is State.CONNECTING)

    def _send_leave(self, sample: Sample | None) -> None:
        """Give the grants back, until they are."""
        self._leaving = max(self._leaving - 1, 0)
        if self._leaving and (sample is None or bool((sample.owner == self.owner).any())):
            self._rest_now(Mode.LEAVE, enabled=False)
        else:
            self._point = None
            self._sender.nothing()

    def _connect(self, claim: Claim, answer: Sample | Missing) -> None:
        """Claim the groups, or give it up."""
        claim.look(answer, self._sender.counter)
        self._sender.stand_at(self.sample)
        if claim.ready:
            self._clear_faults()
            self._enter(State.READY, "all groups agree")
            self._rest_now(Mode.HOLD, enabled=True)
        elif claim.refused is not None:
            self._refused = claim.refused
            self._leave(claim.refused.reason)
            self._send_leave(self.sample)
        elif claim.mode is None:
            self._sender.nothing()
        else:
            self._rest_now(claim.mode, enabled=False)

    def _go_on_homing(self, homing: Homing, sample: Sample) -> None:
        """Jog, or look whether the tensions agree."""
        if self._course is not None:
            line = self._ends_jog(sample)
            if line:
                self._say(EventKind.NOTE, "jog", f"the jog ended: {line}")
                self._end_jog(homing, sample)
            elif self._point is not None and self._point.done:
                self._end_jog(homing, sample)
            else:
                self._follow(self._course)
                return
        elif homing.look(sample):
            self._accept(homing)
            self._follow(homing.standing)
            return
        self._rest_now(Mode.HOLD, enabled=True)

    def _ends_jog(self, sample: Sample) -> str:
        """Why a jog in homing goes no further, as tensions alone are watched; "" where it does."""
        stale = ~(sample.age <= FRESH * self.period)
        if stale.any():
            g = int(np.argmax(stale))
            return f"group {g} is silent for {sample.age[g]:.2g} s. Check its PLC and the network"
        if self.degraded:
            return "a load cell is not to be believed. Check the cells, then home again"
        most = self._most_tension
        if most is None or (sample.tension <= most).all():
            return ""
        i = int(np.argmax(~(sample.tension <= most)))
        return f"cable {i} has {sample.tension[i]:.1f} N; allowed: {most[i]:.1f} N"

    def _end_jog(self, homing: Homing, sample: Sample) -> None:
        self._course = None
        self._sender.stand_at(sample)
        homing.rest()

    def _accept(self, homing: Homing) -> None:
        """Lengths are those of the plan from here on."""
        self.zero, self.homed = homing.zero, True
        self._estimator.begin_at(homing.state.pose)
        self._course = homing.standing
        self._held, self._homing = homing.plan, None
        largest = 1e3 * float(np.abs(self.zero).max())
        self._enter(State.IDLE, f"the tensions agree; lengths set to the plan's, by up to {largest:.2f} mm")

    def _stand_at(self, length: Array) -> Future[Standing | ForwardStatus]:
        """Begin to work out where the platform stands with these lengths."""
        return aside(
            partial(standing_at, self.robot, length, self._estimator.pose, self._model), self._pace is not None
        )

    def _stands(self, found: Standing | ForwardStatus) -> bool:
        """Stay there from now on, if there is such a place."""
        self._held = None
        if isinstance(found, Standing):
            self._course = found
            self._point = found.step()
            return True
        self._say(EventKind.NOTE, "estimate", f"no place for these lengths: {found.text}")
        return False

    def _finish(self) -> None:
        """The last set point of a course was sent."""
        point, course = self._point, self._course
        if self.state is State.STOPPING:
            self._stopped(point)
        elif isinstance(course, PlatformJog) and course.failed and course.stops_hard:
            self._begin_stop(State.IDLE, ExecutionStatus.STOPPED, course.failed)
        elif isinstance(course, Along) and course.motion.plan is not None and point is not None:
            self._end(*(_DONE if course.at_end else _PAUSED))
            if course.at_end:
                self._held = course.motion.plan
            else:
                self._paused = course
            self._course = Standing(point, course.pose)
            self._enter(State.IDLE, self._reason)
        elif point is not None:
            self._idle_or_fault(point.length, ExecutionStatus.DONE, "the jog ended")

    def _stopped(self, point: SetPoint | None) -> None:
        """The ramp ended."""
        if self._after is State.IDLE and point is not None:
            self._idle_or_fault(point.length, self._status, self._reason)
            return
        self._end(self._status, self._reason)
        self._sender.stand_at(self.sample, None if point is None else point.drum_tension)
        self._course = None
        self._enter(self._after, self._reason)

    def _idle_or_fault(self, length: Array, status: ExecutionStatus, reason: str) -> None:
        """Be idle at lengths, once it is known where the platform is with them; set points stay until then."""
        if self._standing is None:
            self._standing = self._stand_at(length)
        if not self._standing.done():
            return
        found = self._standing.result()
        self._end(status, reason)
        if self._stands(found):
            self._enter(State.IDLE, reason)
            return
        self.homed = False
        lost = "it is not known where the platform is; home again"
        if self.state is State.STOPPING:
            self._after, self._status, self._reason = State.FAULT, ExecutionStatus.FAULT, lost
            self._stopped(self._point)
        else:
            self._begin_stop(State.FAULT, ExecutionStatus.FAULT, lost)

    # what the operator's methods use too

    def _begin(self, state: State, course: Course, motion: Motion | None, text: str) -> None:
        """Begin to follow a course."""
        self._course, self._motion, self._paused = course, motion, None
        self._tape = Tape(self.robot.cable_count, len(self._link.groups), ROOM + (0 if motion is None else len(motion)))
        self._told = len(self._journal.events)
        if self._told_of_plan:
            self._tell_end()  # of one that was paused
        plan = None if motion is None else motion.plan
        if self._journal.watched and plan is not None:
            self._told_of_plan = True
            self._tell(lambda record: record.begins(plan))
        self._go(state, text)

    def _go(self, state: State, text: str) -> None:
        """Set off, or go on."""
        self._point = self._stood(text)._replace(done=False)
        self._taping, self._status, self._reason = True, ExecutionStatus.RUNNING, ExecutionStatus.RUNNING.text
        self._garbage.stop()
        self._enter(state, text)

    def _end(self, status: ExecutionStatus, reason: str) -> None:
        """Nothing moves any more."""
        self._status, self._reason = status, reason
        self._garbage.go_on()

    def _stood(self, what: str) -> SetPoint:
        """Where it stands, which what moves begins from."""
        if self._point is None:
            raise RefusedError(what, "there is no set point to begin from", "Home first: home(pose).")
        return self._point

    def _check_agreement(self, what: str) -> Sample:
        """The last sample; refuses what needs all groups, where one of them does not agree."""
        if self.sample is None:
            raise RefusedError(what, "no group has answered", "Connect first.")
        why = trouble(self.sample, self.owner, self._sender.counter, self._link.groups, self.period)
        if why is not None:
            raise why.refusal(what)
        return self.sample

    def _leave(self, reason: str) -> None:
        """Give the grants back."""
        self._end(ExecutionStatus.STOPPED, reason)
        self._course, self._paused, self._homing, self._claim = None, None, None, None
        self.homed, self._leaving = False, round(LEAVING / self.period)
        self._sender.stand_at(self.sample)
        self._enter(State.OFF, reason)

    def _enter(self, state: State, text: str) -> None:
        """Change the state, as the table allows."""
        check_transition(self.state, state, state.name)
        self.state, self._standing = state, None
        self._say(EventKind.STATE, state.name, text)

    def _say(self, kind: EventKind, name: str, text: str) -> None:
        if line := self._journal.add(Event(self._time, self._number, kind, name, self.state, text)):
            self._say(EventKind.FAULT, "recording stopped", line)

    def _clear_faults(self) -> None:
        """Rules that remember nothing."""
        self._faults: tuple[Fault, ...] = faults_of(
            self.robot,
            self.period,
            groups=self._link.groups,
            largest_correction=self._settings.largest,
        )
        self._is_degraded = False
        self._degrading = [fault for fault in self._faults if fault.reaction is Reaction.DEGRADED]

    def _new_loop(self) -> None:
        """A tension loop that has added nothing; none for a robot without redundancy."""
        m, n = self.robot.cable_count, self.robot.degrees_of_freedom
        self._loop = TensionLoop(m, self._settings, self.period) if m > n else None
        self._correction = np.zeros(m)


def _check_link(link: object) -> None:
    """Refuse what is no link at all."""
    has = all(hasattr(link, name) for name in ("groups", "period")) and callable(getattr(link, "exchange", None))
    if isinstance(link, type) or not has:
        step = "Take that of a machine, machine.link(), or make one: sl.plc.S7Link(addresses, robot)."
        raise InvalidValueError("link", brief(link), "a Link", step)


def _check_period(link: Link, period: float) -> None:
    """Refuse PLCs that would reach each set point sooner or later than it is meant."""
    told = number(link.period, "link.period", "s", above=0.0)
    if abs(told - period) > SAME * period:
        step = f"Give the machine period={period:g}, or the controller pace=Pace({told:g})."
        allowed = f"{1e3 * period:g} ms, the controller's"
        raise InvalidValueError("link", f"of PLCs with a period of {1e3 * told:g} ms", allowed, step)


def _aged(known: Sample | None, missing: Missing) -> Sample | None:
    """What was said last, older by now, where a link that had samples has none."""
    if known is None:
        return None
    return known._replace(time=missing.time, age=known.age + (missing.time - known.time))


_DONE: Final = (ExecutionStatus.DONE, "the end of the plan")
_PAUSED: Final = (ExecutionStatus.PAUSED, "paused; resume goes on")
