"""Sweeps: every robot at every pose under every wrench, computed by workers of Dask, with results in a folder."""

from sagline.core.surface import group

group(__name__)
