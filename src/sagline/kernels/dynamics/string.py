"""One cable as a string that vibrates about its catenary: how it hangs, and how much of it may be one element."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.jit import formula

# columns of the table of strings
HORIZONTAL, VERTICAL = 0, 1  # T_x, T_z on the platform end [N]
LENGTH = 2  # unstrained length of the free span [m]
WEIGHT = 3  # per length [N/m]
STIFFNESS = 4  # EA [N]
DENSITY = 5  # [kg/m]
# compliance of what is behind the frame end: (x, z) times its transpose in the plane, and normal to it [m/N]
BEHIND_X, BEHIND_Z, BEHIND_Y = 6, 7, 8  # [sqrt(m/N)] the first two
STRING_COLUMNS = 9

SMOOTH = 0.5  # of min N/w: longest element for which what it is made of is smooth
TINY = 1e-300


class String(NamedTuple):
    """A cable at rest.

    Attributes:
        horizontal: T_x [N].
        vertical: T_z on the platform end [N].
        length: Unstrained length L [m].
        weight: w [N/m].
        stiffness: EA [N].
        density: Rho [kg/m].
    """

    horizontal: float
    vertical: float
    length: float
    weight: float
    stiffness: float
    density: float


@formula
def string_at(strings: Array, i: int) -> String:
    """A row of the table of strings."""
    return String(
        strings[i, HORIZONTAL],
        strings[i, VERTICAL],
        strings[i, LENGTH],
        strings[i, WEIGHT],
        strings[i, STIFFNESS],
        strings[i, DENSITY],
    )


@formula
def vertical_at(string: String, s: float) -> float:
    """Vertical part of the force in the cable [N] at a material point, counted from the frame end."""
    return string.vertical - string.weight * (string.length - s)


@formula
def _least_force(string: String, start: float, end: float) -> float:
    """Least force between two material points [N]."""
    low, high = vertical_at(string, start), vertical_at(string, end)
    vertical = max(low, -high, 0.0)
    return math.sqrt(string.horizontal * string.horizontal + vertical * vertical)


@formula
def slowness(string: String, force: float) -> float:
    """Time that a transverse wave takes for a meter of unstrained cable [s/m] under a force."""
    return math.sqrt(string.density * (1.0 / (force + TINY) + 1.0 / string.stiffness))


@formula
def shortest_wave(string: String, omega: float) -> float:
    """Half the length of a transverse wave where the force is largest [m]: it is shorter elsewhere."""
    low, high = abs(vertical_at(string, 0.0)), abs(string.vertical)
    force = math.hypot(string.horizontal, max(low, high))
    return math.pi / (omega * slowness(string, force) + TINY)


@formula
def _longest_element(string: String, start: float, end: float, omega: float, phase: float) -> float:
    """Longest element [m] that an interval allows: C smooth, and at most so much phase of a transverse wave [rad]."""
    force = _least_force(string, start, end)
    return min(SMOOTH * force / (string.weight + TINY), phase / (omega * slowness(string, force) + TINY))


@formula
def is_at_end(string: String, s: float) -> bool:
    """True if the sum of the elements' lengths equals the cable's but for rounding."""
    return s >= string.length * (1.0 - 1e-12)


@formula
def element_length(string: String, start: float, omega: float, phase: float) -> float:
    """Length of the element that begins at a material point [m]."""
    size = string.length - start
    for _ in range(2000):
        allowed = _longest_element(string, start, start + size, omega, phase)
        if size <= allowed:
            break
        size = max(allowed, 0.5 * size)
    return size if start + 1.0001 * size < string.length else string.length - start
