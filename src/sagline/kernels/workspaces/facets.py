"""Facets of the available wrench set: normals to all subsets of n - 1 columns of the structure matrix.

Elimination with complete pivoting turns n columns, the basis, into unit vectors. Each row is then a normal to all
columns of the basis except one. The other r = m - n columns are not in the basis. A facet contains k of the other
columns. It also contains all columns of the basis except k + 1 of them. Its normal is a combination of k + 1 rows. The
coefficients are the k x k minors of the k columns in these rows. Laplace's expansion computes them from the minors of k
- 1 columns. The subsets of the other columns are visited depth first. A loop without branches computes all normals of a
subset. A normal with rounding errors is still a valid direction for the margin.
"""

from __future__ import annotations

from itertools import combinations
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory, block, counters

# relative to the largest entry, as in `kernels.algebra.factors`; if a pivot is smaller, the rank is not full
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


class Facets(NamedTuple):
    """State of the walk over the facets."""

    # One row per column of the basis, (n, m + 7): components along the m columns, six components in world axes, and the
    # sum of the absolute values of these six components, with moments times the lever arm.
    table: Array
    others: Array  # components of the other columns along the rows, scaled to a largest entry of 1, (r, n)
    minors: Array  # minors of the present subset and of its leading parts, for each set of rows, (n, 2^n)
    basis: Indices  # index of the basis column of each row, (n,)
    chosen: Indices  # present subset of the other columns, from index 1 on, (n + 1,)


@glue
def new_facets(memory: Memory, n: int, m: int) -> tuple[Facets, Memory]:
    """Work arrays for n free motions and m cables, and the remaining memory."""
    table, memory = block(memory, n, m + 7)
    others, memory = block(memory, m - n, n)
    minors, memory = block(memory, n, 1 << n)
    basis, memory = counters(memory, n)
    chosen, memory = counters(memory, n + 1)
    return Facets(table, others, minors, basis, chosen), memory


@glue
def choose_basis(facets: Facets, n: int, m: int, lever: float) -> bool:
    """Eliminate in place, and fill the fields `basis` and `others`. False if the rank is not full."""
    table, basis = facets.table, facets.basis
    first = 0.0
    for k in range(n):
        row = column = -1
        largest = 0.0
        for j in range(k, n):
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
        for j in range(n):
            if j != k:
                _subtract_row(table[j], table[j, column], table[k])
                table[j, column] = 0.0
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
def next_subset(facets: Facets, n: int, depth: int) -> int:
    """Advance to the next subset of the other columns, and fill its minors. Returns its size, or -1 after the last.

    depth: size of the present subset; the first subset is empty.
    """
    chosen, others, minors = facets.chosen, facets.others, facets.minors
    r = others.shape[0]
    if depth < n - 1 and (0 if depth == 0 else chosen[depth] + 1) < r:
        chosen[depth + 1] = -1 if depth == 0 else chosen[depth]
        depth += 1
    while depth > 0 and chosen[depth] == r - 1:
        depth -= 1
    if depth == 0:
        return -1
    chosen[depth] += 1
    column = others[chosen[depth]]
    for s in range(START[n, depth], START[n, depth + 1]):
        rows = ORDER[n, s]
        total = 0.0
        sign = 1.0
        for j in range(depth):
            k = MEMBERS[rows, j]
            total += sign * column[k] * minors[depth - 1, rows ^ (1 << k)]
            sign = -sign
        minors[depth, rows] = total
    return depth
