"""Rest-to-rest motion through waypoints by 5th-order polynomials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, checked
from sagline.errors import InvalidValueError
from sagline.motion.path import Path
from sagline.robot.pose import Pose

PEAK_SPEED = 15.0 / 8.0  # largest slope of 10 s^3 - 15 s^4 + 6 s^5, at s = 1/2
PEAK_ACCELERATION = 10.0 / np.sqrt(3.0)  # largest second derivative, at s = 1/2 - sqrt(3)/6
STILL = 1e-9  # m and rad: a shorter move is the rounding of a waypoint
MOST_SAMPLES = 100_000_000  # 16 GB of path: beyond it a duration or the rate has the wrong unit
BLOCK = 1 << 16  # samples worked on at once; keeps the temporaries at a few MB


def quintic_path(
    waypoints: Pose | Sequence[Pose] | ArrayLike,
    *,
    durations: ArrayLike | None = None,
    speed: float | None = None,
    acceleration: float | None = None,
    angular_speed: float | None = None,
    angular_acceleration: float | None = None,
    rate: float = 100.0,
) -> Path:
    """Move from waypoint to waypoint, each time from rest to rest.

    Within a segment of duration T the share 10 s^3 - 15 s^4 + 6 s^5 (s = time/T) of the way is done: the position moves
    along the straight line, the orientation turns about one fixed axis, and velocity and acceleration vanish at both
    ends. A turn of exactly 180 degrees has two equally short ways; the one of scipy's `Rotation.as_rotvec` is taken.

    Time is given either by `durations` or by limits. With limits, each segment takes the shortest time in which all of
    them hold, the slower of translation and turn deciding for both.

    The samples lie at 0, 1/rate, 2/rate, ... and at the very end, whatever the step before it. A waypoint between two
    of those times is passed between two samples.

    Args:
        waypoints: At least two poses, as a batch or a sequence; or positions [m] of shape (N, 3), orientation identity.
        durations: Time of each segment [s], shape () or (N - 1,), > 0. A waypoint given twice is a dwell.
        speed: Limit of the origin's speed [m/s], > 0.
        acceleration: Limit of the origin's acceleration [m/s^2], > 0.
        angular_speed: Limit of the angular speed [rad/s], > 0.
        angular_acceleration: Limit of the angular acceleration [rad/s^2], > 0.
        rate: Samples per second [1/s], > 0.

    Returns:
        Path that starts at time 0.

    Raises:
        InvalidValueError: If a value is out of range, both or neither of durations and limits are given, a segment
            moves or turns without a limit on it, or two consecutive waypoints are the same while limits are given.
    """
    segments = _Segments.between(_as_pose(waypoints))
    limits = {
        "speed": speed,
        "acceleration": acceleration,
        "angular_speed": angular_speed,
        "angular_acceleration": angular_acceleration,
    }
    given = [name for name, value in limits.items() if value is not None]
    if (durations is None) == (not given):
        raise InvalidValueError(
            "the timing of the path",
            f"given by durations and {given[0]}" if given else "missing",
            "either durations, or limits of speed and acceleration",
            "Leave one of them out." if given else "Give durations=... or speed=...",
        )
    times = segments.durations_within(**limits) if durations is None else _checked_durations(durations, len(segments))
    ends = np.cumsum(times)
    return segments.sampled(_time_grid(float(ends[-1]), rate), ends, times)


@dataclass(frozen=True, slots=True, eq=False)
class _Segments:
    """S straight moves with a turn about a fixed axis.

    Attributes:
        start: Position at the beginning [m], shape (S, 3).
        move: Displacement to the end [m], shape (S, 3).
        turn: Rotation vector to the end in world axes [rad], shape (S, 3).
        start_quaternion: Orientation q at the beginning, scalar last, shape (S, 4).
        side_quaternion: The quaternion product of the unit axis of the turn and q, shape (S, 4): a turn by the angle a
            leads to cos(a/2) q + sin(a/2) side.
    """

    start: Array
    move: Array
    turn: Array
    start_quaternion: Array
    side_quaternion: Array

    @classmethod
    def between(cls, stops: Pose) -> _Segments:
        move, kept = np.diff(stops.position, axis=0), stops.quaternion[:-1]
        if np.array_equal(kept, stops.quaternion[1:]):  # nothing turns: the axis is never asked for
            return cls(stops.position[:-1], move, np.zeros_like(move), kept, np.zeros_like(kept))
        from scipy.spatial.transform import Rotation  # takes a third of the time that sagline takes to load

        first, second = stops.rotation[:-1], stops.rotation[1:]
        turn = (second * first.inv()).as_rotvec()
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        axis = np.where(angle > 0.0, turn / np.where(angle > 0.0, angle, 1.0), (0.0, 0.0, 1.0))
        half_turn = Rotation.from_quat(np.hstack((axis, np.zeros_like(angle))))  # a pure quaternion is half a turn
        side = (half_turn * first).as_quat()
        return cls(stops.position[:-1], move, turn, first.as_quat(), side)

    def __len__(self) -> int:
        return len(self.start)

    def durations_within(
        self,
        speed: float | None,
        acceleration: float | None,
        angular_speed: float | None,
        angular_acceleration: float | None,
    ) -> Array:
        """Shortest times [s] that keep all limits, shape (S,)."""
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
        moving = _least_time(distance, "moves", "speed", "m", speed, acceleration)
        turning = _least_time(angle, "turns", "angular_speed", "rad", angular_speed, angular_acceleration)
        slower: Array = np.maximum(moving, turning)
        return slower

    def sampled(self, time: Array, ends: Array, durations: Array) -> Path:
        """The path at the given times [s]; segment k takes durations[k] and is over at ends[k]."""
        starts = np.concatenate(([0.0], ends[:-1]))
        half_angle = 0.5 * np.linalg.norm(self.turn, axis=1, keepdims=True)
        position, quaternion = np.empty((time.size, 3)), np.empty((time.size, 4))
        twist, twist_rate = np.empty((time.size, 6)), np.empty((time.size, 6))
        for low in range(0, time.size, BLOCK):
            block = slice(low, low + BLOCK)
            k = np.minimum(np.searchsorted(ends, time[block], side="right"), len(self) - 1)
            T = durations[k][:, None]
            s = np.minimum((time[block] - starts[k])[:, None] / T, 1.0)  # rounding of starts may pass 1
            share = s**3 * (10.0 + s * (6.0 * s - 15.0))
            share_rate = 30.0 * (s * (1.0 - s)) ** 2 / T
            share_curvature = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / T**2
            move, turn, turned = self.move[k], self.turn[k], share * half_angle[k]
            position[block] = self.start[k] + share * move
            quaternion[block] = np.cos(turned) * self.start_quaternion[k] + np.sin(turned) * self.side_quaternion[k]
            # The axis is fixed, so the derivatives of the rotation vector are those of the orientation, exactly.
            twist[block, :3], twist[block, 3:] = share_rate * move, share_rate * turn
            twist_rate[block, :3], twist_rate[block, 3:] = share_curvature * move, share_curvature * turn
        return Path(time, Pose.from_quaternion(position, quaternion), twist, twist_rate)


def _as_pose(waypoints: Pose | Sequence[Pose] | ArrayLike) -> Pose:
    if isinstance(waypoints, Pose):
        stops = waypoints
    elif isinstance(waypoints, list | tuple) and waypoints and all(isinstance(w, Pose) for w in waypoints):
        position = np.vstack([w.position for w in waypoints])
        stops = Pose.from_quaternion(position, np.vstack([w.quaternion for w in waypoints]))
    else:
        position = checked(cast(ArrayLike, waypoints), "waypoints", "m", shape=(None, 3))
        stops = Pose.from_euler(position, 0.0, 0.0, 0.0)
    if stops.shape < (2,):
        raise InvalidValueError(
            "waypoints", f"of shape {stops.shape}", "shape (N,), N >= 2", "Give at least two poses."
        )
    return stops


def _checked_durations(durations: ArrayLike, segments: int) -> Array:
    given = checked(durations, "durations", "s", above=0.0)
    if given.shape not in ((), (segments,)):
        raise InvalidValueError(
            "durations",
            f"of shape {given.shape}",
            f"one number, or one for each of the {segments} segments",
            "Give one duration from each waypoint to the next.",
        )
    return np.broadcast_to(given, (segments,))


def _least_time(
    extent: Array, verb: str, name: str, unit: str, speed: float | None, acceleration: float | None
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
    time: Array = np.maximum(PEAK_SPEED * extent / fastest, np.sqrt(PEAK_ACCELERATION * extent / strongest))
    return time


def _limit(value: float | None, item: str, unit: str) -> float:
    return np.inf if value is None else _positive(value, item, unit)


def _positive(value: float, item: str, unit: str) -> float:
    number = checked(value, item, unit, above=0.0)
    if number.ndim:
        raise InvalidValueError(item, f"of shape {number.shape}", "one number", f"Give one {item} for the whole path.")
    return float(number)


def _time_grid(total: float, rate: float) -> Array:
    """Times k/rate from 0 to the total time, and the total itself as the last [s]."""
    steps = total * _positive(rate, "rate", "1/s")
    if steps > MOST_SAMPLES:
        raise InvalidValueError(
            "the number of samples",
            f"{steps:.3g} ({total:g} s at {rate:g} 1/s)",
            f"<= {MOST_SAMPLES:g}",
            "Check the units of durations, limits and rate.",
        )
    # A total within rounding of a multiple of 1/rate gets no extra sample.
    last = round(steps) if abs(steps - round(steps)) <= 1e-9 * steps else int(np.ceil(steps))
    time = np.arange(last + 1) / rate
    time[-1] = total
    return time
