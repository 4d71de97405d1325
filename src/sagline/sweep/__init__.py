"""Sweeps: computations for all combinations of robots, poses and wrenches, in parallel, with results in a folder."""

from sagline.core.surface import group

group(__name__)
