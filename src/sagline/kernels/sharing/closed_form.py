"""The closed-form ways of sharing: near the middle of the limits, without a search. They do not find every answer."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.algebra.gram_schmidt import keep, take_out
from sagline.kernels.algebra.strips import HIGH, LOW, START, TOLERANCE, largest_number
from sagline.kernels.codes import CLOSED_FORM, PUNCTURE
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.sharing.nearest import within_limits

DEPENDENT = 1e-10  # square of what is left of a cable's row once the cables before it are held


@kernel
def share_near_middle(method: int, strips: Array, null: Array, memory: Memory, tension: Array) -> bool:
    """Fill the tensions (m,) by the closed form, the improved closed form or the puncture method.

    Returns:
        Whether the method found tensions within their limits.

    Source:
        Pott, Bruckmann & Mikelsons 2009; Pott 2014; Mueller, Reichert & Bruckmann 2015.
    """
    r, m = null.shape
    slack = TOLERANCE * largest_number(strips)
    for i in range(m):
        tension[i] = strips[START, i]
    if method == PUNCTURE and within_limits(strips, tension, slack):
        return True
    for k in range(r):
        share = 0.0
        for i in range(m):
            share += null[k, i] * 0.5 * (strips[LOW, i] + strips[HIGH, i])
        for i in range(m):
            tension[i] += null[k, i] * share
    if method == CLOSED_FORM:
        return within_limits(strips, tension, slack)
    if not hold_violated(strips, null, slack, memory, tension):
        return False
    if method == PUNCTURE:
        puncture(strips, tension)
    return True


@glue
def hold_violated(strips: Array, null: Array, slack: float, memory: Memory, tension: Array) -> bool:
    """Hold the cable that misses its limit most at that limit, and share the rest again, until all keep theirs.

    Works on the tensions, by orthogonal steps in the null space; a cable once held stays there.
    """
    r, m = null.shape
    held, at = block(memory.numbers, 0, r + 1, r)
    triangle, at = block(memory.numbers, at, r + 1, r + 1)
    for count in range(r + 1):
        worst = slack
        cable = -1
        limit = 0.0
        for i in range(m):
            if strips[LOW, i] - tension[i] > worst:
                worst = strips[LOW, i] - tension[i]
                cable = i
                limit = strips[LOW, i]
            if tension[i] - strips[HIGH, i] > worst:
                worst = tension[i] - strips[HIGH, i]
                cable = i
                limit = strips[HIGH, i]
        if cable < 0:
            return True
        if count == r:
            return False
        for k in range(r):
            held[count, k] = null[k, cable]
        square = take_out(held, count, triangle)
        if square < DEPENDENT:
            return False
        step = (limit - tension[cable]) / square
        for i in range(m):
            for k in range(r):
                tension[i] += step * held[count, k] * null[k, i]
        keep(held, count, triangle, square)
    return False


@glue
def puncture(strips: Array, tension: Array) -> None:
    """Move the tensions back towards the minimum norm, START, as far as the limits let them."""
    m = tension.size
    share = 0.0  # 0 at the minimum norm, 1 where we are
    for i in range(m):
        start = strips[START, i]
        way = tension[i] - start
        if start < strips[LOW, i] and way > 0.0:
            share = max(share, min((strips[LOW, i] - start) / way, 1.0))
        if start > strips[HIGH, i] and way < 0.0:
            share = max(share, min((strips[HIGH, i] - start) / way, 1.0))
    for i in range(m):
        tension[i] = strips[START, i] + share * (tension[i] - strips[START, i])
