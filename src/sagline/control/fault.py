"""What a fault is: a rule that looks at every cycle, what follows, and a line for the operator."""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import IntEnum
from typing import ClassVar

from sagline.control.evidence import Cycle, Evidence


class Reaction(IntEnum):
    """What follows from a fault; of several at a time the largest counts."""

    EVENT = 0  # it is told and recorded, and nothing else
    DEGRADED = 1  # the tension loop keeps what it has added; the motion goes on
    STOPPING = 2  # the ramp, then FAULT
    EMERGENCY = 3  # drums locked, no motion offered


class Fault(ABC):
    """One rule. A fresh set of them, from `faults_of`, remembers nothing: make one when the operator clears a fault.

    Attributes:
        name: What an event calls it.
        rule: When it is there, in words.
        reaction: What follows.
        within: How long it takes to be found, in words.
        homing: Whether it leaves a length in doubt, so that the robot must be homed again.
        lasting: Whether it stays until a fresh set is made, though its rule holds no longer; each item is told once.
        quiet: For how long after it was told nothing is said where it begins again, but how often it did [s].
        present: Whether it is there now; one that stops a motion which another has stopped already, once that stands.
        seen: What the set of faults has seen.
    """

    name: ClassVar[str]
    rule: ClassVar[str]
    reaction: ClassVar[Reaction]
    within: ClassVar[str]
    homing: ClassVar[bool] = False
    lasting: ClassVar[bool] = False
    quiet: ClassVar[float] = 0.0

    def __init__(self, seen: Evidence) -> None:
        """Begin with nothing found.

        Args:
            seen: Shared by the whole set.
        """
        self.seen, self.present = seen, False
        self._spoke, self._unsaid = 10**9, 0  # cycles since it was told, and how often it began meanwhile

    def look(self, cycle: Cycle) -> str | None:
        """Look at a cycle; every cycle once, in order.

        Args:
            cycle: The cycle.

        Returns:
            Where the fault begins a line for the operator: what, which item, value, limit, next step. None otherwise,
            while it lasts, and as long as another one stops the motion: what is left of it is told when that stands.
        """
        if cycle is not self.seen.cycle:  # what the first rule lets be worked out serves them all
            self.seen.at(cycle)
        # what comes after a stop is mostly its consequence; what puts a length in doubt is told for all that
        stops, waits = self.reaction >= Reaction.STOPPING, False
        if self.seen.stopped and self.reaction is Reaction.STOPPING and not self.homing:
            if self.lasting:  # it has each of its items once
                return None
            waits = not self.present
        line = self.found(cycle)
        self._spoke += 1
        if line is None:
            if not self.lasting:
                self.present = False
            return None
        if waits:
            return None
        begins = self.lasting or not self.present
        self.present = True
        if begins and stops:
            self.seen.stop()
        return self._said(line) if begins else None

    def _said(self, line: str) -> str | None:
        """The line, unless there was one a moment ago."""
        if not self.quiet:
            return line
        if self._spoke * self.seen.period <= self.quiet:
            self._unsaid += 1
            return None
        more = f" It was so {self._unsaid} times more since this was told last." if self._unsaid else ""
        self._spoke, self._unsaid = 0, 0
        return line + more

    @abstractmethod
    def found(self, cycle: Cycle) -> str | None:
        """The operator's line in every cycle in which the rule holds; of one that lasts, where an item is new."""
