"""States of the controller as classes. A state prepares the next command and returns the next state."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Final

import numpy as np

from sagline.control.commands import FRESH, Claim
from sagline.control.context import Context
from sagline.control.execution import ExecutionStatus
from sagline.control.homing import Homing
from sagline.control.link import CHECK, Missing, Mode, Sample
from sagline.control.recording import EventKind
from sagline.control.set_points import Along, HomingJog, PlatformJog, Ramp, SetPoint, SetPointSource, Standing
from sagline.control.states import RefusedError, State
from sagline.core.arrays import Array
from sagline.kinematics.status import ForwardStatus

LEAVING: Final = 0.3  # longest time in which the controller must have given up all groups [s]
LOOP_ON: Final = frozenset({State.IDLE, State.MOVING, State.PAUSING})
POSE_LOST: Final = "the pose of the platform is not known; home again"


class ActiveState(ABC):
    """Base class of the states of a controller; `context.state` is the name of the state."""

    def __init__(self, context: Context, point: SetPoint | None = None, source: SetPointSource | None = None) -> None:
        """Enter the state with the set point of the previous state."""
        # point: last set point that was sent; None if the drives are at rest
        # source: source of the set points; None in a state without set points
        self.context, self.point, self.source = context, point, source

    @abstractmethod
    def next(self, answer: Sample | Missing) -> ActiveState:
        """Prepare the command of the next cycle; return the next state."""

    def stop(self) -> ActiveState:
        """Return the next state after a stop by the operator."""
        return self

    def fail(self, line: str) -> ActiveState:
        """Return the next state after a fault that stops the motion."""
        return _Stopping(self, State.FAULT, ExecutionStatus.FAULT, line)

    def rest(self, mode: Mode, *, enabled: bool) -> None:
        """Command the drives to rest."""
        self.point = None
        self.context.sender.rest(mode, enabled=enabled, claims=self.context.state is State.CONNECTING)

    def follow(self, source: SetPointSource) -> None:
        """Command the next set point, with the correction of the tension loop."""
        c = self.context
        due, point = self.point, source.step()
        row, sample = point.row, c.sample
        if c.tension_loop is not None and row is not None and sample is not None and c.state in LOOP_ON:
            planned = point.tension if due is None else due.tension
            leads = point.leading or (due is not None and due.leading)  # here, tensions differ from the plan on purpose
            c.correction = c.tension_loop.step(sample.tension, planned, row, frozen=c.degraded or leads)
        length = point.length + c.correction
        length -= c.zero
        self.point = point
        c.sender.follow(length, point.rate, point.drum_tension, point.enable)

    def settle(self, length: Array, status: ExecutionStatus, reason: str) -> ActiveState | None:
        """Enter IDLE at the equilibrium for the lengths `length` [m]. Returns None if no equilibrium is found."""
        self.context.end_run(status, reason)
        return Following.at_rest(self.context, self.context.find_equilibrium(length), reason)


class Off(ActiveState):
    """OFF: the controller gives up the ownership of all groups, and then sends no commands."""

    def __init__(self, context: Context, reason: str = "", point: SetPoint | None = None) -> None:
        """Begin to give up all groups. An empty `reason` means that the controller owns no group yet."""
        super().__init__(context, point)
        self._cycles = 0
        if reason:
            self._cycles = round(LEAVING / context.period)
            context.end_run(ExecutionStatus.STOPPED, reason)
            context.run.paused, context.homed = None, False
            context.sender.stand_at(context.sample)
            context.enter(State.OFF, reason)

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Send the command LEAVE, or nothing."""
        self.leave(self.context.sample)
        return self

    def leave(self, sample: Sample | None) -> None:
        """Send the command LEAVE while the controller owns a group."""
        self._cycles = max(self._cycles - 1, 0)
        if self._cycles and (sample is None or bool((sample.owner == self.context.sender.owner).any())):
            self.rest(Mode.LEAVE, enabled=False)
        else:
            self.point = None
            self.context.sender.command = None


