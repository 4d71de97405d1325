"""Faults in the exchange between controller and machine, the table of all faults, and the creation of the rules."""

from __future__ import annotations

from collections import deque
from typing import Final, NamedTuple

import numpy as np

from sagline.control.evidence import Cycle, Evidence, Fault, Reaction
from sagline.control.faults_cables import CABLE_FAULTS
from sagline.control.faults_drives import DRIVE_FAULTS
from sagline.control.link import CHECK, PERIOD, GroupFault, GroupStatus, Mode, WinchState, fault_text
from sagline.control.null_space import TensionSettings, cell_errors
from sagline.core.arguments import brief, instance
from sagline.core.arrays import Flags, number
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot

STALE, SILENT = 3, 10  # largest age of a sample [cycles]
WINDOW: Final = 100  # length of the window in which late cycles are counted [cycles]
LATE, LATE_OFTEN, LOST = 0.02, 0.005, 0.1  # delay of a late cycle [s]
OFTEN: Final = 3  # largest number of late cycles per window
ROUNDING: Final = 1e-6  # relative tolerance of an age

# plain integers, because array operations with members of an enumeration are four times slower
_LOCKED, _EMERGENCY, _PRESSED = int(GroupStatus.LOCKED), int(GroupStatus.EMERGENCY), int(GroupFault.EMERGENCY_STOP)
_TRIPPED, _LEAVE = int(WinchState.FAULT), int(Mode.LEAVE)

_FREE: Final = "Stop other programs on this computer."


class _Old(Fault):
    """Base class for a group whose newest sample is too many cycles old."""

    cycles: int
    step: str

    def found(self, cycle: Cycle) -> str | None:
        worst, limit = self.seen.oldest, self.cycles * self.seen.period
        if worst < limit * (1.0 - ROUNDING):
            return None
        group = int(np.argmax(cycle.sample.age))
        what = f"its newest sample is {1e3 * worst:.0f} ms old; allowed: below {1e3 * limit:.0f} ms"
        return f"group {group}: {what}. {self.step}"


class _GroupStale(_Old, name="group stale", reaction=Reaction.DEGRADED, within="30 ms", quiet=1.0):
    """Group that answers late. The tension loop is off until the group answers again."""

    rule = f"the newest sample of a group is {STALE} cycles old, as blocks are missing, repeated, late or invalid"
    cycles = STALE
    step = "The tension loop is off until the group answers."


class _GroupSilent(_Old, name="group silent", reaction=Reaction.STOPPING, within="100 ms"):
    """Group that does not answer."""

    rule = f"the newest sample of a group is {SILENT} cycles old"
    cycles = SILENT
    step = f"{CHECK}, then acknowledge."


class _BlockDiscarded(Fault, name="block discarded", reaction=Reaction.EVENT, within="1 cycle"):
    """Group that sends invalid blocks. A group without valid blocks counts first as late and then as silent."""

    rule = "incomplete or foreign (by its counters, magic, version or size), repeated, or older than an earlier block"

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._quiet, self._line = WINDOW, ""

    def found(self, cycle: Cycle) -> str | None:
        sample, before = cycle.sample, cycle.before
        self._quiet += 1  # the fault ends after a second without discarded blocks
        if before is not None and sample.discarded.tolist() != before.discarded.tolist():
            group = int(np.argmax(sample.discarded - before.discarded))
            count = int(sample.discarded[group])
            self._quiet = 0
            reason = sample.reasons[group] if sample.reasons else None
            why, step = reason or ("the link gives no reason", CHECK)
            self._line = f"group {group}: a block was discarded, {count} so far: {why}. {step}."
        return self._line if self._quiet < WINDOW else None


class _OwnerLost(Fault, name="owner lost", reaction=Reaction.STOPPING, within="1 cycle"):
    """Group that the controller no longer owns."""

    rule = "the owner of a group changes after the controller owned all groups"

    def found(self, cycle: Cycle) -> str | None:
        command = cycle.command
        if command is None or command.mode == _LEAVE:
            return None
        owners = cycle.sample.owner.tolist()
        if owners.count(command.owner) == len(owners):
            return None
        group, owner = next((g, owner) for g, owner in enumerate(owners) if owner != command.owner)
        who = f"controller {owner} owns it" if owner else "no controller owns it"
        return f"group {group}: {who}; expected: {command.owner}. Stop the other controller, then connect again."


