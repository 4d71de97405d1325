"""Obstacles: boxes, capsules, spheres, closed meshes of triangles, and the beams of a frame."""

from __future__ import annotations

from itertools import combinations, product
from typing import Any, Final

import numpy as np
from attrs import field, frozen
from numpy.typing import ArrayLike

from sagline.core.arguments import check_memory, instance, label
from sagline.core.arrays import FARTHEST, Array, Flags, Indices, checked, exactly, locked, number, numbers
from sagline.core.errors import InvalidValueError
from sagline.core.fields import check_fields, checked_by, given, reduced
from sagline.core.numbers import counted
from sagline.core.results import Result, set_fields
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.reach import bounds
from sagline.robot.robot import Robot

_LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ROUNDING: Final = 1e-14  # tolerance for products of unit vectors


def _rotation(value: ArrayLike, item: str) -> Array:
    """Check the rotation matrix `value`. If its errors exceed rounding, the nearest rotation matrix replaces it."""
    matrix = exactly(value, item, "", (3, 3))
    nearest = Pose(np.zeros(3), matrix).matrix
    return matrix if np.abs(matrix.T @ matrix - np.eye(3)).max() < ROUNDING else nearest


@frozen(eq=False, weakref_slot=False)
class Box(Result):
    """A solid box.

    Attributes:
        size: Lengths of the edges [m], shape (3,), > 0.
        center: Middle in the world [m], shape (3,); for a platform, in the platform frame.
        orientation: Directions of the edges in world axes, as columns of a rotation matrix (3, 3).
        name: Name in messages and results.

    Raises:
        InvalidValueError: If an edge is not positive. If `orientation` is not a rotation.

    Examples:
        >>> import sagline as sl
        >>> table = sl.Box([1.2, 0.8, 0.7], center=[2.0, 0.0, 0.35], name="table")
    """

    size: Array = field(converter=given, metadata=checked_by(exactly, "m", (3,), above=0.0))
    center: Array = field(default=(0.0, 0.0, 0.0), converter=given, metadata=checked_by(exactly, "m", (3,)))
    orientation: Array = field(default=_LEVEL, converter=given, metadata=checked_by(_rotation))
    name: str = field(default="box", metadata=checked_by(label))

    __attrs_post_init__ = check_fields
    __reduce__ = reduced

    @property
    def bounds(self) -> Array:
        """Lowest and highest corner [m] of the box around the body, along the world axes, shape (2, 3)."""
        reach = 0.5 * np.abs(self.orientation) @ self.size
        return np.stack((self.center - reach, self.center + reach))


@frozen(eq=False, weakref_slot=False)
class Capsule(Result):
    """A solid rod with round ends, such as a pole, a pipe or a lamp.

    Attributes:
        start: One end of the center line in the world [m], shape (3,).
        end: Other end of the center line in the world [m], shape (3,).
        radius: Radius [m], >= 0.
        name: Name in messages and results.

    Raises:
        InvalidValueError: If the radius is negative. If an end is not a point.

    Examples:
        >>> import sagline as sl
        >>> pole = sl.Capsule([1.0, 0.0, 0.0], [1.0, 0.0, 3.0], radius=0.05, name="pole")
    """

    start: Array = field(converter=given, metadata=checked_by(exactly, "m", (3,)))
    end: Array = field(converter=given, metadata=checked_by(exactly, "m", (3,)))
    radius: float = field(metadata=checked_by(number, "m", low=0.0))
    name: str = field(default="capsule", metadata=checked_by(label))

    __attrs_post_init__ = check_fields
    __reduce__ = reduced

    @property
    def bounds(self) -> Array:
        """Lowest and highest corner [m] of the box around the body, along the world axes, shape (2, 3)."""
        low, high = np.minimum(self.start, self.end), np.maximum(self.start, self.end)
        return np.stack((low - self.radius, high + self.radius))


@frozen(eq=False, weakref_slot=False)
class Sphere(Result):
    """A solid ball.

    Attributes:
        center: Center in the world [m], shape (3,).
        radius: Radius [m], >= 0.
        name: Name in messages and results.

    Raises:
        InvalidValueError: If the radius is negative. If the center is not a point.

    Examples:
        >>> import sagline as sl
        >>> lamp = sl.Sphere([0.0, 0.0, 2.8], radius=0.2, name="lamp")
    """

    center: Array = field(converter=given, metadata=checked_by(exactly, "m", (3,)))
    radius: float = field(metadata=checked_by(number, "m", low=0.0))
    name: str = field(default="sphere", metadata=checked_by(label))

    __attrs_post_init__ = check_fields
    __reduce__ = reduced

    @property
    def bounds(self) -> Array:
        """Lowest and highest corner [m] of the box around the body, along the world axes, shape (2, 3)."""
        return np.stack((self.center - self.radius, self.center + self.radius))


