"""The control loop. Each cycle exchanges data, estimates the pose, checks for faults and prepares the next command."""

from __future__ import annotations

from contextlib import suppress

from sagline.control.active_states import ActiveState, Emergency, Holding, Off
from sagline.control.context import Context
from sagline.control.evidence import Cycle, Reaction
from sagline.control.execution import ExecutionStatus
from sagline.control.link import Missing, Mode, Sample
from sagline.control.recording import EventKind, Recorded
from sagline.control.states import MOTION, OWNING, State
from sagline.core.arrays import Array

FOLLOWING = (MOTION - {State.HOMING}) | {State.IDLE}
UNWATCHED = frozenset({State.OFF, State.CONNECTING})


class Loop:
    """Control loop of a controller, cycle by cycle."""

    def __init__(self, context: Context) -> None:
        """Begin in the state OFF."""
        # stop_requested: True if the next cycle begins to stop the motion
        self.context, self.stop_requested = context, False
        self.active: ActiveState = Off(context)

    def cycle(self) -> None:
        """Run one cycle. After any exception, let the drives hold, and raise the exception again."""
        try:
            self._cycle()
        except BaseException as error:
            self._break_off(error)
            raise

    def _cycle(self) -> None:
        c, point = self.context, self.active.point
        late = 0.0 if c.pace is None else c.pace.wait()
        command, correction = c.sender.command, c.correction
        answer = c.link.exchange(command)
        c.time = answer.time
        none = c.unknown, None, None, float("nan")
        planned, row, wrench, clock = none if point is None else (point.tension, point.row, point.wrench, point.clock)
        sample = answer if isinstance(answer, Sample) else _aged(c.sample, answer)
        if sample is not None:
            before, c.sample = c.sample, sample
            self._judge(Cycle(sample, before, command, planned, row, correction, late), wrench)
        if self.stop_requested:
            self.stop_requested = False
            self.active = self.active.stop()
        self.active = self.active.next(answer)
        if c.run.recording or c.journal.watched:
            about, pose = (c.number, c.state, c.degraded, late, clock), c.estimator
            estimate = pose.position, pose.quaternion, pose.status
            c.keep(Recorded(*about, command, answer, *estimate, c.zero, planned, correction))
        c.number += 1

    def _judge(self, cycle: Cycle, wrench: Array | None) -> None:
        """Estimate the pose, check for faults, and react."""
        c = self.context
        if c.homed or c.shadow:
            lost = c.locate(cycle.sample, wrench)
            if lost and c.state in FOLLOWING:
                self.active = self.active.fail(lost)
        elif c.estimator.status >= 0:
            c.estimator.forget()
        if not c.shadow and c.state in UNWATCHED:
            return
        reaction, line = c.find_faults(cycle._replace(recording=self._recording_stopped()))
        if c.shadow:
            return
        if reaction is Reaction.STOPPING:
            self.active = self.active.fail(line)
        elif reaction is Reaction.EMERGENCY and c.state is not State.EMERGENCY:
            self.active = Emergency(self.active, line)

    def _recording_stopped(self) -> str:
        """Reason why the recorder has stopped; "" while it runs."""
        found: list[str] = []
        self.context.tell(lambda record: found.append(record.stopped))
        return found[0] if found else ""

    def _break_off(self, error: BaseException) -> None:
        """Command the PLCs to reduce the rates to zero by themselves, because perhaps no further cycle follows."""
        c = self.context
        c.collect_garbage()
        line = f"a cycle ended with {type(error).__name__}: {' '.join(str(error).split())[:160]}. The drives hold."
        c.say(EventKind.FAULT, "cycle broken off", line)
        if c.state is State.CONNECTING:
            off = Off(c, line)
            off.leave(None)
            self.active = off
        elif c.state in OWNING and c.state is not State.EMERGENCY:
            c.end_run(ExecutionStatus.FAULT, line)
            c.sender.stand_at(c.sample)
            c.run.paused = None
            if c.state is not State.FAULT:
                if c.state is not State.STOPPING:
                    c.enter(State.STOPPING, line)
                self.active = Holding(c, State.FAULT, line)
            self.active.rest(Mode.HOLD, enabled=True)
        with suppress(Exception):  # the link itself may have raised the exception
            c.link.exchange(c.sender.command)


def _aged(known: Sample | None, missing: Missing) -> Sample | None:
    """The previous sample `known` with increased age, for a cycle without a new sample. None if `known` is None."""
    if known is None:
        return None
    return known._replace(time=missing.time, age=known.age + (missing.time - known.time))
