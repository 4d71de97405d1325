"""Statics of the platform: structure matrix, inertial wrench, stiffness, and the article's force balance."""

from sagline.core.surface import group

group(__name__)
