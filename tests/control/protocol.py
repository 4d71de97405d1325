"""Constants and codes of the protocol between controller and PLCs, for tests of other folders."""

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
