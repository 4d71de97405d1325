"""A path that leaves frequencies at rest: its motion along its own curve, convolved with a shaper."""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arguments import instance
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.memory import check_memory
from sagline.dynamics.moves import Move, moves_of
from sagline.dynamics.shapers import Shaper
from sagline.motion.path import Path
from sagline.motion.rest_to_rest import time_grid
from sagline.robot.pose import Pose

_BYTES: Final = 300.0  # a sample for each impulse, while it is shaped


def shaped(path: Path, shaper: Shaper) -> Path:
    """The path, shaped: it leads along the same curve, a little later, and leaves the shaper's frequencies at rest.

    How far along its curve the platform is at each time is convolved with the shaper's impulses, in each move from rest
    to rest by itself; the next begins when the last has ended, later than before. Along a straight line with a turn
    about a fixed axis the acceleration itself is so convolved, and a linear vibration cancels exactly; along a curve
    the platform stays on it, and most cancels.

    Paths of `quintic_path` and `septic_path` are the polynomials that they are, to rounding. Between the samples of
    others splines of 5th or 7th degree are taken; along a curve poses are off it by the sixth power of the way from
    sample to sample.

    Args:
        path: A path from rest to rest; where it does not know its rests (see `Path.rests`), they are the samples
            without velocity and acceleration.
        shaper: What to convolve with: `ZV`, `ZVD`, `EI` of a frequency, or their product.

    Returns:
        Path at the same sample rate, each of its moves longer by the shaper's duration.

    Raises:
        InvalidValueError: If the path is in motion at an end or turns around in the middle of a curve, or a frequency
            of the shaper is above half the path's sample rate.

    Source:
        Singhose, Command shaping for flexible systems: a review of the first 50 years, 2009;
        docs/howto/without-vibration.md.

    Examples:
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 1.5), (3, 0, 1.5)], durations=2.0)
        >>> calm = sl.shaped(path, sl.ZVD(2.5))
        >>> print(f"{calm.duration} s, to {calm.pose.position[-1]}")
        2.4 s, to [3.  0.  1.5]
    """
    step = sample_time(instance(path, Path, "path"))
    fastest = instance(shaper, Shaper, "shaper").frequency.max(initial=0.0)
    if fastest > 0.5 / step:
        limit = f"<= {0.5 / step:g} Hz, half the path's sample rate"
        raise InvalidValueError("the shaper's frequency", f"{fastest:g} Hz", limit, "Give the path a higher rate.")
    moves = moves_of(path)
    longer = np.array([move.duration + (0.0 if move.curve is None else shaper.duration) for move in moves])
    ends = np.cumsum(longer)
    rests = np.append(0.0, ends)
    time = time_grid(float(ends[-1]), 1.0 / step)
    check_memory("the shaped path", _BYTES * time.size * shaper.time.size, "Shape a shorter path.")
    position, quaternion, rates = np.empty((time.size, 3)), np.empty((time.size, 4)), np.zeros((3, time.size, 6))
    which = np.minimum(np.searchsorted(ends, time, side="right"), len(moves) - 1)
    for k, move in enumerate(moves):
        part = which == k
        pose = _held(path, move)
        if move.curve is not None:
            motion = convolved(move, shaper, time[part] - rests[k])
            jet = move.curve.at(motion[0])
            pose, rates[:, part] = jet.pose, jet.twists(motion)
        position[part], quaternion[part] = pose.position, pose.quaternion
    start = path.time[0]
    kept = None if path.jerk is None else locked(rates[2])
    return Path(time + start, Pose.from_quaternion(position, quaternion), rates[0], rates[1], kept, rests + start)


def convolved(move: Move, shaper: Shaper, time: Array) -> Array:
    """Parameter of a shaped move and its first three derivatives at times since its begin, shape (4, N)."""
    motion = np.zeros((4, time.size))
    for delay, share in zip(shaper.time, shaper.amplitude, strict=True):
        motion += share * move.rates(time - delay)
    return motion


def _held(path: Path, move: Move) -> Pose:
    """Where the platform is at the first sample of a move."""
    return path.pose[move.sample]


def sample_time(path: Path) -> float:
    """The usual time from one sample to the next [s]; a rate that is all but a whole number is that.

    Args:
        path: The path.

    Returns:
        The time.

    Raises:
        InvalidValueError: If the path has one sample only.
    """
    if len(path) < 2:
        raise InvalidValueError("path", "of one sample", "two or more, from rest to rest", "Give a longer path.")
    rate = 1.0 / float(np.median(np.diff(path.time)))
    return 1.0 / (round(rate) if abs(rate - round(rate)) <= 1e-6 * rate else rate)
