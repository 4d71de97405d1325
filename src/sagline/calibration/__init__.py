"""Calibration: actual anchors, length zeros and cable properties of a robot, from its own readings."""

from sagline.core.surface import group

group(__name__)
