"""The robot as data: geometry, cables, mass, limits, poses and the presets."""
