"""Nearest distributions and least norms: minimum norm, closest tensions, quadratic program, sum, maximum, p-norm.

docs/model.md, section 5. Objective (55) of the article selects the tensions closest to given tensions t_ref. In
coordinates of an orthonormal null-space basis N, the selected tensions are the projection of lambda_ref = N^T (t_ref -
t0) onto the feasible set. The distribution of minimum norm is the projection of 0. Sum and maximum are linear programs.
A p-norm is minimized by Newton steps, each projected onto the feasible set with distances in the metric of the step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes
from sagline.kernels.algebra import programs
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS, TOLERANCE, largest_bound, most_violated_bound
from sagline.kernels.algebra.factors import factor_positive, solve_lower, solve_upper
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector


class Distribution(NamedTuple):
    """Tension distribution of one pose."""

    method: int  # code of the method
    parameter: float  # exponent of the p-norm, or code of the optimum of the polygon walk
    variable: int  # code of the variable of the distribution
    weight: Array  # root weights of the cables, (m,)
    goal: Array  # target tensions of the quadratic program [N], (m,)


class ReferencePoint(NamedTuple):
    """Reference point of a nearest-point method, in coordinates of the null space."""

    previous: Array  # reference tensions in the distribution's variable (m,), NaN without a reference
    reference: Array  # lambda_ref, (r,)
    held: programs.ActiveSet  # active limits of the last projection
    point: Array  # result of the last projection, (r,)


@glue
def new_reference_point(memory: Memory, previous: Array, r: int) -> tuple[ReferencePoint, Memory]:
    """Work arrays for r redundant cables, and the remaining memory."""
    rows, memory = block(memory, 2, r)
    held, memory = programs.new_active_set(memory, r)
    return ReferencePoint(previous, rows[0], held, rows[1]), memory


@glue
def set_reference(distribution: Distribution, offset: Array, null: Array, near: ReferencePoint) -> None:
    """Fill the reference point of `distribution` in the null space."""
    # `offset`: offset of the distribution's variable (m,).
    from_before = distribution.method == codes.CLOSEST and not math.isnan(near.previous[0])
    for k in range(null.shape[0]):
        near.reference[k] = 0.0
        for i in range(null.shape[1]):
            goal = near.previous[i] if from_before else distribution.goal[i]
            near.reference[k] += null[k, i] * distribution.weight[i] * (goal - offset[i])


@formula
def set_point(bounds: Array, null: Array, point: Array, tension: Array) -> None:
    """Fill the tensions (m,) of `point` in the null space."""
    for i in range(tension.size):
        tension[i] = bounds[START, i]
    for k in range(point.size):
        for i in range(tension.size):
            tension[i] += null[k, i] * point[k]


@formula
def satisfies_limits(bounds: Array, tension: Array, slack: float) -> bool:
    """True if every tension is within its limits up to the tolerance `slack`."""
    for i in range(tension.size):
        if not bounds[LOW, i] - slack <= tension[i] <= bounds[HIGH, i] + slack:
            return False
    return True


@glue
def share_nearest(bounds: Array, null: Array, near: ReferencePoint, tension: Array) -> int:
    """Fill the tensions (m,) nearest to the reference. Returns POSE_SOLVED or POSE_INFEASIBLE."""
    set_point(bounds, null, near.reference, tension)
    if satisfies_limits(bounds, tension, 0.0):
        near.held.labels[0] = 0
        return codes.POSE_SOLVED
    slack = TOLERANCE * largest_bound(bounds)
    if null.shape[0] == 0:
        return codes.POSE_SOLVED if satisfies_limits(bounds, tension, slack) else codes.POSE_INFEASIBLE
    if not programs.nearest_point(null, bounds, near.reference, slack, near.held, near.point):
        return codes.POSE_INFEASIBLE
    set_point(bounds, null, near.point, tension)
    return codes.POSE_SOLVED


@glue
def is_nearest(distribution: Distribution) -> bool:
    """True if `distribution` gives the feasible tensions nearest to a reference."""
    return distribution.method <= codes.QUADRATIC_PROGRAM


TIED = 1e-10  # sums with a smaller relative difference count as equal; a smaller relative weight counts as zero


@formula
def program_status(outcome: int) -> int:
    """Status of the pose that belongs to the outcome of a linear program."""
    if outcome == programs.LP_SOLVED:
        return codes.POSE_SOLVED
    if outcome == programs.LP_UNBOUNDED:
        return codes.POSE_UNBOUNDED
    return codes.POSE_NOT_CONVERGED if outcome == programs.LP_GAVE_UP else codes.POSE_INFEASIBLE


@formula
def _is_tied(basis: programs.Basis) -> bool:
    """True if a linear program has more than one optimum, which means that an active bound has a multiplier of zero."""
    largest = 0.0
    least = math.inf
    for j in range(basis.weights.size - 1):
        largest = max(largest, basis.weights[j])
        least = min(least, basis.weights[j])
    return least <= TIED * largest


@kernel
def share_lowest_sum(bounds: Array, null: Array, near: ReferencePoint, basis: programs.Basis, memory: Memory) -> int:
    """Fill `near.point` (r,) with the null-space point whose tensions have the least sum."""
    # If several points have the least sum, the point nearest to the reference is selected.
    r, m = null.shape
    cost, memory = vector(memory, r)
    for k in range(r):
        cost[k] = 0.0
        for i in range(m):
            cost[k] += null[k, i]
    outcome = programs.lowest_point(null, bounds, cost, 0.0, basis, near.point)
    if outcome != programs.LP_SOLVED:
        basis.labels[0] = -1
        return program_status(outcome)
    if not _is_tied(basis):
        return codes.POSE_SOLVED
    rows, memory = block(memory, r, m + 1)
    tied, memory = block(memory, STRIP_ROWS, m + 1)
    found, memory = vector(memory, r)
    least = 0.0
    for k in range(r):
        rows[k, m] = cost[k]
        least += cost[k] * near.point[k]
    for i in range(m):
        for k in range(r):
            rows[k, i] = null[k, i]
        for row in range(STRIP_ROWS):
            tied[row, i] = bounds[row, i]
    largest = largest_bound(bounds)
    tied[START, m], tied[LOW, m], tied[HIGH, m] = 0.0, -math.inf, least + TIED * largest
    if programs.nearest_point(rows, tied, near.reference, TOLERANCE * largest, near.held, found):
        for k in range(r):
            near.point[k] = found[k]
    return codes.POSE_SOLVED


@kernel
def share_lowest_maximum(
    bounds: Array, offset: Array, null: Array, near: ReferencePoint, basis: programs.Basis, memory: Memory
) -> int:
    """Fill the point (r,) of `near` with the least maximum tension; of several points, the nearest to the reference."""
    # The program's last unknown is the largest tension.
    r, m = null.shape
    rows, memory = block(memory, r + 1, 2 * m)
    wide, memory = block(memory, STRIP_ROWS, 2 * m)
    lower, memory = block(memory, STRIP_ROWS, m)
    vectors, memory = block(memory, 3, r + 1)
    cost, found, nearest = vectors[0], vectors[1], vectors[2, :r]
    for i in range(m):
        for k in range(r):
            rows[k, i] = null[k, i]
            rows[k, m + i] = -null[k, i]
        rows[r, i] = 0.0
        rows[r, m + i] = 1.0
        for row in range(STRIP_ROWS):
            wide[row, i] = bounds[row, i]
        # largest tension minus tension of cable i >= 0
        wide[START, m + i], wide[LOW, m + i], wide[HIGH, m + i] = -bounds[START, i] - offset[i], 0.0, math.inf
    cost[:r] = 0.0
    cost[r] = 1.0
    largest = largest_bound(bounds)
    outcome = programs.lowest_point(rows, wide, cost, TOLERANCE * largest, basis, found)
    if outcome != programs.LP_SOLVED:
        basis.labels[0] = -1
        return codes.POSE_INFEASIBLE if program_status(outcome) == codes.POSE_INFEASIBLE else codes.POSE_NOT_CONVERGED
    for k in range(r):
        near.point[k] = found[k]
    if not _is_tied(basis):
        return codes.POSE_SOLVED
    for i in range(m):
        for row in range(STRIP_ROWS):
            lower[row, i] = bounds[row, i]
        highest = found[r] - offset[i] + 4.0 * TOLERANCE * largest
        lower[HIGH, i] = max(min(bounds[HIGH, i], highest), bounds[LOW, i])
    if programs.nearest_point(null, lower, near.reference, TOLERANCE * largest, near.held, nearest):
        for k in range(r):
            near.point[k] = nearest[k]
    return codes.POSE_SOLVED


STEPS = 200
HALVINGS = 40
CLOSE = 1e-2  # the exponent is increased after a step below this share of the largest tension
STILL = 1e-12  # the search ends after a step below this share of the largest tension


@kernel
def share_by_norm(
    p: float, bounds: Array, offset: Array, null: Array, near: ReferencePoint, known: Indices, memory: Memory
) -> int:
    """Fill the point (r,) of `near` whose tensions have the least p-norm."""
    # `known`: (1,); if True, the point is the result of the previous iteration, and the search starts at this point.
    point = near.point
    slack = TOLERANCE * largest_bound(bounds)
    if known[0] > 0:
        last, _ = vector(memory, point.size)
        for k in range(point.size):
            last[k] = point[k]
        kept = programs.nearest_point(null, bounds, last, slack, near.held, point)
        if kept and _lowest_p_norm(p, p, bounds, offset, null, near, memory):
            return codes.POSE_SOLVED
    known[0] = 0
    near.held.labels[0] = 0
    if not programs.nearest_point(null, bounds, near.reference, slack, near.held, point):
        return codes.POSE_INFEASIBLE
    if not _lowest_p_norm(min(4.0, p), p, bounds, offset, null, near, memory):
        return codes.POSE_NOT_CONVERGED
    known[0] = 1
    return codes.POSE_SOLVED


@formula
def _tension_at(bounds: Array, null: Array, point: Array, i: int) -> float:
    """Tension of cable `i` at `point` of the null space, in the distribution's variable without its offset."""
    tension = bounds[START, i]
    for k in range(point.size):
        tension += null[k, i] * point[k]
    return tension


