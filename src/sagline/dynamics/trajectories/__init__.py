"""Shaped and time-optimal motion along paths."""
