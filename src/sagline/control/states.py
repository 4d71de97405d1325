"""States of the controller, and one table of all transitions between states."""

from __future__ import annotations

from typing import Final

from sagline.core.errors import ThreePartError
from sagline.core.results import Status


class State(Status):
    """State of the controller."""

    OFF = 0, "brakes on, no group is owned; connect() begins"
    CONNECTING = 1, "the controller claims the groups and waits until all of them agree; brakes on"
    READY = 2, "the drives hold; home(pose) sets the pose of the platform"
    HOMING = 3, "one winch at a time is jogged until tensions and lengths agree with the plan at the stated pose"
    IDLE = 4, "the platform is at rest at a known pose; a path, a pose or a jog may begin"
    MOVING = 5, "set points follow the plan"
    JOGGING = 6, "set points follow the operator"
    PAUSING = 7, "the platform slows down along the path; resume() continues the path"
    STOPPING = 8, "all rates decrease to zero in the same time"
    FAULT = 9, "the drives hold; the operator reads the reason, repairs the cause and acknowledges"
    EMERGENCY = 10, "drums locked; the operator unlocks them at the machine, then connects and homes again"


_OFF: Final = {State.OFF: "the operator"}
_FAULT: Final = {State.STOPPING: "a fault"}
_STOP: Final = {State.STOPPING: "stop, or a fault"}
_EMERGENCY: Final = {State.EMERGENCY: "emergency stop, or a broken cable"}

# for each state: action of the winches, and the condition for each possible next state
TABLE: Final[dict[State, tuple[str, dict[State, str]]]] = {
    State.OFF: ("brakes", {State.CONNECTING: "the operator"}),
    State.CONNECTING: ("brakes", {State.READY: "layouts, counters and owners agree", State.OFF: "they do not agree"}),
    State.READY: (
        "hold",
        {
            State.HOMING: "the operator names a pose",
            State.IDLE: "the pose is still known after a fault",
            **_OFF,
            **_FAULT,
            **_EMERGENCY,
        },
    ),
    State.HOMING: (
        "jog, one at a time",
        {State.IDLE: "tensions and lengths within 5 sigma of the plan", **_OFF, **_STOP, **_EMERGENCY},
    ),
    State.IDLE: (
        "hold, tension loop on",
        {
            State.MOVING: "a plan that is feasible and starts here, or resume",
            State.JOGGING: "the operator",
            **_OFF,
            **_FAULT,
            **_EMERGENCY,
        },
    ),
    State.MOVING: (
        "set points, tension loop on",
        {State.IDLE: "the end of the plan", State.PAUSING: "pause", **_STOP, **_EMERGENCY},
    ),
    State.JOGGING: ("set points of the jog", {State.IDLE: "the end of the jog", **_STOP, **_EMERGENCY}),
    State.PAUSING: (
        "ramp on the path's clock, tension loop on",
        {State.IDLE: "the platform is at rest", **_STOP, **_EMERGENCY},
    ),
    State.STOPPING: (
        "coordinated ramp",
        {
            State.IDLE: "at rest, after a stop by the operator",
            State.READY: "at rest, after a stop of homing by the operator",
            State.FAULT: "at rest, after a stop by a fault",
            **_EMERGENCY,
        },
    ),
    State.FAULT: ("hold", {State.READY: "the operator acknowledges", **_OFF, **_EMERGENCY}),
    State.EMERGENCY: ("drums locked", _OFF),
}
MOTION: Final = frozenset({State.HOMING, State.MOVING, State.JOGGING, State.PAUSING, State.STOPPING})
OWNING: Final = frozenset(State) - {State.OFF, State.CONNECTING}


class RefusedError(ThreePartError):
    """Error: a request was rejected, and no command was sent.

    Attributes:
        what: Rejected request.
        reason: Reason of the rejection.
        next_step: Next step for the reader.
        item: Same text as `what`, because all errors have this attribute.
    """

    _between = " is refused: "

    def __init__(self, what: str, reason: str, next_step: str) -> None:
        """Compose the message from its three parts."""
        super().__init__(what, reason, next_step)
        self.what = what


def check_transition(state: State, to: State, what: str) -> None:
    """Reject the transition from `state` to `to` if it is not in the table."""
    _, exits = TABLE[state]
    if to in exits:
        return
    ways = ", ".join(f"{after.name} ({condition})" for after, condition in exits.items())
    raise RefusedError(what, f"{state.name} does not lead to {to.name}", f"Next states: {ways}.")