@formula
def _p_norm_power(bounds: Array, offset: Array, null: Array, point: Array, p: float, scale: float) -> float:
    """Sum of the p-th powers of tension/scale."""
    total = 0.0
    for i in range(null.shape[1]):
        total += abs((_tension_at(bounds, null, point, i) + offset[i]) / scale) ** p
    return total


@glue
def _newton_target(
    bounds: Array, offset: Array, null: Array, point: Array, p: float, slope: Array, curve: Array, target: Array
) -> float:
    """Fill slope, Cholesky factor of the curvature, and end point of a Newton step that ignores the limits."""
    # Returns the largest tension [N], which is the unit of slope and curvature. A result of 0 means: no step is needed.
    r, m = null.shape
    scale = 0.0
    for i in range(m):
        scale = max(scale, abs(_tension_at(bounds, null, point, i) + offset[i]))
    slope[:] = 0.0
    curve[:] = 0.0
    for i in range(m):
        size = abs(_tension_at(bounds, null, point, i) + offset[i]) / scale
        power = max(size, 1e-9) ** (p - 2.0)
        for k in range(r):
            slope[k] += power * size * null[k, i] * scale
            for j in range(k + 1):
                curve[k, j] += (p - 1.0) * power * null[k, i] * null[j, i]
    largest = 0.0
    for k in range(r):
        largest = max(largest, curve[k, k])
    for k in range(r):
        curve[k, k] += 1e-13 * largest
    factor_positive(curve, 0.0, curve)
    for k in range(r):
        target[k] = -slope[k]
    solve_lower(curve, target)
    solve_upper(curve, target)
    for k in range(r):
        target[k] += point[k]
    return scale


