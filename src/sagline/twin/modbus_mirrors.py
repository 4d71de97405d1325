"""The Modbus servers of a twin: one a group, in one thread, with the same blocks as over S7."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Coroutine, Sequence
from threading import Lock, Thread
from typing import Any, TypeVar

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.simulator import DataType, SimData, SimDevice

from sagline.plc.blocks import BLOCKS, CLAIM, FROM_PLC, TO_PLC, Block
from sagline.twin.mirrors import LOOPBACK, free

T = TypeVar("T")


class Memory:
    """The blocks of one group, as registers that others read and write."""

    def __init__(self, block: bytes) -> None:
        """Begin with nothing written.

        Args:
            block: What DB101 holds.
        """
        self.blocks = {kind: bytearray(kind.size) for kind in BLOCKS}
        self.blocks[FROM_PLC][:] = block
        self._lock = Lock()

    def replace(self, block: Block, data: bytes) -> None:
        """Let a block hold other bytes, at once.

        Args:
            block: Which.
            data: All its bytes.
        """
        with self._lock:
            self.blocks[block][:] = data

    def copy(self, block: Block, *, empty: bool = False) -> bytes:
        """What a block holds.

        Args:
            block: Which.
            empty: Whether it holds nothing any more.
        """
        with self._lock:
            data = bytes(self.blocks[block])
            if empty:
                self.blocks[block][:] = bytes(block.size)
            return data

    async def serve(
        self,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[int] | list[bool] | None,
    ) -> ExcCodes | None:
        """Let a client read the blocks, or write in them; pymodbus calls it, and knows these arguments' names.

        Args:
            function: Its code.
            start: Address of the first register there is.
            address: Of the first that is asked for.
            count: How many are.
            registers: All there are; what is read is taken from here.
            values: What is to be written.
        """
        with self._lock:
            for block, data in self.blocks.items():
                first, end = block.register, block.register + block.size // 2
                low, high = max(first, address), min(end, address + count)
                if low >= high:
                    continue
                part = slice(2 * (low - first), 2 * (high - first))
                if values is not None:
                    data[part] = struct.pack(f">{high - low}H", *values[low - address : high - address])
                registers[low - start : high - start] = struct.unpack(f">{high - low}H", data[part])
        return None


class ModbusMirrors:
    """What PLCs show to a network that speaks Modbus.

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
        ports = [port + i if port else 0 for i in range(len(blocks))]
        numbers = [free(host, each) for each in ports]
        self._memory = [Memory(block) for block in blocks]
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever, name="sagline modbus", daemon=True)
        self._thread.start()
        self._servers: list[ModbusTcpServer] = []
        try:
            self._call(self._listen(numbers[0], ports))
            self.addresses = tuple(f"{numbers[0]}:{_port(server)}" for server in self._servers)
        except BaseException:
            self.close()
            raise

    def publish(self, blocks: Sequence[bytes | None]) -> None:
        """Replace each group's DB101, whole.

        Args:
            blocks: One a group; None leaves what is there.
        """
        for memory, block in zip(self._memory, blocks, strict=True):
            if block is not None:
                memory.replace(FROM_PLC, block)

    def written(self) -> list[tuple[bytes, bytes]]:
        """What each group's DB102 and DB103 hold; the claims are taken out, as a PLC does that has looked at them."""
        return [(memory.copy(TO_PLC), memory.copy(CLAIM, empty=True)) for memory in self._memory]

    def close(self) -> None:
        """Listen no more, and let go of who is connected."""
        for server in self._servers:
            self._call(server.shutdown())  # type: ignore[no-untyped-call]
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _call(self, work: Coroutine[Any, Any, T]) -> T:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result()

    async def _listen(self, host: str, ports: Sequence[int]) -> None:
        for memory, port in zip(self._memory, ports, strict=True):
            data = [SimData(b.register, count=b.size // 2, datatype=DataType.REGISTERS) for b in BLOCKS]
            server = ModbusTcpServer(SimDevice(0, data, action=memory.serve), address=(host, port))
            await server.serve_forever(background=True)
            self._servers.append(server)


def _port(server: ModbusTcpServer) -> int:
    listening: Any = server.transport
    return int(listening.sockets[0].getsockname()[1])
