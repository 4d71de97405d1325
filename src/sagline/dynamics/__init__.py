"""Vibration of robots whose cables have mass, motion in time, and trajectories without residual vibration."""

from sagline.core.surface import group

group(__name__)
