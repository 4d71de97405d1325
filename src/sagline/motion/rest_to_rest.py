"""Rest-to-rest motions through waypoints, with polynomials of 5th or 7th degree."""

from __future__ import annotations

from math import comb, factorial
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import check_memory
from sagline.core.arrays import Array, Flags, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path
from sagline.robot.pose import Pose, PoseLike, pose_of


class RestProfile:
    """Polynomial that increases from 0 at s = 0 to 1 at s = 1, with k derivatives that are zero at both ends.

    The derivative of the polynomial is c u^k with u = s (1 - s). See docs/model.md, section 7.

    Attributes:
        order: Number k, >= 2: 2 for the quintic (no acceleration at the ends), 3 for the septic (also no jerk).
        slope: Constant c = (2 k + 1)!/(k!)^2, which makes the integral of c u^k equal to one.
        tail: Coefficients of the polynomial divided by s^(k + 1), in ascending powers of s.
    """

    def __init__(self, order: int) -> None:
        """Create the profile with the first `order` derivatives equal to zero at both ends."""
        scale = factorial(2 * order + 1) // factorial(order) ** 2
        self.order, self.slope = order, float(scale)
        self.tail = tuple(scale * (-1) ** i * comb(order, i) / (order + 1 + i) for i in range(order + 1))

    @property
    def peak_speed(self) -> float:
        """Largest derivative of the polynomial by s, which is c/4^k at s = 1/2."""
        return self.slope / 4.0**self.order

    @property
    def peak_acceleration(self) -> float:
        """Largest second derivative by s: c k u^(k - 1) sqrt(q) with q = (1 - 2 s)^2 = 1/(2 k - 1), u = (1 - q)/4."""
        k = self.order
        q = 1.0 / (2 * k - 1)
        return float(self.slope * k * (0.25 * (1.0 - q)) ** (k - 1) * np.sqrt(q))

    def share(self, s: Array) -> Array:
        """Value of the polynomial at s, which is the share of the segment that is covered."""
        total: Array = np.full_like(s, self.tail[-1])
        for coefficient in self.tail[-2::-1]:
            total = coefficient + s * total
        return s ** (self.order + 1) * total

    def rates(self, s: Array) -> tuple[Array, Array, Array]:
        """First, second and third derivative of the share by s; the first k derivatives are exactly 0 at both ends."""
        k = self.order
        u, bend = s * (1.0 - s), 1.0 - 2.0 * s
        second = self.slope * k * u ** (k - 1) * bend
        third = self.slope * k * u ** (k - 2) * ((k - 1) * bend * bend - 2.0 * u)
        return self.slope * u**k, second, third


QUINTIC: Final = RestProfile(2)  # 10 s^3 - 15 s^4 + 6 s^5
SEPTIC: Final = RestProfile(3)  # 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7

STILL = 1e-9  # [m] and [rad]; a smaller motion is a rounding error of a waypoint
BLOCK = 1 << 16  # number of samples per block; temporary arrays then take a few MB


