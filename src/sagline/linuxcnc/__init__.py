"""Kinematics modules for the machine control LinuxCNC."""

from sagline.core.surface import group

group(__name__)
