"""The ways of sharing the load that are no projection of a reference: the one switch between them."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.algebra.strips import TOLERANCE, largest_number
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
from sagline.kernels.sharing.centers import share_at_center
from sagline.kernels.sharing.closed_form import share_near_middle
from sagline.kernels.sharing.nearest import Nearness, Sharing, set_point, share_nearest, within_limits
from sagline.kernels.sharing.on_polygon import share_on_polygon
from sagline.kernels.sharing.p_norm import share_by_norm
from sagline.kernels.sharing.programs import share_lowest_maximum, share_lowest_sum
from sagline.kernels.sharing.room import Room


@kernel
def share_otherwise(
    sharing: Sharing, strips: Array, offset: Array, null: Array, near: Nearness, room: Room, tension: Array
) -> int:
    """Fill the tensions (m,) in the sharing's variable less its offset; returns POSE_SOLVED, or why there are none.

    Ties go to the tensions nearest to the reference.
    """
    method, parameter = sharing.method, sharing.parameter
    status = POSE_SOLVED
    if null.shape[0] == 0:
        set_point(strips, null, near.reference, tension)
        kept = within_limits(strips, tension, TOLERANCE * largest_number(strips))
        status = POSE_SOLVED if kept else POSE_INFEASIBLE
    elif CLOSED_FORM <= method <= PUNCTURE:
        if not share_near_middle(method, strips, null, room.rest, tension):
            status = share_nearest(strips, null, near, tension)
            status = POSE_NOT_COVERED if status == POSE_SOLVED else status
    else:
        if method == LOWEST_MAXIMUM:
            status = share_lowest_maximum(strips, offset, null, near, room.basis, room.rest)
        elif method == LOWEST_SUM:
            status = share_lowest_sum(strips, null, near, room.basis, room.rest)
        elif method == P_NORM:
            status = share_by_norm(parameter, strips, offset, null, near, room.known, room.rest)
        elif method == ANALYTIC_CENTER:
            status = share_at_center(strips, null, near.point, room)
        elif method == CENTROID or method == POLYGON_WALK:
            status = share_on_polygon(method, parameter, strips, null, near, room)
        if status == POSE_SOLVED:
            set_point(strips, null, near.point, tension)
    return status
