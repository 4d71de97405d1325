"""Messages between controller and machine, for any kind of connection: one command and one sample per cycle."""

from __future__ import annotations

from enum import Enum, IntEnum, IntFlag
from typing import Final, NamedTuple, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, Flags
from sagline.core.results import Status

Whole: TypeAlias = NDArray[np.int64]
Groups: TypeAlias = tuple[tuple[int, ...], ...]  # winches of each group, from 0

PERIOD: Final = 0.01  # period of the controller's cycle [s]; the article uses 100 samples per second
GROUP_SIZE: Final = 2  # number of winches per PLC
COUNTERS: Final = 2**31 - 1  # largest counter of commands and blocks; counters start at 1 again after this value
HEARTBEAT: Final = 0.1  # [s], if the command counter does not change for this time, a PLC stops its winches with a ramp
OWNER_TIMEOUT: Final = 0.5  # [s], if the counter does not change for this time, another controller may become the owner
CHECK: Final = "Check that its PLC or the twin runs and is connected"  # next step after silence of a group
RAMP: Final = 0.2  # duration of the ramp that reduces all rates to zero, in the controller and in a PLC [s]


class Mode(IntEnum):
    """Mode of a command: the task of the drives."""

    LEAVE = 0  # engage the brakes; the controller gives up the ownership
    HOLD = 1  # hold the present position
    FOLLOW = 2  # follow the set points
    LOCK = 3  # stop the drums immediately; they stay locked until the operator of the machine releases them


class GroupStatus(IntFlag):
    """Status bits of a group."""

    READY = 1  # drives have power and no fault
    BRAKED = 2
    FOLLOWING = 4  # the drives follow set points
    RAMPING = 8  # the group slows down without a command
    HOLDING = 16  # the group holds without a command, after a ramp or at a limit
    LOCKED = 32  # drums are locked
    EMERGENCY = 64  # emergency stop of the hardware


class GroupFault(Status):
    """Reason why a PLC has stopped its winches; `text` describes it."""

    NONE = 0, "no fault"
    HEARTBEAT = 1, "no command came for 100 ms"  # the command counter did not change, or the last command expired
    OVER_TENSION = (
        2,
        "a tension was too large, or a load cell had no finite reading, while the cable was wound in",
    )  # after this fault, the winch can only pay out cable
    FOLLOWING_ERROR = 3, "a drive was too far from its set points"
    SET_POINT = 4, "a set point or a tension of a command was out of range"
    EMERGENCY_STOP = 5, "the emergency stop is pressed"
    DRIVE = 6, "a drive tripped"


def fault_text(code: int) -> str:
    """Meaning of a fault code of a PLC. An unknown code also gets a text."""
    return GroupFault(code).text if code in set(GroupFault) else f"unknown code {code}"


class WinchState(IntEnum):
    """State of one winch."""

    BRAKED = 0
    ENABLED = 1
    SATURATED = 2  # its drive is at its force limit
    LOCKED = 3
    FAULT = 4


