"""Servers of the blocks of a twin, for tests of other folders, and the memory behind them."""

from sagline.twin import Server
from sagline.twin.mirrors import Mirrors
from sagline.twin.modbus_mirrors import ModbusMirrors
from sagline.twin.s7_mirrors import S7Mirrors
from tests.plc.protocol import Block

__all__ = ["Mirrors", "ModbusMirrors", "S7Mirrors", "memory"]


def memory(server: Server) -> list[dict[Block, bytearray]]:
    """Blocks of each group, as they are stored."""
    mirrors = server._mirrors
    assert isinstance(mirrors, S7Mirrors | ModbusMirrors)
    return [each if isinstance(each, dict) else each.blocks for each in mirrors._memory]
