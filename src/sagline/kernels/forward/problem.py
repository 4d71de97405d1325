"""What the forward kernels pass to each other: the pose to find, and the memory to work in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, Codes
from sagline.kernels import tables
from sagline.kernels.balance import geometry as g
from sagline.kernels.cable.forces import FORCE_ROWS
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import glue


class Problem(NamedTuple):
    """One pose to find: the cable model, what the robot is, and what is given.

    Attributes:
        model: Cable model.
        freedom: Rows that pick the free motions, (n, 6).
        cables: Rows of the cable_table, (m, CABLE_COLUMNS).
        body: Row of the body_table, (BODY_COLUMNS,).
        lengths: Unstrained lengths [m], (m,).
        wrench: External plus inertial, about the center of mass, (6,).
        scale: Unit of each free motion [m or rad], (n,): what counts as equally far.
    """

    model: Model
    freedom: Array
    cables: Array
    body: Array
    lengths: Array
    wrench: Array
    scale: Array


class Space(NamedTuple):
    """Working memory for m cables and n free motions; `unbalance` and `platform_stiffness` say what they fill."""

    rotation: Array  # (3, 3)
    geometry: Array  # (GEOMETRY_ROWS, m)
    result: Array  # (RESULT_ROWS, m)
    memory: Array  # (FORCE_ROWS, m)
    statuses: Codes  # (m,)
    gradient: Array  # (6,)
    stiffness: Array  # (6, 6)
    matrix: Array  # (n, n)
    factor: Array  # (n, n)
    part: Array  # (n,)
    work: Array  # (n,)
    step: Array  # (n,)
    motion: Array  # (6,)
    trial: Array  # (7,)


@glue
def new_space(m: int, n: int) -> Space:
    """Working memory for m cables and n free motions."""
    return Space(
        np.empty((3, 3)),
        np.empty((g.GEOMETRY_ROWS, m)),
        np.empty((tables.RESULT_ROWS, m)),
        np.full((FORCE_ROWS, m), np.nan),
        np.empty(m, dtype=np.int8),
        np.empty(6),
        np.empty((6, 6)),
        np.empty((n, n)),
        np.empty((n, n)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(6),
        np.empty(7),
    )
