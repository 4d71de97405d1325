"""Straight moves with a turn about a fixed axis, one after the other, each from rest to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arrays import Array, Flags, locked, number
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path
from sagline.motion.profile import Profile
from sagline.robot.pose import Pose

STILL = 1e-9  # m and rad: a shorter move is the rounding of a waypoint
BLOCK = 1 << 16  # samples worked on at once; keeps the temporaries at a few MB


@dataclass(frozen=True, slots=True, eq=False)
class Segments:
    """S straight moves with a turn about a fixed axis.

    Attributes:
        profile: How each of them gets from rest to rest.
        start: Position at the beginning [m], shape (S, 3).
        move: Displacement to the end [m], shape (S, 3).
        turn: Rotation vector to the end in world axes [rad], shape (S, 3).
        start_quaternion: Orientation q at the beginning, scalar last, shape (S, 4).
        side_quaternion: The quaternion product of the unit axis of the turn and q, shape (S, 4): a turn by the angle a
            leads to cos(a/2) q + sin(a/2) side.
    """

    profile: Profile
    start: Array
    move: Array
    turn: Array
    start_quaternion: Array
    side_quaternion: Array

    @classmethod
    def between(cls, stops: Pose, profile: Profile) -> Segments:
        """The segments from each pose of a batch to the next.

        Args:
            stops: The waypoints, a batch of S + 1 poses.
            profile: How to get from each to the next.

        Returns:
            S segments.
        """
        move, kept = np.diff(stops.position, axis=0), stops.quaternion[:-1]
        if np.array_equal(kept, stops.quaternion[1:]):  # nothing turns: the axis is never asked for
            return cls(profile, stops.position[:-1], move, np.zeros_like(move), kept, np.zeros_like(kept))
        from scipy.spatial.transform import Rotation  # takes a third of the time that sagline takes to load

        first, second = stops.rotation[:-1], stops.rotation[1:]
        turn = (second * first.inv()).as_rotvec()
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        axis = np.where(angle > 0.0, turn / np.where(angle > 0.0, angle, 1.0), (0.0, 0.0, 1.0))
        half_turn = Rotation.from_quat(np.hstack((axis, np.zeros_like(angle))))  # a pure quaternion is half a turn
        side = (half_turn * first).as_quat()
        return cls(profile, stops.position[:-1], move, turn, first.as_quat(), side)

    def __len__(self) -> int:
        """Number of segments S."""
        return len(self.start)

    @property
    def moves(self) -> Flags:
        """Whether each segment moves or turns, shape (S,)."""
        moves: Flags = np.linalg.norm(np.hstack((self.move, self.turn)), axis=1) > STILL
        return moves

    def durations_within(
        self,
        speed: float | None,
        acceleration: float | None,
        angular_speed: float | None,
        angular_acceleration: float | None,
    ) -> Array:
        """Shortest times that keep all limits.

        Args:
            speed: Limit of the origin's speed [m/s], or None.
            acceleration: Limit of the origin's acceleration [m/s^2], or None.
            angular_speed: Limit of the angular speed [rad/s], or None.
            angular_acceleration: Limit of the angular acceleration [rad/s^2], or None.

        Returns:
            Times [s], shape (S,).

        Raises:
            InvalidValueError: If a limit is not positive, a segment moves or turns without a limit on it, or goes
                nowhere.
        """
        distance, angle = np.linalg.norm(self.move, axis=1), np.linalg.norm(self.turn, axis=1)
        same = np.flatnonzero((distance <= STILL) & (angle <= STILL))
        if same.size:
            k = int(same[0])
            raise InvalidValueError(
                f"waypoints[{k + 1}]",
                f"the same as waypoints[{k}]",
                "a different pose, where limits give the time",
                "Remove it, or give durations=... to dwell there.",
            )
        moving = self._least_time(distance, "moves", "speed", "m", speed, acceleration)
        turning = self._least_time(angle, "turns", "angular_speed", "rad", angular_speed, angular_acceleration)
        slower: Array = np.maximum(moving, turning)
        return slower

    def sampled(self, time: Array, ends: Array, durations: Array) -> Path:
        """The path at given times.

        Args:
            time: Times of the samples [s], shape (N,).
            ends: When each segment is over [s], shape (S,).
            durations: How long each takes [s], shape (S,).

        Returns:
            Path with its jerk; a sample between two segments belongs to the later one.
        """
        starts = np.concatenate(([0.0], ends[:-1]))
        half_angle = 0.5 * np.linalg.norm(self.turn, axis=1, keepdims=True)
        position, quaternion = np.empty((time.size, 3)), np.empty((time.size, 4))
        rates = np.empty((3, time.size, 6))  # twist, its rate, its jerk
        for low in range(0, time.size, BLOCK):
            block = slice(low, low + BLOCK)
            k = np.minimum(np.searchsorted(ends, time[block], side="right"), len(self) - 1)
            T = durations[k][:, None]
            s = np.minimum((time[block] - starts[k])[:, None] / T, 1.0)  # rounding of starts may pass 1
            share = self.profile.share(s)
            move, turn, turned = self.move[k], self.turn[k], share * half_angle[k]
            position[block] = self.start[k] + share * move
            quaternion[block] = np.cos(turned) * self.start_quaternion[k] + np.sin(turned) * self.side_quaternion[k]
            # The axis is fixed, so the derivatives of the rotation vector are those of the orientation, exactly.
            for order, by_share in enumerate(self.profile.rates(s)):
                rate = by_share / T ** (order + 1)
                rates[order, block, :3], rates[order, block, 3:] = rate * move, rate * turn
        rests, pose = np.append(0.0, ends), Pose.from_quaternion(position, quaternion)
        twist, twist_rate, jerk = locked(rates)
        return Path(time, pose, twist, twist_rate, jerk, rests)

    def _least_time(
        self, extent: Array, verb: str, name: str, unit: str, speed: float | None, acceleration: float | None
    ) -> Array:
        """Shortest time [s] for a move or turn of the given extent [m or rad] under two limits, None for no limit."""
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
