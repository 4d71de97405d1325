"""Shared data of the fault rules, and the base class of a rule."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from enum import IntEnum
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np

from sagline.control.link import RAMP, Command, Groups, Mode, Sample, WinchState, groups_of
from sagline.control.null_space import SIGMAS, NullSpace, extrema, finite, largest
from sagline.core.arrays import Array, Flags
from sagline.robot.robot import Robot

MOVING: Final = 1e-3  # [m/s], a motion: set points change faster than this


class Cycle(NamedTuple):
    """Data of one cycle for the fault rules, collected after the sample and before the next command.

    Attributes:
        sample: The newest sample.
        before: Sample of the previous cycle; None in the first.
        command: Command sent in the previous cycle; None if nothing was sent.
        tension: Planned T_A for this cycle [N], shape (m,); NaN without a plan, for example before homing.
        gains: Gains of the tension loop at this time of the plan; None if the plan has no gains.
        correction: Correction of the plan's lengths by the tension loop [m], shape (m,).
        late: Delay of the start of the cycle [s]; 0 in lockstep.
        recording: Reason why recording has stopped; "" otherwise.
    """

    sample: Sample
    before: Sample | None
    command: Command | None
    tension: Array
    gains: NullSpace | None
    correction: Array
    late: float = 0.0
    recording: str = ""

    @property
    def moving(self) -> bool:
        """True if the set points of this cycle change."""
        command = self.command
        return command is not None and command.mode == Mode.FOLLOW and bool(abs(command.rate).max() > MOVING)


SLACK_SHARE: Final = 0.3  # a cable is slack if its tension is below this share of the lower limit
PLANNED_SHARE: Final = 0.9  # a cable is planned as taut if its planned tension is above this share of the lower limit
PULLING: Final = 0.5  # a cable is taut if the motor torque is above this share of the planned tension
STEADY_TIME: Final = 0.5  # time constant of the filter for the constant part of the tension errors [s]
QUICK_TIME: Final = 0.1  # time constant of the filter for tensions in the comparison with the force balance [s]
MOST_CHANGE: Final = 6.0  # largest change of the quick filter [N per cycle]; it suppresses single outliers
_TRIPPED: Final = int(WinchState.FAULT)


class Evidence:
    """Tensions of this cycle and data of the machine, used by all rules of a set."""

    def __init__(
        self, robot: Robot, period: float, groups: Groups | None, cell: tuple[float, float], largest: float
    ) -> None:
        """Begin without readings. `period` [s]. `cell`: deviation, bias [N]. `largest`: limit of a correction [m]."""
        m, winch = robot.cable_count, robot.winches
        self.group_of = np.zeros(m, dtype=np.int64)  # index of the group of each winch, shape (m,)
        for g, members in enumerate(groups_of(m) if groups is None else groups):
            self.group_of[list(members)] = g
        # period: period of a cycle [s]
        # largest: largest correction of a length without a fault [m]
        self.period, self.largest = period, largest
        # noise: standard deviation of a reading [N]
        # sigma: the same, increased by the bias of a good cell [N]
        self.noise, self.sigma = cell[0], math.hypot(*cell)
        self.limit = robot.tension_max  # upper limits of T_A [N], shape (m,)
        least = robot.tension_min
        self._slack = np.where(least > 0.0, SLACK_SHARE * least, SIGMAS * self.sigma)
        self._taut = np.where(least > 0.0, PLANNED_SHARE * least, 2.0 * SIGMAS * self.sigma)
        self._most_slack, self._neither = float(self._slack.max()), np.maximum(self._slack, self._taut)
        known = winch is not None and winch.load_cell_range is not None
        # full_scale: full scale of the cells [N], infinite if unknown, shape (m,)
        self.full_scale = np.broadcast_to(winch.load_cell_range if known else np.inf, (m,))  # type: ignore[union-attr, arg-type]
        # ratios of cable tension to motor torque, if drum and gear are known
        self._pull_of_torque: Array | None = None
        self._friction = np.zeros(m)
        if winch is not None and winch.drum_radius is not None:
            self._pull_of_torque = np.broadcast_to(-np.abs(winch.gear) / winch.drum_radius, (m,))
            self._friction = np.broadcast_to(winch.friction, (m,))
        self.believed: Flags = np.ones(m, dtype=bool)  # True for load cells whose readings are used, shape (m,)
        self.broken: Flags = np.zeros(m, dtype=bool)  # True for broken cables, shape (m,)
        self.jumped: Flags = np.zeros(m, dtype=bool)  # True for encoders that have jumped, shape (m,)
        # low: number of consecutive new readings of a slack cable that is taut in the plan, shape (m,)
        self.low = np.zeros(m, dtype=np.int64)
        self.before_low = np.full(m, np.nan)  # last reading before the cable became slack [N], shape (m,)
        self._filtered, self._change = np.zeros((2, m)), np.empty((2, m))
        # steady: T_A minus the plan after the slow filter [N], shape (m,); constant while a cable is slack
        # quick: T_A minus the plan after the quick filter [N], shape (m,)
        self.steady, self.quick = self._filtered
        # stopped: True while the winches still move after a fault that stops the motion
        # compared: True if tensions can be compared with a plan
        self.compared = self.any_low = self.stopped = False
        # plain: True if no cell is ignored and all readings are finite
        self.plain, self._all_believed = True, True
        self._still, self._settled = 0, round(RAMP / period)
        # arrays of full size, because numpy is three times slower with scalars or columns
        self._shares = np.array([[period / (time + period)] * m for time in (STEADY_TIME, QUICK_TIME)])
        self.cycle: Cycle | None = None
        # tension: T_A [N], shape (m,): the reading if it is finite and the cell is not ignored, otherwise the planned
        # tension. If there is no plan either, a value between the limits for slack and tight cables.
        self.tension = np.full(m, math.nan)
        # least: smallest tension [N]
        # most: largest tension [N]
        # oldest: age of the oldest group's sample [s]
        self.least = self.most = self.oldest = math.nan
        # bits: status bits set in at least one group
        # common: status bits set in every group
        self.bits = self.common = 0
        self.states = list[int]()  # codes of the winches' states, as plain numbers
        # faulted: True if a PLC reports a fault
        # tripped: True if a drive reports a fault
        self.faulted = self.tripped = False

    def at(self, cycle: Cycle) -> None:
        """Update the evidence with a new cycle."""
        self.cycle, sample = cycle, cycle.sample
        self._read(cycle)
        self.oldest = extrema(sample.age)[1]
        self.bits, self.common, self.states = 0, -1, sample.state.tolist()
        for bits in sample.status.tolist():
            self.bits |= bits
            self.common &= bits
        if self.stopped:
            self._wait(cycle)
        self.faulted = any(sample.fault.tolist())
        self.tripped = _TRIPPED in self.states or any(sample.winch_fault.tolist())
        self._look_for_slack(cycle)
        self._compare(cycle)

    def ignore_cells(self, cells: Flags) -> None:
        """Ignore some cells from now on, shape (m,)."""
        self.believed &= ~cells
        self._all_believed = False

    def stop(self) -> None:
        """Store that a fault stops the motion. Until the winches stop, other faults are mostly consequences of it."""
        self.stopped, self._still = True, 0

    def _wait(self, cycle: Cycle) -> None:
        """Check if the winches have stopped, by the set points or, without set points, by new measured rates."""
        moves = cycle.moving if cycle.command is not None else largest(cycle.sample.rate * self.fresh) > MOVING
        self._still = 0 if moves else self._still + 1
        self.stopped = self._still <= self._settled

    def _read(self, cycle: Cycle) -> None:
        """Store the readings of all cells that are not ignored."""
        self.tension = tension = cycle.sample.tension
        self.least, self.most = extrema(tension)
        self.plain = self._all_believed and math.isfinite(self.least) and math.isfinite(self.most)
        if not self.plain:
            planned = np.where(np.isfinite(cycle.tension), cycle.tension, self._neither)
            self.tension = np.where(self.believed & np.isfinite(tension), tension, planned)
            self.least, self.most = extrema(self.tension)

    @property
    def fresh(self) -> Flags:
        """Flags of the winches that have new data in this cycle, shape (m,)."""
        before = None if self.cycle is None else self.cycle.before
        if self.cycle is None or before is None:
            return np.ones(len(self.group_of), dtype=bool)
        found: Flags = (self.cycle.sample.counter != before.counter)[self.group_of]
        return found

    def _look_for_slack(self, cycle: Cycle) -> None:
        tension = self.tension
        self.any_low = False
        if self.least < self._most_slack:
            low = (tension < self._slack) & (cycle.tension >= self._taut) & self.believed
            self.any_low = bool(low.any())
            if self.any_low:
                self.low = np.where(low, self.low + self.fresh, 0)
                self.before_low = np.where(low, self.before_low, tension)
                return
        self.low.fill(0)
        self.before_low = tension

    def _compare(self, cycle: Cycle) -> None:
        error = self.tension - cycle.tension
        if not finite(error):
            self.compared = False
            return
        if not self.compared:
            self.compared = True
            self.steady[:], self.quick[:] = error, 0.0
        change = self._change
        change[:] = error
        change -= self._filtered
        change *= self._shares
        if (most := largest(change[1])) > MOST_CHANGE:  # one factor keeps the ratios of the errors
            change[1] *= MOST_CHANGE / most
        if self.any_low:
            change[0] = 0.0
        self._filtered += change

    def pull(self, cycle: Cycle) -> Array:
        """Cable tension from the motor torque, with friction [N], shape (m,); NaN for unknown drums."""
        torque = cycle.sample.torque
        return np.full(torque.shape, np.nan) if self._pull_of_torque is None else self._pull_of_torque * torque

    def pulling(self, cycle: Cycle) -> Flags:
        """Flags of cables under tension according to the torque of their motors, shape (m,)."""
        found: Flags = self.pull(cycle) > np.maximum(PULLING * cycle.tension, 2.0 * self._friction)
        return found


class Reaction(IntEnum):
    """Reaction to a fault. If there are several faults, the strongest reaction is executed."""

    EVENT = 0  # reported and recorded
    DEGRADED = 1  # the motion continues, and the tension loop keeps its correction
    STOPPING = 2  # ramp of all rates to zero, then FAULT
    EMERGENCY = 3  # drums locked, no motion possible


class Fault(ABC):
    """Base class of a fault rule. `faults_of` creates a set of rules, and a new set after each acknowledged fault.

    Attributes:
        name: Name of its events.
        rule: Condition of the fault as text.
        reaction: Reaction of the controller.
        within: Longest time until the fault is detected, as text.
        homing: True if the robot must be homed again after the fault, because a length is unreliable.
        lasting: True if the fault remains until a new set of rules is created. Each faulty item is reported once.
        quiet: Time after a report [s] in which repeated faults are only counted.
        present: True if the condition holds. While another fault stops the winches, the value does not change.
        seen: Evidence, which all rules of the set use.
    """

    name: ClassVar[str]
    rule: ClassVar[str]
    reaction: ClassVar[Reaction]
    within: ClassVar[str]
    homing: ClassVar[bool] = False
    lasting: ClassVar[bool] = False
    quiet: ClassVar[float] = 0.0

    def __init_subclass__(cls, **declared: Any) -> None:
        """Declare a rule: the attributes of the class that the class statement gives."""
        super().__init_subclass__()
        for name, value in declared.items():
            setattr(cls, name, value)

    def __init__(self, seen: Evidence) -> None:
        """Begin without findings.

        Args:
            seen: Evidence that all rules of the set use.
        """
        self.seen, self.present = seen, False
        self._for = np.zeros(len(seen.group_of), dtype=np.int64)  # consecutive samples with a true condition
        self._since_report, self._suppressed = 10**9, 0  # number of cycles since the last report, and repeats in them

    def look(self, cycle: Cycle) -> str | None:
        """Check one cycle. Call this method once for every cycle, in order.

        Args:
            cycle: The cycle.

        Returns:
            Message for the operator in the cycle in which the fault begins: fault, item, value, limit, next step. None
            in all other cycles. A fault that begins while another fault stops the winches is reported after the stop,
            if it is still present.
        """
        if cycle is not self.seen.cycle:  # the first rule updates the evidence for all rules
            self.seen.at(cycle)
        # a fault during a stop is mostly a consequence of the stop; it is reported only if it makes a length unreliable
        waits = False
        if self.seen.stopped and self.reaction is Reaction.STOPPING and not self.homing:
            if self.lasting:  # a faulty item is reported once
                return None
            waits = not self.present
        line = self.found(cycle)
        self._since_report += 1
        if line is None:
            if not self.lasting:
                self.present = False
            return None
        if waits:
            return None
        begins = self.lasting or not self.present
        self.present = True
        if begins and self.reaction >= Reaction.STOPPING:
            self.seen.stop()
        return self._without_repeats(line) if begins else None

    def _without_repeats(self, line: str) -> str | None:
        """Message `line`, or None if it repeats a report within `quiet` seconds."""
        if not self.quiet:
            return line
        if self._since_report * self.seen.period <= self.quiet:
            self._suppressed += 1
            return None
        more = f" It was repeated {self._suppressed} times since the last report." if self._suppressed else ""
        self._since_report, self._suppressed = 0, 0
        return line + more

    @abstractmethod
    def found(self, cycle: Cycle) -> str | None:
        """Message for the operator in each cycle in which the condition holds; a lasting fault reports only new items.

        Args:
            cycle: Readings and set points of the cycle.

        Returns:
            Text of the message; None without a fault.
        """
