"""Facets of the available wrench set: normals to all subsets of n - 1 columns of the structure matrix.

Elimination with complete pivoting turns n columns, the basis, into unit vectors. Each row is then a normal to all
columns of the basis except one. The other r = m - n columns are not in the basis. A facet contains k of the other
columns and n - 1 - k columns of the basis. The normal of the facet is a combination of k + 1 rows. The coefficients of
the k + 1 rows are the k x k minors of the k columns. Laplace's expansion computes these minors from the minors of k - 1
columns. Loops over many subsets of the other columns vectorize: the subsets of up to three columns are in order of
their last column, so that all subsets of the columns before a further column are the first ones. Further columns are
added depth first. A normal with rounding errors is still a valid direction for the margin.

Let y be the normal of a facet. The product of y with a column of the structure matrix is a minor of one column more.
Thus the products of many normals with a column are a sum of a few rows of minors. The least value of the available
wrench set along y, minus the demand, follows from these products. Sets of wrenches, sag forces and rounding errors
change the margin of a facet at most by the slack, a number that is the same for all facets of a pose.
"""

from __future__ import annotations

import math
from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters, vector
from sagline.kernels.workspaces.wrench_set import WrenchSetArrays

# the rank is not full if a pivot is smaller, relative to the largest entry (as in `kernels.algebra.factors`)
RANK = 1e-9
DEPENDENT = 1e-10  # columns with a smaller minor count as linearly dependent
LIMIT = 1 << 40  # largest number of steps, which is never reached
MOST_FREE = 6  # largest number of free motions

# Subsets of up to six rows, as bits. Subsets of size k of n rows are ORDER[n, START[n, k] : START[n, k + 1]].
_SUBSETS = [
    [sum(1 << i for i in chosen) for k in range(n + 1) for chosen in combinations(range(n), k)]
    for n in range(MOST_FREE + 1)
]
ORDER: Final = np.array([subsets + [0] * (64 - len(subsets)) for subsets in _SUBSETS])
START: Final = np.array(
    [[sum(bits.bit_count() < k for bits in subsets) for k in range(MOST_FREE + 2)] for subsets in _SUBSETS]
)
MEMBERS: Final = np.array([([i for i in range(6) if bits >> i & 1] + [0] * 6)[:6] for bits in range(64)])
# Laplace's expansion: signs of the terms, 0 for terms that do not exist, and the rows without the row of the term
SIGNS: Final = np.array([[(-1.0) ** j * (j < bits.bit_count()) for j in range(6)] for bits in range(64)])
FEWER: Final = np.array(
    [[bits & ~(1 << int(MEMBERS[bits, j if j < bits.bit_count() else 0])) for j in range(6)] for bits in range(64)]
)
AT_ONCE = 3  # largest number of other columns whose subsets are all stored


class Facets(NamedTuple):
    """State of the walk over the facets."""

    # One row per column of the basis, (n, m + 7): components along the m columns, six components in world axes, and the
    # sum of the absolute values of these six components, with moments times the lever arm.
    table: Array
    others: Array  # components of the other columns along the rows, scaled to a largest entry of 1, (r, n)
    minors: Array  # minors of the present subsets and of their leading parts, for each set of rows, (2^n, subsets)
    basis: Indices  # index of the basis column of each row, (n,)
    outside: Indices  # indices of the other columns, (r,)
    chosen: Indices  # further columns of the present subsets, from index AT_ONCE + 1 on, (n + 1,)


@formula
def _subsets_of(count: int, size: int) -> int:
    """Number of subsets of `size` elements of a set of `count` elements, for a size of at most AT_ONCE."""
    ways = 1
    for k in range(size):
        ways = ways * (count - k) // (k + 1)
    return ways


