"""Robots at equilibrium and meshes for tests of distances."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

import sagline as sl
from sagline import Mesh
from sagline.core.arrays import Array

LEVEL = np.eye(3)
_FACES = [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1]]
_FACES += [[2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]


DEEP = sl.Robot(
    "deep",
    frame_anchors=[[6, 1, 5], [-4, 5, 5], [-4, -5, 4]],
    platform_anchors=[[0.1, 0, 0], [-0.1, 0.1, 0], [-0.1, -0.1, 0]],
    cables=sl.Cable(linear_density=2.0, axial_stiffness=1e5),
    mass=0.5,
    motion_pattern="3T",
)


def at_rest(name: str = "cogiro", place: tuple[float, float, float] = (1.0, 0.5, 1.5)) -> sl.Equilibrium:
    robot = DEEP if name == "deep" else sl.load_robot(name)
    return sl.inverse(robot, sl.Pose(place, LEVEL)).state


def box_mesh(size: ArrayLike, center: ArrayLike, orientation: Array = LEVEL, name: str = "block") -> Mesh:
    """A box as a mesh."""
    corners = 0.5 * np.array(list(product((-1.0, 1.0), repeat=3))) * np.asarray(size)
    return Mesh(corners @ orientation.T + np.asarray(center), _FACES, name)


def turned(rng: np.random.Generator) -> Array:
    """A random rotation."""
    x, y, z, w = (q := rng.normal(size=4)) / np.linalg.norm(q)
    pose = sl.Pose.from_quaternion([0.0, 0.0, 0.0], [x, y, z, w])
    return pose.matrix


def cable_points(state: sl.Equilibrium, cable: int, count: int = 4001) -> Array:
    """Points of a cable from its state [m], shape (count, 3)."""
    start, end = state.exit_point[cable], state.pose.transform(state.one_robot.platform_anchors)[cable]
    along, up = np.moveaxis(state.cables.points(count)[cable], -1, 0)
    level = (end - start)[:2] / np.hypot(*(end - start)[:2])
    return np.asarray(start + np.stack((level[0] * along, level[1] * along, up), axis=-1))


def from_box(points: Array, box: sl.Box) -> Array:
    """Distances of points from a solid box [m]."""
    own = (points - box.center) @ box.orientation
    return np.asarray(np.linalg.norm(np.maximum(np.abs(own) - 0.5 * box.size, 0.0), axis=-1))


def from_segment(points: Array, start: Array, end: Array) -> Array:
    """Distances of points from a segment [m]."""
    run = end - start
    share = np.clip((points - start) @ run / max(float(run @ run), 1e-300), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[..., None] * run, axis=-1))
