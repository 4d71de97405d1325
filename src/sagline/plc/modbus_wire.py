"""A connection to one PLC over Modbus TCP; the only file of the links that knows pymodbus."""

from __future__ import annotations

import logging
import socket
import struct
from contextlib import suppress

from pymodbus.client import ModbusTcpClient
from pymodbus.pdu import ModbusPDU

from sagline.plc.blocks import LOAD, Block, Refusal
from sagline.plc.wire import ANSWER, WireError, refused

logging.getLogger("pymodbus").addHandler(logging.NullHandler())  # what goes wrong is told by the link


class ModbusWire:
    """A connection to one PLC whose blocks are in holding registers, two bytes each, the same bytes as over S7."""

    def __init__(self, host: str, port: int, device: int) -> None:
        """Know where to connect.

        Args:
            host: Name or IPv4 address.
            port: TCP port.
            device: Id of the device behind it.
        """
        self._client = ModbusTcpClient(host, port=port, timeout=ANSWER, retries=0)
        self._place = (host, port)
        self._device = device

    def open(self) -> None:
        """Connect; waits at most ANSWER."""
        try:
            connected = self._client.connect()  # type: ignore[no-untyped-call]
        except Exception as error:
            raise WireError(refused(error, "Modbus")) from error
        if not connected:
            try:  # the library keeps to itself why not
                socket.create_connection(self._place, timeout=ANSWER).close()
            except OSError as error:
                raise WireError(refused(error, "Modbus")) from error
            raise WireError(Refusal("the connection was closed", "Check that nobody else is connected to it"))

    def read(self, block: Block) -> bytes:
        """The bytes of a block.

        Args:
            block: Which.
        """
        count = block.size // 2
        try:
            answer = self._client.read_holding_registers(block.register, count=count, device_id=self._device)
            registers = _good(answer, block).registers
            return struct.pack(f">{len(registers)}H", *registers)
        except Exception as error:  # of a stranger's answer the library may make anything
            raise _failed(error) from error

    def write(self, block: Block, data: bytes) -> None:
        """Replace the bytes of a block.

        Args:
            block: Which.
            data: All of them.
        """
        registers = list(struct.unpack(f">{len(data) // 2}H", data))
        try:
            _good(self._client.write_registers(block.register, registers, device_id=self._device), block)
        except Exception as error:
            raise _failed(error) from error

    def close(self) -> None:
        """Disconnect."""
        with suppress(Exception):  # of a connection that is given up nothing matters
            self._client.close()  # type: ignore[no-untyped-call]

    def abort(self) -> None:
        """From another thread: end whatever waits."""
        connection = self._client.socket
        with suppress(OSError):
            if connection is not None:
                connection.shutdown(socket.SHUT_RDWR)

    def reached(self) -> bool:
        """Whether somebody is at the other end."""
        return self._client.connected


def _failed(error: Exception) -> WireError:
    return error if isinstance(error, WireError) else WireError(refused(error, "Modbus"))


def _good(answer: ModbusPDU, block: Block) -> ModbusPDU:
    if answer.isError():
        last = block.register + block.size // 2 - 1
        raise WireError(Refusal(f"it has no holding registers {block.register} to {last}, DB{block.number}", LOAD))
    return answer
