"""Addresses of PLCs, as a person writes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from sagline.control.link import groups_of
from sagline.core.arguments import brief, whole_number
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot

LAST_PORT: Final = 65535
MOST: Final = 10_000  # addresses, or characters of all of them


class Address(NamedTuple):
    """Where a PLC is.

    Attributes:
        host: Name or IPv4 address.
        port: TCP port.
    """

    host: str
    port: int

    def __str__(self) -> str:
        """As it is written: host:port."""
        return f"{self.host}:{self.port}"


def addresses_of(given: str | Sequence[str], port: int) -> tuple[Address, ...]:
    """Addresses of the groups, in their order.

    Args:
        given: "host" or "host:port" of each; or all of them in one text, with commas between.
        port: Where none is given.

    Raises:
        InvalidValueError: If one is no address, or two are the same.
    """
    items: Any = given
    if not isinstance(items, Sequence) or isinstance(items, bytes) or not 0 < len(items) <= MOST:
        step = "Give a list of them, or one text with commas between."
        raise InvalidValueError("addresses", brief(items), f"a text, or 1 to {MOST} of them", step)
    texts = items.split(",") if isinstance(items, str) else list(items)
    addresses: list[Address] = []
    for i, text in enumerate(texts):
        address = _address(i, text, port)
        if address in addresses:
            raise InvalidValueError(
                f"address of group {i}",
                f"{address}, as that of group {addresses.index(address)}",
                "one PLC a group",
                "Give each group its own address.",
            )
        addresses.append(address)
    return tuple(addresses)


def groups_at(addresses: Sequence[Address], robot: Robot | int) -> tuple[tuple[int, ...], ...]:
    """The winches of each group, where there are as many addresses as groups.

    Args:
        addresses: Of the PLCs.
        robot: Whose winches they drive; or how many there are.

    Raises:
        InvalidValueError: If there are more or fewer addresses than groups.
    """
    known: Any = robot
    winches = known.cable_count if isinstance(known, Robot) else whole_number(known, "robot", 1, MOST)
    groups = groups_of(winches)
    if len(addresses) != len(groups):
        raise InvalidValueError(
            "number of PLC addresses",
            len(addresses),
            f"{len(groups)}: two winches a group, {winches} winches",
            "Give one address a group, in the groups' order, with commas between.",
        )
    return groups


def _address(index: int, text: object, port: int) -> Address:
    host, colon, number = (text.strip() if isinstance(text, str) else "").partition(":")
    known = number.isascii() and number.isdecimal() and 0 < int(number[:6]) <= LAST_PORT if colon else True
    if not host or not known or any(c.isspace() or not c.isprintable() or c in "/@,;" for c in host):
        raise InvalidValueError(
            f"address of group {index}",
            brief(text),
            f"host or host:port, port 1 to {LAST_PORT}",
            "The twin prints its addresses; a PLC has its own in TIA Portal.",
        )
    return Address(host, int(number) if colon else port)
