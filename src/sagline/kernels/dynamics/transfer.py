"""An element of a vibrating cable: what takes displacement and force at its start to those at its end, exactly.

u' = C f, f' = -mu u about rest, by collocation at eight Gauss points; docs/model.md, section 11. Out of the cable's
plane it is one equation, in it two; both go through the same code, with real numbers or, where something takes energy,
with complex ones.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.kernels.dynamics.string import String, vertical_at
from sagline.kernels.jit import glue

Numbers = Any  # an array of float64 or complex128
STAGES = 8


def _gauss() -> tuple[Array, Array, Array]:
    """Nodes on [0, 1], weights and integrals from 0 to the nodes of Gauss collocation."""
    nodes, weights = np.polynomial.legendre.leggauss(STAGES)
    basis = [np.polynomial.legendre.Legendre.basis(k) for k in range(STAGES)]
    values = np.array([one(nodes) for one in basis])
    integrals = np.array([one.integ(lbnd=-1.0)(nodes) for one in basis])
    scale = np.arange(STAGES) + 0.5
    lagrange = values * weights * scale[:, None]  # of Legendre's polynomials, one node a column
    return 0.5 * (nodes + 1.0), 0.5 * weights, np.ascontiguousarray(0.5 * (integrals.T @ lagrange))


NODES, WEIGHTS, INTEGRALS = (locked(values) for values in _gauss())  # kernels take them as they are once compiled


class Wave(NamedTuple):
    """Terms of the two wave equations at a frequency: mu, and the factors of C across and along the cable."""

    mu: Any
    across: Any
    along: Any


@glue
def fill_flexibility(string: String, wave: Wave, start: float, size: float, normal: bool, c: Numbers) -> None:
    """Fill C at the stages of an element, (STAGES, 3): xx, xz, zz; normal to the plane the first only."""
    for k in range(STAGES):
        vertical = vertical_at(string, start + NODES[k] * size)
        square = string.horizontal * string.horizontal + vertical * vertical
        turn = wave.across * (1.0 / math.sqrt(square) + 1.0 / string.stiffness)
        if normal:
            c[k, 0] = turn
        else:
            less = (wave.along / string.stiffness - turn) / square
            c[k, 0] = turn + less * string.horizontal * string.horizontal
            c[k, 1] = less * string.horizontal * vertical
            c[k, 2] = turn + less * vertical * vertical


@glue
def fill_integral(c: Numbers, size: float, d: int, phi: Numbers) -> None:
    """Fill the integral of C over an element, (d, d)."""
    for a in range(d):
        for b in range(d):
            total = 0.0 * c[0, 0]
            for k in range(STAGES):
                total += WEIGHTS[k] * c[k, a + b]
            phi[a, b] = size * total


@glue
def _fill_stages(c: Numbers, mu: Any, size: float, d: int, system: Numbers) -> None:
    """Fill the equations of u at the stages, (STAGES d, STAGES d), and right of them their sides for u, f at 0."""
    scale = size * size * mu
    n = STAGES * d
    for i in range(STAGES):
        for a in range(d):
            row = system[i * d + a]
            for j in range(n):
                row[j] = 0.0
            for b in range(d):
                row[n + b] = 1.0 if a == b else 0.0
                total = 0.0 * mu
                for k in range(STAGES):
                    weighted = INTEGRALS[i, k] * c[k, a + b]
                    total += weighted
                    weighted *= scale
                    for j in range(STAGES):
                        row[j * d + b] += weighted * INTEGRALS[k, j]
                row[n + d + b] = size * total
            row[i * d + a] += 1.0


@glue
def _solve_in_place(system: Numbers, n: int, columns: int) -> None:
    """Solve n equations for the columns that follow them, in their place."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if best != k:
            for j in range(k, columns):
                system[k, j], system[best, j] = system[best, j], system[k, j]
        inverse = 1.0 / system[k, k]
        for i in range(k + 1, n):
            ratio = system[i, k] * inverse
            for j in range(k + 1, columns):
                system[i, j] -= ratio * system[k, j]
    for r in range(n):
        i = n - 1 - r
        for k in range(i + 1, n):
            ratio = system[i, k]
            for j in range(n, columns):
                system[i, j] -= ratio * system[k, j]
        inverse = 1.0 / system[i, i]
        for j in range(n, columns):
            system[i, j] *= inverse


@glue
def transfer(c: Numbers, mu: Any, size: float, d: int, system: Numbers, phi: Numbers) -> None:
    """Fill the transfer matrix (2 d, 2 d) of an element: u, f at its end by u, f at its start."""
    n = STAGES * d
    _fill_stages(c, mu, size, d, system)
    _solve_in_place(system, n, n + 2 * d)
    for column in range(2 * d):
        for a in range(d):
            phi[a, column] = 1.0 if a == column else 0.0
            phi[d + a, column] = 1.0 if d + a == column else 0.0
        for k in range(STAGES):
            for b in range(d):
                force = 0.0 * mu + (1.0 if d + b == column else 0.0)
                for j in range(STAGES):
                    force -= size * mu * INTEGRALS[k, j] * system[j * d + b, n + column]
                for a in range(d):
                    phi[a, column] += size * WEIGHTS[k] * c[k, a + b] * force
                phi[d + b, column] -= size * mu * WEIGHTS[k] * system[k * d + b, n + column]
