"""Representation of robots, plans and results in Jupyter: a summary and a small figure."""
