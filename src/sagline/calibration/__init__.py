"""Calibration: what a robot's anchors, zeros and cables really are, from its own readings."""
