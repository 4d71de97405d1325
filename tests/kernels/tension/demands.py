"""Weightless cables and their demands as kernel arguments."""

from __future__ import annotations

import numpy as np

from sagline.core.arrays import Array
from sagline.kernels.cable.sag_forces import TURN_ROWS, Curves
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import STRAIGHT
from sagline.kernels.tension.least_change import Demand, TensionChange
from tests.kernels.cable.plain import plain_cables


def weightless(low: Array, high: Array) -> Curves:
    """Curves of cables without weight between limits (m,)."""
    m = len(low)
    given = {"density": np.zeros(m), "half_weight": np.zeros(m), "stiffness": np.full(m, 1e6)}
    cables = plain_cables(m, 1.0, **given, low=low.copy(), high=high.copy())
    return Curves(Model(STRAIGHT, 0.0, 0.0, 9.81), cables, np.full((TURN_ROWS, m), np.nan), np.zeros(m, dtype=np.int8))


def demand_of(matrix: Array, right: Array, soft: int) -> Demand:
    """Demand of weightless cables with a structure matrix (n, m), whose first rows are forces."""
    return Demand(matrix.copy(), np.zeros_like(matrix), right.copy(), soft, float(np.abs(right).max()))


def change_from(tau: Array, n: int) -> TensionChange:
    """A search that begins at tensions (m,); other memory must be written before it is read."""
    return TensionChange(tau.copy(), np.full(len(tau), np.nan), np.full(n, np.nan), np.full(n, np.nan))
