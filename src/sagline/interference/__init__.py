"""Interference: clearances between cables, platform and obstacles."""
