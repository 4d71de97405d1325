"""Inverse kinematics: tensions and lengths from a motion. Forward kinematics: poses from lengths."""

from sagline.core.surface import group

group(__name__)
