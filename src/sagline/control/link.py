"""Messages between controller and machine: one command and one sample in each cycle, over any connection."""

from __future__ import annotations

from enum import Enum, IntEnum, IntFlag
from typing import Final, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, Flags
from sagline.core.status import Status

Whole: TypeAlias = NDArray[np.int64]

PERIOD: Final = 0.01  # s, of the controller's cycle: the article's 100 samples a second
GROUP_SIZE: Final = 2  # winches behind one PLC
COUNTERS: Final = 2**31 - 1  # of commands and blocks go from 1 to here, and begin again
HEARTBEAT: Final = 0.1  # s without a change of the command counter, after which a PLC ramps its winches down and holds
OWNER_TIMEOUT: Final = 0.5  # s without a change of it, after which another controller may have the grant
RAMP: Final = 0.2  # s, in which rates go to zero, here and in a PLC


class Mode(IntEnum):
    """Task of the drives in a command."""

    LEAVE = 0  # brakes on; the grant is given back
    HOLD = 1  # stay where you are
    FOLLOW = 2  # go to the set points
    LOCK = 3  # stop the drums at once, and stay so until the operator of the machine lets them go


class GroupStatus(IntFlag):
    """Status bits of a group."""

    READY = 1  # drives have no fault, and power
    BRAKED = 2
    FOLLOWING = 4  # set points
    RAMPING = 8  # slows down by itself
    HOLDING = 16  # by itself: after a ramp, or at a limit
    LOCKED = 32  # drums
    EMERGENCY = 64  # stop, of the hardware


class GroupFault(Status):
    """Reason why a PLC has stopped its winches, in words `text`."""

    NONE = 0, "no fault"
    HEARTBEAT = 1, "no command came for 100 ms"  # the counter stood, or a command was valid no longer
    OVER_TENSION = (
        2,
        "a tension was too large, or its cell had no finite reading, while a cable was wound in",
    )  # pays out only
    FOLLOWING_ERROR = 3, "a drive lagged too far behind its set points"
    SET_POINT = 4, "a set point or a tension of a command was out of its range"
    EMERGENCY_STOP = 5, "the emergency stop is pressed"
    DRIVE = 6, "a drive tripped"


def fault_text(code: int) -> str:
    """Meaning of a PLC's fault code; also of unknown codes."""
    return GroupFault(code).text if code in set(GroupFault) else f"unknown code {code}"


class WinchState(IntEnum):
    """State of one winch."""

    BRAKED = 0
    ENABLED = 1
    SATURATED = 2  # its drive gives all it can
    LOCKED = 3
    FAULT = 4


class Command(NamedTuple):
    """Command of a controller in one cycle.

    Attributes:
        counter: Of commands, one more each cycle; wraps to 1 after 2^31 - 1.
        owner: The controller's random id, 1 to 2^31 - 1.
        mode: Task of the drives.
        valid_for: Time for which a PLC may use it [s].
        length: Set points of the unstrained lengths off the drums at the end of the cycle [m], shape (m,).
        rate: Their rates [m/s], shape (m,).
        tension: Expected at the drums, feedforward of the motors [N], shape (m,).
        enable: Drives that may move, shape (m,).
        claims: Whether grants that are not ours are claimed; a command to leave never does so.
    """

    counter: int
    owner: int
    mode: Mode
    valid_for: float
    length: Array
    rate: Array
    tension: Array
    enable: Flags
    claims: bool = True


class Sample(NamedTuple):
    """Newest data of the machine, in arrays of the caller's own. G groups, m winches.

    Attributes:
        time: Of the request, on the link's clock [s].
        age: Time since the newest valid block of each group arrived [s], shape (G,).
        counter: Of each group's blocks, shape (G,).
        plc_time: Time of writing, on the clock of each PLC [s], shape (G,).
        owner: Owner of each grant, 0 for none, shape (G,).
        echo: Counter of the last command each PLC took, shape (G,).
        status: Bits of `GroupStatus`, shape (G,).
        fault: Codes of `GroupFault`, shape (G,).
        length: Unstrained lengths off the drums, from the encoders [m], shape (m,).
        rate: Their rates [m/s], shape (m,).
        torque: Of the motors at their shafts, positive where it lets cable out [N m], shape (m,).
        tension: T_A, at the frame ends, as the load cells read it [N], shape (m,).
        filtered: The same after the PLC's filter [N], shape (m,).
        counts: Of the encoders, shape (m,).
        state: Codes of `WinchState`, shape (m,).
        winch_fault: The drives' own codes, 0 for none, shape (m,).
        discarded: Number of invalid blocks of each group so far, shape (G,).
    """

    time: float
    age: Array
    counter: Whole
    plc_time: Array
    owner: Whole
    echo: Whole
    status: Whole
    fault: Whole
    length: Array
    rate: Array
    torque: Array
    tension: Array
    filtered: Array
    counts: Whole
    state: Whole
    winch_fault: Whole
    discarded: Whole


class Missing(NamedTuple):
    """No sample, because some groups have never answered.

    Attributes:
        time: Of the request, on the link's clock [s].
        groups: Numbers of the silent groups, from 0.
        reasons: One for each of them.
    """

    time: float
    groups: tuple[int, ...]
    reasons: tuple[str, ...]


class Link(Protocol):
    """Connection to a machine.

    What it hands over is never older than what it handed over before: a block that is torn, foreign, repeated or out of
    order is discarded, and the group's age increases.
    """

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The winches of each group, from 0."""

    @property
    def period(self) -> float:
        """Time between two commands, after which set points are reached [s]."""

    def exchange(self, command: Command | None) -> Sample | Missing:
        """Send a command and return the newest sample, without waiting for an answer.

        What each group is sent, `sent_to` says: the command only where its owner has the grant.

        Args:
            command: Command to send; None only reads.
        """

    def close(self) -> None:
        """Close the connection."""


class Sent(Enum):
    """Message to a group in a cycle."""

    COMMAND = "the command"
    CLAIM = "the claim of its owner"
    NOTHING = "nothing"


def sent_to(owner: int, command: Command) -> Sent:
    """Message to a group, by the owner of its grant; 0 for none."""
    if owner == command.owner:
        return Sent.COMMAND
    return Sent.CLAIM if command.claims and command.mode != Mode.LEAVE else Sent.NOTHING


def newer(counter: int, known: int) -> bool:
    """True if a counter is ahead of another, by less than half of the range."""
    return 0 < (counter - known) % COUNTERS < COUNTERS // 2


def groups_of(cable_count: int) -> tuple[tuple[int, ...], ...]:
    """Winches of each group: two neighbors share a PLC, the last may be alone."""
    winches = range(cable_count)
    return tuple(tuple(winches[i : i + GROUP_SIZE]) for i in range(0, cable_count, GROUP_SIZE))
