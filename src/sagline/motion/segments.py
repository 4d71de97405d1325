"""Straight segments with a rotation about a fixed axis, and their rest-to-rest polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from math import factorial
from typing import Final

import numpy as np

from sagline.core.arrays import Array, Flags, locked, number
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path
from sagline.robot.pose import Pose


@dataclass(frozen=True, slots=True)
class RestProfile:
    """Polynomial that increases from 0 to 1 for s from 0 to 1. Its first k derivatives vanish at both ends.

    The derivative of the polynomial is c u^k with u = s (1 - s). The degree of the polynomial is 2 k + 1.

    Attributes:
        order: k, >= 2. It is 2 for the quintic (no acceleration at the ends) and 3 for the septic (also no jerk).
        tail: Coefficients of the polynomial divided by s^(k + 1), constant first.

    Source:
        c u^k integrated by the binomial theorem; docs/model.md, section 7.
    """

    order: int
    tail: tuple[float, ...]

    @classmethod
    def of_order(cls, order: int) -> RestProfile:
        """Create the profile whose first `order` derivatives vanish at both ends."""
        k = order
        scale = factorial(2 * k + 1) // factorial(k) ** 2
        binomials = (factorial(k) // factorial(i) // factorial(k - i) for i in range(k + 1))
        return cls(k, tuple(scale * (-1) ** i * b / (k + 1 + i) for i, b in enumerate(binomials)))

    @property
    def slope(self) -> float:
        """Constant c = (2 k + 1)!/(k!)^2, for which the integral of c u^k is one."""
        return float(factorial(2 * self.order + 1) // factorial(self.order) ** 2)

    @property
    def peak_speed(self) -> float:
        """Largest derivative with respect to s, at s = 1/2: c/4^k."""
        return self.slope / 4.0**self.order

    @property
    def peak_acceleration(self) -> float:
        """Largest second derivative: c k u^(k - 1) sqrt(q) with q = (1 - 2 s)^2 = 1/(2 k - 1) and u = (1 - q)/4."""
        k = self.order
        q = 1.0 / (2 * k - 1)
        return float(self.slope * k * (0.25 * (1.0 - q)) ** (k - 1) * np.sqrt(q))

    def share(self, s: Array) -> Array:
        """Share of the segment covered at s."""
        total: Array = np.full_like(s, self.tail[-1])
        for coefficient in self.tail[-2::-1]:
            total = coefficient + s * total
        return s ** (self.order + 1) * total

    def rates(self, s: Array) -> tuple[Array, Array, Array]:
        """First to third derivatives of the share with respect to s. The first k are exactly 0 at both ends."""
        k = self.order
        u, bend = s * (1.0 - s), 1.0 - 2.0 * s
        second = self.slope * k * u ** (k - 1) * bend
        third = self.slope * k * u ** (k - 2) * ((k - 1) * bend * bend - 2.0 * u)
        return self.slope * u**k, second, third


QUINTIC: Final = RestProfile.of_order(2)  # 10 s^3 - 15 s^4 + 6 s^5
SEPTIC: Final = RestProfile.of_order(3)  # 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7


STILL = 1e-9  # [m] and [rad]; a smaller motion counts as a rounding error of a waypoint
BLOCK = 1 << 16  # samples per block, so that temporary arrays have only a few MB


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """S straight segments, each with a rotation about a fixed axis.

    Attributes:
        profile: Profile from rest to rest.
        start: Position at the start [m], shape (S, 3).
        move: Displacement to the end [m], shape (S, 3).
        turn: Rotation vector from start to end in world axes [rad], shape (S, 3).
        start_quaternion: Orientation q at the start, scalar last, shape (S, 4).
        side_quaternion: Product `side` of the unit rotation axis and q, shape (S, 4). The orientation after a rotation
            by the angle a is cos(a/2) q + sin(a/2) side.
    """

    profile: RestProfile
    start: Array
    move: Array
    turn: Array
    start_quaternion: Array
    side_quaternion: Array

    @classmethod
    def between(cls, stops: Pose, profile: RestProfile) -> Segments:
        """Create the segments between consecutive poses of a batch."""
        move, kept = np.diff(stops.position, axis=0), stops.quaternion[:-1]
        if np.array_equal(kept, stops.quaternion[1:]):  # without a rotation, the axis is not needed
            return cls(profile, stops.position[:-1], move, np.zeros_like(move), kept, np.zeros_like(kept))
        from scipy.spatial.transform import Rotation  # this import takes a third of the load time of sagline

        first, second = stops.rotation[:-1], stops.rotation[1:]
        turn = (second * first.inv()).as_rotvec()
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        axis = np.where(angle > 0.0, turn / np.where(angle > 0.0, angle, 1.0), (0.0, 0.0, 1.0))
        # a pure quaternion is a rotation by 180 degrees
        half_turn = Rotation.from_quat(np.hstack((axis, np.zeros_like(angle))))
        side = (half_turn * first).as_quat()
        return cls(profile, stops.position[:-1], move, turn, first.as_quat(), side)

    def __len__(self) -> int:
        """Number of segments S."""
        return len(self.start)

    @property
    def moves(self) -> Flags:
        """True for segments that translate or rotate, shape (S,)."""
        moves: Flags = np.linalg.norm(np.hstack((self.move, self.turn)), axis=1) > STILL
        return moves

    def durations_within(
        self,
        speed: float | None,
        acceleration: float | None,
        angular_speed: float | None,
        angular_acceleration: float | None,
    ) -> Array:
        """Shortest times of the segments that satisfy all limits.

        Shapes: speed [m/s]; acceleration [m/s^2]; angular_speed [rad/s]; angular_acceleration [rad/s^2]; returns
        (S,) [s].
        """
        distance, angle = np.linalg.norm(self.move, axis=1), np.linalg.norm(self.turn, axis=1)
        same = np.flatnonzero((distance <= STILL) & (angle <= STILL))
        if same.size:
            k = int(same[0])
            raise InvalidValueError(
                f"waypoints[{k + 1}]",
                f"the same as waypoints[{k}]",
                "a different pose, because limits determine the time",
                "Remove this waypoint, or give durations=... to dwell at it.",
            )
        moving = self._least_time(distance, "moves", "speed", "m", speed, acceleration)
        turning = self._least_time(angle, "turns", "angular_speed", "rad", angular_speed, angular_acceleration)
        slower: Array = np.maximum(moving, turning)
        return slower

    def sampled(self, time: Array, ends: Array, durations: Array) -> Path:
        """Compute the path at given times.

        Shapes: time (N,) [s]; ends (S,) [s]; durations (S,) [s].
        """
        starts = np.concatenate(([0.0], ends[:-1]))
        half_angle = 0.5 * np.linalg.norm(self.turn, axis=1, keepdims=True)
        position, quaternion = np.empty((time.size, 3)), np.empty((time.size, 4))
        rates = np.empty((3, time.size, 6))  # twist and its first and second time derivatives
        for low in range(0, time.size, BLOCK):
            block = slice(low, low + BLOCK)
            k = np.minimum(np.searchsorted(ends, time[block], side="right"), len(self) - 1)
            T = durations[k][:, None]
            s = np.minimum((time[block] - starts[k])[:, None] / T, 1.0)  # the rounded start times may give more than 1
            share = self.profile.share(s)
            move, turn, turned = self.move[k], self.turn[k], share * half_angle[k]
            position[block] = self.start[k] + share * move
            quaternion[block] = np.cos(turned) * self.start_quaternion[k] + np.sin(turned) * self.side_quaternion[k]
            # because the axis is fixed, the derivatives of the rotation vector are the exact derivatives of the
            # orientation
            for order, by_share in enumerate(self.profile.rates(s)):
                rate = by_share / T ** (order + 1)
                rates[order, block, :3], rates[order, block, 3:] = rate * move, rate * turn
        rests, pose = np.append(0.0, ends), Pose.from_quaternion(position, quaternion)
        twist, twist_rate, jerk = locked(rates)
        return Path(time, pose, twist, twist_rate, jerk, rests)

    def _least_time(
        self, extent: Array, verb: str, name: str, unit: str, speed: float | None, acceleration: float | None
    ) -> Array:
        """Shortest times [s] for motions of given extent [m or rad] with two limits (None: no limit)."""
        if speed is None and acceleration is None and (extent > STILL).any():
            k = int(np.argmax(extent > STILL))
            raise InvalidValueError(
                f"the limit of {name}",
                f"missing, while the path {verb} by {extent[k]:.6g} {unit} from waypoints[{k}] to waypoints[{k + 1}]",
                f"> 0 {unit}/s",
                f"Give {name}=..., or durations=... instead of limits.",
            )
        fastest = _limit(speed, name, f"{unit}/s")
        strongest = _limit(acceleration, name.replace("speed", "acceleration"), f"{unit}/s^2")
        time: Array = np.maximum(
            self.profile.peak_speed * extent / fastest, np.sqrt(self.profile.peak_acceleration * extent / strongest)
        )
        return time


def _limit(value: float | None, item: str, unit: str) -> float:
    return np.inf if value is None else number(value, item, unit, above=0.0)
