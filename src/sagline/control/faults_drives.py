"""Faults of encoders and drives, and faults that the tension loop detects."""

from __future__ import annotations

from collections import deque
from typing import Final

import numpy as np

from sagline.control.commands import BEHIND
from sagline.control.evidence import Cycle, Evidence, Fault, Reaction
from sagline.control.link import CHECK, COUNTERS, Command, GroupStatus, Mode, Sample, WinchState, newer
from sagline.control.null_space import finite, largest
from sagline.core.arrays import Array

JUMP: Final = 1e-3  # largest jump of a length [m per cycle]
OFF_BEAT: Final = 1.5  # allowed difference between the number of cycles and the number of commands that a PLC accepted
CATCHING_UP: Final = 10  # number of cycles without a check after a larger difference
FOLLOWING: Final = 5e-3  # largest distance from a set point [m]
SATURATED: Final = 0.2  # duration of the fault [s]
IDLE: Final = 3  # number of samples in which a group must begin to follow
_AT_LIMIT, _ENABLED = int(WinchState.SATURATED), int(WinchState.ENABLED)
_FOLLOWING, _FOLLOW = int(GroupStatus.FOLLOWING), int(Mode.FOLLOW)
REMEMBERED: Final = 32  # number of stored commands; fewer commands than this are in transit at one time
LONGEST: Final = 1.0  # longest time between two samples of a PLC [s]; a longer time means that its clock was reset


class _EncoderJump(Fault, name="encoder jump", reaction=Reaction.STOPPING, within="10 ms", homing=True):
    """Encoder whose length contradicts its rate."""

    rule = (
        f"|change of length - rate x time| > {1e3 * JUMP:g} mm per cycle between two samples, both with the rate "
        "in the first sample and with the rate of the set points; only for drives with power, not at a limit, and with "
        f"commands in time for the last {CATCHING_UP} cycles; also a length that is not a number"
    )

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._numbers = False  # False for encoders whose previous reading was not finite
        self._regular = np.full(seen.group_of.max() + 1, CATCHING_UP)  # cycles with a command each, per group

    def found(self, cycle: Cycle) -> str | None:
        sample, before = cycle.sample, cycle.before
        known, self._numbers = self._numbers, finite(sample.length) and finite(sample.rate)
        if before is not None:
            self._regular += 1
            cycles = (sample.plc_time - before.plc_time) / self.seen.period
            self._regular[np.abs(cycles - (sample.echo - before.echo)) > OFF_BEAT] = 0
        if not self._numbers:
            wrong = ~(np.isfinite(sample.length) & np.isfinite(sample.rate))
            self.seen.jumped |= wrong
            winch = int(np.argmax(wrong))
            return f"encoder {winch} has no finite reading. Check its drive, acknowledge, and home again."
        return self._jump(cycle, sample, before) if known and before is not None else None

    def _jump(self, cycle: Cycle, sample: Sample, before: Sample) -> str | None:
        """Message if the change of a length contradicts the previous rate. The new rate may be wrong after a jump."""
        passed = (sample.plc_time - before.plc_time)[self.seen.group_of]
        change = sample.length - before.length
        jump = change - before.rate * passed
        if largest(jump) <= JUMP:
            return None
        jump = np.abs(jump)
        if cycle.command is not None:
            jump = np.minimum(jump, np.abs(change - cycle.command.rate * passed))
        # only drives that follow their set points: a locked drum stops at once, and a cable moves a drive at its limit
        free = (sample.state == _ENABLED) & (before.state == _ENABLED)
        free &= (passed >= 0.0) & (passed < LONGEST)
        # a drive without commands for some cycles moves to the next set point at its largest speed
        free &= (self._regular >= CATCHING_UP)[self.seen.group_of]
        allowed = JUMP * np.maximum(1.0, passed / self.seen.period)  # in a gap between two samples, rates change more
        jumped = free & ~(jump <= allowed)
        if not jumped.any():
            return None
        self.seen.jumped |= jumped
        winch = int(np.argmax(np.where(jumped, jump, 0.0)))
        return (
            f"encoder {winch} jumped by {1e3 * jump[winch]:.4g} mm against its speed; allowed: "
            f"{1e3 * allowed[winch]:.3g} mm. "
            "Check its plug and coupling, acknowledge, and home again."
        )


