"""Vibration of robots whose cables have mass, motion in time, and trajectories without residual vibration."""
