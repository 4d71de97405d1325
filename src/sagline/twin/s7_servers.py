"""S7 servers of a twin in one process, with the data blocks of its PLCs."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from threading import Thread
from typing import Any

from snap7.server import CPUState, Server, ServerState
from snap7.type import SrvArea

from sagline.plc.blocks import Block
from sagline.plc.s7_link import PDU
from sagline.twin.block_servers import LOOPBACK, BlockServers


class _S71200(Server):
    """S7 server that has the PDU size of an S7-1200 and can close its connections."""

    def __init__(self) -> None:
        super().__init__(log=False)
        self._sockets: set[socket.socket] = set()

    def start(self, tcp_port: int = 102) -> int:
        """Listen for connections, in place of the library's method, which supports only IPv4."""
        if ":" not in self.host:
            return super().start(tcp_port)
        self.server_socket = socket.create_server((self.host, tcp_port), family=socket.AF_INET6)
        self.running, self.state, self.cpu_state = True, ServerState.RUNNING, CPUState.RUN
        self.server_thread = Thread(target=self._server_loop, daemon=True)
        self.server_thread.start()
        return 0

    @staticmethod
    def _event_sender(address: Any) -> int:
        """Name of an event's sender (unused), in place of the library's method, which supports only IPv4."""
        return 0

    def disconnect_all(self) -> None:
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


class S7Servers(BlockServers):
    """Servers of the data blocks of all PLCs for PUT and GET."""

    def __init__(self, blocks: Sequence[bytes], host: str = LOOPBACK, port: int = 0) -> None:
        """Start the servers. The arguments are the same as in `BlockServers`."""
        self._servers: list[_S71200] = []
        super().__init__(blocks, host, port)

    def close(self) -> None:
        """Stop the servers and close all connections."""
        for server in self._servers:
            server.disconnect_all()
        for server in self._servers:
            server.stop()

    @contextmanager
    def _locked(self, group: int, block: Block) -> Iterator[None]:
        server = self._servers[group]
        server.lock_area(SrvArea.DB, block.number)
        yield
        server.unlock_area(SrvArea.DB, block.number)

    def _listen(self, group: int, host: str, port: int) -> int:
        server = _S71200()
        for kind, content in self._memory[group].items():
            server.register_area(SrvArea.DB, kind.number, content)
        server.host = host
        server.start(port)
        self._servers.append(server)
        assert server.server_socket is not None
        return int(server.server_socket.getsockname()[1])
