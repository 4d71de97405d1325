"""Input shapers, and convolution of paths with input shapers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial, reduce
from math import comb
from operator import mul
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from sagline.core.arguments import check_memory, instance
from sagline.core.arrays import Array, broadcast_shape, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result, set_fields
from sagline.dynamics.trajectories.segments import RestToRestSegment, joined_path, sample_time, segments_of
from sagline.motion.path import Path, checked_time

MOST_IMPULSES: Final = 10_000  # largest number of impulses; three impulses for each of eight frequencies give 6,561
_SAME: Final = 1e-12  # impulses with a smaller distance, as a share of a shaper's duration, are merged
_ROUNDING: Final = 1e-9  # tolerance of the sum of the amplitudes


@dataclass(frozen=True, slots=True, eq=False)
class Shaper(Result):
    """Impulses for the convolution with a motion. The result is a sum of scaled and delayed copies of the motion.

    The product of two shapers is their convolution. It cancels the vibrations of both.

    Attributes:
        time: Times of the impulses [s], shape (K,), ascending, the first >= 0.
        amplitude: Amplitudes of the impulses, shape (K,); their sum is 1.
        frequency: Design frequencies [Hz], shape (F,); empty if unknown.
    """

    time: Array
    amplitude: Array
    frequency: Array

    def __init__(self, time: ArrayLike, amplitude: ArrayLike, frequency: ArrayLike = ()) -> None:
        """Check the impulses.

        Args:
            time: Times of the impulses [s], shape (K,), strictly increasing, >= 0.
            amplitude: Amplitudes of the impulses, shape (K,); their sum is 1.
            frequency: Design frequencies [Hz], > 0, shape (F,).

        Raises:
            InvalidValueError: If `time`, `amplitude` or `frequency` does not satisfy these conditions.

        Examples:
            >>> import sagline as sl
            >>> both = sl.ZV(1.8) * sl.ZV(2.9)
            >>> print(both.time.round(3), both.amplitude)
            [0.    0.172 0.278 0.45 ] [0.25 0.25 0.25 0.25]
        """
        clock = checked(checked_time(time), "time", "s", low=0.0)
        shares = checked(amplitude, "amplitude", "", shape=(None,))
        if shares.shape != clock.shape or abs(shares.sum() - 1.0) > _ROUNDING:
            value = f"{shares.size} that sum to {shares.sum():.9g}"
            raise InvalidValueError("amplitude", value, f"{clock.size} that sum to 1", "Divide them by their sum.")
        set_fields(self, time=clock, amplitude=shares, frequency=_frequencies(frequency))

    @property
    def duration(self) -> float:
        """Additional duration of a shaped motion [s]."""
        return float(self.time[-1])

    def __mul__(self, other: Shaper) -> Shaper:
        """Convolution of two shapers; the order has no effect.

        Args:
            other: A shaper.

        Returns:
            Shaper of both. It has one impulse for every pair of an impulse of this shaper and an impulse of `other`.
            Impulses at the same time are merged.

        Raises:
            InvalidValueError: If `other` is not a shaper, or the product would have more than 10,000 impulses.
        """
        theirs = instance(other, Shaper, "the other factor")
        if (count := self.time.size * theirs.time.size) > MOST_IMPULSES:
            step = "Shape fewer frequencies."
            raise InvalidValueError("a product of shapers", f"of {count} impulses", f"<= {MOST_IMPULSES}", step)
        times = np.add.outer(self.time, theirs.time).ravel()
        order = np.argsort(times, kind="stable")
        times, shares = times[order], np.multiply.outer(self.amplitude, theirs.amplitude).ravel()[order]
        first = np.append(True, np.diff(times) > _SAME * times[-1])
        merged = np.add.reduceat(shares, np.flatnonzero(first))
        return Shaper(times[first], merged, np.concatenate((self.frequency, theirs.frequency)))

    def residual(self, frequency: ArrayLike, damping_ratio: float = 0.0) -> Array:
        """Residual vibration at the end of a motion, relative to the unshaped motion.

        Args:
            frequency: Undamped frequency of the vibration [Hz], >= 0, of any shape.
            damping_ratio: Damping ratio of the vibration, >= 0, < 1.

        Returns:
            |sum A_j exp((zeta w + i w_d) t_j)| exp(-zeta w t_K) with w = 2 pi frequency and w_d = w sqrt(1 - zeta^2),
            same shape as the frequency. The value 1 means no effect.

        Raises:
            InvalidValueError: If an argument is out of its range.

        Source:
            Singhose, Command shaping for flexible systems: a review of the first 50 years, 2009.
        """
        turning = 2.0 * np.pi * checked(frequency, "frequency", "Hz", low=0.0)[..., None]
        ratio = _damping_ratio(damping_ratio)
        before = self.time - self.time[-1]
        damped = np.exp(ratio * turning * before) * np.exp(1j * turning * np.sqrt(1.0 - ratio**2) * before)
        return locked(np.asarray(np.abs(damped @ self.amplitude)))


def ZV(frequency: ArrayLike, damping_ratio: ArrayLike = 0.0) -> Shaper:  # noqa: N802
    """Zero-vibration (ZV) shaper: two impulses with a distance of half a period cancel a vibration.

    Args:
        frequency: Natural frequencies of the vibrations [Hz], > 0, one or shape (F,). Several shapers are multiplied.
        damping_ratio: Damping ratio of the vibrations, >= 0, < 1, one for all or one per frequency.

    Returns:
        Shaper that extends a motion by half a period of the vibration.

    Raises:
        InvalidValueError: If a frequency is not positive, or a damping ratio out of its range.

    Source:
        Singhose, Command shaping for flexible systems: a review of the first 50 years, 2009.

    Examples:
        >>> import sagline as sl
        >>> shaper = sl.ZV(2.0)
        >>> print(shaper.time, shaper.amplitude, shaper.residual(2.2).round(3))
        [0.   0.25] [0.5 0.5] 0.156
    """
    return _several(frequency, damping_ratio, "damping_ratio", partial(_zero_vibration, 1))


def ZVD(frequency: ArrayLike, damping_ratio: ArrayLike = 0.0) -> Shaper:  # noqa: N802
    """Zero-vibration-and-derivative (ZVD) shaper: small errors of the frequency leave less vibration than with `ZV`.

    Args:
        frequency: Natural frequencies of the vibrations [Hz], > 0, one or shape (F,). Several shapers are multiplied.
        damping_ratio: Damping ratio of the vibrations, >= 0, < 1, one for all or one per frequency.

    Returns:
        Shaper of three impulses that extends a motion by a period of the vibration.

    Raises:
        InvalidValueError: If a frequency is not positive, or a damping ratio out of its range.

    Source:
        Singhose, Command shaping for flexible systems: a review of the first 50 years, 2009.

    Examples:
        >>> import sagline as sl
        >>> shaper = sl.ZVD(2.0)
        >>> print(shaper.time, shaper.amplitude, shaper.residual(2.2).round(3))
        [0.   0.25 0.5 ] [0.25 0.5  0.25] 0.024
    """
    return _several(frequency, damping_ratio, "damping_ratio", partial(_zero_vibration, 2))


def EI(frequency: ArrayLike, tolerance: ArrayLike = 0.05) -> Shaper:  # noqa: N802
    """Extra-insensitive (EI) shaper: allows the share `tolerance` of the vibration, in a wider range of frequencies.

    Args:
        frequency: Natural frequencies of vibrations with very low damping [Hz], > 0, one or shape (F,). Several shapers
            are multiplied.
        tolerance: Residual vibration at the natural frequency, as a share of the unshaped vibration, >= 0, < 1, one for
            all or one per frequency.

    Returns:
        Shaper of three impulses that extends a motion by a period of the vibration.

    Raises:
        InvalidValueError: If a frequency is not positive, or a tolerance out of its range.

    Source:
        Singhose, Command shaping for flexible systems: a review of the first 50 years, 2009.

    Examples:
        >>> import sagline as sl
        >>> shaper = sl.EI(2.0, tolerance=0.05)
        >>> print(shaper.amplitude, shaper.residual([1.8, 2.0, 2.2]).round(3))
        [0.2625 0.475  0.2625] [0.024 0.05  0.024]
    """
    return _several(frequency, tolerance, "tolerance", _extra_insensitive)


def _several(frequency: ArrayLike, option: ArrayLike, name: str, make: Callable[[float, float], Shaper]) -> Shaper:
    """Product of one shaper per frequency. Each value of `option` is a number >= 0 and < 1."""
    frequencies, options = checked(frequency, "frequency", "Hz", above=0.0), checked(option, name, "", low=0.0)
    if (options >= 1.0).any():
        raise InvalidValueError(name, f"{options.max():g}", ">= 0, < 1", "Give a share, 0.05 for 5 %.")
    shape = broadcast_shape(f"frequency and {name}", frequencies.shape, options.shape, (1,))
    if len(shape) > 1 or shape == (0,):
        step = "Give the frequencies to suppress."
        raise InvalidValueError("frequency", f"of shape {frequencies.shape}", "one number, or shape (F,), F >= 1", step)
    each = zip(np.broadcast_to(frequencies, shape), np.broadcast_to(options, shape), strict=True)
    return reduce(mul, (make(float(f), float(o)) for f, o in each))


def _zero_vibration(order: int, frequency: float, damping_ratio: float) -> Shaper:
    """Convolution of `order` shapers with two impulses, half a period of the damped vibration apart."""
    root = np.sqrt(1.0 - damping_ratio**2)
    decay = float(np.exp(-np.pi * damping_ratio / root))  # ratio of the amplitudes after and before half a period
    shares = np.array([comb(order, k) * decay**k for k in range(order + 1)]) / (1.0 + decay) ** order
    return Shaper(0.5 / (frequency * root) * np.arange(order + 1), shares, [frequency])


def _extra_insensitive(frequency: float, tolerance: float) -> Shaper:
    outer, inner = 0.25 * (1.0 + tolerance), 0.5 * (1.0 - tolerance)
    return Shaper(np.array([0.0, 0.5, 1.0]) / frequency, [outer, inner, outer], [frequency])


def _frequencies(frequency: ArrayLike) -> Array:
    found = checked(frequency, "frequency", "Hz", above=0.0)
    if found.ndim != 1:
        raise InvalidValueError("frequency", f"of shape {found.shape}", "shape (F,)", "Give a list of shapers.")
    return found


def _damping_ratio(value: float) -> float:
    ratio = number(value, "damping_ratio", "", low=0.0)
    if ratio >= 1.0:
        raise InvalidValueError("damping_ratio", f"{ratio:g}", ">= 0, < 1", "Give the ratio, 0.01 for 1 %.")
    return ratio


_BYTES: Final = 300.0  # bytes of memory per sample and impulse during shaping


def shaped(path: Path, shaper: Shaper) -> Path:
    """Path along the same curve that does not excite the frequencies of a shaper.

    In each rest-to-rest segment, the curve parameter over time is convolved with the shaper's impulses. Each segment
    starts at the delayed end of the previous segment. The platform stays on the curve. Along a straight line with a
    rotation about a fixed axis, the acceleration is convolved like the parameter, and a linear vibration cancels
    exactly. Along other curves, most of the vibration cancels.

    Paths of `quintic_path` and `septic_path` are represented exactly, except for rounding. For other paths, splines of
    5th or 7th degree connect the samples. Along a curve, the pose error is proportional to the sixth power of the
    distance between samples.

    Args:
        path: A path from rest to rest. If its rests are not given (see `Path.rests`), samples with zero velocity and
            acceleration count as rests.
        shaper: Shaper of the convolution: `ZV`, `ZVD` or `EI` of a frequency, or a product of these.

    Returns:
        Path at the same sample rate. Each segment is longer by the duration of the shaper.

    Raises:
        InvalidValueError: If the path is in motion at an end or reverses in the middle of a curve. If a frequency of
            the shaper is above half the path's sample rate.

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
        raise InvalidValueError("the shaper's frequency", f"{fastest:g} Hz", limit, "Sample the path at a higher rate.")
    segments = [_convolved(segment, shaper) for segment in segments_of(path)]
    samples = sum(segment.duration for segment in segments) / step
    check_memory("the shaped path", _BYTES * samples * shaper.time.size, "Shape a shorter path.")
    return joined_path(path, segments, with_jerk=path.jerk is not None)


def _convolved(segment: RestToRestSegment, shaper: Shaper) -> RestToRestSegment:
    """The segment with its motion convolved with the impulses; a segment at rest is unchanged."""

    def motion(time: Array) -> Array:
        total = np.zeros((4, time.size))
        for delay, share in zip(shaper.time, shaper.amplitude, strict=True):
            total += share * segment.rates(time - delay)
        return total

    if segment.curve is None:
        return segment
    return replace(segment, duration=segment.duration + shaper.duration, rates=motion)