class Segments:
    """S straight segments, each with a rotation about a fixed axis.

    Attributes:
        profile: Polynomial that gives the share of a segment over time.
        start: Position at the start [m], shape (S, 3).
        move: Displacement between start and end [m], shape (S, 3).
        turn: Rotation vector from start to end in world axes [rad], shape (S, 3).
        start_quaternion: Orientation q at the start, scalar last, shape (S, 4).
        side_quaternion: Quaternion product p of the unit rotation axis and q, shape (S, 4). The orientation after a
            rotation by the angle a is cos(a/2) q + sin(a/2) p.
    """

    def __init__(self, stops: Pose, profile: RestProfile) -> None:
        """Create the segments between consecutive poses of a batch."""
        self.profile, self.start, self.move = profile, stops.position[:-1], np.diff(stops.position, axis=0)
        self.start_quaternion = stops.quaternion[:-1]
        self.turn, self.side_quaternion = np.zeros_like(self.move), np.zeros_like(self.start_quaternion)
        if np.array_equal(self.start_quaternion, stops.quaternion[1:]):  # no rotation, so no axis is needed
            return
        from scipy.spatial.transform import Rotation  # the import would take a third of the load time of sagline

        first, second = stops.rotation[:-1], stops.rotation[1:]
        self.turn = (second * first.inv()).as_rotvec()
        angle = np.linalg.norm(self.turn, axis=1, keepdims=True)
        axis = np.where(angle > 0.0, self.turn / np.where(angle > 0.0, angle, 1.0), (0.0, 0.0, 1.0))
        # a quaternion without scalar part is a rotation by 180 degrees
        half_turn = Rotation.from_quat(np.hstack((axis, np.zeros_like(angle))))
        self.start_quaternion, self.side_quaternion = first.as_quat(), (half_turn * first).as_quat()

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
        """Shortest times (S,) [s] of the segments that satisfy all limits; the arguments have the order of `LIMITS`."""
        distance, angle = np.linalg.norm(self.move, axis=1), np.linalg.norm(self.turn, axis=1)
        if (same := (distance <= STILL) & (angle <= STILL)).any():
            k = int(np.argmax(same))
            allowed = "a different pose, because limits determine the time"
            step = "Remove this waypoint, or give durations=... to dwell at it."
            raise InvalidValueError(f"waypoints[{k + 1}]", f"the same as waypoints[{k}]", allowed, step)
        moving = self._least_time(distance, "moves", "speed", "m", speed, acceleration)
        turning = self._least_time(angle, "turns", "angular_speed", "rad", angular_speed, angular_acceleration)
        slower: Array = np.maximum(moving, turning)
        return slower

    def sampled(self, time: Array, ends: Array, durations: Array) -> Path:
        """Path with samples at `time` (N,) [s]; ends, durations: end times and durations (S,) of the segments [s]."""
        starts = np.concatenate(([0.0], ends[:-1]))
        half_angle = 0.5 * np.linalg.norm(self.turn, axis=1, keepdims=True)
        position, quaternion = np.empty((time.size, 3)), np.empty((time.size, 4))
        rates = np.empty((3, time.size, 6))  # twist, twist rate, jerk
        for low in range(0, time.size, BLOCK):
            block = slice(low, low + BLOCK)
            k = np.minimum(np.searchsorted(ends, time[block], side="right"), len(self) - 1)
            T = durations[k][:, None]
            s = np.minimum((time[block] - starts[k])[:, None] / T, 1.0)  # rounded start times can give s > 1
            share = self.profile.share(s)
            move, turn, turned = self.move[k], self.turn[k], share * half_angle[k]
            position[block] = self.start[k] + share * move
            quaternion[block] = np.cos(turned) * self.start_quaternion[k] + np.sin(turned) * self.side_quaternion[k]
            # The rotation axis is constant: angular velocity and acceleration are derivatives of the rotation vector.
            for order, by_share in enumerate(self.profile.rates(s)):
                rate = by_share / T ** (order + 1)
                rates[order, block, :3], rates[order, block, 3:] = rate * move, rate * turn
        rests, pose = np.append(0.0, ends), Pose.from_quaternion(position, quaternion)
        twist, twist_rate, jerk = locked(rates)
        return Path(time, pose, twist, twist_rate, jerk, rests)

    def _least_time(
        self, extent: Array, verb: str, name: str, unit: str, speed: float | None, acceleration: float | None
    ) -> Array:
        """Shortest times [s] for motions with the sizes `extent` [m or rad] within limits of speed and acceleration."""
        if speed is None and acceleration is None and (moves := extent > STILL).any():
            k = int(np.argmax(moves))
            motion = f"{verb} by {extent[k]:.6g} {unit} from waypoints[{k}] to waypoints[{k + 1}]"
            value, step = f"missing, while the path {motion}", f"Give {name}=..., or durations=... instead of limits."
            raise InvalidValueError(f"the limit of {name}", value, f"> 0 {unit}/s", step)
        fastest = _limit(speed, name, f"{unit}/s")
        strongest = _limit(acceleration, name.replace("speed", "acceleration"), f"{unit}/s^2")
        time: Array = np.maximum(
            self.profile.peak_speed * extent / fastest, np.sqrt(self.profile.peak_acceleration * extent / strongest)
        )
        return time


def _limit(value: float | None, item: str, unit: str) -> float:
    return np.inf if value is None else number(value, item, unit, above=0.0)


LIMITS = ("speed", "acceleration", "angular_speed", "angular_acceleration")
MOST_SAMPLES = 100_000_000  # 21 GB; a larger number suggests a wrong unit of a duration or rate
SAMPLE_BYTES = 300.0  # [bytes], peak memory per sample during the construction of a path
_CHECK_UNITS = "Check the units of durations, limits and rate."


