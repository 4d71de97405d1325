"""Servers of the blocks of a twin and their memory, for tests of other folders."""

from sagline.twin import Server
from sagline.twin.block_servers import BlockServers
from sagline.twin.modbus_servers import ModbusServers
from sagline.twin.s7_servers import S7Servers
from tests.plc.protocol import Block

__all__ = ["BlockServers", "ModbusServers", "S7Servers", "memory"]


def memory(server: Server) -> list[dict[Block, bytearray]]:
    """Stored blocks of each group."""
    return server._servers._memory
