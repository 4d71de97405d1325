"""Bounds of the margins of many facets together, and the weights of the facets of a pose.

Let y be the normal of a facet. The product of y with a column of the structure matrix is a minor of one column more.
Thus the products of many normals with a column are a sum of a few rows of minors. The least value of the available
wrench set along y, minus the demand, follows from these products. Sets of wrenches, sag forces and rounding errors
change the margin of a facet at most by the slack, a number that is the same for all facets of a pose.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.workspaces.facets import FEWER, MEMBERS, Facets, most_subsets, signed_entries
from sagline.kernels.workspaces.wrench_set import WrenchSetArrays

ROUNDING_ERROR = 1e-13  # of a margin, relative to the sum of all forces times the condition of the basis

# Rows of the cables' weights (COUNT_ROWS, m).
WIDTH = 0  # half the range of the tensions
BELOW_SECANT, ABOVE_SECANT = 1, 2  # least and largest difference of the sag force from its secant
LEVER_X, LEVER_Y = 3, 4
COLUMN = 5  # wrench of the secant per newton of chord tension, six rows
COUNT_ROWS = 11

# columns of the terms of a bound
WEIGHT = 6
ROW, FORCE = 0, 1  # of a column of the basis: length of its row, and its norm
TERM_COLUMNS = 7


class FacetWeights(NamedTuple):
    """Weights of the facets of one pose."""

    rows: Array  # rows of the cables' weights, (COUNT_ROWS, m)
    middle: Array  # wrench of the cables at the middle of their secants minus the demand, (6,)
    high: Array  # upper limits [N], (m,)
    endless: bool  # True if a cable has no upper limit
    curved: bool  # True if a sag force differs from its secant
    arm: float  # lever arm of the norm [m]
    lever: float  # mean lever arm [m] that divides moments in the search for normals; 1 without a lever arm


class Bounds(NamedTuple):
    """Work arrays for the bounds of many facets."""

    # One row per column of the basis, one per other column, and one for the demand. The last two kinds contain the
    # entries along the rows of the basis, (m + 1, TERM_COLUMNS).
    terms: Array
    first: int  # index of the first other column
    excess: Array  # excess of a lower bound over the limit, times the length of the normal, (subsets,)


@glue
def new_bounds(memory: Memory, n: int, m: int) -> tuple[Bounds, Memory]:
    """Work arrays for n free motions and m cables, and the remaining memory."""
    terms, memory = block(memory, m + 1, TERM_COLUMNS)
    excess, memory = vector(memory, most_subsets(n, m))
    return Bounds(terms, n, excess), memory


@kernel
def fill_bounds(facets: Facets, m: int, counts: FacetWeights, wrenches: WrenchSetArrays, terms: Array) -> float:
    """Fill the terms of the bounds. Returns the slack."""
    n = facets.basis.size
    table, rows, corners, arm = facets.table, counts.rows, wrenches.corners, counts.arm
    terms[:] = 0.0
    for j in range(m - n):
        for k in range(n):
            terms[n + j, k] = table[k, facets.outside[j]]
        terms[n + j, WEIGHT] = rows[WIDTH, facets.outside[j]]
    terms[m, WEIGHT] = -1.0
    for a in range(6):
        demand = counts.middle[a]
        first = 0
        for p in range(wrenches.sizes.size):
            demand += corners[first, a]
            first += wrenches.sizes[p]
        for k in range(n):
            terms[m, k] += table[k, m + a] * demand
    slack = condition = 0.0
    forces = _force(counts.middle, arm)
    for i in range(m):
        forces += rows[WIDTH, i] * _force_of_column(rows, i, arm)
        x, y = rows[LEVER_X, i] / arm, rows[LEVER_Y, i] / arm
        slack += max(-rows[BELOW_SECANT, i], rows[ABOVE_SECANT, i]) * math.sqrt(1.0 + x * x + y * y)
    for k in range(n):
        terms[k, WEIGHT] = rows[WIDTH, facets.basis[k]]
        terms[k, ROW] = _force(table[k, m:], 1.0 / arm)
        terms[k, FORCE] = _force_of_column(rows, facets.basis[k], arm)
        condition += terms[k, FORCE] * terms[k, ROW]
    slack += _reach(wrenches, arm)
    return slack + ROUNDING_ERROR * condition * (forces + slack)


@glue
def _reach(wrenches: WrenchSetArrays, arm: float) -> float:
    """Largest extent of the set from the first corners of its polytopes [N]."""
    square = reach = 0.0
    for s in range(6):
        square += _force(wrenches.own[s], arm) ** 2
    for s in range(6, 9):
        reach += _force(wrenches.own[s], arm)
    for s in range(wrenches.segments.shape[0]):
        reach += _force(wrenches.segments[s], arm)
    for e in range(wrenches.ellipsoids.shape[0]):
        for j in range(6):
            reach += _force(wrenches.ellipsoids[e, j], arm)
    first = 0
    for p in range(wrenches.sizes.size):
        largest = 0.0
        for c in range(first + 1, first + wrenches.sizes[p]):
            largest = max(largest, _force(wrenches.corners[first], arm) + _force(wrenches.corners[c], arm))
        reach += largest
        first += wrenches.sizes[p]
    return math.sqrt(square) + reach


@formula
def _force(wrench: Array, arm: float) -> float:
    """Norm of a wrench [N], with moments divided by the lever arm."""
    return math.sqrt(
        wrench[0] * wrench[0] + wrench[1] * wrench[1] + wrench[2] * wrench[2]
        + (wrench[3] * wrench[3] + wrench[4] * wrench[4] + wrench[5] * wrench[5]) / (arm * arm)
    )  # fmt: skip


@formula
def _force_of_column(rows: Array, i: int, arm: float) -> float:
    """Norm of the column of a cable."""
    force = moment = 0.0
    for a in range(3):
        force += rows[COLUMN + a, i] * rows[COLUMN + a, i]
        moment += rows[COLUMN + 3 + a, i] * rows[COLUMN + 3 + a, i]
    return math.sqrt(force + moment / (arm * arm))


@kernel
def measure_bounds(minors: Array, rows: int, members: int, count: int, limit: float, bounds: Bounds) -> None:
    """Fill the excess of the bounds over `limit` for the facets of `rows`, a set of `members`, and each subset."""
    # The coefficients of a normal bound its length: it is at most their sum with the lengths of the rows, and at least
    # their sum divided by the sum of the norms of the columns.
    terms, excess = bounds.terms, bounds.excess
    excess[:count] = 0.0
    forces = 0.0
    for j in range(members):
        forces += terms[MEMBERS[rows, j], FORCE]
    for j in range(members):
        k = MEMBERS[rows, j]
        minor = minors[rows ^ (1 << k)]
        weight = terms[k, WEIGHT] - limit * (terms[k, ROW] if limit > 0.0 else 1.0 / forces)
        for c in range(count):
            excess[c] += weight * abs(minor[c])
    m0, m1, m2 = minors[FEWER[rows, 0]], minors[FEWER[rows, 1]], minors[FEWER[rows, 2]]
    m3, m4, m5 = minors[FEWER[rows, 3]], minors[FEWER[rows, 4]], minors[FEWER[rows, 5]]
    for t in range(bounds.first, terms.shape[0]):
        c0, c1, c2, c3, c4, c5 = signed_entries(rows, terms[t])
        weight = terms[t, WEIGHT]
        for c in range(count):
            along = c0 * m0[c] + c1 * m1[c] + c2 * m2[c] + c3 * m3[c] + c4 * m4[c] + c5 * m5[c]
            excess[c] += weight * abs(along)
