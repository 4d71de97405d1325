"""Random robots and poses as kernel arguments, and their balance in NumPy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.kernels import tables

GRAVITY = 9.81
EVERY_MOTION = np.eye(6)
IN_A_PLANE = np.eye(6)[[0, 2, 4]]  # x, z and the rotation about y
A_POINT = np.eye(6)[:3]
TO_AND_FRO = np.eye(6)[[0]]  # along x


class Case(NamedTuple):
    """One robot at one pose, as kernel arguments."""

    freedom: Array
    body: Array
    robot: Array
    pose: Array
    wrench: Array

    @property
    def structure(self) -> Array:
        """Columns (u; r x u) along the free motions (n, m), from anchors and pose only."""
        turn = Rotation.from_quat(self.pose[3:]).as_matrix()
        frame, platform = self.robot[:, :3], self.robot[:, 3:6]
        rope = frame - (self.pose[:3] + platform @ turn.T)
        unit = rope / np.linalg.norm(rope, axis=1, keepdims=True)
        lever = (platform - self.body[tables.CENTER_X :]) @ turn.T
        return np.asarray(self.freedom @ np.concatenate((unit.T, np.cross(lever, unit).T)))

    @property
    def chords(self) -> Array:
        """From frame end to platform end (m, 3)."""
        turn = Rotation.from_quat(self.pose[3:]).as_matrix()
        return np.asarray(self.pose[:3] + self.robot[:, 3:6] @ turn.T - self.robot[:, :3])


def random_case(rng: np.random.Generator, m: int, freedom: Array = EVERY_MOTION, flat: bool = False) -> Case:
    """Frame anchors on a ball of 3 m around a platform of 0.5 m, tilted by a few tenths of a radian."""
    robot = np.zeros((m, tables.CABLE_COLUMNS))
    ways = rng.normal(size=(m, 3))
    robot[:, :3] = 3.0 * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    robot[:, 3:6] = rng.uniform(-0.5, 0.5, (m, 3))
    robot[:, tables.DENSITY] = rng.uniform(0.01, 0.1, m)
    robot[:, tables.STIFFNESS] = rng.uniform(2e4, 6e4, m)
    robot[:, tables.TENSION_MIN], robot[:, tables.TENSION_MAX] = rng.uniform(5, 20, m), rng.uniform(300, 900, m)
    body = np.array([5.0, GRAVITY, *rng.uniform(-0.1, 0.1, 3)])
    turn = Rotation.from_rotvec(rng.uniform(-0.2, 0.2, 3))
    if flat:
        robot[:, [1, 4]] = body[tables.CENTER_Y] = 0.0
        turn = Rotation.from_rotvec([0.0, 0.2, 0.0])
    pose = np.concatenate((rng.uniform(-0.3, 0.3, 3) * (1, 0 if flat else 1, 1), turn.as_quat()))
    return Case(freedom, body, robot, pose, rng.normal(size=6) * (3, 3, 3, 0.2, 0.2, 0.2))
