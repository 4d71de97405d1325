"""Interference: clearances between cables, platform and obstacles."""

from sagline.core.surface import group

group(__name__)
