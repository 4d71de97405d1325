"""Links to PLCs, over S7 or Modbus."""

from sagline.core.surface import group

group(__name__)
