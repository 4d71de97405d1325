"""Commands of a controller, and the claim of the ownership of all groups."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.control import link
from sagline.core.arrays import Array, Flags

VALID_FOR: Final = link.HEARTBEAT  # time in which a PLC may use a command [s]
MOST_OWNER: Final = 2**31


class Sender:
    """Builder of the next command that the controller sends."""

    def __init__(self, cable_count: int, random: np.random.Generator) -> None:
        """Begin without a command: nothing is sent yet."""
        self.owner = int(random.integers(1, MOST_OWNER))
        self.counter = int(random.integers(1, MOST_OWNER))  # counter of the last command
        self.command: link.Command | None = None  # next command; None if nothing is sent
        # length: measured lengths at rest [m], shape (m,)
        # tension: tensions at rest, at the drums [N], shape (m,)
        self.length, self.tension = np.full(cable_count, np.nan), np.zeros(cable_count)
        self._enabled: Flags = np.ones(cable_count, dtype=np.bool_)
        self._disabled: Flags = ~self._enabled

    def follow(self, length: Array, rate: Array, tension: Array, enable: Flags | None) -> None:
        """Command `length` [m], `rate` [m/s], `tension` at the drums [N], each (m,). `enable`: None for all drives."""
        self._send(link.Mode.FOLLOW, length, rate, tension, self._enabled if enable is None else enable, claims=False)

    def rest(self, mode: link.Mode, *, enabled: bool, claims: bool = False) -> None:
        """Command the drives to hold their present position."""
        enable = self._enabled if enabled else self._disabled
        self._send(mode, self.length, np.zeros(len(self.length)), self.tension, enable, claims)

    def stand_at(self, sample: link.Sample | None, tension: Array | None = None) -> None:
        """Store the lengths of `sample` and the tensions at rest [N], (m,): `tension`, or filtered readings if None."""
        if sample is not None:
            self.length, self.tension = sample.length, sample.filtered if tension is None else tension

    def _send(self, mode: link.Mode, length: Array, rate: Array, tension: Array, enable: Flags, claims: bool) -> None:
        self.counter = self.counter % link.COUNTERS + 1
        positive = np.maximum(tension, 0.0)  # a reading can be below zero, but a PLC rejects negative tensions
        self.command = link.Command(self.counter, self.owner, mode, VALID_FOR, length, rate, positive, enable, claims)


CLAIMING: Final = link.OWNER_TIMEOUT + 0.7  # longest time until the controller owns all groups [s]
SILENT: Final = 7.0  # longest wait for the first answers of all groups [s]
GIVING_BACK: Final = 0.05  # longest time in which the controller owns only some of the groups [s]
LONGEST_WAIT: Final = 0.6  # upper limit of the random wait before the next claim [s]
TRIES: Final = 4
FRESH: Final = 3  # largest age of a sample [cycles]
AGREEING: Final = 5  # consecutive cycles in which all groups must agree
SURE: Final = 20  # [cycles]; after this time, no cause of disagreement from before the claim remains
BEHIND: Final = 10  # largest number of commands by which a PLC's echo may lag behind the last command
_LOCKED, _PRESSED, _READY = int(link.GroupStatus.LOCKED), int(link.GroupStatus.EMERGENCY), int(link.GroupStatus.READY)
_AGAIN: Final = "Try again; if this continues, check the program of the PLC."


def disagreement(
    sample: link.Sample, owner: int, counter: int, groups: link.Groups, period: float = link.PERIOD
) -> tuple[link.Refusal | None, bool]:
    """First reason why a group does not agree, and True if the operator must act. (None, False) if all groups agree."""
    # A group agrees if its sample is fresh, this controller owns it, its drives are ready, without fault and not
    # locked, and it has accepted one of the last commands. Reasons that concern the whole group are checked first.
    status, other = sample.status, sample.owner
    faulty = (sample.winch_fault != 0) | (sample.state == int(link.WinchState.FAULT))
    tripped = np.array([bool(faulty[list(winches)].any()) for winches in groups])
    age, stranger = float(sample.age.max()), (other != owner) & (other != 0)
    foreign = int(other[stranger][0]) if stranger.any() else 0
    codes = sorted({int(code) for code in sample.fault} - {0})
    stops = f"its PLC has stopped it: {'; '.join(map(link.fault_text, codes))}"
    causes: tuple[tuple[Flags, str, str, bool], ...] = (
        (~(sample.age <= FRESH * period), f"silent for {age:.2g} s", f"{link.CHECK}.", False),
        (
            (status & _PRESSED) != 0,
            "the emergency stop is pressed",
            "Make the machine safe and release the stop.",
            True,
        ),
        ((status & _LOCKED) != 0, "the drums are locked", "Unlock the drums at the machine, then connect again.", True),
        (stranger, f"belongs to another controller, {foreign}", "Stop that controller, then connect again.", False),
        (other != owner, "no controller owns it", "Connect again.", False),
        (tripped, "a drive has tripped", "Repair and reset it at the machine.", False),
        ((status & _READY) == 0, "a drive is not ready", "Repair and reset it at the machine.", False),
        (sample.fault != 0, stops, "Remove the cause, and wait 0.3 s for the PLC.", False),
        ((counter - sample.echo) % link.COUNTERS > BEHIND, "does not accept commands", _AGAIN, False),
    )
    for there, reason, step, lasting in causes:
        if there.any():
            names = ", ".join(map(str, np.flatnonzero(there)))
            return link.Refusal(f"group {names}: {reason}", step), lasting
    return None, False


class Claim:
    """Claim of the ownership of all groups."""

    def __init__(self, owner: int, groups: link.Groups, period: float, random: np.random.Generator) -> None:
        """Begin the claim for cycles of `period` [s]."""
        self._owner, self._groups, self._period, self._random = owner, groups, period, random
        self._silent = self._cycles = self._agreed = 0
        self._waiting = 0
        self._tries = 1
        self.mode: link.Mode | None = link.Mode.HOLD  # mode of the next command; None if nothing is sent
        self.ready = False  # True if all groups agree
        self.refused: link.Refusal | None = None  # reason of the failure; None before a failure

    def look(self, answer: link.Sample | link.Missing, counter: int) -> None:
        """Evaluate an answer of the machine, and choose the mode of the next command."""
        if isinstance(answer, link.Missing):
            self._silent += 1
            if self._silent * self._period >= SILENT:
                reason = "; ".join(f"group {g}: {why}" for g, why in zip(*answer[1:], strict=True))
                self._refuse(link.Refusal(reason, f"{link.CHECK}, then try again."))
            return
        self._cycles += 1
        if self._waiting:
            self._wait()
            return
        why, lasting = disagreement(answer, self._owner, counter, self._groups, self._period)
        self._agreed = self._agreed + 1 if why is None else 0
        if why is None:
            self.ready = self._agreed >= AGREEING
        elif (lasting and self._cycles >= SURE) or (self._late and self._tries == TRIES):
            self._refuse(why)
        elif self._late:
            self._give_back()

    @property
    def _late(self) -> bool:
        return self._cycles * self._period >= CLAIMING

    def _give_back(self) -> None:
        """Give up all groups for a random time, because another controller may own some and wait for the rest."""
        self._tries += 1
        self.mode = link.Mode.LEAVE
        longest = LONGEST_WAIT / self._period
        self._waiting = round(GIVING_BACK / self._period) + int(self._random.integers(1, max(int(longest), 2)))
        self._cycles = 0

    def _wait(self) -> None:
        self._waiting -= 1
        if self._cycles * self._period >= GIVING_BACK:
            self.mode = None
        if not self._waiting:
            self.mode, self._cycles = link.Mode.HOLD, 0

    def _refuse(self, why: link.Refusal) -> None:
        self.refused, self.mode = why, link.Mode.LEAVE
