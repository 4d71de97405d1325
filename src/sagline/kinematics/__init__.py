"""Inverse kinematics (motion to tensions and lengths) and forward kinematics (lengths to poses)."""

from sagline.core.surface import group

group(__name__)
