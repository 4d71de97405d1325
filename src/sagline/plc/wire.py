"""Addresses of PLCs, connections to PLCs, and errors of addresses and connections."""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from ipaddress import IPv6Address
from typing import Any, Final, NamedTuple, Protocol

from sagline.control.link import Refusal, groups_of
from sagline.core.arguments import brief, whole_number
from sagline.core.errors import InvalidValueError, ThreePartError
from sagline.plc.blocks import Block
from sagline.robot.robot import Robot

LAST_PORT: Final = 65535
MOST_ADDRESSES: Final = 10_000  # largest number of addresses, and largest number of characters of all addresses


class Address(NamedTuple):
    """Address of a PLC."""

    host: str  # name, IPv4 address, or IPv6 address without brackets
    port: int  # TCP port

    def __str__(self) -> str:
        """The address as text: host:port, or [host]:port for IPv6."""
        return f"[{self.host}]:{self.port}" if ":" in self.host else f"{self.host}:{self.port}"


def addresses_of(given: str | Sequence[str], port: int) -> tuple[Address, ...]:
    """Read the addresses of the groups, in their order."""
    items: Any = given
    if not isinstance(items, Sequence) or isinstance(items, bytes) or not 0 < len(items) <= MOST_ADDRESSES:
        step = "Give a list of addresses, or one text with commas between them."
        raise InvalidValueError("addresses", brief(items), f"a text, or 1 to {MOST_ADDRESSES} of them", step)
    texts = items.split(",") if isinstance(items, str) else list(items)
    addresses: list[Address] = []
    for i, text in enumerate(texts):
        address = _address(i, text, port)
        if address in addresses:
            given, step = f"{address}, as that of group {addresses.index(address)}", "Give each group its own address."
            raise InvalidValueError(f"address of group {i}", given, "one PLC per group", step)
        addresses.append(address)
    return tuple(addresses)


def groups_at(addresses: Sequence[Address], robot: Robot | int) -> tuple[tuple[int, ...], ...]:
    """Winches of each group. Raise an error if the number of addresses is not the number of groups."""
    known: Any = robot
    winches = known.cable_count if isinstance(known, Robot) else whole_number(known, "robot", 1, MOST_ADDRESSES)
    groups = groups_of(winches)
    if len(addresses) != len(groups):
        allowed = f"{len(groups)}: two winches per group, {winches} winches"
        step = "Give one address per group, in the groups' order, with commas between them."
        raise InvalidValueError("number of PLC addresses", len(addresses), allowed, step)
    return groups


def _address(index: int, text: object, port: int) -> Address:
    given = text.strip() if isinstance(text, str) else ""
    if given.startswith("["):
        host, bracket, rest = given[1:].partition("]")
        between, colon, number = rest.partition(":")
        known = bool(bracket) and not between and _is_ipv6(host)
    elif given.count(":") > 1:
        host, colon, number = given, "", ""
        known = _is_ipv6(host)
    else:
        host, colon, number = given.partition(":")
        known = bool(host) and not any(c.isspace() or not c.isprintable() or c in "/@,;[]" for c in host)
    if colon:
        known = known and number.isascii() and number.isdecimal() and 0 < int(number[:6]) <= LAST_PORT
    if not known:
        allowed = f"host, host:port or [IPv6]:port, port 1 to {LAST_PORT}"
        step = "The twin prints its addresses; TIA Portal shows the address of a PLC."
        raise InvalidValueError(f"address of group {index}", brief(text), allowed, step)
    return Address(host, int(number) if colon else port)


def _is_ipv6(host: str) -> bool:
    """True for an IPv6 address, with or without a zone."""
    try:
        IPv6Address(host)
    except ValueError:
        return False
    return True


ANSWER: Final = 0.5  # longest wait for an answer [s]; then the connection is opened again


class LinkError(ThreePartError):
    """Error of a PLC that cannot be used.

    Attributes:
        item: Group and address ("group 2 at 192.168.0.12:102").
        reason: Reason as text.
        next_step: Next step for the reader.
    """


class WireError(Exception):
    """Error of a failed connection."""

    def __init__(self, refusal: Refusal) -> None:
        """Store the refusal."""
        super().__init__(refusal)
        self.refusal = refusal  # reason and next step


@contextmanager
def wire_errors(refusal: Callable[[Exception], Refusal]) -> Iterator[None]:
    """Convert all errors of a library, which may raise any exception for an unknown answer, to `WireError`."""
    try:
        yield
    except WireError:
        raise
    except Exception as error:
        raise WireError(refusal(error)) from error


class Wire(Protocol):
    """Connection to one PLC. Its methods raise `WireError`. Other threads may call only `abort` and `reached`."""

    def open(self) -> None:
        """Connect. The longest wait depends on the protocol."""

    def read(self, block: Block) -> bytes:
        """Read the bytes of a block."""

    def write(self, block: Block, data: bytes) -> None:
        """Write the bytes of a block."""

    def close(self) -> None:
        """Disconnect without raising an error."""

    def abort(self) -> None:
        """End all waits of the connection. Another thread calls this method."""

    def reached(self) -> bool:
        """True if the connection is open."""


def refusal_of(error: BaseException, protocol: str) -> Refusal:
    """Reason why a connection failed."""
    text = " ".join(str(error).split()) or type(error).__name__
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, OSError):
        cause = cause.__cause__ or cause.__context__
    if isinstance(cause, ConnectionRefusedError):
        return Refusal("nothing listens there", "Check address and port, and that the PLC or the twin runs")
    if isinstance(cause, socket.gaierror):
        return Refusal("the host is not known", "Check the address")
    if isinstance(cause, ConnectionResetError | BrokenPipeError) or "closed" in text:
        return Refusal("the PLC closes the connection at once", "Check the port, and the number of its other clients")
    if isinstance(cause, TimeoutError) or "timeout" in text.lower() or "No response" in text:
        return Refusal("it does not answer", "Check address and port, and that the PLC or the twin runs")
    if isinstance(cause, OSError):
        return Refusal(f"no connection ({cause.strerror or cause})", "Check the address and the network")
    return Refusal(f"the answer is not {protocol} ({text})", "Check the port")
