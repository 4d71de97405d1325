"""Least distances between sagging cables and other bodies."""
