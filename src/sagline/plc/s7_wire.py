"""A connection to one Siemens PLC; the only file of the links that knows python-snap7."""

from __future__ import annotations

import logging
import socket
from contextlib import suppress
from typing import Final

from snap7 import Client
from snap7.type import Parameter

from sagline.plc.blocks import LOAD, Block, Refusal
from sagline.plc.wire import ANSWER, WireError, refused

PDU: Final = 240  # bytes, what an S7-1200 has: the blocks fit, one request each
RACK: Final = 0
FORBIDDEN: Final = 0x8104  # what a CPU says to PUT or GET that its settings do not permit
_CLOSED: Final = Refusal("the connection was closed", "Connect again")
SLOT: Final = 1  # of every S7-1200 and S7-1500

logging.getLogger("snap7").addHandler(logging.NullHandler())  # what goes wrong is told by the link


class S7Wire:
    """A connection to one PLC over S7."""

    def __init__(self, host: str, port: int) -> None:
        """Know where to connect.

        Args:
            host: Name or IPv4 address.
            port: TCP port.
        """
        self._host = host
        self._port = port
        self._client: Client | None = None

    def open(self) -> None:
        """Connect; the library waits up to 5 s."""
        try:
            self._client = client = Client()
            client.set_param(Parameter.PDURequest, PDU)
            client.connect(self._host, RACK, SLOT, tcp_port=self._port)
            _socket(client).settimeout(ANSWER)
        except Exception as error:  # of a stranger's answer the library may make anything
            raise WireError(refused(error, "S7")) from error

    def read(self, block: Block) -> bytes:
        """The bytes of a block.

        Args:
            block: Which.
        """
        try:
            return bytes(self._open.db_read(block.number, 0, block.size))
        except Exception as error:
            raise WireError(_no_access(error, block)) from error

    def write(self, block: Block, data: bytes) -> None:
        """Replace the bytes of a block.

        Args:
            block: Which.
            data: All of them.
        """
        try:
            self._open.db_write(block.number, 0, bytearray(data))
        except Exception as error:
            raise WireError(_no_access(error, block)) from error

    def close(self) -> None:
        """Disconnect."""
        client, self._client = self._client, None
        with suppress(Exception):  # of a connection that is given up nothing matters
            if client is not None:
                client.disconnect()

    @property
    def _open(self) -> Client:
        if self._client is None:
            raise WireError(_CLOSED)
        return self._client

    def abort(self) -> None:
        """From another thread: end whatever waits."""
        client = self._client
        with suppress(OSError, WireError):
            if client is not None:
                _socket(client).shutdown(socket.SHUT_RDWR)

    def reached(self) -> bool:
        """Whether somebody is at the other end."""
        client = self._client
        with suppress(OSError, WireError):
            if client is not None:
                _socket(client).getpeername()
                return True
        return False


def _socket(client: Client) -> socket.socket:
    """What the library speaks through; it has no setting for how long to wait."""
    connection = client.connection
    if connection is None or connection.socket is None:
        raise WireError(_CLOSED)
    return connection.socket


def _no_access(error: Exception, block: Block) -> Refusal:
    """Why a block was not read or written."""
    if isinstance(error, WireError):
        return error.refusal
    text = str(error)
    if "(0x0a)" in text or "(0x05)" in text:
        return Refusal(f"it has no DB{block.number} of {block.size} bytes", f"{LOAD}, without optimized access")
    if "(0x03)" in text or "(0x01)" in text or getattr(error, "error_code", None) == FORBIDDEN:
        return Refusal(f"it lets nobody at DB{block.number}", "Permit PUT/GET in its protection settings")
    return refused(error, "S7")