@formula
def most_subsets(n: int, m: int) -> int:
    """Largest number of subsets that are present together."""
    r = m - n
    return max(1, r, r * (r - 1) // 2, r * (r - 1) * (r - 2) // 6)


@glue
def new_facets(memory: Memory, n: int, m: int) -> tuple[Facets, Memory]:
    """Work arrays for n free motions and m cables, and the remaining memory."""
    table, memory = block(memory, n, m + 7)
    others, memory = block(memory, m - n, n)
    minors, memory = block(memory, 1 << n, most_subsets(n, m))
    basis, memory = counters(memory, n)
    outside, memory = counters(memory, m - n)
    chosen, memory = counters(memory, n + 1)
    return Facets(table, others, minors, basis, outside, chosen), memory


@glue
def choose_basis(facets: Facets, n: int, m: int, lever: float, full: bool) -> bool:
    """Eliminate in place, and fill the columns and the minors of single columns. False if the rank is not full."""
    # If not `full`, only the rank is found, with pivots from one row at a time.
    table, basis = facets.table, facets.basis
    width = m + 7 if full else m
    first = 0.0
    for k in range(n):
        row = column = -1
        largest = 0.0
        for j in range(k, n if full else k + 1):
            for i in range(m):
                if abs(table[j, i]) > largest:
                    largest = abs(table[j, i])
                    row, column = j, i
        first = max(first, largest)
        if not largest > RANK * first:
            return False
        _exchange_rows(table, k, row)
        basis[k] = column
        scale = 1.0 / table[k, column]
        for j in range(table.shape[1]):
            table[k, j] *= scale
        for j in range(0 if full else k, n):
            if j != k:
                _subtract_row(table[j, :width], table[j, column], table[k])
                table[j, column] = 0.0
    if not full:
        return True
    for k in range(n):
        for a in range(6):
            table[k, m + 6] += abs(table[k, m + a]) * (1.0 if a < 3 else lever)
    count = 0
    for i in range(m):
        inside = False
        for k in range(n):
            inside = inside or basis[k] == i
        if not inside:
            largest = 0.0
            for k in range(n):
                largest = max(largest, abs(table[k, i]))
            for k in range(n):
                facets.others[count, k] = table[k, i] / largest if largest > 0.0 else 0.0
                facets.minors[1 << k, count] = facets.others[count, k]
            facets.outside[count] = i
            count += 1
    return True


@formula
def _exchange_rows(table: Array, k: int, row: int) -> None:
    """Exchange the rows `k` and `row`."""
    for j in range(table.shape[1]):
        table[k, j], table[row, j] = table[row, j], table[k, j]


@formula
def _subtract_row(row: Array, factor: float, other: Array) -> None:
    """Subtract `factor` times the row `other` from `row`."""
    for j in range(row.size):
        row[j] -= factor * other[j]


@glue
def next_subsets(facets: Facets, n: int, size: int) -> tuple[int, int]:
    """Advance to the next subsets of the other columns, and fill their minors. Returns their size and their number."""
    # size: size of the present subsets; the first subset is empty. The size after the last subsets is -1.
    chosen, r = facets.chosen, facets.others.shape[0]
    if size < min(AT_ONCE, n - 1, r):
        size += 1
        for i in range(size - 1 if size > 1 else r, r):  # `choose_basis` fills the minors of single columns
            _add_column(facets, n, size, i, _subsets_of(i, size - 1), _subsets_of(i, size))
        chosen[size] = AT_ONCE - 1
        return size, _subsets_of(r, size)
    if AT_ONCE <= size < n - 1 and chosen[size] + 1 < r:
        chosen[size + 1] = chosen[size]
        size += 1
    while size > AT_ONCE and chosen[size] == r - 1:
        size -= 1
    if size <= AT_ONCE:
        return -1, 0
    chosen[size] += 1
    count = _subsets_of(chosen[AT_ONCE + 1], AT_ONCE)
    _add_column(facets, n, size, chosen[size], count, 0)
    return size, count


@kernel
def _add_column(facets: Facets, n: int, size: int, column: int, count: int, first: int) -> None:
    """Fill the minors of the first `count` subsets together with another column, from the index `first` on."""
    minors = facets.minors
    for s in range(START[n, size], START[n, size + 1]):
        rows = ORDER[n, s]
        m0, m1, m2 = minors[FEWER[rows, 0]], minors[FEWER[rows, 1]], minors[FEWER[rows, 2]]
        m3, m4, m5 = minors[FEWER[rows, 3]], minors[FEWER[rows, 4]], minors[FEWER[rows, 5]]
        c0, c1, c2, c3, c4, c5 = _signed_entries(rows, facets.others[column])
        out = minors[rows, first:]
        for c in range(count):
            out[c] = c0 * m0[c] + c1 * m1[c] + c2 * m2[c] + c3 * m3[c] + c4 * m4[c] + c5 * m5[c]


@formula
def _signed_entries(rows: int, column: Array) -> tuple[float, float, float, float, float, float]:
    """Entries of a column in `rows`, with the signs of Laplace's expansion; the last ones are zero."""
    return (
        SIGNS[rows, 0] * column[MEMBERS[rows, 0]], SIGNS[rows, 1] * column[MEMBERS[rows, 1]],
        SIGNS[rows, 2] * column[MEMBERS[rows, 2]], SIGNS[rows, 3] * column[MEMBERS[rows, 3]],
        SIGNS[rows, 4] * column[MEMBERS[rows, 4]], SIGNS[rows, 5] * column[MEMBERS[rows, 5]],
    )  # fmt: skip


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
        c0, c1, c2, c3, c4, c5 = _signed_entries(rows, terms[t])
        weight = terms[t, WEIGHT]
        for c in range(count):
            along = c0 * m0[c] + c1 * m1[c] + c2 * m2[c] + c3 * m3[c] + c4 * m4[c] + c5 * m5[c]
            excess[c] += weight * abs(along)
