"""From lengths to poses."""
