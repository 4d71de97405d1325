"""The point within all bounds that is nearest to a target, for any number of unknowns: a dual active-set method.

The method starts from the target. It adds violated sides one by one, and drops sides with a negative multiplier, until
all sides are satisfied; docs/model.md, section 5. The search starts with the active sides of a similar problem, which
are usually also active in the solution.

Source:
    Goldfarb & Idnani 1983, "A numerically stable dual method for solving strictly convex quadratic programs", with
    the identity as its matrix.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import inward, most_violated_bound, side_of
from sagline.kernels.algebra.factors import normalize_row, orthogonalize_row
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block, counters

EXCHANGES = 2000
DEPENDENT = 1e-10  # a side counts as dependent on the others if the part of its normal outside their span is smaller

# rows of `pushes`
PUSH, SHARE = 0, 1  # multipliers of the active sides, and components of the entering side


class ActiveSet(NamedTuple):
    """The active sides of a nearest point, and work arrays."""

    labels: Indices  # number of active sides, then their labels, (d + 2,)
    frame: Array  # orthonormal frame of the active sides, and a row for the entering side, (d + 1, d)
    triangle: Array  # triangular factor, (d + 1, d + 1)
    pushes: Array  # rows PUSH and SHARE, (2, d + 1)


@glue
def new_active_set(memory: Memory, d: int) -> tuple[ActiveSet, Memory]:
    """Work arrays for d unknowns, and the remaining memory."""
    frame, memory = block(memory, d + 1, d)
    triangle, memory = block(memory, d + 1, d + 1)
    pushes, memory = block(memory, 2, d + 1)
    labels, memory = counters(memory, d + 2)
    return ActiveSet(labels, frame, triangle, pushes), memory


@glue
def _point_on_active_sides(rows: Array, bounds: Array, held: ActiveSet, target: Array, point: Array) -> bool:
    """Fill the point on all active sides that is nearest to `target`. False if this point is not optimal."""
    labels, frame, triangle, pushes = held
    count, d = labels[0], point.size
    for k in range(d):
        point[k] = target[k]
    for c in range(count):  # distance of the active sides from the target, along row c of the frame
        label = labels[1 + c]
        miss = side_of(bounds, label)
        size = 0.0
        for k in range(d):
            frame[c, k] = inward(label) * rows[k, label // 2]
            size += frame[c, k] * frame[c, k]
            miss -= frame[c, k] * target[k]
        square = orthogonalize_row(frame, c, triangle)
        if not square > DEPENDENT * size:
            return False
        normalize_row(frame, c, triangle, square)
        for b in range(c):
            miss -= triangle[b, c] * pushes[SHARE, b]
        pushes[SHARE, c] = miss / triangle[c, c]
        for k in range(d):
            point[k] += pushes[SHARE, c] * frame[c, k]
    for c in range(count - 1, -1, -1):
        push = pushes[SHARE, c]
        for b in range(c + 1, count):
            push -= triangle[c, b] * pushes[PUSH, b]
        pushes[PUSH, c] = push / triangle[c, c]
        if pushes[PUSH, c] < 0.0:
            return False
    return True


@glue
def _drop_side(rows: Array, held: ActiveSet, leaving: int) -> None:
    """Release the active side with the index `leaving`, and update the frame of the remaining sides."""
    labels, frame, triangle, pushes = held
    count = labels[0] - 1
    labels[0] = count
    for c in range(leaving, count):
        labels[1 + c] = labels[2 + c]
        pushes[PUSH, c] = pushes[PUSH, c + 1]
    for c in range(leaving, count):
        for k in range(rows.shape[0]):
            frame[c, k] = inward(labels[1 + c]) * rows[k, labels[1 + c] // 2]
        normalize_row(frame, c, triangle, orthogonalize_row(frame, c, triangle))


@kernel
def nearest_point(rows: Array, bounds: Array, target: Array, slack: float, held: ActiveSet, point: Array) -> bool:
    """Fill the point (d,) within all bounds (up to `slack`) that is nearest to `target` (d,). False if none exists.

    held: active sides of a similar problem, or labels[0] = 0 if there is none. They are overwritten with the active
        sides of the point.
    """
    labels, frame, triangle, pushes = held
    d = target.size
    if labels[0] > 0 and not _point_on_active_sides(rows, bounds, held, target, point):
        labels[0] = 0
    if labels[0] == 0:
        for k in range(d):
            point[k] = target[k]
    for exchange in range(EXCHANGES):
        entering = most_violated_bound(rows, bounds, point, slack, exchange > EXCHANGES // 2)
        if entering < 0:
            return True
        push = 0.0
        for _ in range(d + 1):
            count = labels[0]
            size = 0.0
            for k in range(d):
                frame[count, k] = inward(entering) * rows[k, entering // 2]
                size += frame[count, k] * frame[count, k]
            square = orthogonalize_row(frame, count, triangle)
            first = math.inf
            leaving = -1
            for c in range(count - 1, -1, -1):
                share = triangle[c, count]
                for b in range(c + 1, count):
                    share -= triangle[c, b] * pushes[SHARE, b]
                pushes[SHARE, c] = share / triangle[c, c]
            for c in range(count):
                if pushes[SHARE, c] > 0.0 and pushes[PUSH, c] / pushes[SHARE, c] < first:
                    first = pushes[PUSH, c] / pushes[SHARE, c]
                    leaving = c
            full = math.inf
            if count < d and square > DEPENDENT * DEPENDENT * size:
                miss = side_of(bounds, entering)
                for k in range(d):
                    miss -= inward(entering) * rows[k, entering // 2] * point[k]
                full = max(miss, 0.0) / square
            step = min(first, full)
            if step == math.inf:
                labels[0] = 0
                return False
            for c in range(count):
                pushes[PUSH, c] -= step * pushes[SHARE, c]
            push += step
            if full < math.inf:
                for k in range(d):
                    point[k] += step * frame[count, k]
            if full <= first:
                labels[1 + count] = entering
                pushes[PUSH, count] = push
                normalize_row(frame, count, triangle, square)
                labels[0] = count + 1
                break
            _drop_side(rows, held, leaving)
    labels[0] = 0
    return False
