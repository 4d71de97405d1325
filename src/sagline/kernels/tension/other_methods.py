"""Tension distribution methods that are not projections: their selection, the analytic center, and the closed forms.

The analytic center has the largest product of the distances to all limits. The closed forms give tensions near the
middle of the limits without a search. At some feasible poses, the closed forms find no distribution.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS, TOLERANCE, largest_bound
from sagline.kernels.algebra.factors import (
    dot,
    factor_positive,
    normalize_row,
    orthogonalize_row,
    solve_lower,
    solve_upper,
)
from sagline.kernels.algebra.programs import LP_SOLVED, lowest_point
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.tension import nearest
from sagline.kernels.tension.on_polygon import centroid, distribute_on_polygon, feasible_corners
from sagline.kernels.tension.polygon import WorkArrays

THIN = 1e-9  # a feasible set that is thinner, relative to the largest tension, has no center
NEWTON_STEPS = 200
CENTERED = 1e-18  # square of the Newton decrement at which the search ends


@kernel
def share_at_center(bounds: Array, null: Array, point: Array, work: WorkArrays) -> int:
    """Move `point` (r,) to the analytic center. If a previous center exists, the search starts from it."""
    corners, labels, known = work.corners, work.labels, work.known
    if known[0] > 0 and _keeps_limits_inside(bounds, null, point) and _analytic_center(bounds, null, work.rest, point):
        return codes.POSE_SOLVED
    known[0] = 0
    r, m = null.shape
    if r > 2:
        status = deepest_point(bounds, null, work, point)
        if status != codes.POSE_SOLVED:
            return status
    else:
        count = feasible_corners(bounds, null, corners, labels)
        if count == 0:
            return codes.POSE_INFEASIBLE
        for k in range(count):
            if labels[k] >= 2 * m:
                return codes.POSE_UNBOUNDED
        x, y = centroid(corners, count)
        point[0] = x
        if r == 2:
            point[1] = y
    if not _analytic_center(bounds, null, work.rest, point):
        return codes.POSE_NOT_CONVERGED
    known[0] = 1
    return codes.POSE_SOLVED


@kernel
def _keeps_limits_inside(bounds: Array, null: Array, point: Array) -> bool:
    """True if the distance of `point` from every limit exceeds the smallest thickness."""
    slack = THIN * largest_bound(bounds)
    for i in range(null.shape[1]):
        tension = bounds[START, i]
        for k in range(point.size):
            tension += null[k, i] * point[k]
        if not min(tension - bounds[LOW, i], bounds[HIGH, i] - tension) > slack:
            return False
    return True


@kernel
def deepest_point(bounds: Array, null: Array, work: WorkArrays, point: Array) -> int:
    """Fill the point (r,) whose tensions are farthest from their nearest limits. Returns the pose's status."""
    r, m = null.shape
    rows, memory = block(work.rest, r + 1, 2 * m)
    # one bound per limit; an additional unknown, the distance from all limits, narrows the bounds
    halves, memory = block(memory, STRIP_ROWS, 2 * m)
    vectors, memory = block(memory, 2, r + 1)
    cost, found = vectors[0], vectors[1]
    for i in range(m):
        for k in range(r):
            rows[k, i], rows[k, m + i] = null[k, i], -null[k, i]
        rows[r, i] = rows[r, m + i] = -1.0
        halves[START, i], halves[LOW, i], halves[HIGH, i] = bounds[START, i], bounds[LOW, i], math.inf
        halves[START, m + i], halves[LOW, m + i] = -bounds[START, i], -bounds[HIGH, i]
        halves[HIGH, m + i] = math.inf
    cost[:r] = 0.0
    cost[r] = -1.0
    slack = TOLERANCE * largest_bound(bounds)
    work.basis.labels[0] = -1
    outcome = lowest_point(rows, halves, cost, slack, work.basis, found)
    for k in range(r):
        point[k] = found[k]
    return codes.POSE_INFEASIBLE if outcome == LP_SOLVED and found[r] < -slack else nearest.program_status(outcome)


@kernel
def _analytic_center(bounds: Array, null: Array, memory: Memory, point: Array) -> bool:
    """Move a point (r,) inside the feasible set to the point with the largest product of distances to all limits."""
    # The method takes damped Newton steps on the self-concordant barrier function and ignores infinite limits. If the
    # set is too thin to have interior points, the point does not change.
    # Returns True if the center was found.
    r, m = null.shape
    vectors, memory = block(memory, 2, r)
    curve, memory = block(memory, r, r)
    slope, step = vectors[0], vectors[1]
    largest = largest_bound(bounds)
    for _ in range(NEWTON_STEPS):
        slope[:] = 0.0
        curve[:] = 0.0
        for i in range(m):
            tension = bounds[START, i]
            for k in range(r):
                tension += null[k, i] * point[k]
            below = tension - bounds[LOW, i]
            above = bounds[HIGH, i] - tension
            if not min(below, above) > THIN * largest:
                return True
            below = 1.0 / below
            above = 1.0 / above
            push = above - below
            weight = below * below + above * above
            for k in range(r):
                slope[k] += push * null[k, i]
                for j in range(k + 1):
                    curve[k, j] += weight * null[k, i] * null[j, i]
        if not factor_positive(curve, 0.0, curve):
            return False
        for k in range(r):
            step[k] = -slope[k]
        solve_lower(curve, step)
        decrement = dot(step, step)
        solve_upper(curve, step)
        share = 1.0 if decrement < 0.0625 else 1.0 / (1.0 + math.sqrt(decrement))
        for k in range(r):
            point[k] += share * step[k]
        if decrement < CENTERED:
            return True
    return False


