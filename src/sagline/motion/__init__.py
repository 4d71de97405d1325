"""Paths of the platform: poses, velocities and accelerations over time."""
