"""A robot that moves in a vertical plane: four cables, two translations and a rotation."""

from __future__ import annotations

import numpy as np

import sagline as sl

PLANAR = sl.Robot(
    name="planar", frame_anchors=np.array([[0.0, 0.0, 3.0], [4.0, 0.0, 3.0], [0.0, 0.0, 0.0], [4.0, 0.0, 0.0]]),
    platform_anchors=np.array([[-0.1, 0.0, 0.1], [0.1, 0.0, 0.1], [-0.1, 0.0, -0.1], [0.1, 0.0, -0.1]]),
    mass=10.0, cables=sl.Cable(linear_density=0.02, axial_stiffness=1e5), tension_min=5.0, tension_max=300.0,
    inertia=np.eye(3), motion_pattern="1R2T", plane_normal=[0.0, 1.0, 0.0],
)  # fmt: skip
