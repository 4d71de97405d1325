"""Piecewise polynomials through values and derivatives at knots."""

from __future__ import annotations

from math import comb, factorial
from typing import Any

import numpy as np

from sagline.core.arrays import Array


def piecewise(knots: Array, values: Array, at_end: int) -> Any:
    """The piecewise polynomial with given derivatives at both ends of every piece: of 7th degree for four of each.

    Args:
        knots: Strictly increasing, shape (n,), n >= 2.
        values: Value and first K - 1 derivatives at the knots, shape (K, n).
        at_end: How many of them hold at the end of the last piece, from the value on.

    Returns:
        scipy's PPoly, which goes on beyond the outermost knots.
    """
    from scipy.interpolate import PPoly  # takes longer to load than all the rest of motion

    step = np.diff(knots)
    known = len(values)
    # derivatives as Taylor coefficients of a piece, its length taken as 1
    left, right = (values[:, part] * _powers(step, known) for part in (slice(None, -1), slice(1, None)))
    pieces = np.concatenate((left, np.zeros_like(left)))
    pieces[:, :-1] = _pieces(left[:, :-1], right[:, :-1])
    last = _pieces(left[:, -1:], right[:at_end, -1:])
    pieces[: len(last), -1:] = last
    return PPoly((pieces / step ** np.arange(2 * known)[:, None])[::-1], knots, extrapolate=True)


def _powers(step: Array, count: int) -> Array:
    return np.array([step**k / factorial(k) for k in range(count)])


def _pieces(left: Array, right: Array) -> Array:
    """Coefficients of ascending order from Taylor coefficients at both ends, shape (left + right, pieces)."""
    low, high = len(left), len(right)
    binomials = np.array([[float(comb(i, j)) for i in range(low + high)] for j in range(high)])
    rest = np.linalg.solve(binomials[:, low:], right - binomials[:, :low] @ left)
    return np.concatenate((left, rest))
