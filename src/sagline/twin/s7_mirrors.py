"""The S7 servers of a twin: one a group, in one process, with the same data blocks as its PLC would have."""

from __future__ import annotations

import socket
import struct
from collections.abc import Sequence
from contextlib import suppress
from typing import Any

from snap7.server import Server
from snap7.type import SrvArea

from sagline.plc.blocks import BLOCKS, CLAIM, FROM_PLC, TO_PLC, Block
from sagline.plc.s7_wire import PDU
from sagline.twin.mirrors import LOOPBACK, free


class S71200(Server):
    """A server that grants no larger PDU than an S7-1200 does, and can hang up."""

    def __init__(self) -> None:
        """Nobody is connected."""
        super().__init__(log=False)
        self._sockets: set[socket.socket] = set()

    def hang_up(self) -> None:
        """Disconnect everybody."""
        for client in list(self._sockets):
            with suppress(OSError):
                client.shutdown(socket.SHUT_RDWR)

    def _handle_client(self, client_socket: socket.socket, address: tuple[str, int]) -> None:
        self._sockets.add(client_socket)
        try:
            super()._handle_client(client_socket, address)
        finally:
            self._sockets.discard(client_socket)

    def _handle_setup_communication(self, request: dict[str, Any]) -> bytes:
        answer = super()._handle_setup_communication(request)
        (granted,) = struct.unpack(">H", answer[-2:])
        return answer[:-2] + struct.pack(">H", min(granted, PDU))


class S7Mirrors:
    """What PLCs show to the network: their data blocks, to be read and written by whoever connects.

    Attributes:
        addresses: "host:port" of each group.
    """

    def __init__(self, blocks: Sequence[bytes], host: str = LOOPBACK, port: int = 0) -> None:
        """Listen.

        Args:
            blocks: What each group's DB101 holds at first.
            host: Address to listen at; this machine only unless told otherwise.
            port: Of the first group, the others follow; 0: any that are free.

        Raises:
            InvalidValueError: If a port is in use, or the address is none of this machine.
        """
        self._memory: list[dict[Block, bytearray]] = []
        self._servers: list[S71200] = []
        self.addresses: tuple[str, ...] = ()
        try:
            for i, block in enumerate(blocks):
                self._listen(block, host, port + i if port else 0)
        except BaseException:
            self.close()
            raise

    def publish(self, blocks: Sequence[bytes | None]) -> None:
        """Replace each group's DB101, whole.

        Args:
            blocks: One a group; None leaves what is there.
        """
        for server, memory, block in zip(self._servers, self._memory, blocks, strict=True):
            if block is not None:
                server.lock_area(SrvArea.DB, FROM_PLC.number)
                memory[FROM_PLC][:] = block
                server.unlock_area(SrvArea.DB, FROM_PLC.number)

    def written(self) -> list[tuple[bytes, bytes]]:
        """What each group's DB102 and DB103 hold; the claims are taken out, as a PLC does that has looked at them."""
        return [(self._copy(i, TO_PLC), self._copy(i, CLAIM, empty=True)) for i in range(len(self._servers))]

    def close(self) -> None:
        """Listen no more, and let go of who is connected."""
        for server in self._servers:
            server.hang_up()
        for server in self._servers:
            server.stop()

    def _listen(self, block: bytes, host: str, port: int) -> None:
        memory = {kind: bytearray(kind.size) for kind in BLOCKS}
        memory[FROM_PLC][:] = block
        server = S71200()
        for kind, content in memory.items():
            server.register_area(SrvArea.DB, kind.number, content)
        number = free(host, port)
        server.start_to(number, port)
        self._memory.append(memory)
        self._servers.append(server)
        assert server.server_socket is not None
        self.addresses += (f"{number}:{server.server_socket.getsockname()[1]}",)

    def _copy(self, index: int, block: Block, *, empty: bool = False) -> bytes:
        server, content = self._servers[index], self._memory[index][block]
        server.lock_area(SrvArea.DB, block.number)
        copy = bytes(content)
        if empty:
            content[:] = bytes(block.size)
        server.unlock_area(SrvArea.DB, block.number)
        return copy
