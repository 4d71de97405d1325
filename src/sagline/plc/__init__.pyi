"""Public names of `sagline.plc`."""

from .modbus_link import ModbusLink as ModbusLink
from .s7_link import S7Link as S7Link
from .wire import LinkError as LinkError