class _FollowingError(Fault, name="following error", reaction=Reaction.STOPPING, within="10 ms", homing=True):
    """Drum that is too far from its set point."""

    rule = f"|set point - length| > {1e3 * FOLLOWING:g} mm, for set points that the PLC has accepted"

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._sent: deque[Command] = deque(maxlen=REMEMBERED)

    def found(self, cycle: Cycle) -> str | None:
        command, length = cycle.command, cycle.sample.length
        if command is None or command.mode != _FOLLOW:
            self._sent.clear()
            return None
        self._sent.append(command)
        if largest(command.length - length) <= FOLLOWING:
            return None
        away = self._away(cycle)
        far = ~(away <= FOLLOWING) & ~self.seen.jumped  # the rule _EncoderJump reports jumps
        if not far.any():
            return None
        winch = int(np.argmax(np.where(far, away, 0.0)))
        return (
            f"winch {winch} is {1e3 * away[winch]:.4g} mm from its set point; allowed: {1e3 * FOLLOWING:g} mm. "
            "Check what blocks the winch, acknowledge, and home again."
        )

    def _away(self, cycle: Cycle) -> Array:
        """Distances (m,) [m] of the lengths from the ranges between the last two set points that the PLCs accepted."""
        # drives that are not enabled, and groups whose commands are still in transit, are excluded
        sent = {command.counter: k for k, command in enumerate(self._sent)}
        length = cycle.sample.length
        away = np.zeros(length.size)
        for g, echo in enumerate(cycle.sample.echo.tolist()):
            k = sent.get(echo, 0)
            if k == 0 or not cycle.sample.status[g] & _FOLLOWING:  # no previous command, or not in follow mode
                continue
            mine = self.seen.group_of == g
            last, first = self._sent[k], self._sent[k - 1]
            low, high = np.minimum(first.length, last.length), np.maximum(first.length, last.length)
            out = np.maximum(np.maximum(low - length, length - high), 0.0)
            # infinite for a length that is not finite
            away[mine & last.enable] = np.where(np.isfinite(out), out, np.inf)[mine & last.enable]
        return away


class _NotFollowing(Fault, name="group does not follow", reaction=Reaction.STOPPING, within="40 or 100 ms"):
    """Group that accepts no commands, or accepts them but does not follow."""

    rule = (
        f"a group has accepted none of the last {BEHIND} follow commands, or {IDLE + 1} consecutive samples do not "
        "report that the group follows them"
    )

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._first: int | None = None  # counter of the first command to follow
        self._idle: dict[int, int] = {}  # consecutive samples in which a group does not follow an accepted command

    def found(self, cycle: Cycle) -> str | None:
        command, sample = cycle.command, cycle.sample
        if command is None or command.mode != _FOLLOW:
            self._first = None
            self._idle.clear()
            return None
        if self._first is None:
            self._first = command.counter
        behind = [(command.counter - echo) % COUNTERS for echo in sample.echo.tolist()]
        if max(behind) <= BEHIND and self.seen.common & _FOLLOWING:
            self._idle.clear()
            return None
        asked = {int(group) for group in self.seen.group_of[command.enable]}
        for g in sorted(asked):
            missed = behind[g] - round(float(sample.age[g]) / self.seen.period)  # later commands do not count
            if missed > BEHIND:
                return (
                    f"group {g} accepts no command for {missed} cycles; allowed: {BEHIND}. {CHECK}, then acknowledge."
                )
            if self._idles(cycle, g) > IDLE:
                return (
                    f"group {g} does not follow its set points and reports no reason; allowed: in {IDLE} samples. "
                    "Check its PLC, then acknowledge."
                )
        return None

    def _idles(self, cycle: Cycle, group: int) -> int:
        """Number of consecutive samples in which the group `group` did not follow its accepted commands."""
        sample, before = cycle.sample, cycle.before
        assert self._first is not None
        echo = int(sample.echo[group])
        if sample.status[group] & _FOLLOWING or not (echo == self._first or newer(echo, self._first)):
            self._idle[group] = 0
        elif before is None or sample.counter[group] != before.counter[group]:
            self._idle[group] = self._idle.get(group, 0) + 1
        return self._idle.get(group, 0)


class _ServoSaturated(Fault, name="servo at its limit", reaction=Reaction.STOPPING, within="0.2 s"):
    """Drive at its force limit."""

    rule = f"a drive's force at its limit for {SATURATED:g} s"

    def found(self, cycle: Cycle) -> str | None:
        if _AT_LIMIT not in self.seen.states:
            self._for.fill(0)
            return None
        at_limit = cycle.sample.state == _AT_LIMIT
        self._for = np.where(at_limit, self._for + 1, 0)
        winch = int(np.argmax(self._for))
        if self._for[winch] < round(SATURATED / self.seen.period):
            return None
        return (
            f"drive {winch} has been at its limit of force for {self._for[winch] * self.seen.period:.1f} s at "
            f"{cycle.sample.torque[winch]:.3g} N m; allowed: {SATURATED:g} s. Check what blocks it, then acknowledge."
        )


class _CorrectionAtLimit(
    Fault, name="correction at its limit", reaction=Reaction.STOPPING, within="1 cycle", homing=True
):
    """Length that the tension loop has corrected by more than the error of any good encoder."""

    rule = "the tension loop has changed a length by the allowed maximum, 5 mm by default"

    def found(self, cycle: Cycle) -> str | None:
        if largest(cycle.correction) < self.seen.largest * (1.0 - 1e-9):
            return None
        winch = int(np.argmax(np.abs(cycle.correction)))
        return (
            f"the tension loop has changed length {winch} by {1e3 * cycle.correction[winch]:+.1f} mm; allowed: "
            f"{1e3 * self.seen.largest:g} mm. A length is not reliable: acknowledge, and home again."
        )


DRIVE_FAULTS: Final = (_EncoderJump, _FollowingError, _NotFollowing, _ServoSaturated, _CorrectionAtLimit)
