"""Work arrays of the methods that are not projections, kept between iterations of one pose."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.linear_program import Basis, new_basis
from sagline.kernels.codes import LOWEST_SUM
from sagline.kernels.jit import glue
from sagline.kernels.memory import Memory, block, counters
from sagline.kernels.tension.polygon import SPARE_CORNERS


class WorkArrays(NamedTuple):
    """Memory with a meaning.

    Attributes:
        corners: Of the feasible polygon, (2m + SPARE_CORNERS, 2).
        labels: Of its sides, (2m + SPARE_CORNERS,).
        known: How many corners the polygon of the last round had, (1,); 0 for none.
        basis: Of the linear program of the last round.
        rest: Memory that keeps nothing.
    """

    corners: Array
    labels: Indices
    known: Indices
    basis: Basis
    rest: Memory


@glue
def new_work_arrays(method: int, memory: Memory, m: int, r: int) -> WorkArrays:
    """Work arrays for m cables, r of them redundant."""
    corner_count = 2 * m + SPARE_CORNERS
    corners, at = block(memory.numbers, 0, corner_count, 2)
    known, after = counters(memory, 0, 1)
    labels, after = counters(memory, after, corner_count)
    rest = Memory(memory.numbers[at:], memory.counters[after:])
    basis, rest = new_basis(rest, r if method == LOWEST_SUM else r + 1)
    return WorkArrays(corners, labels, known, basis, rest)


@glue
def reset_work_arrays(room: WorkArrays) -> None:
    """A new pose: nothing is known from the one before."""
    room.known[0] = 0
    room.basis.labels[0] = -1
