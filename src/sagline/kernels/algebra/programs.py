"""Optimal points within all bounds: the point of least linear cost, and the point nearest to a target.

The linear program has few unknowns and is solved by the dual simplex method. The method moves from point to point; each
point is optimal for the sides that are active there. The method ends at a point that satisfies all bounds, or at a side
that contradicts the active sides, which proves infeasibility. If only the limits of the bounds change, the active sides
of the last solution remain optimal, and the next search starts from them.

The nearest point, for any number of unknowns, is found by a dual active-set method; docs/model.md, section 5. The
method starts from the target. The search adds violated sides one by one, and drops sides with a negative multiplier,
until all sides are satisfied. The active sides of a similar problem are tried first: they are usually active.

Source:
    Goldfarb & Idnani 1983, "A numerically stable dual method for solving strictly convex quadratic programs", with
    the identity as its matrix.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.algebra.bounds import TOLERANCE, box_radius, inward, largest_bound, most_violated_bound, side_of
from sagline.kernels.algebra.factors import copy, normalize_row, orthogonalize_row
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, counters, vector

LP_SOLVED, LP_EMPTY, LP_UNBOUNDED, LP_GAVE_UP = 0, 1, 2, 3
PIVOTS = 2000
CAREFUL = 60  # number of pivots after which ties are decided by label (Bland's rule), so that the search cannot cycle
ROUNDING = 4e-16  # rounding error of a point, relative to its largest coordinate
PIVOT = 1e-11  # smallest pivot, relative to the largest entry of the row


class Basis(NamedTuple):
    """The active sides of an optimal point, from which the next program with equal rows and cost can start."""

    # A finite limit must stay finite in the next program, because a side at infinity cannot be active.

    # labels of the active sides, (d + 1,). If the bounds have no common point, the last entry is the side that
    # contradicts the others. labels[0] is -1 if there is no basis. Labels from 2k on are sides of a box that replaces
    # infinity.
    labels: Indices
    weights: Array  # multipliers of the infeasibility proof, (d + 1,), >= 0
    inverse: Array  # inverse of the matrix of the normals of the active sides, (d, d)


@glue
def new_basis(memory: Memory, d: int) -> tuple[Basis, Memory]:
    """Work arrays for d unknowns, and the remaining memory."""
    weights, memory = vector(memory, d + 1)
    inverse, memory = block(memory, d, d)
    labels, memory = counters(memory, d + 1)
    return Basis(labels, weights, inverse), memory


@formula
def _growth_along_edge(rows: Array, label: int, inverse: Array, j: int) -> float:
    """Growth of the product normal . x along edge `j` of the basis; the normal is that of the side `label`."""
    total = 0.0
    for i in range(inverse.shape[0]):
        total += rows[i, label // 2] * inverse[i, j]
    return inward(label) * total


@formula
def _violation(rows: Array, bounds: Array, label: int, radius: float, cost: Array, point: Array) -> float:
    """Violation of the side `label` by `point`. Labels of 2k and more are sides of the box that replaces infinity."""
    box = label - 2 * rows.shape[1]
    if box >= 0:
        return -radius - (point[box] if cost[box] >= 0.0 else -point[box])
    miss = side_of(bounds, label)
    for i in range(point.size):
        miss -= inward(label) * rows[i, label // 2] * point[i]
    return miss


@glue
def _start_at_box_corner(rows: Array, cost: Array, radius: float, basis: Basis, point: Array) -> None:
    """Start at the corner of the box with the least cost."""
    labels, weights, inverse = basis
    d = cost.size
    for k in range(d):
        sign = 1.0 if cost[k] >= 0.0 else -1.0
        inverse[k] = 0.0
        inverse[k, k] = sign
        labels[k] = 2 * rows.shape[1] + k
        weights[k] = abs(cost[k])
        point[k] = -radius * sign


@glue
def _exchange_sides(rows: Array, entering: int, leaving: int, miss: float, basis: Basis, point: Array) -> None:
    """Replace the side `leaving` of the basis by the violated side `entering`, and move `point` to the new vertex."""
    labels, weights, inverse = basis
    d = point.size
    pivot = _growth_along_edge(rows, entering, inverse, leaving)
    ratio = weights[leaving] / pivot
    for i in range(d):
        point[i] += inverse[i, leaving] * (miss / pivot)
    for j in range(d):
        if j != leaving:
            share = _growth_along_edge(rows, entering, inverse, j)
            weights[j] = max(weights[j] - ratio * share, 0.0)
            for i in range(d):
                inverse[i, j] -= share / pivot * inverse[i, leaving]
    for i in range(d):
        inverse[i, leaving] /= pivot
    weights[leaving] = max(ratio, 0.0)
    labels[leaving] = entering


@glue
def _move_to_vertex(rows: Array, bounds: Array, cost: Array, radius: float, basis: Basis, point: Array) -> None:
    """Move `point` to the intersection of the sides of the basis, with two steps of iterative refinement."""
    d = point.size
    for _ in range(3):
        for j in range(d):
            miss = _violation(rows, bounds, basis.labels[j], radius, cost, point)
            for i in range(d):
                point[i] += basis.inverse[i, j] * miss


@kernel
def lowest_point(rows: Array, bounds: Array, cost: Array, slack: float, basis: Basis, point: Array) -> int:
    """Fill `point` (d,) with the point of least cost . x within all bounds. Returns the outcome."""
    # `slack`: allowed violation of a bound; 0 for the usual tolerance. At the box that replaces infinity: unbounded.
    labels, weights, inverse = basis
    d = cost.size
    largest = largest_bound(bounds)
    radius = box_radius(largest, bounds)
    if slack == 0.0:
        slack = TOLERANCE * largest
    if labels[0] < 0:
        _start_at_box_corner(rows, cost, radius, basis, point)
    else:
        point[:] = 0.0
        _move_to_vertex(rows, bounds, cost, radius, basis, point)
    for pivots in range(PIVOTS):
        careful = pivots > CAREFUL
        far = 0.0
        for k in range(d):
            far = max(far, abs(point[k]))
        seen = max(slack, ROUNDING * d * far)  # far from the origin, a rounding error can exceed the slack
        entering = most_violated_bound(rows, bounds, point, seen, careful)
        if entering < 0:
            _move_to_vertex(rows, bounds, cost, radius, basis, point)  # removes the rounding errors of many pivots
            entering = most_violated_bound(rows, bounds, point, seen, careful)
        if entering < 0:
            outcome = LP_SOLVED
            for j in range(d):
                if labels[j] >= 2 * rows.shape[1] and weights[j] > 0.0:
                    outcome = LP_UNBOUNDED
            return outcome
        largest_share = 0.0
        for j in range(d):
            largest_share = max(largest_share, abs(_growth_along_edge(rows, entering, inverse, j)))
        leaving = -1
        pivot = 0.0
        least = math.inf
        for j in range(d):
            share = _growth_along_edge(rows, entering, inverse, j)
            if share > PIVOT * largest_share:
                ratio = weights[j] / share
                tied = leaving >= 0 and ratio == least
                if ratio < least or (tied and (labels[j] < labels[leaving] if careful else share > pivot)):
                    least, leaving, pivot = ratio, j, share
        if leaving < 0:
            for j in range(d):
                weights[j] = max(-_growth_along_edge(rows, entering, inverse, j), 0.0)
            labels[d] = entering
            weights[d] = 1.0
            return LP_EMPTY
        _exchange_sides(rows, entering, leaving, _violation(rows, bounds, entering, radius, cost, point), basis, point)
    return LP_GAVE_UP


EXCHANGES = 2000
DEPENDENT = 1e-10  # least part of a side's normal outside the span of the other normals

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
    """Fill `point`, the point on all active sides that is nearest to `target`. False if `point` is not optimal."""
    labels, frame, triangle, pushes = held
    count, d = labels[0], point.size
    copy(target, point)
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
    """Fill `point` (d,), the nearest to `target` (d,) within all bounds, up to `slack`. False if no such point exists.

    `held`: active sides of a similar problem, or labels[0] = 0; overwritten with the active sides of the point.
    """
    labels, frame, triangle, pushes = held
    d = target.size
    if labels[0] > 0 and not _point_on_active_sides(rows, bounds, held, target, point):
        labels[0] = 0
    if labels[0] == 0:
        copy(target, point)
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
