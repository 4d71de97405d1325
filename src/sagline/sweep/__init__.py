"""Sweeps: every robot at every pose under every wrench, computed by Dask workers into a folder."""

from sagline.core.surface import group

group(__name__)
