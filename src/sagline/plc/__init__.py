"""Links to PLCs, over S7 or Modbus."""

from sagline.plc.modbus_link import ModbusLink
from sagline.plc.s7_link import S7Link
from sagline.plc.wire import LinkError

__all__ = ["LinkError", "ModbusLink", "S7Link"]
