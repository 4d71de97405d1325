"""Obstacles of simple form: boxes, capsules, spheres, and the beams of a frame."""

from __future__ import annotations

from itertools import combinations, product
from typing import Final

import numpy as np
from attrs import field, frozen
from numpy.typing import ArrayLike

from sagline.core.arguments import instance, label
from sagline.core.arrays import Array, exactly, number
from sagline.core.fields import check_fields, checked_by, given, reduced
from sagline.core.results import Result
from sagline.robot.pose import Pose
from sagline.robot.reach import bounds
from sagline.robot.robot import Robot

_LEVEL = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ROUNDING: Final = 1e-14  # tolerance for products of unit vectors


def _rotation(value: ArrayLike, item: str) -> Array:
    """The checked rotation matrix `value`. If its errors exceed rounding, the nearest rotation matrix replaces it."""
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
        InvalidValueError: If an edge is not positive, or `orientation` is not a rotation.

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
        InvalidValueError: If the radius is negative, or an end is not a point.

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
        InvalidValueError: If the radius is negative, or the center is not a point.

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
    frame_size is unknown, the frame is the box around the anchors and down to the floor. Frame anchors are on the frame
    or near it. Therefore exclude the first part of each cable with the argument `from_anchor` of `clearance`.

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
