"""Where a path leads, whenever it does: pose and its derivatives by a parameter that grows along the curve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.motion.segments import QUINTIC, Segments
from sagline.robot.pose import Pose

_STOPPED: Final = 1e-6  # of the largest speed
_NARROW: Final = 0.2  # of the mean step: knots of a spline are no nearer, as where a motion begins


class Jet(NamedTuple):
    """Poses of a curve, and how they change with its parameter.

    Attributes:
        pose: Poses, a batch of N.
        rates: Twist for a parameter that grows by 1 a second, and its first two derivatives by the parameter, shape
            (3, N, 6).
    """

    pose: Pose
    rates: Array

    def twists(self, motion: Array) -> Array:
        """Twist, its rate and its jerk of a motion along the curve, by the chain rule.

        Args:
            motion: Parameter and its first three derivatives by time, shape (4, N).

        Returns:
            Array of shape (3, N, 6).
        """
        (first, second, third), (_, v, a, j) = self.rates, motion[:, :, None]
        return np.stack((first * v, second * v**2 + first * a, third * v**3 + 3.0 * second * v * a + first * j))


class Curve(Protocol):
    """A curve in the space of poses."""

    def at(self, parameter: Array) -> Jet:
        """Poses and their change at parameters of shape (N,)."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A straight way with a turn about a fixed axis; its parameter is the share of both that is done.

    Attributes:
        ends: The one segment that it is.
    """

    ends: Segments

    @classmethod
    def between(cls, pose: Pose) -> Line:
        """The line from the first pose of a batch to the last."""
        return cls(Segments.between(pose[np.array([0, -1])], QUINTIC))

    @property
    def moves(self) -> bool:
        """Whether it leads anywhere."""
        return bool(self.ends.moves[0])

    @property
    def direction(self) -> Array:
        """Twist for a parameter that grows by 1 a second, shape (6,)."""
        return np.concatenate((self.ends.move[0], self.ends.turn[0]))

    def parameter(self, pose: Pose) -> Array:
        """Parameters of poses that are on the line, shape (N,)."""
        move, turn = self.ends.move[0], self.ends.turn[0]
        if (extent := move @ move) >= (angle := float(np.linalg.norm(turn))) ** 2:
            along: Array = (pose.position - self.ends.start[0]) @ move / extent
            return along
        # half angles from -45 to 135 degrees: the sign of a quaternion means nothing
        half = np.arctan2(
            pose.quaternion @ self.ends.side_quaternion[0], pose.quaternion @ self.ends.start_quaternion[0]
        )
        turned: Array = (np.mod(half + 0.25 * np.pi, np.pi) - 0.25 * np.pi) * 2.0 / angle
        return turned

    def at(self, parameter: Array) -> Jet:
        """Poses and their change at parameters of shape (N,)."""
        rates = np.zeros((3, parameter.size, 6))
        rates[0] = self.direction
        half = (0.5 * np.linalg.norm(self.ends.turn[0]) * parameter)[:, None]
        quaternion = np.cos(half) * self.ends.start_quaternion + np.sin(half) * self.ends.side_quaternion
        position = self.ends.start + parameter[:, None] * self.ends.move
        return Jet(Pose.from_quaternion(position, quaternion), rates)


@dataclass(frozen=True, slots=True, eq=False)
class Bent:
    """A curve through samples, by splines of 5th degree in position and quaternion over its own length.

    Attributes:
        position: Spline of the position.
        quaternion: Spline of a quaternion that need not be of unit length.
    """

    position: Any
    quaternion: Any

    @classmethod
    def through(cls, pose: Pose, parameter: Array) -> Bent:
        """The splines through poses at ascending parameters; where these are too near each other, through some."""
        from scipy.interpolate import make_interp_spline  # takes longer to load than all the rest of motion

        least, knots = _NARROW * parameter[-1] / len(parameter), [0]
        for k in range(1, len(parameter)):
            if parameter[k] - parameter[knots[-1]] >= least:
                knots.append(k)
        knots[-1] = len(parameter) - 1
        degree = min(5, len(knots) - 1)
        aligned = np.sum(pose.quaternion[1:] * pose.quaternion[:-1], axis=1) >= 0.0
        sign = np.cumprod(np.append(1.0, np.where(aligned, 1.0, -1.0)))
        columns = (pose.position, pose.quaternion * sign[:, None])
        return cls(*(make_interp_spline(parameter[knots], values[knots], k=degree) for values in columns))

    def at(self, parameter: Array) -> Jet:
        """Poses and their change at parameters of shape (N,)."""
        place = [self.position(parameter, order) for order in range(4)]
        q = [self.quaternion(parameter, order) for order in range(4)]
        # with w = 2 vec(q' q*)/(q . q), whatever the length of q: numerator, denominator and their derivatives
        top = [2.0 * _vector(q[1], q[0]), 2.0 * _vector(q[2], q[0])]
        top.append(2.0 * _vector(q[3], q[0]) + 2.0 * _vector(q[2], q[1]))
        below = [np.sum(q[0] * q[k], axis=1)[:, None] * (1.0 if k == 0 else 2.0) for k in range(3)]
        below[2] += 2.0 * np.sum(q[1] * q[1], axis=1)[:, None]
        spin = top[0] / below[0]
        second = (top[1] - spin * below[1]) / below[0]
        third = (top[2] - 2.0 * second * below[1] - spin * below[2]) / below[0]
        rates = np.stack([np.hstack(pair) for pair in zip(place[1:], (spin, second, third), strict=True)])
        return Jet(Pose.from_quaternion(place[0], q[0]), rates)


def lengths(time: Array, twist: Array, twist_rate: Array) -> Array:
    """Length of the way at each sample, a radian counted as a meter, with its first two derivatives by time.

    Args:
        time: Times of the samples [s], shape (N,).
        twist: Twists, shape (N, 6), not zero but for the first and the last.
        twist_rate: Their rates, shape (N, 6).

    Returns:
        Array of shape (3, N); the length is good to the fourth order of the time step.

    Raises:
        InvalidValueError: If the platform stops in between: there it turns around.
    """
    speed = np.linalg.norm(twist, axis=1)
    inside = speed[1:-1] <= _STOPPED * speed.max()
    if inside.any():
        k = int(np.argmax(inside)) + 1
        raise InvalidValueError(
            f"the path at {time[k]:g} s",
            "without speed in the middle of a curve, where it turns around",
            "moves along a straight line, or without stops",
            "Make it of two paths, each from rest to rest.",
        )
    growth = np.sum(twist * twist_rate, axis=1) / np.where(speed > 0.0, speed, 1.0)
    growth[[0, -1]] = np.linalg.norm(twist_rate[[0, -1]], axis=1) * (1.0, -1.0)  # where it stands
    step = np.diff(time)
    pieces = 0.5 * step * (speed[1:] + speed[:-1]) + step**2 / 12.0 * (growth[:-1] - growth[1:])
    return np.stack((np.append(0.0, np.cumsum(pieces)), speed, growth))


def _vector(a: Array, b: Array) -> Array:
    """Vector part of the quaternion product a b*, scalars last, shapes (N, 4) -> (N, 3)."""
    vector: Array = b[:, 3:] * a[:, :3] - a[:, 3:] * b[:, :3] - np.cross(a[:, :3], b[:, :3])
    return vector
