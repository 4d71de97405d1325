"""Tension distribution of redundant cables: methods, limits, and the polygon of feasible tensions."""