class Connecting(ActiveState):
    """CONNECTING: the controller claims the groups."""

    def __init__(self, context: Context) -> None:
        """Begin to claim all groups."""
        context.enter(State.CONNECTING, "claims the groups")
        super().__init__(context)
        self.claim = Claim(context.sender.owner, context.link.groups, context.period, context.random)

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Change to READY if all groups agree, or to OFF if the claim fails."""
        c, claim = self.context, self.claim
        claim.look(answer, c.sender.counter)
        c.sender.stand_at(c.sample)
        if claim.ready:
            c.clear_faults()
            return Holding(c, State.READY, "all groups agree").next(answer)
        if claim.refused is not None:
            return Off(c, claim.refused.reason).next(answer)
        if claim.mode is None:
            c.sender.command = None
        else:
            self.rest(claim.mode, enabled=False)
        return self

    def stop(self) -> ActiveState:
        """Change to OFF."""
        return Off(self.context, "the operator stopped")


class Holding(ActiveState):
    """READY or FAULT: the drives hold their present position."""

    def __init__(self, context: Context, state: State, reason: str) -> None:
        """Enter READY or FAULT."""
        context.enter(state, reason)
        super().__init__(context)

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Send the command HOLD."""
        self.rest(Mode.HOLD, enabled=True)
        return self

    def fail(self, line: str) -> ActiveState:
        """Change to STOPPING, which ends in FAULT."""
        return self if self.context.state is State.FAULT else super().fail(line)


class Emergency(ActiveState):
    """EMERGENCY: the drums are locked."""

    def __init__(self, before: ActiveState, line: str) -> None:
        """Lock the drums, and forget the pose, which is no longer known."""
        c = before.context
        c.end_run(ExecutionStatus.EMERGENCY, line)
        c.homed = False
        c.enter(State.EMERGENCY, line)
        super().__init__(c, source=before.source)

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Send the command LOCK."""
        self.rest(Mode.LOCK, enabled=False)
        return self

    def fail(self, line: str) -> ActiveState:
        """Stay in this state."""
        return self


class HomingState(ActiveState):
    """HOMING: the operator jogs single winches until the tensions agree with the plan."""

    def __init__(self, context: Context, homing: Homing) -> None:
        """Enter the state at rest."""
        context.enter(State.HOMING, "the operator named the pose")
        super().__init__(context)
        self.homing = homing  # plan at the pose that the operator named; it compares samples with this plan
        self._largest_tension = np.full(len(context.zero), np.inf)  # upper limits of the tensions during a jog [N]

    def jog(self, winch: int, by: float) -> None:
        """Jog winch `winch` by the length `by` [m]. The other winches have no power; only tensions are monitored."""
        c = self.context
        if c.sample is None or self.source is not None:
            raise RefusedError("the jog", "another winch is being jogged", "Wait until it stops.")
        self._largest_tension = self.homing.jog_limits(c.sample)
        length, still = c.sample.length + c.zero, np.zeros(len(c.zero))
        begin = SetPoint(length, still, c.unknown, c.sender.tension, None, None, np.nan, False)
        self.source = HomingJog(begin, winch, by, c.period)
        c.say(EventKind.NOTE, "jog", f"winch {winch} by {1e3 * by:+g} mm")

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Continue the jog, or compare tensions at rest. Change to IDLE if the tensions agree with the plan."""
        c, sample, homing = self.context, self.context.sample, self.homing
        if sample is None:
            pass
        elif self.source is not None:
            line = self._reason_to_end(sample)
            if line:
                c.say(EventKind.NOTE, "jog", f"the jog ended: {line}")
            elif self.point is None or not self.point.done:
                self.follow(self.source)
                return self
            self.source = None
            c.sender.stand_at(sample)
            homing.moved()
        elif homing.look(sample):
            c.zero, c.homed = homing.zero, True
            c.estimator.begin_at(homing.state.pose)
            c.previous_plan = homing.plan
            basis = "the operator confirmed the pose" if homing.confirmed else "the tensions agree"
            reason = f"{basis}; lengths set to those of the plan, by up to {1e3 * np.abs(homing.apart).max():.2f} mm"
            return Following(c, State.IDLE, reason, None, homing.standing).next(answer)
        self.rest(Mode.HOLD, enabled=True)
        return self

    def _reason_to_end(self, sample: Sample) -> str:
        """Reason to end the present jog; "" if the jog continues."""
        c = self.context
        stale = ~(sample.age <= FRESH * c.period)
        if stale.any():
            g = int(np.argmax(stale))
            return f"group {g} has been silent for {sample.age[g]:.2g} s. {CHECK}"
        if c.degraded:
            return "a load cell is not reliable. Check the cells, then home again"
        limit = self._largest_tension
        if (sample.tension <= limit).all():
            return ""
        i = int(np.argmax(~(sample.tension <= limit)))
        if not np.isfinite(sample.tension[i]):
            return f"the load cell of cable {i} gives no reading. Check cell, plug and amplifier, then home again"
        return f"cable {i} has {sample.tension[i]:.1f} N; allowed: {limit[i]:.1f} N"

    def stop(self) -> ActiveState:
        """Change to STOPPING, which ends in READY."""
        return _Stopping(self, State.READY, ExecutionStatus.STOPPED, "the operator stopped")


