"""Data of the robot: geometry, cables, mass, limits, poses and presets."""

from sagline.core.surface import group

group(__name__)