class Command(NamedTuple):
    """Command of a controller in one cycle.

    Attributes:
        counter: Counter of commands, incremented each cycle; wraps to 1 after 2^31 - 1.
        owner: The controller's random id, 1 to 2^31 - 1.
        mode: Task of the drives.
        valid_for: Time for which a PLC may use the command [s].
        length: Set points of the unstrained lengths off the drums at the end of the cycle [m], shape (m,).
        rate: Rates of these lengths [m/s], shape (m,).
        tension: Expected tensions at the drums, for the feedforward of the motors [N], shape (m,).
        enable: Drives that may move, shape (m,).
        claims: True if the command claims groups of other owners. A command to leave claims no group.
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


class Refusal(NamedTuple):
    """Reason why a block or a PLC cannot be used."""

    reason: str
    next_step: str


class Sample(NamedTuple):
    """Newest data of a machine with G groups and m winches. The caller may change the arrays.

    Attributes:
        time: Time of the request, on the link's clock [s].
        age: Time since the arrival of the newest valid block of each group [s], shape (G,).
        counter: Counter of each group's blocks, shape (G,).
        plc_time: Time at which the block was written, on the clock of each PLC [s], shape (G,).
        owner: Id of the controller that owns each group, 0 for none, shape (G,).
        echo: Counter of the last command accepted by each PLC, shape (G,).
        status: Bits of `GroupStatus`, shape (G,).
        fault: Codes of `GroupFault`, shape (G,).
        length: Unstrained lengths off the drums, from the encoders [m], shape (m,).
        rate: Their rates [m/s], shape (m,).
        torque: Torque of the motors at their shafts [N m], shape (m,); positive torque pays out cable.
        tension: T_A, tension at the frame ends measured by the load cells [N], shape (m,).
        filtered: T_A after the PLC's filter [N], shape (m,).
        counts: Encoder counts, shape (m,).
        state: Codes of `WinchState`, shape (m,).
        winch_fault: Fault codes of the drives, 0 for none, shape (m,).
        discarded: Number of invalid blocks of each group so far, shape (G,).
        reasons: Reason of the last invalid block of each group; None for a group without an invalid block. Empty if the
            link gives no reasons.
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
    reasons: tuple[Refusal | None, ...] = ()


# fields of a sample with one value per winch (all others have one per group), and fields with real numbers
OF_WINCHES: Final = ("length", "rate", "torque", "tension", "filtered", "counts", "state", "winch_fault")
REALS: Final = ("age", "plc_time", "length", "rate", "torque", "tension", "filtered")


class Missing(NamedTuple):
    """Answer of a link that has no sample, because some groups have never answered.

    Attributes:
        time: Time of the request, on the link's clock [s].
        groups: Indices of the silent groups, from 0.
        reasons: One reason per silent group.
    """

    time: float
    groups: tuple[int, ...]
    reasons: tuple[str, ...]


class Link(Protocol):
    """Connection to a machine.

    A sample is never older than the previous sample. Incomplete, foreign, repeated and out-of-order blocks are
    discarded. The age of the group's data then increases.
    """

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Winches of each group, from 0."""

    @property
    def period(self) -> float:
        """Time between two commands [s]. A set point is reached after this time."""

    def exchange(self, command: Command | None) -> Sample | Missing:
        """Send a command and return the newest sample, without waiting for an answer.

        `sent_to` returns the message for each group. A group receives the command only if the command's sender owns the
        group.

        Args:
            command: Command to send; None to read only.
        """

    def close(self) -> None:
        """Close the connection."""


class Sent(Enum):
    """Kind of message to one group in a cycle."""

    COMMAND = "the command"
    CLAIM = "the claim of its owner"
    NOTHING = "nothing"


def sent_to(owner: int, command: Command) -> Sent:
    """Message to a group whose owner is `owner` (0: no owner); `Sent.NOTHING` if nothing is sent to the group."""
    if owner == command.owner:
        return Sent.COMMAND
    return Sent.CLAIM if command.claims and command.mode != Mode.LEAVE else Sent.NOTHING


def newer(counter: int, known: int) -> bool:
    """True if `counter` is ahead of `known` by less than half of the range of counters."""
    return 0 < (counter - known) % COUNTERS < COUNTERS // 2


def no_news(counter: int, known: int) -> Refusal:
    """Reason to discard a block whose `counter` is not ahead of `known`, the newest counter so far."""
    if counter == known:
        step = "Check that its PLC runs, and that a scan takes less than a cycle"
        return Refusal(f"its counter {counter} is repeated", step)
    step = "Check that only one PLC has this address, and that it does not restart"
    return Refusal(f"it is older than the previous block: its counter is {counter} after {known}", step)


def groups_of(cable_count: int) -> Groups:
    """Winches of each group: two neighboring winches have one PLC, and the last winch may be alone."""
    winches = range(cable_count)
    return tuple(tuple(winches[i : i + GROUP_SIZE]) for i in range(0, cable_count, GROUP_SIZE))
