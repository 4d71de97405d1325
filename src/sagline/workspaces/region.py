"""Positions and orientations of a workspace: a box or a part of a plane, and the rotations of the platform."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, choice, optional
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.core.results import set_fields
from sagline.robot.checks import PLANAR, ROTATING
from sagline.robot.pose import Pose, PoseBox
from sagline.robot.reach import LEVEL, ROUNDING, bounds, forbidden_turn, turn_in_words
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Need = Literal["all", "any"]
_NEEDS: Final = ("all", "any")
_SHARES: Final = np.array([-1.0, -0.5, 0.5, 1.0])  # sampled rotations of a planar platform, relative to the angle
_CORNERS: Final = np.array([one for one in product((-1.0, 0.0, 1.0), repeat=3) if any(one)])
_AXES: Final = _CORNERS / np.linalg.norm(_CORNERS, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True, eq=False)
class Orientations:
    """Rotations of the platform. At a position, all rotations or at least one rotation must be feasible.

    A continuous set of rotations is represented by the listed samples.

    Attributes:
        quaternion: Rotations from platform to world as unit quaternions (x, y, z, w), shape (K, 4).
        need: "all" if all rotations must be feasible, "any" if one feasible rotation is sufficient.
    """

    quaternion: Array
    need: Need

    def __init__(self, rotations: Rotation | ArrayLike, need: Need = "all") -> None:
        """Check rotations and need.

        Args:
            rotations: scipy Rotation, or rotation matrices of shape (3, 3) or (K, 3, 3).
            need: "all" or "any".

        Raises:
            InvalidValueError: If a matrix is not a rotation. If no rotation is given. If `need` is another word.

        Examples:
            >>> import numpy as np
            >>> import sagline as sl
            >>> turned = sl.Pose.from_euler(np.zeros(3), np.radians([-20, 0, 20]), 0, 0)
            >>> print(sl.Orientations(turned.matrix, need="any"))
            any of 3 sampled rotations, by up to 20°
        """
        if rotations is None:
            raise InvalidValueError("rotations", "None", "at least one rotation", "Give np.eye(3) for level.")
        quaternion = np.atleast_2d(Pose(np.zeros(3), rotations).quaternion)
        if not len(quaternion):
            raise InvalidValueError("rotations", "an empty set", "at least one rotation", "Give np.eye(3) for level.")
        set_fields(self, quaternion=locked(quaternion), need=choice(need, "need", _NEEDS))

    @classmethod
    def _of(cls, quaternion: Array, need: Need) -> Orientations:
        """Orientations of unit quaternions, unchecked."""
        made = object.__new__(cls)
        set_fields(made, quaternion=locked(quaternion), need=need)
        return made

    def __len__(self) -> int:
        """Number of rotations."""
        return len(self.quaternion)

    def __str__(self) -> str:
        """Description of the rotations in one line."""
        if len(self) > 1:
            most = 2.0 * np.arctan2(np.linalg.norm(self.quaternion[:, :3], axis=1), np.abs(self.quaternion[:, 3])).max()
            return f"{self.need} of {len(self)} sampled rotations, by up to {n(np.degrees(most), unit='°')}"
        turn = self.quaternion[0, :3]
        if np.linalg.norm(turn) <= ROUNDING:
            return "level"
        return f"turned by {turn_in_words(turn * np.copysign(1.0, self.quaternion[0, 3]))}"

    def __reduce__(self) -> tuple[Any, tuple[Array, Need]]:
        """Pickle data that preserve all bits."""
        return Orientations._of, (self.quaternion, self.need)

    def at(self, positions: Array, index: int) -> Array:
        """Pose rows: the platform at `positions`, in the rotation with the index `index`.

        Args:
            positions: Positions of the platform origin [m], shape (N, 3).
            index: Index of the rotation.

        Returns:
            Positions and quaternions, shape (N, 7).
        """
        rows = np.empty((len(positions), 7))
        rows[:, :3], rows[:, 3:] = positions, self.quaternion[index]
        return locked(rows)


@dataclass(frozen=True, slots=True)
class Tilts:
    """All rotations by at most `angle` about any axis, which must all be feasible at a position.

    The samples are the level orientation, and rotations by the full angle about 26 axes that cover all directions. For
    a planar robot, the samples are rotations by the angle and by half the angle, in both directions.

    Attributes:
        angle: Largest angle of rotation [rad], 0 to pi.
    """

    angle: float

    def __post_init__(self) -> None:
        """Check the angle."""
        angle = number(self.angle, "angle", "rad", low=0.0)
        if angle > np.pi:
            step = "Give the angle in radians; it is at most half a turn."
            raise InvalidValueError("angle", f"{angle:.6g} rad", "0 to pi rad", step)
        object.__setattr__(self, "angle", angle)

    def sampled(self, robot: Robot) -> Orientations:
        """Sample the tilts up to the angle.

        Args:
            robot: The robot; its motion pattern gives the axes of rotation of the platform.

        Returns:
            Level orientation, then the tilted orientations.

        Raises:
            InvalidValueError: If the platform cannot rotate.
        """
        if self.angle == 0.0:
            return Orientations._of(LEVEL[None].copy(), "all")
        check_tilt(robot, self.angle, "orientations: tilt")
        if robot.motion_pattern in PLANAR and robot.plane_normal is not None:
            axes, angles = np.repeat(robot.plane_normal[None], len(_SHARES), axis=0), self.angle * _SHARES
        else:
            axes, angles = _AXES, np.full(len(_AXES), self.angle)
        turned = np.hstack((np.sin(0.5 * angles)[:, None] * axes, np.cos(0.5 * angles)[:, None]))
        return Orientations._of(np.vstack((LEVEL, turned)), "all")


def check_tilt(robot: Robot, angle: float, item: str) -> None:
    """Reject a tilt by `angle` [rad] if the platform of `robot` cannot rotate; `item` names the tilt in messages."""
    if angle > 0.0 and robot.motion_pattern not in ROTATING:
        value, step = f"{np.degrees(angle):.4g} deg", "Leave out the tilt."
        allowed = f"none, because a platform with motion_pattern {robot.motion_pattern} cannot rotate"
        raise InvalidValueError(item, value, allowed, step)


def orientations_of(robot: Robot, given: Any, tilt: float) -> Orientations:
    """Orientations for `robot`: the checked argument `given` of `workspace`, or all rotations up to `tilt` [rad]."""
    if given is not None and tilt > 0.0:
        step = "Give the tilt of the box, or orientations."
        value = f"given with a box of tilt {np.degrees(tilt):.4g} deg"
        raise InvalidValueError("orientations", value, "one of the two", step)
    if given is None:
        given = Tilts(tilt)
    if isinstance(given, Tilts):
        return given.sampled(robot)
    if not isinstance(given, Orientations):
        step = "Give Tilts(np.radians(10)), or Orientations(rotations)."
        raise InvalidValueError("orientations", brief(given), "Tilts, Orientations, or None for level", step)
    _check_turns(robot, given)
    return given


def _check_turns(robot: Robot, given: Orientations) -> None:
    """Reject rotations of `given` that the motion pattern of `robot` does not allow."""
    turns = forbidden_turn(robot, Pose.from_quaternion(np.zeros(3), given.quaternion), LEVEL)
    wrong = np.flatnonzero(np.linalg.norm(turns, axis=1) > ROUNDING)
    if wrong.size:
        k = int(wrong[0])
        value, turn = f"a turn by {turn_in_words(turns[k])}", "a turn about plane_normal"
        allowed = f"{turn if robot.motion_pattern in ROTATING else 'no turn'}, by motion_pattern {robot.motion_pattern}"
        step = "Leave out this rotation, or give the robot another motion_pattern."
        raise InvalidValueError(f"orientations[{k}]", value, allowed, step)


AXES: Final = "xyz"


class Region(NamedTuple):
    """Region of positions, with the number of cells of its grid."""

    box: PoseBox  # the given box, or the robot's own box
    low: Array  # lowest corner of the region [m], shape (3,)
    high: Array  # highest corner [m], above the lowest corner along every axis
    # Index of the axis along which the box has no extent; None if it has an extent along all axes. With a flat axis,
    # the positions are in a plane, and the region has a thickness. The area is the volume of the region divided by the
    # thickness.
    flat: int | None
    thickness: float  # thickness of the region along the flat axis [m]; 1 without a flat axis
    cells: tuple[int, int, int]  # number of cells along each axis

    @property
    def unit(self) -> str:
        """Unit of the region's volume or area."""
        return "m³" if self.flat is None else "m²"


