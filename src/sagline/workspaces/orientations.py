"""Orientations of the platform in a workspace: level, or several rotations, of which all or any must be feasible."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.core.results import set_fields
from sagline.robot.pattern import PLANAR, ROTATING
from sagline.robot.pose import Pose
from sagline.robot.reach import LEVEL, ROUNDING, forbidden_turn, turn_in_words
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Need = Literal["all", "any"]
_NEEDS: Final = ("all", "any")
_SHARES: Final = np.array([-1.0, -0.5, 0.5, 1.0])  # rotations of a planar platform, relative to the angle
_CORNERS: Final = np.array([one for one in product((-1.0, 0.0, 1.0), repeat=3) if any(one)])
_AXES: Final = _CORNERS / np.linalg.norm(_CORNERS, axis=1, keepdims=True)


@dataclass(frozen=True, slots=True, eq=False)
class Orientations:
    """Rotations of the platform; at a position, either all rotations or any one of them must be feasible.

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
            InvalidValueError: If a matrix is not a rotation, if no rotation is given, or if `need` is another word.

        Examples:
            >>> import numpy as np
            >>> import sagline as sl
            >>> turned = sl.Pose.from_euler(np.zeros(3), np.radians([-20, 0, 20]), 0, 0)
            >>> print(sl.Orientations(turned.matrix, need="any"))
            any of 3 sampled rotations, by up to 20°
        """
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
        """Rows of poses: the platform at positions, in one of the rotations.

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
    """All rotations by at most an angle, about any axis; all of them must be feasible at a position.

    The samples are the level orientation, and rotations by the full angle about 26 axes in all directions. For a planar
    robot, the samples are rotations by the angle and by half the angle, in both directions.

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
            return _level()
        check_tilt(robot, self.angle, "orientations: tilt")
        if robot.motion_pattern in PLANAR and robot.plane_normal is not None:
            axes, angles = np.repeat(robot.plane_normal[None], len(_SHARES), axis=0), self.angle * _SHARES
        else:
            axes, angles = _AXES, np.full(len(_AXES), self.angle)
        turned = np.hstack((np.sin(0.5 * angles)[:, None] * axes, np.cos(0.5 * angles)[:, None]))
        return Orientations._of(np.vstack((LEVEL, turned)), "all")


def _level() -> Orientations:
    """Level orientation alone."""
    return Orientations._of(LEVEL[None].copy(), "all")


def check_tilt(robot: Robot, angle: float, item: str) -> None:
    """Reject a tilt by `angle` [rad] if the platform of `robot` cannot rotate; `item` names the tilt in messages."""
    if angle > 0.0 and robot.motion_pattern not in ROTATING:
        value, step = f"{np.degrees(angle):.4g} deg", "Leave out the tilt."
        allowed = f"none, because a platform with motion_pattern {robot.motion_pattern} cannot rotate"
        raise InvalidValueError(item, value, allowed, step)


def orientations_of(robot: Robot, given: Any, tilt: float) -> Orientations:
    """Checked orientations for `robot`: `given`, the argument of `workspace`, or all rotations up to `tilt` [rad]."""
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
        allowed = "a turn about plane_normal" if robot.motion_pattern in ROTATING else "no turn"
        value, step = (
            f"a turn by {turn_in_words(turns[k])}",
            "Leave out this rotation, or give the robot another motion_pattern.",
        )
        raise InvalidValueError(
            f"orientations[{k}]", value, f"{allowed}, by motion_pattern {robot.motion_pattern}", step
        )
