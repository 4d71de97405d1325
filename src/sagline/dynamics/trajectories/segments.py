"""Rest-to-rest segments of a path: curve of each segment, and curve parameter over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import comb, factorial
from typing import Any, Final, NamedTuple, Protocol

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.motion.path import Path, conjugate_product, without_sign_changes
from sagline.motion.rest_to_rest import QUINTIC, Segments, time_grid
from sagline.robot.pose import Pose

_STOPPED: Final = 1e-6  # largest speed at a stop, as a share of the path's largest speed
# smallest distance of spline knots divided by the mean step; knots are close at the start of a motion
_NARROW: Final = 0.2


class Jet(NamedTuple):
    """Poses on a curve, and their derivatives with respect to the curve parameter."""

    pose: Pose  # poses, a batch of N
    # twist at unit parameter rate, and its first two derivatives with respect to the parameter, shape (3, N, 6)
    rates: Array

    def twists(self, motion: Array) -> Array:
        """Twist and its first and second time derivatives for a motion along the curve, by the chain rule."""
        # shapes: motion (4, N); returns (3, N, 6)
        (first, second, third), (_, v, a, j) = self.rates, motion[:, :, None]
        return np.stack((first * v, second * v**2 + first * a, third * v**3 + 3.0 * second * v * a + first * j))


class Curve(Protocol):
    """Curve in the space of poses."""

    def at(self, parameter: Array) -> Jet:
        """Poses and their derivatives at parameters of shape (N,)."""
        ...


class _LineCurve:
    """Straight line with a rotation about a fixed axis. The parameter is 0 at the start and 1 at the end."""

    def __init__(self, pose: Pose) -> None:
        """Line from the first to the last pose of a batch."""
        self.ends = Segments(pose[np.array([0, -1])], QUINTIC)  # a single segment
        # twist at unit parameter rate, shape (6,)
        self.direction = np.concatenate((self.ends.move[0], self.ends.turn[0]))

    def parameter(self, pose: Pose) -> Array:
        """Parameters of poses on the line, shape (N,)."""
        move, turn = self.ends.move[0], self.ends.turn[0]
        if (extent := move @ move) >= (angle := float(np.linalg.norm(turn))) ** 2:
            return np.asarray((pose.position - self.ends.start[0]) @ move / extent)
        # half angles from -45 to 135 degrees, because q and -q are the same rotation
        half = np.arctan2(
            pose.quaternion @ self.ends.side_quaternion[0], pose.quaternion @ self.ends.start_quaternion[0]
        )
        return np.asarray((np.mod(half + 0.25 * np.pi, np.pi) - 0.25 * np.pi) * 2.0 / angle)

    def at(self, parameter: Array) -> Jet:
        """Poses and their derivatives at parameters of shape (N,)."""
        rates = np.zeros((3, parameter.size, 6))
        rates[0] = self.direction
        half = (0.5 * np.linalg.norm(self.ends.turn[0]) * parameter)[:, None]
        quaternion = np.cos(half) * self.ends.start_quaternion + np.sin(half) * self.ends.side_quaternion
        position = self.ends.start + parameter[:, None] * self.ends.move
        return Jet(Pose.from_quaternion(position, quaternion), rates)


class _SplineCurve:
    """Curve through samples: 5th-degree splines of position and quaternion over its arc length."""

    def __init__(self, pose: Pose, parameter: Array) -> None:
        """Splines through poses at ascending parameters. Poses with nearly the same parameter are left out."""
        from scipy.interpolate import make_interp_spline  # this import takes longer than the rest of motion

        least, knots = _NARROW * parameter[-1] / len(parameter), [0]
        for k in range(1, len(parameter)):
            if parameter[k] - parameter[knots[-1]] >= least:
                knots.append(k)
        knots[-1] = len(parameter) - 1
        degree = min(5, len(knots) - 1)
        columns = (pose.position, without_sign_changes(pose.quaternion))  # splines need not have unit length
        splines = (make_interp_spline(parameter[knots], values[knots], k=degree) for values in columns)
        self._position, self._quaternion = splines

    def at(self, parameter: Array) -> Jet:
        """Poses and their derivatives at parameters of shape (N,)."""
        place = [self._position(parameter, order) for order in range(4)]
        q = [self._quaternion(parameter, order) for order in range(4)]
        # w = 2 vec(q' q*)/(q . q) for any length of q: numerator, denominator and their derivatives
        top = [2.0 * conjugate_product(q[1], q[0]), 2.0 * conjugate_product(q[2], q[0])]
        top.append(2.0 * conjugate_product(q[3], q[0]) + 2.0 * conjugate_product(q[2], q[1]))
        below = [np.sum(q[0] * q[k], axis=1)[:, None] * (1.0 if k == 0 else 2.0) for k in range(3)]
        below[2] += 2.0 * np.sum(q[1] * q[1], axis=1)[:, None]
        spin = top[0] / below[0]
        second = (top[1] - spin * below[1]) / below[0]
        third = (top[2] - 2.0 * second * below[1] - spin * below[2]) / below[0]
        rates = np.stack([np.hstack(pair) for pair in zip(place[1:], (spin, second, third), strict=True)])
        return Jet(Pose.from_quaternion(place[0], q[0]), rates)


def _arc_lengths(time: Array, twist: Array, twist_rate: Array) -> Array:
    """Arc length at each sample, with 1 rad counted as 1 m, and its first two time derivatives."""
    # shapes: time (N,) [s]; twist (N, 6); twist_rate (N, 6); returns (3, N)
    speed = np.linalg.norm(twist, axis=1)
    inside = speed[1:-1] <= _STOPPED * speed.max()
    if inside.any():
        k = int(np.argmax(inside)) + 1
        value, allowed = "with zero speed inside a curve", "moves along a straight line, or without stops"
        hint = "Split it into two paths, each from rest to rest."
        raise InvalidValueError(f"the path at {time[k]:g} s", value, allowed, hint)
    growth = np.sum(twist * twist_rate, axis=1) / np.where(speed > 0.0, speed, 1.0)
    growth[[0, -1]] = np.linalg.norm(twist_rate[[0, -1]], axis=1) * (1.0, -1.0)  # position
    step = np.diff(time)
    pieces = 0.5 * step * (speed[1:] + speed[:-1]) + step**2 / 12.0 * (growth[:-1] - growth[1:])
    return np.stack((np.append(0.0, np.cumsum(pieces)), speed, growth))


def piecewise(knots: Array, values: Array, at_end: int) -> Any:
    """Piecewise polynomial with the derivatives `values` at `knots`. Four derivatives per knot give degree 7."""
    # shapes: knots (n,); values (K, n)
    from scipy.interpolate import PPoly  # this import takes longer than the rest of motion

    step = np.diff(knots)
    known = len(values)
    # derivatives as Taylor coefficients of a piece, scaled to length 1
    scale = np.array([step**k / factorial(k) for k in range(known)])
    left, right = values[:, :-1] * scale, values[:, 1:] * scale
    pieces = np.concatenate((left, np.zeros_like(left)))
    pieces[:, :-1] = _pieces(left[:, :-1], right[:, :-1])
    last = _pieces(left[:, -1:], right[:at_end, -1:])
    pieces[: len(last), -1:] = last
    return PPoly((pieces / step ** np.arange(2 * known)[:, None])[::-1], knots, extrapolate=True)


def _pieces(left: Array, right: Array) -> Array:
    """Coefficients in ascending order from Taylor coefficients at both ends, shape (left + right, pieces)."""
    low, high = len(left), len(right)
    binomials = np.array([[float(comb(i, j)) for i in range(low + high)] for j in range(high)])
    rest = np.linalg.solve(binomials[:, low:], right - binomials[:, :low] @ left)
    return np.concatenate((left, rest))


# in a spline through samples, a speed or acceleration below this share of its largest value counts as rest
RESTING: Final = 1e-3
# stricter share between the ends of the path, because the platform may only reverse there
_STANDING: Final = 1e-9
_ON_A_LINE: Final = 1e-7  # largest distance of samples from a line, divided by its length
TINY: Final = 1e-300
_SAME_TIME: Final = 1e-9  # tolerance of times, as a share of the path's duration


@dataclass(frozen=True, slots=True, eq=False)
class RestToRestSegment:
    """Motion from rest to rest."""

    begin: float  # start time [s]
    duration: float  # [s]
    sample: int  # index of its first sample
    curve: Curve | None = None  # curve of the motion; None if the platform is at rest all the time
    # curve parameter and its first three time derivatives (4, N) at times since the start (N,) [s]
    rates: Callable[[Array], Array] = lambda time: np.zeros((4, time.size))


def segments_of(path: Path) -> tuple[RestToRestSegment, ...]:
    """Rest-to-rest segments of a path, in order."""
    # Between two samples of a segment the parameter is a polynomial that matches all known derivatives of the path. Its
    # degree is 7, or 5 for a path without jerk. Paths of `quintic_path` and `septic_path` are represented exactly.
    speed, rate = _speed(path.twist), _speed(path.twist_rate)
    for k, which in ((0, "begin"), (len(path) - 1, "end")):
        if speed[k] > RESTING * speed.max():
            velocity, turning = (np.linalg.norm(path.twist[k, part]) for part in (slice(0, 3), slice(3, 6)))
            value = f"in motion, at {velocity:.3g} m/s and {turning:.3g} rad/s"
            raise InvalidValueError(f"the path at its {which}", value, "at rest", "Give a path from rest to rest.")
    rests = path.rests
    if rests is None:  # the times of the samples at rest, including the first and the last
        still = (speed <= _STANDING * speed.max()) & (rate <= RESTING * rate.max())
        still[[0, -1]] = True
        rests = path.time[still]
    return tuple(_segment(path, float(first), float(last)) for first, last in pairwise(rests))


def _speed(twist: Array) -> Array:
    """Speed with 1 rad counted as 1 m, shape (N,)."""
    return np.asarray(np.linalg.norm(twist, axis=-1))


def _segment(path: Path, begin: float, end: float) -> RestToRestSegment:
    """Segment from the rest `begin` to the rest `end`. If a rest is between samples, a polynomial is extended to it."""
    near = _SAME_TIME * max(path.duration, abs(begin))
    first, last = np.searchsorted(path.time, (begin - near, end + near))
    part = slice(int(first), int(last))
    time = path.time[part] - begin
    if not _speed(path.twist[part]).any():
        return RestToRestSegment(begin, end - begin, part.start)
    if time.size < 2:
        item, step = f"the move from {begin:g} s to {end:g} s", "Sample the path at a higher rate."
        raise InvalidValueError(item, f"of {time.size} samples", ">= 2", step)
    rates = [path.twist[part], path.twist_rate[part], *([] if path.jerk is None else [path.jerk[part]])]
    curve, values = _parametrized(time, path.pose[part], rates)
    standing, over = abs(time[0]) <= near, abs(time[-1] - (end - begin)) <= near
    # a sample at a rest may belong only to the next segment; with 3 of 4 derivatives, quintic paths are exact, and
    # septic paths have an error of the order h^7
    at_end = 3 if path.jerk is not None or part.stop == len(path) else 2
    progress = piecewise(time, values, at_end if over else len(values))
    if not (standing and over):
        knots = np.concatenate(([] if standing else [0.0], time, [] if over else [end - begin]))
        held = np.zeros((len(values), knots.size))
        held[:, int(not standing) :][:, : time.size] = values
        held[0] = progress(knots)
        if not standing and len(values) > 3:
            held[3, 0] = progress(0.0, 3)  # at rest, but its jerk can be nonzero
        progress = piecewise(knots, held, at_end if over else 3)

    def motion(since: Array) -> Array:
        """The platform is at rest before and after the segment. At a jump, a derivative has the value after it."""
        found = np.stack([progress(np.clip(since, 0.0, end - begin), order) for order in range(4)])
        found[1:, (since < 0.0) | (since >= end - begin)] = 0.0
        return found

    return RestToRestSegment(begin, end - begin, part.start, curve, motion)


def _parametrized(time: Array, pose: Pose, rates: list[Array]) -> tuple[Curve, Array]:
    """Curve through samples, and the parameter at each sample with its derivatives, shape (K, n)."""
    line = _LineCurve(pose)
    if line.ends.moves[0]:
        parameter, square = line.parameter(pose), float(line.direction @ line.direction)
        values = np.stack((parameter, *(rate @ line.direction / square for rate in rates)))
        there = line.at(parameter).pose
        off = [np.abs(there.position - pose.position).max() ** 2]
        off.append(1.0 - np.abs(np.sum(there.quaternion * pose.quaternion, axis=1)).min())
        for rate, value in zip(rates, values[1:], strict=True):  # the last sample may be in the next segment
            aside = np.abs(rate - value[:, None] * line.direction)[:-1].max()
            off.append((aside / max(np.abs(rate[:-1]).max(), TINY)) ** 2)
        if max(off) <= _ON_A_LINE**2 * max(1.0, square):
            return line, values
    way = _arc_lengths(time, *rates[:2])
    way /= way[0, -1]
    return _SplineCurve(pose, way[0]), way


def sample_time(path: Path) -> float:
    """Typical time between samples [s]. A sample rate that is nearly a whole number is rounded to this number."""
    if len(path) < 2:
        raise InvalidValueError("path", "of one sample", "two or more, from rest to rest", "Give a longer path.")
    rate = 1.0 / float(np.median(np.diff(path.time)))
    return 1.0 / (round(rate) if abs(rate - round(rate)) <= 1e-6 * rate else rate)


def joined_path(path: Path, segments: Sequence[RestToRestSegment], *, with_jerk: bool) -> Path:
    """Path of `segments` with new durations and motions, at the sample rate of `path`."""
    ends = np.cumsum([segment.duration for segment in segments])
    rests = np.append(0.0, ends)
    time = time_grid(float(ends[-1]), 1.0 / sample_time(path))
    position, quaternion, rates = np.empty((time.size, 3)), np.empty((time.size, 4)), np.zeros((3, time.size, 6))
    which = np.minimum(np.searchsorted(ends, time, side="right"), len(segments) - 1)
    for k, segment in enumerate(segments):
        part, pose = which == k, path.pose[segment.sample]
        if segment.curve is not None:
            motion = segment.rates(time[part] - rests[k])
            jet = segment.curve.at(motion[0])
            pose, rates[:, part] = jet.pose, jet.twists(motion)
        position[part], quaternion[part] = pose.position, pose.quaternion
    jerk, start = locked(rates[2]) if with_jerk else None, path.time[0]
    return Path(time + start, Pose.from_quaternion(position, quaternion), rates[0], rates[1], jerk, rests + start)
