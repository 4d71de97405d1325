"""Scalar data of one cable: inputs and outputs of kernels for a single cable.

These records cost no time in compiled code, because the compiler turns a NamedTuple into separate numbers.
"""

from __future__ import annotations

from typing import NamedTuple

from sagline.kernels.jit import glue

# a Model as Python passes it: a plain tuple, whose type numba identifies faster
Terms = tuple[int, float, float, float]


class Model(NamedTuple):
    """Cable model with the local gravity."""

    code: int  # code of the equations
    k_h: float  # the empirical model's constant of the sag force
    k_p: float  # the empirical model's constant of the sag
    gravity: float  # [m/s^2]
    # True if cables with given lengths may have pulleys or dead lengths; if None, the code for pulleys is not compiled
    behind: bool | None = None


@glue
def model_of(terms: Terms) -> Model:
    """Convert the plain tuple `terms` from Python to a `Model`."""
    return Model(terms[0], terms[1], terms[2], terms[3], None)


class Material(NamedTuple):
    """Material of a cable."""

    density: float  # mass per length [kg/m]
    stiffness: float  # EA [N]


class Chord(NamedTuple):
    """The straight line from a cable's frame end to its platform end."""

    length: float  # D [m]
    sine: float  # sin phi
    cosine: float  # cos phi


class Force(NamedTuple):
    """Force on a cable at its platform end, in the cable's vertical plane."""

    horizontal: float  # T_x [N]
    vertical: float  # T_z [N], up positive
    tension: float  # chord tension tau [N]


class PlaneStiffness(NamedTuple):
    """Stiffness of a cable's platform end in the cable's vertical plane [N/m]; rows: force, columns: displacement."""

    xx: float
    xz: float
    zx: float
    zz: float
