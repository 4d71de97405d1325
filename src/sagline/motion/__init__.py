"""Paths of the platform: poses, velocities and accelerations over time."""

from sagline.core.surface import group

group(__name__)
