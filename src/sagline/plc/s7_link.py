"""The link to Siemens PLCs: data blocks by PUT and GET of the S7 protocol."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from sagline.plc.addresses import addresses_of
from sagline.plc.block_link import BlockLink
from sagline.plc.wire import needed
from sagline.robot.robot import Robot

PORT: Final = 102


class S7Link(BlockLink):
    """The link (`sagline.control.link.Link`) to S7-1200 PLCs, or to a twin.

    Examples:
        >>> link = sl.plc.S7Link("127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024", robot)
        ... # doctest: +SKIP
    """

    def __init__(self, addresses: str | Sequence[str], robot: Robot | int, *, timeout: float = 2.0) -> None:
        """Connect to all groups at once.

        Args:
            addresses: "host" or "host:port" of each group's PLC, in their order; or one text with commas between.
            robot: Whose winches they drive; or how many there are.
            timeout: How long they may take to answer first [s].

        Raises:
            InvalidValueError: If the addresses are not as many as groups, none at all, or two are the same.
            LinkError: If a PLC does not answer, or not as sagline's blocks would.
            FileError: If python-snap7 is not installed.
        """
        with needed():
            from sagline.plc.s7_wire import S7Wire
        places = addresses_of(addresses, PORT)
        super().__init__(places, robot, [S7Wire(*place) for place in places], timeout)
