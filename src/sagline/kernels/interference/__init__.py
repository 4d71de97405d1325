"""Least distances of hanging cables."""
