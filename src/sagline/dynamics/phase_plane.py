"""The fastest way along a curve within bounds on acceleration and squared speed, without a bound on jerk."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.balances import HalfPlanes

_FLAT = 1e-12  # of the largest: rates that are none


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Constant acceleration of the parameter from place to place.

    Attributes:
        place: Parameters, shape (K,).
        square: Squares of the speed there, shape (K,).
        time: When they are passed [s], shape (K,).
    """

    place: Array
    square: Array
    time: Array

    @classmethod
    def of(cls, place: Array, square: Array) -> Profile:
        """The profile with the times that follow."""
        speed = np.sqrt(square)
        return cls(place, square, np.append(0.0, np.cumsum(2.0 * np.diff(place) / (speed[1:] + speed[:-1]))))

    @property
    def duration(self) -> float:
        """How long it takes [s]."""
        return float(self.time[-1])

    @property
    def acceleration(self) -> Array:
        """From each place to the next, shape (K - 1,)."""
        rate: Array = 0.5 * np.diff(self.square) / np.diff(self.place)
        return rate

    @property
    def motion(self) -> Array:
        """Acceleration that follows and square of the speed at each place, shape (K, 2)."""
        rate = self.acceleration
        return np.stack((np.append(rate, rate[-1]), self.square), axis=1)

    def at(self, time: Array) -> Array:
        """Parameter and its first three derivatives by time, shape (4, N); the last is 0 where it is one."""
        k = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, len(self.place) - 2)
        since, rate, speed = time - self.time[k], self.acceleration[k], np.sqrt(self.square[k])
        place = self.place[k] + since * (speed + 0.5 * since * rate)
        return np.stack((place, speed + since * rate, rate, np.zeros_like(place)))


def fastest_profile(place: Array, planes: HalfPlanes) -> Profile | None:
    """The profile from rest to rest that is at each place as fast as any that stays within the bounds.

    Backward, from which squares of the speed the end can be reached; forward, the largest acceleration that stays
    among them. What holds at both ends of a step holds in it, but for the bounds' curvature.

    Args:
        place: Parameters, ascending, shape (K,).
        planes: Bounds at each.

    Returns:
        Profile; None where there is none from rest to rest.

    Source:
        Pham & Pham, A new approach to time-optimal path parameterization based on reachability analysis, 2018.
    """
    steps, last = np.diff(place), len(place) - 1
    reach = np.zeros((len(place), 2))
    for i in range(last - 1, -1, -1):
        reach[i] = _range(*_rows(planes, i, steps[i], reach[i + 1]))
        if not reach[i, 0] <= reach[i, 1]:
            return None
    if reach[0, 0] > 0.0:
        return None
    square = np.zeros(len(place))
    for i in range(last):
        rates, bound = _rows(planes, i, steps[i], reach[i + 1])
        rising = rates[:, 0] > _FLAT * np.abs(rates[:, 0]).max()
        most = np.min((bound - rates[:, 1] * square[i])[rising] / rates[rising, 0])
        square[i + 1] = np.clip(square[i] + 2.0 * steps[i] * most, *reach[i + 1])
    inner = square[1:-1]
    return Profile.of(place, square) if (inner > 0.0).all() else None


def _rows(planes: HalfPlanes, i: int, step: float, reach: Array) -> tuple[Array, Array]:
    """Bounds on (acceleration, square of the speed) at place i: there, at the next, and to stay in reach."""
    sheared = planes.rates[i + 1].copy()
    sheared[:, 0] += 2.0 * step * sheared[:, 1]  # the square grows by 2 step times the acceleration
    ahead = np.array([[2.0 * step, 1.0], [-2.0 * step, -1.0], [0.0, -1.0]])
    rates = np.concatenate((planes.rates[i], sheared, ahead))
    bound = np.concatenate((planes.bound[i], planes.bound[i + 1], [reach[1], -reach[0], 0.0]))
    said = np.isfinite(bound)
    return rates[said], bound[said]


def _range(rates: Array, bound: Array) -> tuple[float, float]:
    """Least and largest second variable that some first one goes with; the least the larger where there is none."""
    flat = np.abs(rates[:, 0]) <= _FLAT * np.abs(rates[:, 0]).max()
    up, down = ~flat & (rates[:, 0] > 0.0), ~flat & (rates[:, 0] < 0.0)
    slope, level = rates[:, 1] / np.where(flat, 1.0, rates[:, 0]), bound / np.where(flat, 1.0, rates[:, 0])
    # what bounds the first from above, less what bounds it from below, must leave something
    rate = np.concatenate(((slope[up][:, None] - slope[down]).ravel(), rates[flat, 1]))
    room = np.concatenate(((level[up][:, None] - level[down]).ravel(), bound[flat]))
    size = np.abs(rate).max(initial=0.0) * _FLAT
    above, below = rate > size, rate < -size
    low = max(0.0, float(np.max(room[below] / rate[below], initial=0.0)))
    high = float(np.min(room[above] / rate[above], initial=np.inf))
    return low, high
