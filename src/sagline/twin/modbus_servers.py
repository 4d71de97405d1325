"""Modbus servers of a twin in one thread, with the same data blocks as the S7 servers."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Coroutine, Sequence
from contextlib import AbstractContextManager
from threading import Lock, Thread
from typing import Any, TypeVar

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from sagline.plc.blocks import BLOCKS, Block
from sagline.twin.block_servers import LOOPBACK, BlockServers

T = TypeVar("T")


class ModbusServers(BlockServers):
    """Data blocks of all PLCs in holding registers."""

    def __init__(self, blocks: Sequence[bytes], host: str = LOOPBACK, port: int = 0) -> None:
        """Start the thread and the servers. The arguments are the same as in `BlockServers`."""
        self._locks = [Lock() for _ in blocks]
        self._servers: list[ModbusTcpServer] = []
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever, name="sagline modbus", daemon=True)
        self._thread.start()
        super().__init__(blocks, host, port)

    def close(self) -> None:
        """Stop the servers and close all connections."""
        for server in self._servers:
            self._call(server.shutdown())  # type: ignore[no-untyped-call]
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _call(self, work: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    def _locked(self, group: int, block: Block) -> AbstractContextManager[object]:
        return self._locks[group]

    def _listen(self, group: int, host: str, port: int) -> int:
        async def serve(
            function: int,
            start: int,
            address: int,
            count: int,
            registers: list[int],
            values: list[int] | list[bool] | None,
        ) -> ExcCodes | None:  # pymodbus uses these argument names; values: data to write, None for reading
            with self._locks[group]:
                for block, data in self._memory[group].items():
                    first, end = block.register, block.register + block.size // 2
                    low, high = max(first, address), min(end, address + count)
                    if low >= high:
                        continue
                    part = slice(2 * (low - first), 2 * (high - first))
                    if values is not None:
                        data[part] = struct.pack(f">{high - low}H", *values[low - address : high - address])
                    registers[low - start : high - start] = struct.unpack(f">{high - low}H", data[part])
            return None

        async def begin() -> int:
            data = [SimData(b.register, count=b.size // 2, datatype=DataType.REGISTERS) for b in BLOCKS]
            server = ModbusTcpServer(SimDevice(0, data, action=serve), address=(host, port))
            await server.serve_forever(background=True)
            self._servers.append(server)
            listening: Any = server.transport
            return int(listening.sockets[0].getsockname()[1])

        return self._call(begin())