class Following(ActiveState):
    """IDLE, MOVING, JOGGING and PAUSING: a source gives the set point of each cycle."""

    def __init__(
        self, context: Context, state: State, text: str, point: SetPoint | None, source: SetPointSource
    ) -> None:
        """Enter the state `state` at `point`, the last set point that was sent."""
        context.enter(state, text)
        super().__init__(context, point, source)
        self._followed = source

    @classmethod
    def at_rest(cls, context: Context, found: Standing | ForwardStatus, reason: str) -> Following | None:
        """Enter IDLE at the equilibrium `found`. If `found` is a status of failure, forget the pose and return None."""
        context.previous_plan = None
        if isinstance(found, Standing):
            return cls(context, State.IDLE, reason, found.step(), found)
        context.say(EventKind.NOTE, "estimate", f"no equilibrium at these lengths: {found.text}")
        context.homed = False
        return None

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Command the next set point. Change to IDLE at the end of the source."""
        point = self.point
        if self.context.state is not State.IDLE and point is not None and point.done:
            return self._finish(point).next(answer)
        self.follow(self._followed)
        return self

    def stop(self) -> ActiveState:
        """Change to STOPPING, which ends in IDLE."""
        if self.context.state is State.IDLE:
            return self
        return _Stopping(self, State.IDLE, ExecutionStatus.STOPPED, "the operator stopped")

    def _finish(self, point: SetPoint) -> ActiveState:
        """Return the next state after the last set point was sent."""
        c, source = self.context, self.source
        if isinstance(source, PlatformJog) and source.failed and source.stops_hard:
            return _Stopping(self, State.IDLE, ExecutionStatus.STOPPED, source.failed)
        if isinstance(source, Along) and source.motion.plan is not None:
            if source.at_end:
                c.end_run(ExecutionStatus.DONE, "the end of the plan")
                c.previous_plan = source.motion.plan
            else:
                c.end_run(ExecutionStatus.PAUSED, "paused; resume continues")
                c.run.paused = source
            return Following(c, State.IDLE, c.run.reason, point, Standing(point, source.pose))
        after = self.settle(point.length, ExecutionStatus.DONE, "the jog ended")
        return after or _Stopping(self, State.FAULT, ExecutionStatus.FAULT, POSE_LOST)


class _Stopping(ActiveState):
    """STOPPING: a ramp that begins at the last set point that was sent. All rates reach zero at the same time."""

    def __init__(self, before: ActiveState, after: State, status: ExecutionStatus, reason: str) -> None:
        """Begin the ramp. `status` and `reason` are stored in the record of the motion."""
        c, point, source = before.context, before.point, before.source
        if point is not None:
            point = point._replace(done=False)
            source = Ramp(point, c.period)
        c.run.status, c.run.reason, c.run.paused = status, reason, None
        c.enter(State.STOPPING, reason)
        super().__init__(c, point, source)
        self.after = after

    def next(self, answer: Sample | Missing) -> ActiveState:
        """Command the next set point of the ramp. Change to IDLE, READY or FAULT at its end."""
        if self.point is None or self.point.done:
            return self._finish().next(answer)
        if self.source is not None:
            self.follow(self.source)
        return self

    def fail(self, line: str) -> ActiveState:
        """End the ramp in the state FAULT."""
        self._end_in_fault(line)
        return self

    def _end_in_fault(self, line: str) -> None:
        run = self.context.run
        self.after, run.status, run.reason = State.FAULT, ExecutionStatus.FAULT, line

    def _finish(self) -> ActiveState:
        """Return the state after the ramp."""
        c, point = self.context, self.point
        if self.after is State.IDLE and point is not None:
            after = self.settle(point.length, c.run.status, c.run.reason)
            if after is not None:
                return after
            self._end_in_fault(POSE_LOST)
        c.end_run(c.run.status, c.run.reason)
        c.sender.stand_at(c.sample, None if point is None else point.drum_tension)
        return Holding(c, self.after, c.run.reason)