# least squared length of a cable's remaining row; a smaller row depends on the fixed cables
DEPENDENT = 1e-10


@kernel
def _share_near_middle(method: int, bounds: Array, null: Array, memory: Memory, tension: Array) -> bool:
    """Fill the tensions (m,) by the closed form, the improved closed form or the puncture method."""
    # Returns True if the method found tensions within their limits.
    # Source: Pott, Bruckmann & Mikelsons 2009; Pott 2014; Mueller, Reichert & Bruckmann 2015.
    r, m = null.shape
    slack = TOLERANCE * largest_bound(bounds)
    for i in range(m):
        tension[i] = bounds[START, i]
    if method == codes.PUNCTURE and nearest.satisfies_limits(bounds, tension, slack):
        return True
    for k in range(r):
        share = 0.0
        for i in range(m):
            share += null[k, i] * 0.5 * (bounds[LOW, i] + bounds[HIGH, i])
        for i in range(m):
            tension[i] += null[k, i] * share
    if method == codes.CLOSED_FORM:
        return nearest.satisfies_limits(bounds, tension, slack)
    if not _hold_violated(bounds, null, slack, memory, tension):
        return False
    if method == codes.PUNCTURE:
        _puncture(bounds, tension)
    return True


@glue
def _hold_violated(bounds: Array, null: Array, slack: float, memory: Memory, tension: Array) -> bool:
    """Fix the cable with the largest violation at its limit, distribute the rest, and repeat while one is violated."""
    # The tensions change in place, by orthogonal steps in the null space. A cable that was fixed remains fixed.
    r, m = null.shape
    held, memory = block(memory, r + 1, r)
    triangle, memory = block(memory, r + 1, r + 1)
    for count in range(r + 1):
        worst = slack
        cable = -1
        limit = 0.0
        for i in range(m):
            if bounds[LOW, i] - tension[i] > worst:
                worst = bounds[LOW, i] - tension[i]
                cable = i
                limit = bounds[LOW, i]
            if tension[i] - bounds[HIGH, i] > worst:
                worst = tension[i] - bounds[HIGH, i]
                cable = i
                limit = bounds[HIGH, i]
        if cable < 0:
            return True
        if count == r:
            return False
        for k in range(r):
            held[count, k] = null[k, cable]
        square = orthogonalize_row(held, count, triangle)
        if square < DEPENDENT:
            return False
        step = (limit - tension[cable]) / square
        for i in range(m):
            for k in range(r):
                tension[i] += step * held[count, k] * null[k, i]
        normalize_row(held, count, triangle, square)
    return False


@glue
def _puncture(bounds: Array, tension: Array) -> None:
    """Move the tensions toward the minimum norm (START) until a limit is reached."""
    m = tension.size
    share = 0.0  # share of the way: 0 at the minimum norm, 1 at the given tensions
    for i in range(m):
        start = bounds[START, i]
        way = tension[i] - start
        if start < bounds[LOW, i] and way > 0.0:
            share = max(share, min((bounds[LOW, i] - start) / way, 1.0))
        if start > bounds[HIGH, i] and way < 0.0:
            share = max(share, min((bounds[HIGH, i] - start) / way, 1.0))
    for i in range(m):
        tension[i] = bounds[START, i] + share * (tension[i] - bounds[START, i])


@kernel
def distribute_by_other_method(
    distribution: nearest.Distribution,
    bounds: Array,
    offset: Array,
    null: Array,
    near: nearest.ReferencePoint,
    work: WorkArrays,
    tension: Array,
) -> int:
    """Fill the tensions (m,) in the distribution's variable minus its offset. Returns POSE_SOLVED or the failure."""
    # Among several solutions, the solution nearest to the reference is selected.
    method, parameter = distribution.method, distribution.parameter
    status = codes.POSE_SOLVED
    if null.shape[0] == 0:
        nearest.set_point(bounds, null, near.reference, tension)
        kept = nearest.satisfies_limits(bounds, tension, TOLERANCE * largest_bound(bounds))
        status = codes.POSE_SOLVED if kept else codes.POSE_INFEASIBLE
    elif codes.CLOSED_FORM <= method <= codes.PUNCTURE:
        if not _share_near_middle(method, bounds, null, work.rest, tension):
            status = nearest.share_nearest(bounds, null, near, tension)
            status = codes.POSE_NOT_COVERED if status == codes.POSE_SOLVED else status
    else:
        if method == codes.LOWEST_MAXIMUM:
            status = nearest.share_lowest_maximum(bounds, offset, null, near, work.basis, work.rest)
        elif method == codes.LOWEST_SUM:
            status = nearest.share_lowest_sum(bounds, null, near, work.basis, work.rest)
        elif method == codes.P_NORM:
            status = nearest.share_by_norm(parameter, bounds, offset, null, near, work.known, work.rest)
        elif method == codes.ANALYTIC_CENTER:
            status = share_at_center(bounds, null, near.point, work)
        elif method == codes.CENTROID or method == codes.POLYGON_WALK:
            status = distribute_on_polygon(method, parameter, bounds, null, near, work)
        if status == codes.POSE_SOLVED:
            nearest.set_point(bounds, null, near.point, tension)
    return status
