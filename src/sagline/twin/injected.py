"""Faults that are injected into a machine. Each fault can be written as one line of text."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from heapq import heappop, heappush
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from sagline.core.arguments import brief
from sagline.core.errors import InvalidValueError, nearest


class _FaultKind(NamedTuple):
    """One kind of fault."""

    item: str  # kind of part ("cell")
    words: str  # text of the fault, with # at the place of the value
    sense: str  # meaning as text
    unit: str = ""  # unit of the value, in texts
    scale: float = 1.0  # factor that converts the value to SI
    for_good: bool = False  # True if the fault ends only by a reset

    @property
    def numbered(self) -> bool:
        """True if a machine has several parts of this kind, which are numbered."""
        return self.item in ("cell", "cable", "encoder", "servo", "group")


KINDS: Final = MappingProxyType(
    {
        f"{kind.item} {kind.words}".strip(): kind
        for kind in (
            _FaultKind("cell", "sticks", "repeats its last reading"),
            _FaultKind("cell", "reads #", "reads this value, at any tension", "N"),
            _FaultKind("cell", "saturates", "reads its full scale"),
            _FaultKind("cell", "fails", "gives no reading: its value is not a number"),
            _FaultKind("cell", "is wrong by #", "reads this value too much", "N"),
            _FaultKind("cable", "breaks", "has no tension and no weight", for_good=True),
            _FaultKind("encoder", "jumps by #", "counts this additional length of cable", "mm", 1e-3, True),
            _FaultKind("servo", "is limited to #", "has a cable force of at most this value", "N", 1.0, True),
            _FaultKind("servo", "trips", "has no power until the operator resets the machine", for_good=True),
            _FaultKind("load", "grows by #", "is added at the center of mass; removed if less than 0", "kg"),
            _FaultKind("emergency stop", "", "is pressed until the operator resets the machine", for_good=True),
            _FaultKind("group", "is silent", "its blocks do not arrive"),
            _FaultKind("group", "repeats", "its last block arrives again and again"),
            _FaultKind("group", "doubles", "each of its blocks arrives twice"),
            _FaultKind("group", "swaps", "two of its blocks arrive in the wrong order"),
            _FaultKind("group", "goes back", "its earlier blocks arrive in reverse order"),
            _FaultKind("group", "is torn", "the counters at the two ends of its blocks differ"),
            _FaultKind("group", "is foreign", "its blocks are of another program"),
            _FaultKind("group", "stops", "its PLC stops: its block stays unchanged, its drives have no power"),
            _FaultKind("group", "is taken", "another controller owns it"),
            _FaultKind("commands", "stop", "none arrives at any PLC"),
            _FaultKind("commands", "repeat", "the last one arrives again and again"),
            _FaultKind("commands", "are torn", "the counters at the two ends of their blocks differ"),
            _FaultKind("commands", "are foreign", "they come from another owner"),
        )
    }
)
TINY: Final = 1e-9  # tolerance for rounding errors of times [s]
_TAIL: Final = re.compile(r"(?: at (?P<time>\S+) s)?(?: for (?P<duration>\S+) s)?$")
_NUMBER: Final = r"(?P<value>\S+)"


@dataclass(frozen=True, slots=True)
class Injected:
    """Fault injected into a machine.

    Attributes:
        kind: One of `KINDS`, for example "cell sticks".
        which: Index of the cell, cable, encoder, servo or group, from 0; 0 for a part without a number.
        value: Value in SI units; 0 for a kind of fault without a value.
        time: Time from the start of the machine to the beginning of the fault [s].
        duration: Duration [s]; infinite by default.
    """

    kind: str
    which: int = 0
    value: float = 0.0
    time: float = 0.0
    duration: float = math.inf

    def __str__(self) -> str:
        """Text from which `fault` creates the same fault."""
        kind = KINDS[self.kind]
        item = f"{kind.item} {self.which}" if kind.numbered else kind.item
        words = kind.words.replace("#", f"{self.value / kind.scale:.12g} {kind.unit}")
        lasts = f" for {self.duration:.12g} s" if self.duration < math.inf else ""
        return f"{item} {words}".strip() + f" at {self.time:.12g} s{lasts}"


def fault(text: str) -> Injected:
    """Create a fault from its text.

    Args:
        text: Part with its number (from 0), fault and time, for example "cell 3 sticks at 40 s" or "group 2 is silent
            at 12.5 s for 0.2 s". A fault without a time begins at the start of the machine. A fault without a duration
            does not end. `sl.twin.KINDS` lists all kinds of faults.

    Returns:
        The fault.

    Raises:
        InvalidValueError: If the fault does not exist: the message lists the known words.

    Examples:
        >>> import sagline as sl
        >>> print(sl.twin.fault("encoder 5 jumps by 2 mm at 40 s"))
        encoder 5 jumps by 2 mm at 40 s
    """
    given: Any = text
    if not isinstance(given, str):
        raise InvalidValueError("fault", brief(given), "a text", 'Write the fault as "cell 3 sticks at 40 s".')
    words = " ".join(given.lower().split())
    tail = _TAIL.search(words)
    assert tail is not None  # the text before the time may be empty
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
                raise _refused(text, "no duration, because this fault ends only by a reset")
            value = _number(text, found.get("value"), 0.0, kind.unit) * kind.scale
            return Injected(name, int(found.get("which") or 0), value, time, duration)
    raise _unknown(text, what)


def _unknown(text: str, what: str) -> InvalidValueError:
    """Create the error for unknown words. The error lists the known faults of the part, or the known parts."""
    items = sorted({kind.item for kind in KINDS.values()})
    first = what.split(" ")[0] if what else ""
    item = next((item for item in items if item.split(" ")[0] == first), None)
    if item is None:
        near = nearest(first, items)
        step = f"Did you mean {near}?" if near else 'Write "cell 3 sticks at 40 s" for instance.'
        return InvalidValueError("fault", brief(text), f"one of {', '.join(items)}", step)
    of_it = [kind for kind in KINDS.values() if kind.item == item]
    happens = ", ".join(kind.words.replace("#", f"# {kind.unit}") for kind in of_it if kind.words)
    allowed = f"{item} {'NUMBER ' if of_it[0].numbered else ''}and then {happens}" if happens else item
    return InvalidValueError("fault", brief(text), allowed, 'When: "at 40 s for 2 s".')


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


class TimedQueue:
    """Queue of items, sorted by their times. Items with equal times keep the order in which they were added."""

    def __init__(self) -> None:
        """Make an empty queue."""
        self._items: list[tuple[float, int, Any]] = []
        self._added = 0

    @property
    def waiting(self) -> bool:
        """True if the queue is not empty."""
        return bool(self._items)

    def add(self, time: float, item: Any) -> None:
        """Add an item. `time`: time from which it is due [s]."""
        self._added += 1
        heappush(self._items, (time, self._added, item))

    def due(self, now: float) -> list[tuple[float, Any]]:
        """Remove all items that are due until `now` [s]. Returns the items with their times, in the order of time."""
        found = []
        while self._items and self._items[0][0] <= now + TINY:
            time, _, item = heappop(self._items)
            found.append((time, item))
        return found
