"""Link to Siemens PLCs: data blocks by PUT and GET of the S7 protocol. Only this file uses snap7."""

from __future__ import annotations

import logging
import socket
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from sagline.control.link import Refusal
from sagline.core.errors import needed_packages
from sagline.plc.block_link import BlockLink
from sagline.plc.blocks import LOAD, Block
from sagline.plc.wire import ANSWER, WireError, addresses_of, refusal_of, wire_errors
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from snap7 import Client

PORT: Final = 102
PDU: Final = 240  # [bytes], PDU size of an S7-1200; each block fits in one request
RACK: Final = 0
FORBIDDEN: Final = 0x8104  # error code of a CPU whose settings do not permit PUT or GET
_NAME: Final = "Connection"  # names of the connection class with IPv6
_CLOSED: Final = Refusal("the connection was closed", "Connect again")
SLOT: Final = 1  # rack and slot of every S7-1200 and S7-1500

logging.getLogger("snap7").addHandler(logging.NullHandler())  # the link itself reports errors, so the library need not


class S7Link(BlockLink):
    """The link (`sagline.control.link.Link`) to S7-1200 PLCs, or to a twin.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> machine = sl.twin.Machine(robot, period=sl.twin.SCAN)
        >>> server = sl.twin.Server(machine)
        >>> link = sl.plc.S7Link(server.addresses, robot)
        >>> print(len(link.groups))
        4
        >>> link.close()
        >>> server.close()
    """

    def __init__(self, addresses: str | Sequence[str], robot: Robot | int, *, timeout: float = 2.0) -> None:
        """Connect to all groups at once.

        Args:
            addresses: "host", "host:port" or "[IPv6]:port" of each group's PLC, in the order of the groups,
                or one text with commas between them.
            robot: The robot, or its number of winches.
            timeout: Longest wait for the first answers [s].

        Raises:
            InvalidValueError: If the number of addresses is not the number of groups. If two addresses are equal.
            LinkError: If a PLC does not answer with sagline's blocks.
            FileError: If python-snap7 is not installed.
        """
        places = addresses_of(addresses, PORT)
        super().__init__(places, robot, [_S7Wire(*place) for place in places], timeout)


class _S7Wire:
    """Connection to one PLC over S7."""

    def __init__(self, host: str, port: int) -> None:
        with needed_packages("PLCs need it", "plc"):
            import snap7
            import snap7.client
        client: Any = snap7.client
        if ":" in host and client.ISOTCPConnection.__name__ != _NAME:
            client.ISOTCPConnection = _with_ipv6(client.ISOTCPConnection)  # the library itself supports only IPv4
        self._library = snap7
        self._host = host
        self._port = port
        self._client: Client | None = None

    def open(self) -> None:
        with wire_errors(lambda error: refusal_of(error, "S7")):
            self._client = client = self._library.Client()
            client.set_param(self._library.type.Parameter.PDURequest, PDU)
            client.connect(self._host, RACK, SLOT, tcp_port=self._port)  # waits up to 5 s
            _socket(client).settimeout(ANSWER)

    def read(self, block: Block) -> bytes:
        with wire_errors(lambda error: _no_access(error, block)):
            return bytes(self._open.db_read(block.number, 0, block.size))

    def write(self, block: Block, data: bytes) -> None:
        with wire_errors(lambda error: _no_access(error, block)):
            self._open.db_write(block.number, 0, bytearray(data))

    def close(self) -> None:
        client, self._client = self._client, None
        with suppress(Exception):  # errors have no effect any longer
            if client is not None:
                client.disconnect()

    @property
    def _open(self) -> Client:
        if self._client is None:
            raise WireError(_CLOSED)
        return self._client

    def abort(self) -> None:
        client = self._client
        with suppress(OSError, WireError):
            if client is not None:
                _socket(client).shutdown(socket.SHUT_RDWR)

    def reached(self) -> bool:
        client = self._client
        with suppress(OSError, WireError):
            if client is not None:
                _socket(client).getpeername()
                return True
        return False


def _with_ipv6(library: Any) -> Any:
    """The connection class of the library, extended to IPv6."""

    def connect(self: Any) -> None:
        self.socket = socket.create_connection((self.host, self.port), self.timeout)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    return type(_NAME, (library,), {"_tcp_connect": connect})


def _socket(client: Client) -> socket.socket:
    """The socket of the library, with a timeout. The library has no setting for a timeout."""
    connection = client.connection
    if connection is None or connection.socket is None:
        raise WireError(_CLOSED)
    return connection.socket


def _no_access(error: Exception, block: Block) -> Refusal:
    text = str(error)
    if "(0x0a)" in text or "(0x05)" in text:
        return Refusal(f"it has no DB{block.number} of {block.size} bytes", f"{LOAD}, without optimized access")
    if "(0x03)" in text or "(0x01)" in text or getattr(error, "error_code", None) == FORBIDDEN:
        return Refusal(f"access to DB{block.number} is not permitted", "Permit PUT/GET in its protection settings")
    return refusal_of(error, "S7")