class _GroupActs(Fault, name="group acts by itself", reaction=Reaction.STOPPING, within="1 cycle", lasting=True):
    """Group that has stopped because of its PLC or one of its drives."""

    rule = "a PLC reports a fault or locked drums, or a drive reports a fault"

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._reported: Flags = np.zeros(int(seen.group_of.max()) + 1, dtype=bool)

    def found(self, cycle: Cycle) -> str | None:
        seen, sample = self.seen, cycle.sample
        if not (seen.faulted or seen.tripped or seen.bits & _LOCKED):
            return None
        if cycle.command is not None and cycle.command.mode in (Mode.LOCK, Mode.LEAVE):
            return None
        tripped = (sample.winch_fault != 0) | (sample.state == _TRIPPED)
        acting = (sample.fault != 0) | ((sample.status & _LOCKED) != 0)
        acting[seen.group_of[tripped]] = True
        acting &= (sample.status & _EMERGENCY) == 0  # the controller itself has locked the groups
        acting &= sample.fault != _PRESSED
        new = acting & ~self._reported
        if not new.any():
            return None
        self._reported |= new
        groups = np.flatnonzero(new)
        names = ", ".join(str(g) for g in groups)
        return f"group {names} has stopped: {self._why(cycle, int(groups[0]), tripped)}. Repair it, then acknowledge."

    def _why(self, cycle: Cycle, group: int, tripped: Flags) -> str:
        mine = np.flatnonzero(tripped & (self.seen.group_of == group))
        if mine.size:
            return f"drive {mine[0]} tripped with code {cycle.sample.winch_fault[mine[0]]}"
        code, locked = int(cycle.sample.fault[group]), cycle.sample.status[group] & _LOCKED
        return ", and ".join(filter(None, (fault_text(code) if code else "", "drums are locked" if locked else "")))


class _EmergencyStop(
    Fault, name="emergency stop", reaction=Reaction.EMERGENCY, within="a scan of the PLC, 1 cycle", homing=True
):
    """Emergency stop of the hardware, reported by the PLC."""

    rule = "a PLC reports that the emergency stop is pressed"

    def found(self, cycle: Cycle) -> str | None:
        if not (self.seen.faulted or self.seen.bits & _EMERGENCY):
            return None
        sample = cycle.sample
        pressed = ((sample.status & _EMERGENCY) != 0) | (sample.fault == _PRESSED)
        if not pressed.any():
            return None
        groups = ", ".join(str(g) for g in np.flatnonzero(pressed))
        return f"emergency stop, reported by group {groups}. Make the machine safe, release it, then connect and home."


class _CycleLate(Fault, name="cycle late", reaction=Reaction.EVENT, within="1 cycle"):
    """Cycles that are late because the computer is too busy."""

    rule = f"> {1e3 * LATE:g} ms late, or {OFTEN} of {WINDOW} cycles > {1e3 * LATE_OFTEN:g} ms late"

    def __init__(self, seen: Evidence) -> None:
        super().__init__(seen)
        self._cycle = 0
        self._late: deque[tuple[int, float]] = deque()  # times and delays of late cycles in the window

    def found(self, cycle: Cycle) -> str | None:
        self._cycle += 1
        late = self._late
        if LATE_OFTEN < cycle.late <= LOST:
            late.append((self._cycle, cycle.late))
        if late and late[0][0] <= self._cycle - WINDOW:
            late.popleft()
        if not late:
            return None
        worst = max(by for _, by in late)
        if worst > LATE:
            return f"a cycle was {1e3 * worst:.0f} ms late; allowed: {1e3 * LATE:g} ms. {_FREE}"
        if len(late) < OFTEN:
            return None
        return (
            f"{len(late)} of the last {WINDOW} cycles were more than {1e3 * LATE_OFTEN:g} ms late, by up to "
            f"{1e3 * worst:.0f} ms; allowed: {OFTEN - 1}. {_FREE}"
        )


class _CycleLost(Fault, name="cycle lost", reaction=Reaction.STOPPING, within="1 cycle"):
    """Cycle that began so late that the PLCs have stopped the winches."""

    rule = f"> {1e3 * LOST:g} ms late"

    def found(self, cycle: Cycle) -> str | None:
        if cycle.late <= LOST:
            return None
        return (
            f"a cycle began {1e3 * cycle.late:.0f} ms late; allowed: {1e3 * LOST:g} ms. The PLCs have stopped the "
            f"winches. {_FREE} Then acknowledge."
        )


