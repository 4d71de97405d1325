"""Poses after a motion: displacement of the center of mass, then a rotation about it; vectors of the platform."""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.balance.wrench import fill_motion_of_components
from sagline.kernels.jit import formula, kernel

Triple = tuple[float, float, float]


@kernel
def step_pose(free: Array, body: Array, pose: Array, step: Array, motion: Array, moved: Array) -> None:
    """Fill the pose `moved` after `step` (n,) along the free motions, and the `motion` (6,) of this step."""
    fill_motion_of_components(free, step, motion)
    moved_pose(body, pose, motion, moved)


@formula
def moved_pose(body: Array, pose: Array, motion: Array, moved: Array) -> None:
    """Fill the pose `moved` after `motion` (6,): displacement of the center of mass, and rotation about this point."""
    angle2 = motion[3] * motion[3] + motion[4] * motion[4] + motion[5] * motion[5]
    angle = math.sqrt(angle2)
    w = math.cos(0.5 * angle)
    half = math.sin(0.5 * angle) / angle if angle > 1e-8 else 0.5
    x, y, z = half * motion[3], half * motion[4], half * motion[5]
    qx, qy, qz, qw = pose[3], pose[4], pose[5], pose[6]
    ax = w * qx + x * qw + y * qz - z * qy
    ay = w * qy - x * qz + y * qw + z * qx
    az = w * qz + x * qy - y * qx + z * qw
    aw = w * qw - x * qx - y * qy - z * qz
    scale = 1.0 / math.sqrt(ax * ax + ay * ay + az * az + aw * aw)
    moved[3], moved[4], moved[5], moved[6] = ax * scale, ay * scale, az * scale, aw * scale
    # displacement of the origin: displacement of the center of mass plus d = Q c - Q' c due to the rotation
    cx, cy, cz = body[tables.CENTER_X], body[tables.CENTER_Y], body[tables.CENTER_Z]
    before = turned(pose, cx, cy, cz)
    after = turned(moved, cx, cy, cz)
    for k in range(3):
        moved[k] = pose[k] + (motion[k] + (before[k] - after[k]))


@formula
def turned(pose: Array, x: float, y: float, z: float) -> Triple:
    """Convert the vector (x, y, z) from the platform frame to world axes."""
    qx, qy, qz, qw = pose[3], pose[4], pose[5], pose[6]
    tx = 2.0 * (qy * z - qz * y)
    ty = 2.0 * (qz * x - qx * z)
    tz = 2.0 * (qx * y - qy * x)
    return (x + qw * tx + qy * tz - qz * ty, y + qw * ty + qz * tx - qx * tz, z + qw * tz + qx * ty - qy * tx)
