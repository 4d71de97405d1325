"""The command `sagline`."""
