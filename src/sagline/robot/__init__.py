"""Data of the robot: geometry, cables, mass, limits, poses and presets."""
