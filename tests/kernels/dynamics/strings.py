"""Cables as vibrating strings: kernel arguments, results of kernels, and a reference of chains of springs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, solve

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.vibration.dynamic_stiffness import EXACT, _waves_of
from sagline.kernels.dynamics import collocation
from sagline.kernels.dynamics.string import STRING_COLUMNS
from sagline.statics.strings import COUNTING, undamped

GRAVITY = 9.81


def string(horizontal: float, vertical: float, length: float, density: float, stiffness: float) -> Array:
    """A cable with a fixed frame end, as a table (1, STRING_COLUMNS)."""
    row = np.zeros((1, STRING_COLUMNS))
    row[0, :6] = horizontal, vertical, length, density * GRAVITY, stiffness, density
    return row


def added(table: Array, frequency: Any, damping: sl.Damping | None = None) -> NDArray[Any]:
    """K(omega) - K(0) of cables at frequencies (F,): xx, xz, zz, yy, shape (F, m, FOUND)."""
    waves = _waves_of(np.atleast_1d(np.asarray(frequency, dtype=np.float64)), damping)
    return _both(table, waves if damping else np.ascontiguousarray(waves.real), EXACT)[0]


def counted(table: Array, frequency: Any) -> NDArray[np.int64]:
    """Number of frequencies of the fixed cable below each of (F,), in the plane and normal to it, shape (F, m, 2)."""
    return _both(table, undamped(np.atleast_1d(np.asarray(frequency, dtype=np.float64))[None]), COUNTING)[1]


def _both(table: Array, waves: NDArray[Any], phase: float) -> tuple[NDArray[Any], NDArray[np.int64]]:
    found = np.empty((1, waves.shape[1], len(table), collocation.FOUND), dtype=waves.dtype)
    counts = np.empty((*found.shape[:-1], 2), dtype=np.int64)
    collocation.dynamic_stiffnesses(
        table[None], waves, phase, np.empty(collocation.ROOM, dtype=waves.dtype), found, counts
    )
    return found[0], counts[0]


def held(table: Array, number: int, plane: int, digits: float = 1e-13) -> float:
    """The frequency with a number, from 1 on, in the plane (0) or normal to it (1), by bisection of the count."""
    low, high = 0.0, 1.0
    while counted(table, high)[0, 0, plane] < number:
        low, high = high, 2.0 * high
    while high - low > digits * high:
        middle = 0.5 * (low + high)
        if counted(table, middle)[0, 0, plane] < number:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


class Chain(NamedTuple):
    """A cable as n equal springs between point masses at its own equilibrium.

    Attributes:
        plane: Stiffness in the plane, nodes from the first after the frame end, (2 n, 2 n).
        normal: The same normal to it, (n, n).
        mass: Of the nodes, (n,).
        stretch: The part of plane that is of the springs' stretch.
        density: [kg/m].
    """

    plane: Array
    normal: Array
    mass: Array
    stretch: Array
    density: float

    def squares(self, plane: int) -> Array:
        """Squared angular frequencies with both ends fixed."""
        matrix, mass = (
            (self.plane[:-2, :-2], np.repeat(self.mass[:-1], 2))
            if plane == 0
            else (self.normal[:-1, :-1], self.mass[:-1])
        )
        root = np.sqrt(mass)
        return np.asarray(eigh(matrix / root / root[:, None], eigvals_only=True))

    def end(self, omega: float, loss_time: float = 0.0, drag: float = 0.0) -> NDArray[Any]:
        """Dynamic stiffness of the last node: xx, xz, zz, yy."""
        found = []
        for matrix, mass, d in (
            (self.plane + 1j * omega * loss_time * self.stretch, np.repeat(self.mass, 2), 2),
            (self.normal, self.mass, 1),
        ):
            moving = matrix - np.diag(omega**2 * mass - 1j * omega * drag / self.density * mass)
            end = moving[-d:, -d:] - moving[-d:, :-d] @ solve(moving[:-d, :-d], moving[:-d, -d:])
            found.append(end)
        ends = np.array([found[0][0, 0], found[0][0, 1], found[0][1, 1], found[1][0, 0]])
        return ends if loss_time or drag else np.asarray(ends.real)


def chain(table: Array, n: int) -> Chain:
    """The chain whose springs have the forces of the given cable at its platform end.

    Statics of a chain are known from its end on: each spring carries the force less the masses' weight beyond it.
    """
    horizontal, vertical, length, weight, stiffness, density = table[0, :6]
    step = length / n
    beyond = vertical - weight * step * (n - np.arange(n) - 0.5)  # the weight of half a step acts at the last node
    force = np.hypot(horizontal, beyond)
    tangent = np.stack((np.full(n, horizontal), beyond), axis=1) / force[:, None]
    long = step * (1.0 + force / stiffness)
    along = tangent[:, :, None] * tangent[:, None, :]
    across = (force / long)[:, None, None] * (np.eye(2) - along)
    return Chain(
        _assembled(stiffness / step * along + across),
        _assembled((force / long)[:, None, None] * np.ones((1, 1))),
        np.append(np.full(n - 1, density * step), 0.5 * density * step),
        _assembled(stiffness / step * along),
        density,
    )


def _assembled(springs: Array) -> Array:
    n, d, _ = springs.shape
    matrix = np.zeros((n, d, n, d))
    for i, spring in enumerate(springs):  # between nodes i - 1 and i; the first one is that of the frame
        matrix[i, :, i] += spring
        if i:
            matrix[i - 1, :, i - 1] += spring
            matrix[i, :, i - 1] -= spring
            matrix[i - 1, :, i] -= spring
    return matrix.reshape(n * d, n * d)