@glue
def _change_metric(null: Array, curve: Array, target: Array, turned: Array, goal: Array) -> None:
    """Convert null space (r, m) and target (r,) to coordinates in which the metric L L^T is Euclidean."""
    r, m = null.shape
    for k in range(r):
        goal[k] = 0.0
        for j in range(k, r):
            goal[k] += curve[j, k] * target[j]
        for i in range(m):
            turned[k, i] = null[k, i]
        for j in range(k):
            for i in range(m):
                turned[k, i] -= curve[k, j] * turned[j, i]
        for i in range(m):
            turned[k, i] /= curve[k, k]


@kernel
def _lowest_p_norm(
    first: float, p: float, bounds: Array, offset: Array, null: Array, near: ReferencePoint, memory: Memory
) -> bool:
    """Move the feasible point (r,) of `near` to the point of least p-norm. Returns True if this point was found."""
    # The exponent starts small. The exponent doubles whenever the steps become short, until it is p. Each Newton
    # iteration thus starts near its solution.
    # The result is False if the iteration does not converge.
    r, m = null.shape
    point = near.point
    vectors, memory = block(memory, 4, r)
    slope, target, trial, goal = vectors[0], vectors[1], vectors[2], vectors[3]
    curve, memory = block(memory, r, r)
    turned, memory = block(memory, r, m)
    largest = largest_bound(bounds)
    slack = TOLERANCE * largest
    exponent = first
    for _ in range(STEPS):
        scale = _newton_target(bounds, offset, null, point, exponent, slope, curve, target)
        if scale == 0.0:
            return True
        if most_violated_bound(null, bounds, target, 0.0, True) >= 0:
            _change_metric(null, curve, target, turned, goal)
            if not programs.nearest_point(turned, bounds, goal, slack * max(curve[0, 0], 1.0), near.held, target):
                return False
            solve_upper(curve, target)
            for k in range(r):
                if not math.isfinite(target[k]):
                    target[k] = point[k]
        length = 0.0
        gain = 0.0
        for k in range(r):
            length = max(length, abs(target[k] - point[k]))
            gain -= slope[k] * (target[k] - point[k])
        before = _p_norm_power(bounds, offset, null, point, exponent, scale)
        share = 1.0
        for _half in range(HALVINGS):
            for k in range(r):
                trial[k] = point[k] + share * (target[k] - point[k])
            after = _p_norm_power(bounds, offset, null, trial, exponent, scale)
            least_gain = 1e-4 * share * exponent * gain / (scale * scale)
            if after <= before - least_gain + 1e-15 * before:
                break
            share *= 0.5
        for k in range(r):
            point[k] = trial[k]
        still = length <= STILL * largest or exponent * gain <= 1e-16 * scale * scale * before
        if exponent == p and still:
            return True
        if length <= CLOSE * largest:
            exponent = min(2.0 * exponent, p)
    return False
