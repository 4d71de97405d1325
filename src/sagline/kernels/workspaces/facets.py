"""Facets of the available wrench set: normals to all subsets of n - 1 columns of the structure matrix.

Elimination with complete pivoting turns n columns, the basis, into unit vectors. Each row is then a normal to all
columns of the basis except one. The other r = m - n columns are not in the basis. A facet contains k of the other
columns and n - 1 - k columns of the basis. The normal of the facet is a combination of k + 1 rows. The coefficients of
the k + 1 rows are the k x k minors of the k columns. Laplace's expansion computes these minors from the minors of k - 1
columns. Loops over many subsets of the other columns vectorize: the subsets of up to three columns are in order of
their last column, so that all subsets of the columns before a further column are the first ones. Further columns are
added depth first. A normal with rounding errors is still a valid direction for the margin.
"""

from __future__ import annotations

from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters

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
        _scale_row(table[k], 1.0 / table[k, column])
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
def _scale_row(row: Array, factor: float) -> None:
    """Multiply `row` by `factor`."""
    for j in range(row.size):
        row[j] *= factor


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
        c0, c1, c2, c3, c4, c5 = signed_entries(rows, facets.others[column])
        out = minors[rows, first:]
        for c in range(count):
            out[c] = c0 * m0[c] + c1 * m1[c] + c2 * m2[c] + c3 * m3[c] + c4 * m4[c] + c5 * m5[c]


@formula
def signed_entries(rows: int, column: Array) -> tuple[float, float, float, float, float, float]:
    """Entries of a column in `rows`, with the signs of Laplace's expansion; the last ones are zero."""
    return (
        SIGNS[rows, 0] * column[MEMBERS[rows, 0]], SIGNS[rows, 1] * column[MEMBERS[rows, 1]],
        SIGNS[rows, 2] * column[MEMBERS[rows, 2]], SIGNS[rows, 3] * column[MEMBERS[rows, 3]],
        SIGNS[rows, 4] * column[MEMBERS[rows, 4]], SIGNS[rows, 5] * column[MEMBERS[rows, 5]],
    )  # fmt: skip
