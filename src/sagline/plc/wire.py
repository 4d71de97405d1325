"""A connection to one PLC, whatever it speaks, and what can be wrong with it."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, Protocol

from sagline.core.errors import MOST, FileError, SaglineError, shortened
from sagline.plc.blocks import Block, Refusal

ANSWER: Final = 0.5  # s: a PLC that has not answered for so long is connected anew


class LinkError(SaglineError):
    """A PLC that cannot be worked with.

    Attributes:
        item: Which, in the reader's words ("group 2 at 192.168.0.12:102").
        reason: What is wrong with it.
        next_step: What to do about it.
    """

    def __init__(self, item: str, reason: str, next_step: str) -> None:
        """Compose the message from its three parts."""
        super().__init__(item, reason, next_step)
        self.item = item
        self.reason = reason
        self.next_step = next_step

    def __str__(self) -> str:
        """One line: which PLC, reason, next step."""
        item, reason, next_step = shortened((self.item, self.reason, self.next_step), room=MOST - len(": . "))
        return f"{item}: {reason}. {next_step}"


class WireError(Exception):
    """A connection that failed.

    Attributes:
        refusal: Why, and what to do.
    """

    def __init__(self, refusal: Refusal) -> None:
        """Keep the refusal."""
        super().__init__(refusal)
        self.refusal = refusal


class Wire(Protocol):
    """A connection to one PLC; all but `abort` and `reached` belong to one thread, and raise `WireError`."""

    def open(self) -> None:
        """Connect; waits as long as the protocol does."""

    def read(self, block: Block) -> bytes:
        """The bytes of a block.

        Args:
            block: Which.
        """

    def write(self, block: Block, data: bytes) -> None:
        """Replace the bytes of a block.

        Args:
            block: Which.
            data: All of them.
        """

    def close(self) -> None:
        """Disconnect; raises nothing."""

    def abort(self) -> None:
        """From another thread: end whatever waits."""

    def reached(self) -> bool:
        """Whether somebody is at the other end."""


@contextmanager
def needed() -> Iterator[None]:
    """Imports of the packages PLCs need.

    Raises:
        FileError: If one is not installed.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        raise FileError.not_installed(str(error.name).partition(".")[0], "PLCs need it", "plc") from None


def refused(error: BaseException | None, speaks: str) -> Refusal:
    """Why a connection failed, in the reader's words.

    Args:
        error: What the system or a library said, perhaps while it handled another.
        speaks: The protocol.
    """
    text = " ".join(str(error).split()) or type(error).__name__
    cause = error
    while cause is not None and not isinstance(cause, OSError):
        cause = cause.__cause__ or cause.__context__
    if isinstance(cause, ConnectionRefusedError):
        return Refusal("nothing listens there", "Check address and port, and that the PLC or the twin runs")
    if isinstance(cause, socket.gaierror):
        return Refusal("there is no such host", "Check the address")
    if isinstance(cause, ConnectionResetError | BrokenPipeError) or "closed" in text:
        return Refusal("whoever is there hangs up", "Check the port, and that not too many others are connected to it")
    if isinstance(cause, TimeoutError) or "timeout" in text.lower() or "No response" in text:
        return Refusal("it does not answer", "Check address and port, and that the PLC is on and in this network")
    if isinstance(cause, OSError):
        return Refusal(f"no connection ({cause.strerror or cause})", "Check the network")
    return Refusal(f"whoever is there speaks no {speaks} ({text})", "Check the port")
