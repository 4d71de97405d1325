"""Statics of the platform: structure matrix, required wrench, and inertial wrench of a motion."""