def region_of(robot: Robot, box: PoseBox | None, cells: int) -> Region:
    """Region of `box`. The default box encloses the frame and the test box; for a planar robot, it is flat."""
    plane = _plane_axis(robot)
    optional(box, PoseBox, "box")
    if box is None:
        low, high = _own(robot)
        if plane is not None:
            low[plane] = high[plane] = _place_of_plane(robot, plane)
        box = PoseBox(low, high)
    extent = box.high - box.low
    flat = np.flatnonzero(extent <= ROUNDING)
    if flat.size > 1:
        value = f"without extent along {' and '.join(AXES[axis] for axis in flat)}"
        raise InvalidValueError("box", value, "extent along two axes at least", "Give a larger box.")
    if plane is not None and plane not in flat:
        where = _place_of_plane(robot, plane)
        value = f"{extent[plane]:.4g} m thick along plane_normal, {AXES[plane]}"
        step = f"Give low and high the same {AXES[plane]}, {where:g} m for instance."
        raise InvalidValueError("box", value, "0 m for a planar robot", step)
    x, y, z = (2 * max(1, round(0.5 * cells * part)) for part in (extent / extent.max()).tolist())
    if not flat.size:
        return Region(box, box.low, box.high, None, 1.0, (x, y, z))
    axis, thickness = int(flat[0]), float(extent.max()) / cells
    half = 0.5 * thickness * np.eye(3)[axis]
    x, y, z = (1 if k == axis else count for k, count in enumerate((x, y, z)))
    return Region(box, box.low - half, box.high + half, axis, thickness, (x, y, z))


