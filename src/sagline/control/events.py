"""What happens while a controller runs: each change of state, each fault, each word for the operator."""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from sagline.control.states import State


class EventKind(StrEnum):
    """What an event is about."""

    STATE = "state"  # it changed
    FAULT = "fault"
    NOTE = "note"  # for the operator; nothing follows from it


class Event(NamedTuple):
    """One thing that happened.

    Attributes:
        time: On the link's clock [s].
        cycle: In which cycle of the controller, from 0.
        kind: What it is about.
        name: The state that was entered, or the fault.
        state: Of the controller after it.
        text: One line for the operator.
    """

    time: float
    cycle: int
    kind: EventKind
    name: str
    state: State
    text: str
