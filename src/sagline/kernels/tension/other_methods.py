"""Tension distribution methods that are not projections: selection of the method, and the closed forms.

The closed forms give tensions near the middle of the limits without a search. At some feasible poses they find no
distribution.
"""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.algebra.bounds import HIGH, LOW, START, TOLERANCE, largest_bound
from sagline.kernels.algebra.factors import normalize_row, orthogonalize_row
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.tension.centers import share_at_center
from sagline.kernels.tension.nearest import Distribution, ReferencePoint, satisfies_limits, set_point, share_nearest
from sagline.kernels.tension.norms import share_by_norm, share_lowest_maximum, share_lowest_sum
from sagline.kernels.tension.on_polygon import distribute_on_polygon
from sagline.kernels.tension.polygon import WorkArrays

# a cable counts as dependent on the fixed cables if the squared length of its remaining row is smaller
DEPENDENT = 1e-10


@kernel
def share_near_middle(method: int, bounds: Array, null: Array, memory: Memory, tension: Array) -> bool:
    """Fill the tensions (m,) by the closed form, the improved closed form or the puncture method.

    Returns True if the method found tensions within their limits.

    Source:
        Pott, Bruckmann & Mikelsons 2009; Pott 2014; Mueller, Reichert & Bruckmann 2015.
    """
    r, m = null.shape
    slack = TOLERANCE * largest_bound(bounds)
    for i in range(m):
        tension[i] = bounds[START, i]
    if method == codes.PUNCTURE and satisfies_limits(bounds, tension, slack):
        return True
    for k in range(r):
        share = 0.0
        for i in range(m):
            share += null[k, i] * 0.5 * (bounds[LOW, i] + bounds[HIGH, i])
        for i in range(m):
            tension[i] += null[k, i] * share
    if method == codes.CLOSED_FORM:
        return satisfies_limits(bounds, tension, slack)
    if not _hold_violated(bounds, null, slack, memory, tension):
        return False
    if method == codes.PUNCTURE:
        _puncture(bounds, tension)
    return True


@glue
def _hold_violated(bounds: Array, null: Array, slack: float, memory: Memory, tension: Array) -> bool:
    """Fix the cable with the largest violation at its limit and distribute the rest. Repeat while limits are violated.

    The tensions change in place, by orthogonal steps in the null space. A cable that was fixed remains fixed.
    """
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
    share = 0.0  # 0 at the minimum norm, 1 at the given tensions
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
    distribution: Distribution,
    bounds: Array,
    offset: Array,
    null: Array,
    near: ReferencePoint,
    work: WorkArrays,
    tension: Array,
) -> int:
    """Fill the tensions (m,) in the distribution's variable minus its offset. Returns POSE_SOLVED or the failure.

    Among several solutions, the solution nearest to the reference is selected.
    """
    method, parameter = distribution.method, distribution.parameter
    status = codes.POSE_SOLVED
    if null.shape[0] == 0:
        set_point(bounds, null, near.reference, tension)
        kept = satisfies_limits(bounds, tension, TOLERANCE * largest_bound(bounds))
        status = codes.POSE_SOLVED if kept else codes.POSE_INFEASIBLE
    elif codes.CLOSED_FORM <= method <= codes.PUNCTURE:
        if not share_near_middle(method, bounds, null, work.rest, tension):
            status = share_nearest(bounds, null, near, tension)
            status = codes.POSE_NOT_COVERED if status == codes.POSE_SOLVED else status
    else:
        if method == codes.LOWEST_MAXIMUM:
            status = share_lowest_maximum(bounds, offset, null, near, work.basis, work.rest)
        elif method == codes.LOWEST_SUM:
            status = share_lowest_sum(bounds, null, near, work.basis, work.rest)
        elif method == codes.P_NORM:
            status = share_by_norm(parameter, bounds, offset, null, near, work.known, work.rest)
        elif method == codes.ANALYTIC_CENTER:
            status = share_at_center(bounds, null, near.point, work)
        elif method == codes.CENTROID or method == codes.POLYGON_WALK:
            status = distribute_on_polygon(method, parameter, bounds, null, near, work)
        if status == codes.POSE_SOLVED:
            set_point(bounds, null, near.point, tension)
    return status
