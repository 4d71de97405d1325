"""The link to PLCs of any make: the same blocks in Modbus holding registers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from sagline.core.arguments import whole_number
from sagline.plc.addresses import addresses_of
from sagline.plc.block_link import BlockLink
from sagline.plc.wire import needed
from sagline.robot.robot import Robot

PORT: Final = 502
MOST_DEVICE: Final = 255


class ModbusLink(BlockLink):
    """The link (`sagline.control.link.Link`) to PLCs over Modbus TCP, or to a twin.

    The blocks are those of `S7Link`, byte for byte: DB101 from holding register 0, DB102 from 100, DB103 from 200.

    Examples:
        >>> link = sl.plc.ModbusLink("192.168.0.11,192.168.0.12,192.168.0.13,192.168.0.14", robot)
        ... # doctest: +SKIP
    """

    def __init__(
        self, addresses: str | Sequence[str], robot: Robot | int, *, device: int = 1, timeout: float = 2.0
    ) -> None:
        """Connect to all groups at once.

        Args:
            addresses: "host" or "host:port" of each group's PLC, in their order; or one text with commas between.
            robot: Whose winches they drive; or how many there are.
            device: Id of the device behind each address.
            timeout: How long they may take to answer first [s].

        Raises:
            InvalidValueError: If the addresses are not as many as groups, none at all, or two are the same.
            LinkError: If a PLC does not answer, or not as sagline's blocks would.
            FileError: If pymodbus is not installed.
        """
        with needed():
            from sagline.plc.modbus_wire import ModbusWire
        unit = whole_number(device, "device", 0, MOST_DEVICE)
        places = addresses_of(addresses, PORT)
        super().__init__(places, robot, [ModbusWire(*place, unit) for place in places], timeout)
