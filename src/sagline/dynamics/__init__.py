"""Dynamics: vibration of robots whose cables have mass, simulation, and trajectories without residual vibration."""

from sagline.core.surface import group

group(__name__)
