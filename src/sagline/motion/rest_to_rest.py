"""Rest-to-rest motion through waypoints with polynomials of 5th or 7th degree."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arrays import Array, Flags, checked, number
from sagline.core.errors import InvalidValueError
from sagline.core.memory import check_memory
from sagline.motion.path import Path
from sagline.motion.segments import QUINTIC, SEPTIC, RestProfile, Segments
from sagline.robot.pose import Pose, PoseLike, pose_of

LIMITS = ("speed", "acceleration", "angular_speed", "angular_acceleration")
MOST_SAMPLES = 100_000_000  # 21 GB; a larger number probably comes from a wrong unit of a duration or of the rate
SAMPLE_BYTES = 300.0  # peak memory per sample during construction of the path


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
    """Path through waypoints, with rest at each waypoint.

    In a segment of duration T, the platform has covered the share 10 s^3 - 15 s^4 + 6 s^5 of the segment at the time s
    T. It moves along a straight line and rotates about a fixed axis. Velocity and acceleration vanish at both ends; the
    jerk does not (see `septic_path`). For a rotation of exactly 180 degrees, both directions are equally short. The
    path uses the direction of scipy's `Rotation.as_rotvec`.

    Give either `durations` or limits. With limits, each segment has the shortest duration that satisfies all limits of
    translation and rotation.

    The samples are at 0, 1/rate, 2/rate, ... and at the end time. The last step can therefore be shorter. A waypoint
    can be between two samples.

    Args:
        waypoints: At least two poses, as a batch or a sequence; or positions [m] of shape (N, 3), orientation identity.
        durations: Time of each segment [s], shape () or (N - 1,), > 0. Two equal consecutive waypoints give a dwell.
        speed: Limit of the origin's speed [m/s], > 0.
        acceleration: Limit of the origin's acceleration [m/s^2], > 0.
        angular_speed: Limit of the angular speed [rad/s], > 0.
        angular_acceleration: Limit of the angular acceleration [rad/s^2], > 0.
        rate: Samples per second [1/s], > 0.

    Returns:
        Path that starts at time 0. Its jerk is discontinuous at every waypoint. The jerk of a sample at a waypoint is
        that of the next segment.

    Raises:
        InvalidValueError: If a value is out of range, durations and limits are both given or both missing, a limit is
            missing for the translation or rotation of a segment, a segment has no sample between its ends, or two
            consecutive waypoints are equal in a path with limits.

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
    """Path through waypoints, with rest at each waypoint and continuous jerk.

    The function is the same as `quintic_path`, but the share is 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7. Velocity,
    acceleration and jerk are zero at both ends of each segment, so that cables and winches have no sudden changes. For
    the same duration, the peak speed is 7/6 of the peak speed of `quintic_path`, and the peak acceleration is 1.30
    times as large.

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
    """Path of segments with one profile and with given durations or limits, which have the order of `LIMITS`."""
    segments = Segments.between(_as_pose(waypoints), profile)
    given = [name for name, value in zip(LIMITS, limits, strict=True) if value is not None]
    if (durations is None) == (not given):
        raise InvalidValueError(
            "the timing of the path",
            f"given by durations and {given[0]}" if given else "missing",
            "either durations, or limits of speed and acceleration",
            "Omit one of the two." if given else "Give durations=... or speed=...",
        )
    times = segments.durations_within(*limits) if durations is None else _checked_durations(durations, len(segments))
    ends = np.cumsum(times)
    grid = time_grid(float(ends[-1]), rate)
    _check_sampled(grid, ends, times, segments.moves)
    return segments.sampled(grid, ends, times)


def _as_pose(waypoints: PoseLike) -> Pose:
    stops = pose_of(waypoints, "waypoints")
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


def _check_sampled(grid: Array, ends: Array, times: Array, moves: Flags) -> None:
    """Refuse a moving segment without a sample between its ends, because all results would lack its motion."""
    rounding = 1e-9 * ends[-1]
    inside = np.searchsorted(grid, ends - rounding) - np.searchsorted(grid, ends - times + rounding)
    if (unseen := np.flatnonzero((inside < 1) & moves)).size:
        k = int(unseen[0])
        raise InvalidValueError(
            f"the time from waypoints[{k}] to waypoints[{k + 1}]",
            f"{times[k]:.4g} s, without a sample inside",
            "more than the time between two samples",
            "Check the units of durations, limits and rate; or give a higher rate.",
        )


def time_grid(total: float, rate: float) -> Array:
    """Sample times [s]: k/rate from 0 on, and the total time as the last.

    Shapes: total [s]; rate [1/s]; returns (N,).
    """
    rate = number(rate, "rate", "1/s", above=0.0)
    steps = total * rate
    if steps > MOST_SAMPLES:
        raise InvalidValueError(
            "the number of samples",
            f"{steps:.3g} ({total:g} s at {rate:g} 1/s)",
            f"<= {MOST_SAMPLES:g}",
            "Check the units of durations, limits and rate.",
        )
    check_memory(
        f"a path of {steps:.4g} samples", SAMPLE_BYTES * steps, "Check the units of durations, limits and rate."
    )
    # no additional last sample, if the total is a multiple of 1/rate except for rounding
    last = round(steps) if abs(steps - round(steps)) <= 1e-9 * steps else int(np.ceil(steps))
    return np.append(np.arange(last) / rate, total)


HEIGHT = 1.5  # height [m], as in the article
STOPS = ((0.0, 0.0), (5.0, 3.5), (-5.0, 3.5), (-5.0, -3.5), (5.0, -3.5), (5.0, 3.5), (0.0, 0.0))  # corner x, y [m]
DURATIONS = (9.0, 11.0, 10.0, 11.0, 10.0, 9.0)  # durations [s]


def article_path(rate: float = 100.0) -> Path:
    """Planar motion of the article, at z = 1.5 m and without rotation, from rest to rest.

    The article gives only the height and the zero angles (its Figure 18). All other values are assumed. The path starts
    at the center, goes to the corner (+5, +3.5) m, counter-clockwise around the rectangle x = +-5 m, y = +-3.5 m, and
    back to the center. It takes 60 s. Peak acceleration is 0.48 m/s^2, peak speed is 1.70 m/s.

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
