"""Least distances of sagging cables."""
