"""Calibration of a robot: estimation of anchors, length zeros and cable properties from the robot's own readings."""

from sagline.core.surface import group

group(__name__)
