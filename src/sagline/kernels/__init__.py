"""Compiled kernels: they take and return floats and arrays in SI units."""