def frame_beams(robot: Robot, radius: float) -> tuple[Capsule, ...]:
    """Twelve beams with round ends at the edges of a robot's frame.

    The frame is the same as in drawings: a box with the robot's frame_size, whose top is at the highest anchors. If
    frame_size is unknown, the frame is the box around the anchors, extended down to the floor. Frame anchors are on the
    frame or near it. Therefore exclude the first part of each cable (argument `from_anchor` of `clearance`).

    Args:
        robot: The robot.
        radius: Half the beams' thickness [m], >= 0.

    Returns:
        Twelve capsules; their names describe their positions.

    Raises:
        InvalidValueError: If `radius` is negative.

    Examples:
        >>> import sagline as sl
        >>> beams = sl.frame_beams(sl.load_robot("cogiro"), radius=0.05)
        >>> len(beams), beams[0].name
        (12, 'beam along z at low x, low y')
    """
    low, high = bounds(instance(robot, Robot, "robot"))
    thick = number(radius, "radius", "m", low=0.0)
    corners = np.array(list(product((0, 1), repeat=3)))
    beams = []
    for one, other in combinations(corners, 2):
        changing = np.flatnonzero(one != other)
        if len(changing) != 1:
            continue
        axis = int(changing[0])
        where = ", ".join(f"{('low', 'high')[one[k]]} {'xyz'[k]}" for k in range(3) if k != axis)
        start, end = (low + corner * (high - low) for corner in (one, other))
        beams.append(Capsule(start, end, thick, f"beam along {'xyz'[axis]} at {where}"))
    return tuple(beams)


MOST: Final = 1_000_000  # largest number of triangles of a mesh
_AT_ONCE: Final = 1 << 19  # largest number of triangles times points in one step


def _as_faces(value: ArrayLike) -> Indices:
    """Return `value` unchanged. This converter only declares the type of the argument."""
    return value  # type: ignore[return-value]


