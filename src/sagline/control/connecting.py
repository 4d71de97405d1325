"""Claiming the groups: all of them, or none."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.control.link import COUNTERS, OWNER_TIMEOUT, GroupStatus, Missing, Mode, Sample

CLAIMING: Final = OWNER_TIMEOUT + 0.7  # s, at most, until all grants are there
SILENT: Final = 7.0  # s, at most, until every group has answered once
GIVING_BACK: Final = 0.05  # s, for grants of some groups only
LONGEST_WAIT: Final = 0.6  # s, at random, before the next claim
TRIES: Final = 4
FRESH: Final = 3  # cycles: so old may a sample be
AGREEING: Final = 5  # cycles in a row
BEHIND: Final = 10  # commands: so far may an echo be


class Claim:
    """What is sent while a controller connects.

    Attributes:
        mode: Of the next command; None: nothing is sent.
        ready: Whether all groups agree.
        refused: Why they do not, when it is given up.
    """

    def __init__(self, owner: int, period: float, random: np.random.Generator) -> None:
        """Begin to claim.

        Args:
            owner: The controller's id.
            period: Of a cycle [s].
            random: For waiting.
        """
        self._owner, self._period, self._random = owner, period, random
        self._silent = self._cycles = self._agreed = 0
        self._waiting = 0
        self._tries = 1
        self.mode: Mode | None = Mode.HOLD
        self.ready, self.refused = False, ""

    def look(self, answer: Sample | Missing, counter: int) -> None:
        """Judge an answer, and decide what goes out next.

        Args:
            answer: What came back.
            counter: Of the last command that was sent.
        """
        if isinstance(answer, Missing):
            self._silent += 1
            if self._silent * self._period >= SILENT:
                self._refuse("; ".join(f"group {g}: {why}" for g, why in zip(*answer[1:], strict=True)))
            return
        self._cycles += 1
        if self._waiting:
            self._wait()
            return
        self._agreed = self._agreed + 1 if self._agree(answer, counter) else 0
        if self._agreed >= AGREEING:
            self.ready = True
        elif self._cycles * self._period >= CLAIMING:
            if self._tries == TRIES:
                self._refuse(self._reasons(answer))
            else:
                self._give_back()

    def _agree(self, sample: Sample, counter: int) -> bool:
        fresh = bool((sample.age <= FRESH * self._period).all())
        behind = (counter - sample.echo) % COUNTERS
        powered = bool(((sample.status & GroupStatus.READY) > 0).all())
        return fresh and powered and bool((sample.owner == self._owner).all()) and bool((behind <= BEHIND).all())

    def _give_back(self) -> None:
        """Somebody else may have what is missing, and wait for what is here."""
        self._tries += 1
        self.mode = Mode.LEAVE
        longest = LONGEST_WAIT / self._period
        self._waiting = round(GIVING_BACK / self._period) + int(self._random.integers(1, max(int(longest), 2)))
        self._cycles = 0

    def _wait(self) -> None:
        self._waiting -= 1
        if self._cycles * self._period >= GIVING_BACK:
            self.mode = None
        if not self._waiting:
            self.mode, self._cycles = Mode.HOLD, 0

    def _refuse(self, reason: str) -> None:
        self.refused, self.mode = reason, Mode.LEAVE

    def _reasons(self, sample: Sample) -> str:
        found = []
        for g, owner in enumerate(sample.owner):
            if sample.age[g] > FRESH * self._period:
                found.append(f"group {g} is silent for {sample.age[g]:.2g} s")
            elif owner not in (0, self._owner):
                found.append(f"group {g} belongs to another controller, {owner}")
            elif not owner:
                found.append(f"group {g} gives its grant to nobody")
            elif sample.status[g] & GroupStatus.EMERGENCY:
                found.append(f"the emergency stop of group {g} is pressed")
            elif not sample.status[g] & GroupStatus.READY:
                found.append(f"a drive of group {g} is not ready")
            else:
                found.append(f"group {g} does not take commands")
        return "; ".join(found)
