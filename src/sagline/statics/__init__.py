"""Statics of the platform: structure matrix, required wrench, and inertial wrench of a motion."""

from sagline.core.surface import group

group(__name__)