@frozen(eq=False, repr=False, weakref_slot=False)
class Mesh(Result):
    """A closed surface of triangles, at rest in the world, or at rest in the platform frame for a platform.

    The enclosed volume is solid. If all triangles face inward, the outside is solid instead, and the enclosed volume is
    free.

    Attributes:
        vertices: Corners [m], shape (V, 3).
        faces: Indices of the three corners of each triangle, counter-clockwise as seen from outside the solid, shape
            (F, 3).
        name: Name in messages and results.

    Raises:
        InvalidValueError: If a face has an invalid corner index. If the number of faces is below 4 or above a million.
            If the surface is not closed: the message gives its extent.

    Examples:
        >>> import sagline as sl
        >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
        >>> faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
        >>> wedge = sl.Mesh(corners, faces, name="wedge")
        >>> print(f"{wedge.volume:.4f} m^3")
        0.1667 m^3
    """

    vertices: Array = field(converter=given)
    faces: Indices = field(converter=_as_faces)
    name: str = field(default="mesh", metadata=checked_by(label))

    def __attrs_post_init__(self) -> None:
        """Check the fields, and check that the surface is closed."""
        corners = checked(self.vertices, "vertices", "m", shape=(None, 3))
        if corners.ndim != 2:
            step = "Give one mesh at a time."
            raise InvalidValueError("vertices", f"of shape {corners.shape}", "shape (any, 3)", step)
        check_coordinates(corners)
        triangles = _faces(self.faces, len(corners))
        check_fields(self)
        if wrong := _open_edges(triangles):
            value = f"not closed ({wrong} edges of {len(triangles)} triangles lack a neighbor that faces the same way)"
            step = "Use its CAD program to close its holes and to turn its faces outward."
            raise InvalidValueError(self.name, f"{value}, {extent_text(corners)}", "a closed surface", step)
        set_fields(self, vertices=corners, faces=triangles)

    __reduce__ = reduced

    def __str__(self) -> str:
        """Name, number of triangles and extent."""
        return f"{self.name}: {counted(len(self.faces), 'triangle')}, {extent_text(self.vertices)}"

    @property
    def bounds(self) -> Array:
        """Lowest and highest corner along the axes [m], shape (2, 3)."""
        used = self.vertices[self.faces]
        return np.stack((used.min(axis=(0, 1)), used.max(axis=(0, 1))))

    @property
    def volume(self) -> float:
        """Enclosed volume [m^3]; negative if the triangles face inward."""
        a, b, c = np.moveaxis(self.vertices[self.faces] - self.bounds.mean(axis=0), 1, 0)
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0)

    def placed(self, pose: PoseLike) -> Mesh:
        """Copy of the mesh at a pose.

        Args:
            pose: A single pose: position and rotation of the mesh's frame in the world.

        Returns:
            Mesh.

        Raises:
            InvalidValueError: If `pose` is not a single Pose.
        """
        return Mesh(single_pose(pose).transform(self.vertices), self.faces, self.name)

    def encloses(self, points: ArrayLike) -> Flags:
        """True for points in the solid.

        The result follows from the winding number of the surface, which is also reliable near edges and corners.

        Args:
            points: Points in the frame of the mesh [m], shape (..., 3).

        Returns:
            True for each point in the solid, shape (...).

        Raises:
            InvalidValueError: If a coordinate is not finite.
        """
        given = checked(points, "points", "m", shape=(3,))
        check_memory("points", 40.0 * given.size, "Give fewer points at once.")
        flat, low, high = given.reshape(-1, 3), *self.bounds
        near = np.flatnonzero(((flat >= low) & (flat <= high)).all(axis=1))
        found = np.zeros(len(flat), dtype=np.bool_)
        size = max(1, _AT_ONCE // len(self.faces))
        for first in range(0, len(near), size):
            some = near[first : first + size]
            found[some] = _winding(self.vertices[self.faces], flat[some]) > 0.5
        return locked(found.reshape(given.shape[:-1]))


def _faces(given: Any, corners: int) -> Indices:
    values = numbers(given, "faces", "")
    if values.ndim != 2 or values.shape[1] != 3 or not 4 <= len(values) <= MOST:
        allowed = f"shape (F, 3) with 4 to {MOST:,} triangles"
        raise InvalidValueError("faces", f"of shape {values.shape}", allowed, "Give three corners per triangle.")
    wrong = ~((values >= 0) & (values < corners) & (values == np.floor(values)))
    if wrong.any():
        i, k = (int(n) for n in np.argwhere(wrong)[0])
        step = "Number the corners from 0."
        raise InvalidValueError(f"faces[{i}, {k}]", f"{values[i, k]:g}", f"whole numbers from 0 to {corners - 1}", step)
    return locked(np.ascontiguousarray(values, dtype=np.int64))


def _open_edges(faces: Indices) -> int:
    """Number of open edges: no neighboring triangle has the same edge in the opposite direction."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = int(faces.max()) + 1
    ways = np.concatenate((start * count + end, end * count + start))
    sign = np.repeat((1, -1), len(start))
    _, place = np.unique(ways, return_inverse=True)
    return int(np.count_nonzero(np.bincount(place, weights=sign)) // 2)


def check_coordinates(corners: Array) -> None:
    """Refuse corners [m] whose coordinates are larger than on any machine."""
    if (far := float(np.abs(corners).max(initial=0.0))) > FARTHEST:
        step = "Correct them, or the unit of their file."
        raise InvalidValueError("vertices", f"up to {far:g} m away", f"up to {FARTHEST:g} m", step)


def extent_text(corners: Array) -> str:
    """Extent of `corners` as text for a message."""
    edges = " x ".join(f"{edge:.4g}" for edge in np.ptp(corners, axis=0))
    return f"{edges} m"


def _winding(triangles: Array, points: Array) -> Array:
    """Winding number of a surface (F, 3, 3) around points (K, 3): solid angles over 4 pi (van Oosterom 1983)."""
    a, b, c = np.moveaxis(triangles - points[:, None, None], 2, 0)
    la, lb, lc = (np.linalg.norm(side, axis=-1) for side in (a, b, c))
    volume = np.einsum("kfi,kfi->kf", a, np.cross(b, c))
    below = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    return np.asarray(np.arctan2(volume, below).sum(axis=1) / (2.0 * np.pi))


def _dot(one: Array, other: Array) -> Array:
    return np.asarray(np.einsum("kfi,kfi->kf", one, other))
