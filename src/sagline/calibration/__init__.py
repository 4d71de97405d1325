"""Calibration: actual anchors, length zeros and cable properties of a robot, from its own readings."""
