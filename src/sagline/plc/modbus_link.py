"""Link to PLCs over Modbus; holding registers contain the data blocks. Only this file uses pymodbus."""

from __future__ import annotations

import logging
import socket
import struct
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from sagline.control.link import Refusal
from sagline.core.arguments import whole_number
from sagline.core.errors import needed_packages
from sagline.plc.block_link import BlockLink
from sagline.plc.blocks import LOAD, Block
from sagline.plc.wire import ANSWER, WireError, addresses_of, refusal_of, wire_errors
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from pymodbus.pdu import ModbusPDU

PORT: Final = 502
MOST_DEVICE: Final = 255

logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # the link itself reports errors


class ModbusLink(BlockLink):
    """The link (`sagline.control.link.Link`) to PLCs over Modbus TCP, or to a twin.

    The blocks have the same bytes as in `S7Link`: DB101 from holding register 0, DB102 from 100, DB103 from 200.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-prototype")
        >>> machine = sl.twin.Machine(robot, period=sl.twin.SCAN)
        >>> server = sl.twin.Server(machine, modbus=True)
        >>> link = sl.plc.ModbusLink(server.addresses, robot)
        >>> print(len(link.groups))
        4
        >>> link.close()
        >>> server.close()
    """

    def __init__(
        self, addresses: str | Sequence[str], robot: Robot | int, *, device: int = 1, timeout: float = 2.0
    ) -> None:
        """Connect to all groups at once.

        Args:
            addresses: "host", "host:port" or "[IPv6]:port" of each group's PLC, in the order of the groups,
                or one text with commas between them.
            robot: The robot, or its number of winches.
            device: Modbus device id, the same for each address.
            timeout: Longest wait for the first answers [s].

        Raises:
            InvalidValueError: If the number of addresses is not the number of groups. If two addresses are equal.
            LinkError: If a PLC does not answer with sagline's blocks.
            FileError: If pymodbus is not installed.
        """
        unit = whole_number(device, "device", 0, MOST_DEVICE)
        places = addresses_of(addresses, PORT)
        super().__init__(places, robot, [_ModbusWire(*place, unit) for place in places], timeout)


class _ModbusWire:
    """Connection to one PLC. Each holding register contains two bytes of a block, the same bytes as over S7."""

    def __init__(self, host: str, port: int, device: int) -> None:
        with needed_packages("PLCs need it", "plc"):
            from pymodbus.client import ModbusTcpClient
        self._client = ModbusTcpClient(host, port=port, timeout=ANSWER, retries=0)
        self._place = (host, port)
        self._device = device

    def open(self) -> None:
        with wire_errors(_refusal):
            if self._client.connect():  # type: ignore[no-untyped-call]
                return
            socket.create_connection(self._place, timeout=ANSWER).close()  # the library reports no reason of a failure
            raise WireError(Refusal("the connection was closed", "Check that no other client is connected to it"))

    def read(self, block: Block) -> bytes:
        count = block.size // 2
        with wire_errors(_refusal):
            answer = self._client.read_holding_registers(block.register, count=count, device_id=self._device)
            registers = _good(answer, block).registers
            return struct.pack(f">{len(registers)}H", *registers)

    def write(self, block: Block, data: bytes) -> None:
        registers = list(struct.unpack(f">{len(data) // 2}H", data))
        with wire_errors(_refusal):
            _good(self._client.write_registers(block.register, registers, device_id=self._device), block)

    def close(self) -> None:
        with suppress(Exception):  # errors have no effect any longer
            self._client.close()  # type: ignore[no-untyped-call]

    def abort(self) -> None:
        connection = self._client.socket
        with suppress(OSError):
            if connection is not None:
                connection.shutdown(socket.SHUT_RDWR)

    def reached(self) -> bool:
        return self._client.connected


def _refusal(error: Exception) -> Refusal:
    return refusal_of(error, "Modbus")


def _good(answer: ModbusPDU, block: Block) -> ModbusPDU:
    if answer.isError():
        last = block.register + block.size // 2 - 1
        raise WireError(Refusal(f"it has no holding registers {block.register} to {last}, DB{block.number}", LOAD))
    return answer
