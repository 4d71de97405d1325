"""What the servers of a twin have in common, whatever they speak."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from typing import Final, Protocol

from sagline.core.errors import InvalidValueError

LOOPBACK: Final = "127.0.0.1"


class Mirrors(Protocol):
    """What PLCs show to the network: their data blocks, to be read and written by whoever connects.

    Attributes:
        addresses: "host:port" of each group.
    """

    addresses: tuple[str, ...]

    def publish(self, blocks: Sequence[bytes | None]) -> None:
        """Replace each group's DB101, whole.

        Args:
            blocks: One a group; None leaves what is there.
        """

    def written(self) -> list[tuple[bytes, bytes]]:
        """What each group's DB102 and DB103 hold; the claims are taken out, as a PLC does that has looked at them."""

    def close(self) -> None:
        """Listen no more, and let go of who is connected."""


def free(host: str, port: int) -> str:
    """The number of a host, where it can be listened at.

    python-snap7 shares ports (SO_REUSEPORT): two twins at one would each have half of the connections.

    Args:
        host: Address of this machine, or its name.
        port: TCP port; 0: any.

    Returns:
        The IPv4 address.

    Raises:
        InvalidValueError: If the port is in use, or the address is none of this machine.
    """
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            number = socket.gethostbyname(host)
            probe.bind((number, port))
            probe.listen()
        except (OSError, OverflowError, ValueError, TypeError) as error:  # the last two of what is no name
            reason = getattr(error, "strerror", None) or str(error)
            raise InvalidValueError(
                "address of the twin",
                f"{host!r}, port {port} ({reason})",
                "a free port at an address of this machine",
                "Choose another with --port, or end what listens there.",
            ) from None
    return number
