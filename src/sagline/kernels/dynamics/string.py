"""One cable as a string that vibrates about its catenary, and compliance of the cable between exit point and drum."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import end_motion_per_length
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.terms import Model, Terms, model_of
from sagline.kernels.jit import entry, formula

# columns of the table of strings; a string is a cable in vibration
HORIZONTAL, VERTICAL = 0, 1  # T_x, T_z on the platform end [N]
LENGTH = 2  # unstrained length of the free span [m]
WEIGHT = 3  # weight per length [N/m]
STIFFNESS = 4  # EA [N]
DENSITY = 5  # [kg/m]
# compliance [m/N] of the cable between frame end and drum: (x, z)^T (x, z) in the plane, and one value normal to it
BEHIND_X, BEHIND_Z, BEHIND_Y = 6, 7, 8  # x and z in [sqrt(m/N)]
STRING_COLUMNS = 9

SMOOTH = 0.5  # length of the longest element in which the flexibility C is smooth, divided by (least force)/w
TINY = 1e-300


class String(NamedTuple):
    """A cable at rest."""

    horizontal: float  # T_x [N]
    vertical: float  # T_z on the platform end [N]
    length: float  # unstrained length L [m]
    weight: float  # w [N/m]
    stiffness: float  # EA [N]
    density: float  # rho [kg/m]


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
    """Vertical part of the force in the cable [N] at the length `s` from the frame end."""
    return string.vertical - string.weight * (string.length - s)


@formula
def _least_force(string: String, start: float, end: float) -> float:
    """Least force between the material points `start` and `end` [N]."""
    low, high = vertical_at(string, start), vertical_at(string, end)
    vertical = max(low, -high, 0.0)
    return math.sqrt(string.horizontal * string.horizontal + vertical * vertical)


@formula
def slowness(string: String, force: float) -> float:
    """Travel time of a transverse wave per meter of unstrained cable [s/m] under the force `force`."""
    return math.sqrt(string.density * (1.0 / (force + TINY) + 1.0 / string.stiffness))


@formula
def shortest_wave(string: String, omega: float) -> float:
    """Half the wavelength of a transverse wave [m] at the largest force, where the wave is longest."""
    low, high = abs(vertical_at(string, 0.0)), abs(string.vertical)
    force = math.hypot(string.horizontal, max(low, high))
    return math.pi / (omega * slowness(string, force) + TINY)


@formula
def _longest_element(string: String, start: float, end: float, omega: float, phase: float) -> float:
    """Length [m] of the longest element in an interval, for a smooth C and at most `phase` [rad] of a wave."""
    force = _least_force(string, start, end)
    return min(SMOOTH * force / (string.weight + TINY), phase / (omega * slowness(string, force) + TINY))


@formula
def is_at_end(string: String, s: float) -> bool:
    """True if the sum of the elements' lengths differs from the cable's length only by rounding."""
    return s >= string.length * (1.0 - 1e-12)


@formula
def element_length(string: String, start: float, omega: float, phase: float) -> float:
    """Length of the element that begins at the material point `start` [m]."""
    size = string.length - start
    for _ in range(2000):
        allowed = _longest_element(string, start, start + size, omega, phase)
        if size <= allowed:
            break
        size = max(allowed, 0.5 * size)
    return size if start + 1.0001 * size < string.length else string.length - start


@entry
def fill_routing_compliance(
    terms: Terms, robots: Array, wraps: Array, leaving: Array, rows: Array, strings: Array
) -> None:
    """Fill the compliances in the table of strings, (N, m, STRING_COLUMNS), for cables with pulleys or dead lengths."""
    # terms: Cable model.
    # robots: cable_table, (1 or N, m, CABLE_COLUMNS).
    # wraps: Wrap angles [rad], (N, m).
    # leaving: Tensions at the exit points [N], (N, m).
    # rows: Work array, (CABLE_ROWS, m).
    # strings: Table of strings, whose other columns are already filled.
    bare = model_of(terms)
    model = Model(bare.code, bare.k_h, bare.k_p, bare.gravity, True)
    for p in range(strings.shape[0]):
        cables = robots[min(p, robots.shape[0] - 1)]
        for i in range(strings.shape[1]):
            rows[g.WRAP, i], rows[g.LEAVING, i] = wraps[p, i], leaving[p, i]
            rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i] = math.sin(wraps[p, i]), math.cos(wraps[p, i])
            x, z, gives = end_motion_per_length(model, cables, rows, i)
            root = math.sqrt(gives)
            strings[p, i, BEHIND_X], strings[p, i, BEHIND_Z] = root * x, root * z
            # the whole plane of the cable turns about the swivel axis
            slack = pulley_at(cables, i).radius * (1.0 - rows[g.WRAP_COSINE, i])
            strings[p, i, BEHIND_Y] = slack / strings[p, i, HORIZONTAL] if slack > 0.0 else 0.0
