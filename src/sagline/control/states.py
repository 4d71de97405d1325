"""States of the controller and one table of the transitions between them."""

from __future__ import annotations

from typing import Final, NamedTuple

from sagline.core.errors import MOST, SaglineError, shortened
from sagline.core.status import Status


class State(Status):
    """State of the controller."""

    OFF = 0, "brakes on, no grant held; connect() begins"
    CONNECTING = 1, "claims the groups and waits until all of them agree; brakes on"
    READY = 2, "the drives hold; home(pose) tells where the platform is"
    HOMING = 3, "one winch at a time is jogged until every tension is that of the plan at home"
    IDLE = 4, "the platform stands, its place is known; a path, a pose or a jog may begin"
    MOVING = 5, "set points follow the plan"
    JOGGING = 6, "set points follow the operator"
    PAUSING = 7, "the path's clock slows down; resume() goes on from there"
    STOPPING = 8, "all rates go to zero together"
    FAULT = 9, "the drives hold; the operator reads why, mends it and acknowledges"
    EMERGENCY = 10, "drums locked; the operator frees the machine by hand, then connects and homes again"


class Exit(NamedTuple):
    """One way out of a state.

    Attributes:
        to: The state it leads to.
        by: Its condition.
    """

    to: State
    by: str


class Row(NamedTuple):
    """One state of the table.

    Attributes:
        state: The state.
        winches: Their action in it.
        exits: All ways out of it.
    """

    state: State
    winches: str
    exits: tuple[Exit, ...]


_STOP: Final = Exit(State.STOPPING, "stop, or a fault")
_FAULT: Final = Exit(State.STOPPING, "a fault")
_EMERGENCY: Final = Exit(State.EMERGENCY, "emergency stop, or a broken cable")
_OFF: Final = Exit(State.OFF, "the operator")

TABLE: Final = (
    Row(State.OFF, "brakes", (Exit(State.CONNECTING, "the operator"),)),
    Row(
        State.CONNECTING,
        "brakes",
        (Exit(State.READY, "layouts, counters and grants agree"), Exit(State.OFF, "they do not")),
    ),
    Row(
        State.READY,
        "hold",
        (
            Exit(State.HOMING, "the operator names a pose"),
            Exit(State.IDLE, "the place is still known after a fault"),
            _OFF,
            _FAULT,
            _EMERGENCY,
        ),
    ),
    Row(
        State.HOMING,
        "jog, one at a time",
        (Exit(State.IDLE, "every tension within 5 sigma of the plan at home"), _OFF, _STOP, _EMERGENCY),
    ),
    Row(
        State.IDLE,
        "hold, tension loop on",
        (
            Exit(State.MOVING, "a plan that is feasible and starts here, or resume"),
            Exit(State.JOGGING, "the operator"),
            _OFF,
            _FAULT,
            _EMERGENCY,
        ),
    ),
    Row(
        State.MOVING,
        "set points, tension loop on",
        (Exit(State.IDLE, "the end of the plan"), Exit(State.PAUSING, "pause"), _STOP, _EMERGENCY),
    ),
    Row(State.JOGGING, "set points of the jog", (Exit(State.IDLE, "the end of the jog"), _STOP, _EMERGENCY)),
    Row(
        State.PAUSING,
        "ramp on the path's clock, tension loop on",
        (Exit(State.IDLE, "the clock stands"), _STOP, _EMERGENCY),
    ),
    Row(
        State.STOPPING,
        "coordinated ramp",
        (
            Exit(State.IDLE, "they stand, the operator stopped"),
            Exit(State.READY, "they stand, the operator stopped homing"),
            Exit(State.FAULT, "they stand, a fault stopped"),
            _EMERGENCY,
        ),
    ),
    Row(State.FAULT, "hold", (Exit(State.READY, "the operator acknowledges"), _OFF, _EMERGENCY)),
    Row(State.EMERGENCY, "drums locked", (_OFF,)),
)
EXITS: Final = {row.state: tuple(exit.to for exit in row.exits) for row in TABLE}
MOTION: Final = frozenset({State.HOMING, State.MOVING, State.JOGGING, State.PAUSING, State.STOPPING})
HOLDS_GRANT: Final = frozenset(State) - {State.OFF, State.CONNECTING}


class RefusedError(SaglineError):
    """Refused request, with the reason; nothing was sent.

    Attributes:
        what: The request.
        reason: Of the refusal.
        next_step: For the reader.
        item: The same as `what`, under the name that all errors have.
    """

    def __init__(self, what: str, reason: str, next_step: str) -> None:
        """Compose the message from its three parts."""
        super().__init__(what, reason, next_step)
        self.what = self.item = what
        self.reason = reason
        self.next_step = next_step

    def __str__(self) -> str:
        """One line: what, reason, next step."""
        what, reason, next_step = shortened(
            (self.what, self.reason, self.next_step), room=MOST - len(" is refused: . ")
        )
        return f"{what} is refused: {reason}. {next_step}"


def check_transition(state: State, to: State, what: str) -> None:
    """Refuse a transition that is not in the table."""
    if to in EXITS[state]:
        return
    ways = ", ".join(f"{exit.to.name} ({exit.by})" for row in TABLE if row.state is state for exit in row.exits)
    raise RefusedError(what, f"{state.name} does not lead to {to.name}", f"It leads to {ways}.")
