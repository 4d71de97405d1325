"""The words of one cable, as scalars: what kernels of a single cable take and give.

They cost nothing in compiled code, where a NamedTuple of numbers is its numbers.
"""

from __future__ import annotations

from typing import NamedTuple

from sagline.kernels.jit import glue

Terms = tuple[int, float, float, float]  # a Model as it comes from Python: numba knows plain tuples three times faster


class Model(NamedTuple):
    """A cable model where it stands.

    Attributes:
        code: Which equations.
        k_h: The empirical model's constant of the pull.
        k_p: The empirical model's constant of the sag.
        gravity: [m/s^2].
        behind: Whether cables of given lengths may have something behind them; None leaves that out of the machine
            code, which then is that of bare cables.
    """

    code: int
    k_h: float
    k_p: float
    gravity: float
    behind: bool | None = None


@glue
def model_of(terms: Terms) -> Model:
    """A cable model as it comes from Python."""
    return Model(terms[0], terms[1], terms[2], terms[3], None)


class Material(NamedTuple):
    """Material of a cable.

    Attributes:
        density: Mass per length [kg/m].
        stiffness: EA [N].
    """

    density: float
    stiffness: float


class Chord(NamedTuple):
    """The straight line from a cable's frame end to its platform end.

    Attributes:
        length: D [m].
        sine: sin phi.
        cosine: cos phi.
    """

    length: float
    sine: float
    cosine: float


class Force(NamedTuple):
    """Force on a cable at its platform end.

    Attributes:
        horizontal: T_x [N].
        vertical: T_z [N], up positive.
        tension: tau, the chord tension [N].
    """

    horizontal: float
    vertical: float
    tension: float


class PlaneStiffness(NamedTuple):
    """Stiffness of a cable's platform end in the cable's vertical plane [N/m]: rows force, columns displacement."""

    xx: float
    xz: float
    zx: float
    zz: float
