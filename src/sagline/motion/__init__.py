"""Paths of the platform: where it is, how it moves, and when."""
