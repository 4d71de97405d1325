"""Representation of robots, plans and results in Jupyter: the summary and a small figure."""
