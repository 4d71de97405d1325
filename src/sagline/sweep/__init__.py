"""Sweeps: Dask workers compute every robot at every pose under every wrench, and write the results to a folder."""

from sagline.core.surface import group

group(__name__)
