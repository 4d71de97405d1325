"""Sets with known volumes: level functions, >= 0 inside."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array

Level = Callable[[Array], Array]


def ball(center: ArrayLike, radius: float) -> Level:
    """Of volume 4/3 pi r^3."""
    return lambda p: radius - np.linalg.norm(p - np.asarray(center), axis=1)


def torus(large: float, small: float) -> Level:
    """Around z, of volume 2 pi^2 R r^2."""
    return lambda p: small - np.hypot(np.hypot(p[:, 0], p[:, 1]) - large, p[:, 2])


def brick(center: ArrayLike, half: ArrayLike, turn: Rotation | None = None) -> Level:
    """A box of half edges, turned about its center."""
    matrix = (turn or Rotation.identity()).as_matrix()
    return lambda p: (np.asarray(half) - np.abs((p - np.asarray(center)) @ matrix)).min(axis=1)


def both(levels: Sequence[Level]) -> Level:
    """Intersection of sets."""
    return lambda p: np.min([level(p) for level in levels], axis=0)


def any_of(levels: Sequence[Level]) -> Level:
    """Union of sets."""
    return lambda p: np.max([level(p) for level in levels], axis=0)


def outside(level: Level) -> Level:
    """Complement of a set."""
    return lambda p: -level(p)


class Counted:
    """A level function that counts and stores its positions."""

    def __init__(self, level: Level) -> None:
        self.level = level
        self.asked: list[Array] = []

    def __call__(self, positions: Array) -> Array:
        self.asked.append(positions)
        return self.level(positions)

    @property
    def positions(self) -> Array:
        """All positions, shape (N, 3)."""
        return np.concatenate(self.asked)