def quintic_path(
    waypoints: PoseLike,
    *,
    durations: ArrayLike | None = None,
    speed: float | None = None,
    acceleration: float | None = None,
    angular_speed: float | None = None,
    angular_acceleration: float | None = None,
    rate: float = 100.0,
) -> Path:
    """Create a path through waypoints with rest at each waypoint and zero acceleration there.

    At the time s T of a segment of duration T, the platform has covered the share 10 s^3 - 15 s^4 + 6 s^5 of the
    segment. The platform moves along a straight line and rotates about a fixed axis. At both ends of a segment,
    velocity and acceleration are zero, but the jerk is not (see `septic_path`). A rotation by 180 degrees has the
    direction of scipy's `as_rotvec`.

    Give either `durations` or limits. Limits give each segment the shortest duration that satisfies all limits of
    translation and rotation.

    The samples are at the times 0, 1/rate, 2/rate, ... and at the end. The last time step can be shorter. A
    waypoint can be between two samples.

    Args:
        waypoints: At least two poses, as a batch or a sequence; or positions [m] of shape (N, 3), orientation identity.
        durations: Time of each segment [s], shape () or (N - 1,), > 0. Two equal consecutive waypoints give a dwell.
        speed: Limit of the origin's speed [m/s], > 0.
        acceleration: Limit of the origin's acceleration [m/s^2], > 0.
        angular_speed: Limit of the angular speed [rad/s], > 0.
        angular_acceleration: Limit of the angular acceleration [rad/s^2], > 0.
        rate: Samples per second [1/s], > 0.

    Returns:
        Path that starts at time 0. The jerk jumps at every waypoint; a sample there has the jerk of the next segment.

    Raises:
        InvalidValueError: If a value is out of range; if durations and limits are both given or both missing; if a
            limit is missing for the translation or rotation of a segment; if a segment has no sample between its ends;
            if two consecutive waypoints of a path with limits are equal.

    Source:
        docs/model.md, section 7.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (4, 3, 1.5)], speed=1.5)  # 5 m
        >>> peak = path.twist[:, :3].max()
        >>> print(f"{path.duration} s, {len(path)} samples, peak {peak:.1f} m/s along x")
        6.25 s, 626 samples, peak 1.2 m/s along x
    """
    limits = (speed, acceleration, angular_speed, angular_acceleration)
    return _rest_to_rest(QUINTIC, waypoints, durations, limits, rate)


def septic_path(
    waypoints: PoseLike,
    *,
    durations: ArrayLike | None = None,
    speed: float | None = None,
    acceleration: float | None = None,
    angular_speed: float | None = None,
    angular_acceleration: float | None = None,
    rate: float = 100.0,
) -> Path:
    """Create a path through waypoints with rest at each waypoint and continuous jerk.

    The path is as for `quintic_path`, but with the share 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7. Velocity, acceleration and
    jerk are zero at both ends of each segment, so that forces and motor torques do not change suddenly. For the same
    duration, the peak speed is larger than for `quintic_path` by the factor 7/6, and the peak acceleration by the
    factor 1.30.

    Args:
        waypoints: At least two poses, as a batch or a sequence; or positions [m] of shape (N, 3), orientation identity.
        durations: Time of each segment [s], shape () or (N - 1,), > 0. Two equal consecutive waypoints give a dwell.
        speed: Limit of the origin's speed [m/s], > 0.
        acceleration: Limit of the origin's acceleration [m/s^2], > 0.
        angular_speed: Limit of the angular speed [rad/s], > 0.
        angular_acceleration: Limit of the angular acceleration [rad/s^2], > 0.
        rate: Samples per second [1/s], > 0.

    Returns:
        Path that starts at time 0.

    Raises:
        InvalidValueError: In the cases listed for `quintic_path`.

    Source:
        docs/model.md, section 7.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> path = sl.septic_path([(0, 0, 1.5), (4, 3, 1.5)], durations=6.25)
        >>> peak = np.linalg.norm(path.twist[:, :3], axis=1).max()
        >>> print(path.jerk[[0, -1]].any(), f"{peak:.2f} m/s")
        False 1.75 m/s
    """
    limits = (speed, acceleration, angular_speed, angular_acceleration)
    return _rest_to_rest(SEPTIC, waypoints, durations, limits, rate)


