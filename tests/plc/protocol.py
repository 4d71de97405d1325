"""The blocks of a PLC and the link over them, for tests of other folders."""

from sagline.plc.block_link import BlockLink
from sagline.plc.blocks import CLAIM, FROM_PLC, TO_PLC, Block
from tests.control.protocol import Refusal

__all__ = ["CLAIM", "FROM_PLC", "TO_PLC", "Block", "BlockLink", "Refusal"]
