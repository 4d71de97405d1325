"""Nodes of Gauss and Lobatto, by degree, as the spectral elements of cables take them."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.polynomial import legendre
from scipy.special import roots_jacobi

from sagline.core.arrays import Array, locked
from sagline.kernels.dynamics.spectral_elements import LARGEST_DEGREE, Lobatto


@cache
def lobatto() -> Lobatto:
    """The nodes and what belongs to them.

    Returns:
        Lobatto, its arrays in rows by degree.
    """
    n = LARGEST_DEGREE + 1
    rule = Lobatto(np.zeros((n, n)), np.zeros((n, n)), np.zeros((n, n, n)), np.zeros((n, n, n)))
    for p in range(2, n):
        nodes = np.concatenate(([-1.0], roots_jacobi(p - 1, 1.0, 1.0)[0], [1.0]))
        values = np.asarray(legendre.legvander(nodes, p + 1), dtype=np.float64)
        weights = np.asarray(2.0 / (p * (p + 1) * values[:, p] ** 2))
        rule.nodes[p, : p + 1], rule.weights[p, : p + 1] = nodes, weights
        rule.slopes[p, : p + 1, : p + 1] = _slopes(nodes, values[:, p])
        rule.integrals[p, : p + 1, : p + 1] = _integrals(weights, values)
    for field in rule:
        locked(field)
    return rule


def _slopes(nodes: Array, last: Array) -> Array:
    """Slopes at the nodes of the polynomials that are 1 at one of them; last: Legendre's of the degree there."""
    apart = nodes[:, None] - nodes
    np.fill_diagonal(apart, 1.0)
    slopes = last[:, None] / last / apart
    np.fill_diagonal(slopes, 0.0)
    np.fill_diagonal(slopes, -slopes.sum(axis=1))  # a constant has none
    return np.asarray(slopes)


def _integrals(weights: Array, values: Array) -> Array:
    """Integrals from -1 to the nodes of the same polynomials; values: Legendre's to one degree more at the nodes."""
    p = weights.size - 1
    scale = np.arange(p + 1) + 0.5
    scale[p] = 0.5 * p  # the rule makes more of its square
    shares = scale[:, None] * (values[:, : p + 1] * weights[:, None]).T  # of Legendre's polynomials, a node a column
    odd = 2.0 * np.arange(1, p + 1) + 1.0
    sums = np.column_stack((values[:, 0] + values[:, 1], (values[:, 2:] - values[:, :p]) / odd))
    return np.asarray(sums @ shares)
