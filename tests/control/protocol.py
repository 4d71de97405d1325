"""Constants and codes of the protocol between controller and PLCs; `sagline.control` itself does not offer them."""

from sagline.control.link import (
    COUNTERS,
    HEARTBEAT,
    OWNER_TIMEOUT,
    PERIOD,
    RAMP,
    GroupFault,
    GroupStatus,
    Refusal,
    WinchState,
)

__all__ = [
    "COUNTERS",
    "HEARTBEAT",
    "OWNER_TIMEOUT",
    "PERIOD",
    "RAMP",
    "GroupFault",
    "GroupStatus",
    "Refusal",
    "WinchState",
]
