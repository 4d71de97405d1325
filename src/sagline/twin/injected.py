"""Injected faults of a machine, each from one line of text."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from heapq import heappop, heappush
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from sagline.core.arguments import brief
from sagline.core.errors import InvalidValueError, nearest


class Kind(NamedTuple):
    """One kind of fault."""

    item: str  # kind of part ("cell")
    numbered: bool  # whether there are several, told apart by a number
    words: str  # the fault, with # in place of its value
    unit: str  # of that value in texts
    scale: float  # to SI
    for_good: bool  # whether it cannot end by itself
    sense: str  # meaning, in words


KINDS: Final = MappingProxyType(
    {
        f"{kind.item} {kind.words}".strip(): kind
        for kind in (
            Kind("cell", True, "sticks", "", 1.0, False, "reads what it read last"),
            Kind("cell", True, "reads #", "N", 1.0, False, "reads that, whatever pulls"),
            Kind("cell", True, "saturates", "", 1.0, False, "reads its full scale"),
            Kind("cell", True, "is wrong by #", "N", 1.0, False, "reads so much more than it did"),
            Kind("cable", True, "breaks", "", 1.0, True, "pulls and weighs no longer"),
            Kind("encoder", True, "jumps by #", "mm", 1e-3, True, "counts so much more cable than there is"),
            Kind("servo", True, "is limited to #", "N", 1.0, True, "gives no more at the cable"),
            Kind("servo", True, "trips", "", 1.0, True, "has no power, until the operator resets the machine"),
            Kind(
                "load",
                False,
                "grows by #",
                "kg",
                1.0,
                False,
                "hangs at the center of mass; less than 0: goes",
            ),
            Kind("emergency stop", False, "", "", 1.0, True, "is pressed, until the operator resets the machine"),
            Kind("group", True, "is silent", "", 1.0, False, "its blocks do not arrive"),
            Kind("group", True, "repeats", "", 1.0, False, "its last block arrives again and again"),
            Kind("group", True, "doubles", "", 1.0, False, "each of its blocks arrives twice"),
            Kind("group", True, "swaps", "", 1.0, False, "of two blocks the later one arrives first"),
            Kind("group", True, "goes back", "", 1.0, False, "older and older blocks arrive"),
            Kind("group", True, "is torn", "", 1.0, False, "the counters at the two ends of its blocks differ"),
            Kind("group", True, "is foreign", "", 1.0, False, "its blocks are of another program"),
            Kind("group", True, "stops", "", 1.0, False, "its PLC stops: what it said stays, its drives have no power"),
            Kind("group", True, "is taken", "", 1.0, False, "another controller has its grant"),
            Kind("commands", False, "stop", "", 1.0, False, "none arrives at any PLC"),
            Kind("commands", False, "repeat", "", 1.0, False, "the last one arrives again and again"),
            Kind("commands", False, "are torn", "", 1.0, False, "the counters at the two ends of their blocks differ"),
            Kind("commands", False, "are foreign", "", 1.0, False, "they come from another owner"),
        )
    }
)
TINY: Final = 1e-9  # s, of rounding
_TAIL: Final = re.compile(r"(?: at (?P<time>\S+) s)?(?: for (?P<duration>\S+) s)?$")
_NUMBER: Final = r"(?P<value>\S+)"


@dataclass(frozen=True, slots=True)
class Injected:
    """Fault injected into a machine.

    Attributes:
        kind: One of `KINDS`, "cell sticks" for instance.
        which: Number of the cell, cable, encoder, servo or group, from 0; 0 where there is only one.
        value: Its number, SI; 0 where it has none.
        time: Of its beginning, since the start of the machine [s].
        duration: Until its end [s]; infinite by default.
    """

    kind: str
    which: int = 0
    value: float = 0.0
    time: float = 0.0
    duration: float = math.inf

    def __str__(self) -> str:
        """As `fault` reads it."""
        kind = KINDS[self.kind]
        item = f"{kind.item} {self.which}" if kind.numbered else kind.item
        words = kind.words.replace("#", f"{self.value / kind.scale:.12g} {kind.unit}")
        lasts = f" for {self.duration:.12g} s" if self.duration < math.inf else ""
        return f"{item} {words}".strip() + f" at {self.time:.12g} s{lasts}"


def fault(text: str) -> Injected:
    """A fault from its text.

    Args:
        text: What happens, to which one (from 0), and when: "cell 3 sticks at 40 s", "group 2 is silent at 12.5 s for
            0.2 s". Without a time it is there from the start, without a duration it lasts. What there is:
            `sl.twin.KINDS`.

    Returns:
        The fault.

    Raises:
        InvalidValueError: If there is no such fault; the message names the words that there are.

    Examples:
        >>> import sagline as sl
        >>> print(sl.twin.fault("encoder 5 jumps by 2 mm at 40 s"))
        encoder 5 jumps by 2 mm at 40 s
    """
    given: Any = text
    if not isinstance(given, str):
        raise InvalidValueError("fault", brief(given), "a text", 'Write it as "cell 3 sticks at 40 s".')
    words = " ".join(given.lower().split())
    tail = _TAIL.search(words)
    assert tail is not None  # it may be empty
    what = words[: tail.start()]
    time, duration = _seconds(text, tail["time"], 0.0), _seconds(text, tail["duration"], math.inf)
    if not duration > 0.0:
        raise _refused(text, "a duration > 0 s")
    for name, kind in KINDS.items():
        number = r" (?P<which>\d{1,6})" if kind.numbered else ""
        happens = kind.words.replace("#", f"{_NUMBER} {kind.unit.lower()}")
        if match := re.fullmatch(f"{kind.item}{number} {happens}".strip(), what, re.ASCII):
            found = match.groupdict()
            if kind.for_good and duration < math.inf:
                raise _refused(text, f"no duration: what {kind.words or 'is pressed'} does not end by itself")
            value = _number(text, found.get("value"), 0.0, kind.unit) * kind.scale
            return Injected(name, int(found.get("which") or 0), value, time, duration)
    raise _unknown(text, what)


def _unknown(text: str, what: str) -> InvalidValueError:
    """Error for unknown words: names the words for that item, or the items."""
    items = sorted({kind.item for kind in KINDS.values()})
    first = what.split(" ")[0] if what else ""
    item = next((item for item in items if item.split(" ")[0] == first), None)
    if item is None:
        near = nearest(first, items)
        step = f"Did you mean {near}?" if near else 'Write "cell 3 sticks at 40 s" for instance.'
        return InvalidValueError("fault", brief(text), f"one of {', '.join(items)}", step)
    of_it = [kind for kind in KINDS.values() if kind.item == item]
    happens = ", ".join(kind.words.replace("#", f"# {kind.unit}") for kind in of_it if kind.words)
    several = f"{item} {'NUMBER ' if of_it[0].numbered else ''}"
    allowed = f"{several}and then {happens}, # a number" if happens else item
    return InvalidValueError("fault", brief(text), allowed.replace(", # a number", ""), 'When: "at 40 s for 2 s".')


def _refused(text: str, allowed: str) -> InvalidValueError:
    return InvalidValueError("fault", brief(text), allowed, 'Write "group 2 is silent at 40 s for 0.2 s" for instance.')


def _seconds(text: str, word: str | None, otherwise: float) -> float:
    seconds = _number(text, word, otherwise, "s")
    if not seconds >= 0.0:
        raise _refused(text, "times >= 0 s")
    return seconds


def _number(text: str, word: str | None, otherwise: float, unit: str) -> float:
    if word is None:
        return otherwise
    try:
        number = float(word) if word.isascii() and "_" not in word else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _refused(text, f"a number before {unit}")
    return number


class Schedule:
    """Queue of the beginnings and ends of faults."""

    def __init__(self) -> None:
        """Begin empty."""
        self._due: list[tuple[float, int, bool, Injected]] = []
        self._planned = 0

    @property
    def waiting(self) -> bool:
        """True if there are any."""
        return bool(self._due)

    def plan(self, what: Injected) -> None:
        """Queue the beginning and the end of a fault."""
        self._push(what.time, True, what)
        if what.duration < math.inf:
            self._push(what.time + what.duration, False, what)

    def _push(self, time: float, begins: bool, what: Injected) -> None:
        self._planned += 1
        heappush(self._due, (time, self._planned, begins, what))

    def due(self, now: float) -> list[tuple[bool, Injected]]:
        """Faults that begin (True) or end by a time [s], in order."""
        found = []
        while self._due and self._due[0][0] <= now + TINY:
            _, _, begins, what = heappop(self._due)
            found.append((begins, what))
        return found
