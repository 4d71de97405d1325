"""Servers of the data blocks of a twin, one server per group: the base class for all protocols."""

from __future__ import annotations

import socket
from abc import ABC, abstractmethod
from collections.abc import Sequence
from contextlib import AbstractContextManager
from typing import Final

from sagline.core.errors import InvalidValueError
from sagline.plc.blocks import BLOCKS, CLAIM, FROM_PLC, TO_PLC, Block
from sagline.plc.wire import Address

LOOPBACK: Final = "127.0.0.1"


class BlockServers(ABC):
    """Servers of the data blocks of all PLCs. Any client may read and write the blocks."""

    def __init__(self, blocks: Sequence[bytes], host: str = LOOPBACK, port: int = 0) -> None:
        """Start one server for each group."""
        self._memory = [{kind: bytearray(kind.size) for kind in BLOCKS} for _ in blocks]
        # addresses: "host:port" of each group
        self.addresses: tuple[str, ...] = ()
        try:
            for i, block in enumerate(blocks):
                self._memory[i][FROM_PLC][:] = block
                number = _check_free(host, port + i if port else 0)
                self.addresses += (str(Address(number, self._listen(i, number, port + i if port else 0))),)
        except BaseException:
            self.close()
            raise

    def publish(self, blocks: Sequence[bytes | None]) -> None:
        """Replace DB101 of each group in one step. The block of a group with None does not change."""
        for group, block in enumerate(blocks):
            if block is not None:
                with self._locked(group, FROM_PLC):
                    self._memory[group][FROM_PLC][:] = block

    def written(self) -> list[tuple[bytes, bytes]]:
        """Read DB102 and DB103 of each group. As in a PLC, reading erases the claims."""
        found = []
        for group, memory in enumerate(self._memory):
            with self._locked(group, TO_PLC):
                command = bytes(memory[TO_PLC])
            with self._locked(group, CLAIM):
                claim = bytes(memory[CLAIM])
                memory[CLAIM][:] = bytes(CLAIM.size)
            found.append((command, claim))
        return found

    @abstractmethod
    def close(self) -> None:
        """Stop the servers and close all connections."""

    @abstractmethod
    def _listen(self, group: int, host: str, port: int) -> int:
        """Start the server of a group. Returns the port of the server."""

    @abstractmethod
    def _locked(self, group: int, block: Block) -> AbstractContextManager[object]:
        """Context manager for exclusive access to a block."""


def _check_free(host: str, port: int) -> str:
    """Address whose port is free. This check is needed, because python-snap7 lets two twins use the same port."""
    try:
        number = host.strip("[]") if ":" in host else socket.gethostbyname(host)
        with socket.create_server((number, port), family=socket.AF_INET6 if ":" in number else socket.AF_INET):
            return number
    except (OSError, OverflowError, ValueError, TypeError) as error:  # an invalid name causes the last two exceptions
        reason = getattr(error, "strerror", None) or str(error)
        found, allowed = f"{host!r}, port {port} ({reason})", "a free port at an address of this machine"
        step = "Choose another port with --port, or stop the program that uses the port."
        raise InvalidValueError("address of the twin", found, allowed, step) from None
