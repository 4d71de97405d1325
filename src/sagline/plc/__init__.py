"""Links to real controllers of drives, over S7 or Modbus."""
