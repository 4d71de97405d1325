"""A weight on two weightless cables, the robot with a closed form of the best anchors.

Anchors at +-x, height h above the weight; tensions from 0 to T; weight G. With the angle theta of the cables from the
vertical, the margin is min(G sin theta, sin theta (2 T cos theta - G)): it is largest if both are equal, at
cos theta = G/T if G/T < sqrt(2/3).
"""

from __future__ import annotations

import numpy as np

import sagline as sl

WEIGHT, TENSION, HEIGHT = 10.0, 20.0, 2.0  # N, N, m
BEST = HEIGHT * np.sqrt(3.0)  # m: at 60 degrees
MARGIN = WEIGHT * np.sin(np.pi / 3.0)  # N
UNDER = sl.Pose([0.0, 0.0, 0.0], np.eye(3))


def pair(x: float = 1.0) -> sl.Robot:
    """The robot with its anchors at +-x [m]."""
    return sl.Robot(
        "pair",
        [[x, 0.0, HEIGHT], [-x, 0.0, HEIGHT]],
        np.zeros((2, 3)),
        sl.Cable(0.01, 1e6),
        WEIGHT / 9.81,
        motion_pattern="2T",
        plane_normal=[0.0, 1.0, 0.0],
        tension_max=TENSION,
    )


def apart(low: float = -0.5, high: float = 5.0) -> sl.FreeAnchors:
    """Its anchors along x, mirrored."""
    return sl.FreeAnchors("frame", low, high, along=[1, 0, 0], symmetry="x")