def _own(robot: Robot) -> tuple[Array, Array]:
    """Corners [m] of the smallest box that encloses the frame and the test box."""
    low, high = bounds(robot)
    if robot.test_box is None:
        return low.copy(), high.copy()
    return np.minimum(low, robot.test_box.low), np.maximum(high, robot.test_box.high)


def flat_axis(box: PoseBox) -> tuple[int, float] | None:
    """First axis along which `box` has no extent, and the coordinate of the box on it [m]. None if none exists."""
    flat = np.flatnonzero(box.high - box.low <= ROUNDING)
    return (int(flat[0]), float(box.low[flat[0]])) if flat.size else None


def _plane_axis(robot: Robot) -> int | None:
    """World axis along the normal of a planar robot's plane. Raises an error if the normal is not along an axis."""
    if robot.plane_normal is None:
        return None
    axis = int(np.argmax(np.abs(robot.plane_normal)))
    if abs(robot.plane_normal[axis]) < 1.0 - ROUNDING:
        normal = ", ".join(f"{x:.4g}" for x in robot.plane_normal)
        step = "Rotate the robot's coordinates so that the normal of its plane is along an axis."
        raise InvalidValueError("plane_normal", f"({normal})", "along x, y or z for a workspace", step)
    return axis


def _place_of_plane(robot: Robot, axis: int) -> float:
    """Coordinate of a planar robot's plane along its normal [m]."""
    return float(robot.frame_anchors[:, axis].mean() - robot.platform_anchors[:, axis].mean())
