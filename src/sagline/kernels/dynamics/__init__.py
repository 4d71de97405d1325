"""Kernels of cables with mass and of motion in time."""
