"""Kernels for cables with mass, and for the motion of platform and cables over time."""
