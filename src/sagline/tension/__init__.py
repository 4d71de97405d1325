"""Tension distribution for redundant cables: methods, limits, and the polygon of feasible tensions."""