class _RecordingStopped(Fault, name="recording stopped", reaction=Reaction.EVENT, within="1 s"):
    """Recording that has stopped; the motion continues."""

    rule = "a write fails, for instance because the disk is full, or the queue to the writer is full"

    def found(self, cycle: Cycle) -> str | None:
        if not cycle.recording:
            return None
        why = cycle.recording if len(cycle.recording) <= 120 else cycle.recording[:117] + "..."
        return f"recording has stopped: {why}. The motion continues; written data are kept. Free some disk space."


LARGEST_CORRECTION: Final = TensionSettings().largest  # largest correction of the tension loop [m]

# in the order of evaluation
FAULTS: Final[tuple[type[Fault], ...]] = (
    *(_EmergencyStop, _OwnerLost, _GroupActs, _GroupSilent, _GroupStale, _BlockDiscarded),
    *CABLE_FAULTS,
    *DRIVE_FAULTS,
    *(_CycleLost, _CycleLate, _RecordingStopped),
)


class FaultRow(NamedTuple):
    """Row of the table of faults in the documentation.

    Attributes:
        name: Name of its events.
        rule: Condition of the fault.
        to: Name of the controller's reaction.
        within: Longest time until detection.
        by: Part that detects the fault.
    """

    name: str
    rule: str
    to: str
    within: str
    by: str


_ELSEWHERE: Final = (
    FaultRow(
        "controller dead", "the command counter does not change for 100 ms", "ramp of 0.2 s, hold", "300 ms", "each PLC"
    ),
    FaultRow("foreign block", "magic, version, group or size differ on connection", "OFF", "1 cycle", "the connection"),
    FaultRow("second controller", "another controller owns a group on connection", "OFF", "1 cycle", "the connection"),
    FaultRow("set point infeasible", "the plan's status", "refused before it is sent", "", "the check of the plan"),
)
FAULT_TABLE: Final = (
    *(FaultRow(kind.name, kind.rule, kind.reaction.name, kind.within, "the controller") for kind in FAULTS),
    *_ELSEWHERE,
)


def faults_of(
    robot: Robot,
    period: float = PERIOD,
    *,
    groups: tuple[tuple[int, ...], ...] | None = None,
    cell_deviation: float | None = None,
    cell_bias: float | None = None,
    largest_correction: float = LARGEST_CORRECTION,
) -> tuple[Fault, ...]:
    """Create a set of fault rules. A controller creates a new set each time it leaves OFF, FAULT or homing.

    Args:
        robot: Robot for planning.
        period: Period of a cycle [s], > 0.
        groups: Winches of each group, as in the link; None for groups of two neighboring winches.
        cell_deviation: Standard deviation of a good load cell [N], > 0. None: the value of the robot's winches, by
            default 1 N.
        cell_bias: Largest bias of a good load cell [N], >= 0. None: the value of the robot's winches, but at least 2 N.
        largest_correction: Largest correction of a length by the tension loop [m], > 0.

    Returns:
        The rules. Evaluate all rules in every cycle, in the order of the list.

    Raises:
        InvalidValueError: If an argument has the wrong type or is out of its range.

    Examples:
        >>> import sagline as sl
        >>> rules = sl.control.faults_of(sl.load_robot("article-prototype"))
        >>> print(len(rules), "rules,", rules[0].name, "first:", rules[0].reaction.name)
        21 rules, emergency stop first: EMERGENCY
    """
    checked_robot = instance(robot, Robot, "robot")
    if groups is not None:
        _check_groups(groups, checked_robot.cable_count)
    known = [float(errors.max()) for errors in cell_errors(checked_robot)]
    given = (cell_deviation, cell_bias)
    deviation, bias = (own if value is None else value for value, own in zip(given, known, strict=True))
    seen = Evidence(
        checked_robot,
        number(period, "period", "s", above=0.0),
        groups,
        (number(deviation, "cell_deviation", "N", above=0.0), number(bias, "cell_bias", "N", low=0.0)),
        number(largest_correction, "largest_correction", "m", above=0.0),
    )
    return tuple(kind(seen) for kind in FAULTS)


def _check_groups(groups: object, cable_count: int) -> None:
    """Reject groups that do not contain every winch exactly once."""
    try:
        winches = sorted(winch for group in groups for winch in group)  # type: ignore[attr-defined]
        fits = winches == list(range(cable_count))
    except TypeError:
        fits = False
    if not fits:
        allowed = f"tuples with each winch from 0 to {cable_count - 1} once"
        raise InvalidValueError("groups", brief(groups), allowed, "Give the groups of the link: link.groups.")
