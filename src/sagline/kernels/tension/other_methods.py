"""Tension distribution methods that are not projections: the one switch between them."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.algebra.bounds import TOLERANCE, largest_bound
from sagline.kernels.codes import (
    ANALYTIC_CENTER,
    CENTROID,
    CLOSED_FORM,
    LOWEST_MAXIMUM,
    LOWEST_SUM,
    P_NORM,
    POLYGON_WALK,
    POSE_INFEASIBLE,
    POSE_NOT_COVERED,
    POSE_SOLVED,
    PUNCTURE,
)
from sagline.kernels.jit import kernel
from sagline.kernels.tension.centers import share_at_center
from sagline.kernels.tension.closed_form import share_near_middle
from sagline.kernels.tension.nearest import Distribution, ReferencePoint, satisfies_limits, set_point, share_nearest
from sagline.kernels.tension.on_polygon import distribute_on_polygon
from sagline.kernels.tension.p_norm import share_by_norm
from sagline.kernels.tension.programs import share_lowest_maximum, share_lowest_sum
from sagline.kernels.tension.work_arrays import WorkArrays


@kernel
def distribute_by_other_method(
    distribution: Distribution,
    bounds: Array,
    offset: Array,
    null: Array,
    near: ReferencePoint,
    room: WorkArrays,
    tension: Array,
) -> int:
    """Fill the tensions (m,) in the distribution's variable less its offset; return POSE_SOLVED or a reason.

    Ties go to the tensions nearest to the reference.
    """
    method, parameter = distribution.method, distribution.parameter
    status = POSE_SOLVED
    if null.shape[0] == 0:
        set_point(bounds, null, near.reference, tension)
        kept = satisfies_limits(bounds, tension, TOLERANCE * largest_bound(bounds))
        status = POSE_SOLVED if kept else POSE_INFEASIBLE
    elif CLOSED_FORM <= method <= PUNCTURE:
        if not share_near_middle(method, bounds, null, room.rest, tension):
            status = share_nearest(bounds, null, near, tension)
            status = POSE_NOT_COVERED if status == POSE_SOLVED else status
    else:
        if method == LOWEST_MAXIMUM:
            status = share_lowest_maximum(bounds, offset, null, near, room.basis, room.rest)
        elif method == LOWEST_SUM:
            status = share_lowest_sum(bounds, null, near, room.basis, room.rest)
        elif method == P_NORM:
            status = share_by_norm(parameter, bounds, offset, null, near, room.known, room.rest)
        elif method == ANALYTIC_CENTER:
            status = share_at_center(bounds, null, near.point, room)
        elif method == CENTROID or method == POLYGON_WALK:
            status = distribute_on_polygon(method, parameter, bounds, null, near, room)
        if status == POSE_SOLVED:
            set_point(bounds, null, near.point, tension)
    return status
