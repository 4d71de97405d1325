"""A path as moves from rest to rest: the curve of each, and how far along it the platform is at any time."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.dynamics.curves import Bent, Curve, Line, lengths
from sagline.dynamics.hermite import piecewise
from sagline.motion.path import Path
from sagline.robot.pose import Pose

RESTING: Final = 1e-3  # of the path's largest speed or acceleration: splines through samples stand no better
_STANDING: Final = 1e-9  # of its largest speed: in between, where it might only turn around
_ON_A_LINE: Final = 1e-7  # of the way: how far samples may be off a line that they are on
TINY: Final = 1e-300
_SAME_TIME: Final = 1e-9  # of the path's duration


@dataclass(frozen=True, slots=True, eq=False)
class Move:
    """A motion from rest to rest.

    Attributes:
        begin: When it begins [s].
        end: When it ends [s].
        curve: Where it leads; None where the platform stands all the time.
        progress: Parameter of the curve over the time since the begin: scipy's PPoly; None likewise.
        sample: Index of its first sample.
    """

    begin: float
    end: float
    curve: Curve | None
    progress: Any
    sample: int

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return self.end - self.begin

    def rates(self, time: Array) -> Array:
        """Parameter of the curve and its first three derivatives at given times since the begin, shape (4, N).

        Before the begin and after the end it rests. A derivative that jumps is that of the later side.
        """
        assert self.progress is not None
        held = np.clip(time, 0.0, self.duration)
        values = np.stack([self.progress(held, order) for order in range(4)])
        values[1:, (time < 0.0) | (time >= self.duration)] = 0.0
        return values


def moves_of(path: Path) -> tuple[Move, ...]:
    """The moves of a path, in order.

    Between rests the parameter runs through the samples with all derivatives that the path knows: a polynomial of
    7th degree from sample to sample, of 5th without jerk. Paths of `quintic_path` and `septic_path` are that exactly.

    Args:
        path: The path; where it does not know its rests, they are the samples that stand.

    Returns:
        Moves that follow on each other.

    Raises:
        InvalidValueError: If the path is in motion at an end, or turns around in the middle of a curve.
    """
    _check_ends(path)
    rests = path.rests if path.rests is not None else _standing(path)
    return tuple(_move(path, float(first), float(last)) for first, last in pairwise(rests))


def _check_ends(path: Path) -> None:
    speed = _speed(path.twist)
    for k, which in ((0, "begin"), (len(path) - 1, "end")):
        if speed[k] > RESTING * speed.max():
            raise InvalidValueError(
                f"the path at its {which}",
                f"in motion, at {np.linalg.norm(path.twist[k, :3]):.3g} m/s and "
                f"{np.linalg.norm(path.twist[k, 3:]):.3g} rad/s",
                "at rest",
                "Give a path from rest to rest.",
            )


def _speed(twist: Array) -> Array:
    """A radian counts as a meter, shape (N,)."""
    speed: Array = np.linalg.norm(twist, axis=-1)
    return speed


def _standing(path: Path) -> Array:
    """Times of the samples that stand, the first and the last among them."""
    speed, rate = _speed(path.twist), _speed(path.twist_rate)
    still = (speed <= _STANDING * speed.max()) & (rate <= RESTING * rate.max())
    still[[0, -1]] = True
    times: Array = path.time[still]
    return times


def _move(path: Path, begin: float, end: float) -> Move:
    """The move between two rests; those that are no samples are reached by the polynomials beside them."""
    near = _SAME_TIME * max(path.duration, abs(begin))
    first, last = np.searchsorted(path.time, (begin - near, end + near))
    part = slice(int(first), int(last))
    time = path.time[part] - begin
    if not _speed(path.twist[part]).any():
        return Move(begin, end, None, None, part.start)
    if time.size < 2:
        value = f"of {time.size} samples"
        raise InvalidValueError(
            f"the move from {begin:g} s to {end:g} s", value, ">= 2", "Give the path a higher rate."
        )
    rates = [path.twist[part], path.twist_rate[part], *([] if path.jerk is None else [path.jerk[part]])]
    curve, values = _parametrized(time, path.pose[part], rates)
    standing, over = abs(time[0]) <= near, abs(time[-1] - (end - begin)) <= near
    # a sample at a rest may know of the move after it only; quintic paths are exact with 3 of 4, septic ones to h^7
    at_end = 3 if path.jerk is not None or part.stop == len(path) else 2
    progress = piecewise(time, values, at_end if over else len(values))
    if not (standing and over):
        knots = np.concatenate(([] if standing else [0.0], time, [] if over else [end - begin]))
        held = np.zeros((len(values), knots.size))
        held[:, int(not standing) :][:, : time.size] = values
        held[0] = progress(knots)
        if not standing and len(values) > 3:
            held[3, 0] = progress(0.0, 3)  # it rests, but its jerk need not be zero
        progress = piecewise(knots, held, at_end if over else 3)
    return Move(begin, end, curve, progress, part.start)


def _parametrized(time: Array, pose: Pose, rates: list[Array]) -> tuple[Curve, Array]:
    """A curve through samples, and its parameter with its derivatives at each, shape (K, n)."""
    line = Line.between(pose)
    if line.moves:
        parameter, square = line.parameter(pose), float(line.direction @ line.direction)
        values = np.stack((parameter, *(rate @ line.direction / square for rate in rates)))
        there = line.at(parameter).pose
        off = [np.abs(there.position - pose.position).max() ** 2]
        off.append(1.0 - np.abs(np.sum(there.quaternion * pose.quaternion, axis=1)).min())
        for rate, value in zip(rates, values[1:], strict=True):  # the last sample may be in the next move
            aside = np.abs(rate - value[:, None] * line.direction)[:-1].max()
            off.append((aside / max(np.abs(rate[:-1]).max(), TINY)) ** 2)
        if max(off) <= _ON_A_LINE**2 * max(1.0, square):
            return line, values
    way = lengths(time, *rates[:2])
    way /= way[0, -1]
    return Bent.through(pose, way[0]), way
