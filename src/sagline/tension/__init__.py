"""Sharing the load among redundant cables: methods, limits, and the polygon of feasible tensions."""