def _rest_to_rest(
    profile: RestProfile,
    waypoints: PoseLike,
    durations: ArrayLike | None,
    limits: tuple[float | None, float | None, float | None, float | None],
    rate: float,
) -> Path:
    """Path of segments with the profile `profile`, and with durations or with limits in the order of `LIMITS`."""
    segments = Segments(_as_pose(waypoints), profile)
    given = [name for name, value in zip(LIMITS, limits, strict=True) if value is not None]
    if (durations is None) == (not given):
        value = f"given by durations and {given[0]}" if given else "missing"
        step = "Omit one of the two." if given else "Give durations=... or speed=..."
        allowed = "either durations, or limits of speed and acceleration"
        raise InvalidValueError("the timing of the path", value, allowed, step)
    times = segments.durations_within(*limits) if durations is None else _checked_durations(durations, len(segments))
    ends = np.cumsum(times)
    grid = time_grid(float(ends[-1]), rate)
    _check_sampled(grid, ends, times, segments.moves)
    return segments.sampled(grid, ends, times)


def _as_pose(waypoints: PoseLike) -> Pose:
    stops = pose_of(waypoints, "waypoints")
    if stops.shape < (2,):
        value, step = f"of shape {stops.shape}", "Give at least two poses."
        raise InvalidValueError("waypoints", value, "shape (N,), N >= 2", step)
    return stops


def _checked_durations(durations: ArrayLike, segments: int) -> Array:
    given = checked(durations, "durations", "s", above=0.0)
    if given.shape not in ((), (segments,)):
        allowed = f"one number, or one for each of the {segments} segments"
        step = "Give one duration from each waypoint to the next."
        raise InvalidValueError("durations", f"of shape {given.shape}", allowed, step)
    return np.broadcast_to(given, (segments,))


def _check_sampled(grid: Array, ends: Array, times: Array, moves: Flags) -> None:
    """Refuse a path in which a moving segment has no sample between its ends, so that its motion would be lost."""
    rounding = 1e-9 * ends[-1]
    inside = np.searchsorted(grid, ends - rounding) - np.searchsorted(grid, ends - times + rounding)
    if (unseen := (inside < 1) & moves).any():
        k = int(np.argmax(unseen))
        item, value = (
            f"the time from waypoints[{k}] to waypoints[{k + 1}]",
            f"{times[k]:.4g} s, without a sample inside",
        )
        step = f"{_CHECK_UNITS[:-1]}; or give a higher rate."
        raise InvalidValueError(item, value, "more than the time between two samples", step)


def time_grid(total: float, rate: float) -> Array:
    """Sample times (N,) [s]: 0, 1/rate, 2/rate, ... and the end time `total` [s]; rate [1/s]."""
    rate = number(rate, "rate", "1/s", above=0.0)
    steps = total * rate
    if steps > MOST_SAMPLES:
        value = f"{steps:.3g} ({total:g} s at {rate:g} 1/s)"
        raise InvalidValueError("the number of samples", value, f"<= {MOST_SAMPLES:g}", _CHECK_UNITS)
    check_memory(f"a path of {steps:.4g} samples", SAMPLE_BYTES * steps, _CHECK_UNITS)
    # if the end time is a multiple of 1/rate, except for rounding, no additional sample is needed
    last = round(steps) if abs(steps - round(steps)) <= 1e-9 * steps else int(np.ceil(steps))
    return np.append(np.arange(last) / rate, total)


HEIGHT = 1.5  # [m], height of the platform in the article
STOPS = ((0.0, 0.0), (5.0, 3.5), (-5.0, 3.5), (-5.0, -3.5), (5.0, -3.5), (5.0, 3.5), (0.0, 0.0))  # x, y [m]
DURATIONS = (9.0, 11.0, 10.0, 11.0, 10.0, 9.0)  # durations of the segments [s]


def article_path(rate: float = 100.0) -> Path:
    """Create the planar motion of the article at z = 1.5 m, without rotation, with rest at each waypoint.

    The article states only the height and the zero angles (Figure 18). All other values are assumed. The path leads
    from the center to the corner (+5, +3.5) m, counter-clockwise around the rectangle x = +-5 m, y = +-3.5 m, and back
    to the center. The motion takes 60 s, with a peak acceleration of 0.48 m/s^2 and a peak speed of 1.70 m/s.

    Args:
        rate: Samples per second [1/s], > 0; 100 gives 6,001 poses.

    Returns:
        Path of 60 s.

    Raises:
        InvalidValueError: If the rate is not positive.

    Examples:
        >>> import sagline as sl
        >>> path = sl.article_path()
        >>> len(path), float(path.time[-1])
        (6001, 60.0)

    Source:
        Gia Luan & Truong Thinh, Appl. Sci. 2020, 10(15), 5318, section 7.
    """
    return quintic_path([(x, y, HEIGHT) for x, y in STOPS], durations=DURATIONS, rate=rate)
