"""The closed-form ways of sharing: near the middle of the limits, without a search. They do not find every answer."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.kernels.codes import CLOSED_FORM, PUNCTURE
from sagline.kernels.jit import kernel
from sagline.kernels.tables import HIGH, LOW, SHARED, START

DEPENDENT = 1e-10  # square of what is left of a cable's row once the cables before it are held


@kernel
def share_near_middle(method: int, work: Array, null: Array, slack: float) -> bool:
    """Fill the shared tensions by the closed form, the improved closed form or the puncture method.

    Returns:
        Whether the method found tensions within their limits.

    Source:
        Pott, Bruckmann & Mikelsons 2009; Pott 2014; Mueller, Reichert & Bruckmann 2015.
    """
    r, m = null.shape
    if method == PUNCTURE:
        for i in range(m):
            work[SHARED, i] = work[START, i]
        if keeps_to(work, slack):
            return True
    for i in range(m):
        work[SHARED, i] = work[START, i]
    for k in range(r):
        share = 0.0
        for i in range(m):
            share += null[k, i] * 0.5 * (work[LOW, i] + work[HIGH, i])
        for i in range(m):
            work[SHARED, i] += null[k, i] * share
    if method == CLOSED_FORM:
        return keeps_to(work, slack)
    if not hold_violated(work, null, slack):
        return False
    if method == PUNCTURE:
        puncture(work)
    return True


@kernel
def keeps_to(work: Array, slack: float) -> bool:
    """Whether every shared tension keeps its limits, up to a slack."""
    for i in range(work.shape[1]):
        if not work[LOW, i] - slack <= work[SHARED, i] <= work[HIGH, i] + slack:
            return False
    return True


@kernel
def hold_violated(work: Array, null: Array, slack: float) -> bool:
    """Hold the cable that misses its limit most at that limit, and share the rest again, until all keep theirs.

    Works on SHARED, by orthogonal steps in the null space; a cable once held stays there.
    """
    r, m = null.shape
    held = np.empty((r, r))
    rest = np.empty(r)
    for count in range(r + 1):
        worst = slack
        cable = -1
        limit = 0.0
        for i in range(m):
            if work[LOW, i] - work[SHARED, i] > worst:
                worst = work[LOW, i] - work[SHARED, i]
                cable = i
                limit = work[LOW, i]
            if work[SHARED, i] - work[HIGH, i] > worst:
                worst = work[SHARED, i] - work[HIGH, i]
                cable = i
                limit = work[HIGH, i]
        if cable < 0:
            return True
        if count == r:
            return False
        for k in range(r):
            rest[k] = null[k, cable]
        for _ in range(2):
            for c in range(count):
                share = 0.0
                for k in range(r):
                    share += held[c, k] * rest[k]
                for k in range(r):
                    rest[k] -= share * held[c, k]
        square = 0.0
        for k in range(r):
            square += rest[k] * rest[k]
        if square < DEPENDENT:
            return False
        step = (limit - work[SHARED, cable]) / square
        for i in range(m):
            for k in range(r):
                work[SHARED, i] += step * rest[k] * null[k, i]
        for k in range(r):
            held[count, k] = rest[k] / np.sqrt(square)
    return False


@kernel
def puncture(work: Array) -> None:
    """Move the shared tensions back towards the minimum norm, START, as far as the limits let them."""
    m = work.shape[1]
    share = 0.0  # 0 at the minimum norm, 1 where we are
    for i in range(m):
        way = work[SHARED, i] - work[START, i]
        if work[START, i] < work[LOW, i] and way > 0.0:
            share = max(share, min((work[LOW, i] - work[START, i]) / way, 1.0))
        if work[START, i] > work[HIGH, i] and way < 0.0:
            share = max(share, min((work[HIGH, i] - work[START, i]) / way, 1.0))
    for i in range(m):
        work[SHARED, i] = work[START, i] + share * (work[SHARED, i] - work[START, i])
