"""The facets of the wrenches that cables can exert: normals to all (n - 1)-subsets of the structure matrix's columns.

Sorted subsets are walked depth first, and each column takes one row out of a table, by a pivot among the rows. The
last row is the normal y along the table's columns: y . J_i of all cables, y in world axes, and y . c of further columns
come together. A normal's own component of 1 in that row keeps them consistent to the last digits whatever the pivots.
"""

from __future__ import annotations

from typing import NamedTuple

from sagline.arrays import Array, Indices
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory, block, counters

DEPENDENT = 1e-10  # of the largest entry of a column: what is left of one that depends on those before it
LIMIT = 1 << 40  # of steps: more than there can be


class Facets(NamedTuple):
    """Where the walk is.

    Attributes:
        tables: One of n - d rows for each depth d, of m + 6 + others columns, (n, n, columns).
        chosen: Cables of the present subset, (n - 1,).
    """

    tables: Array
    chosen: Indices


@glue
def new_facets(memory: Memory, n: int, columns: int) -> tuple[Facets, Memory]:
    """Room for n free motions, and the memory that is left."""
    rows, at = block(memory.numbers, 0, n * n, columns)
    chosen, used = counters(memory, 0, n)
    return Facets(rows.reshape((n, n, columns)), chosen), Memory(memory.numbers[at:], memory.counters[used:])


@formula
def eliminate(table: Array, rows: int, c: int, smallest: float, out: Array) -> bool:
    """Take column c out of the first rows of a table, and one row with it; False where it depends on earlier ones."""
    pivot = 0
    largest = abs(table[0, c])
    for k in range(1, rows):
        if abs(table[k, c]) > largest:
            largest = abs(table[k, c])
            pivot = k
    if not largest > smallest:
        return False
    inverse = 1.0 / table[pivot, c]
    for k in range(rows - 1):
        source = k if k < pivot else k + 1
        factor = table[source, c] * inverse
        for j in range(table.shape[1]):
            out[k, j] = table[source, j] - factor * table[pivot, j]
        out[k, c] = 0.0
    return True
