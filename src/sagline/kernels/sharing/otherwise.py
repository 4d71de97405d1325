"""The ways of sharing the load that are no projection of a reference: the one switch between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.algebra.linear_program import Basis, no_basis
from sagline.kernels.algebra.strips import STRIP_ROWS, TOLERANCE, largest_number
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
from sagline.kernels.jit import glue
from sagline.kernels.sharing.centers import share_at_center
from sagline.kernels.sharing.closed_form import share_near_middle
from sagline.kernels.sharing.nearest import Nearness, Sharing, set_point, share_nearest, within_limits
from sagline.kernels.sharing.on_polygon import share_on_polygon
from sagline.kernels.sharing.p_norm import share_by_norm
from sagline.kernels.sharing.polygon import SPARE_CORNERS
from sagline.kernels.sharing.programs import share_lowest_maximum, share_lowest_sum


class Room(NamedTuple):
    """What these ways work in, and what they keep from round to round of one pose.

    Attributes:
        corners: Of the feasible polygon, (2m + SPARE_CORNERS, 2).
        labels: Of its sides, (2m + SPARE_CORNERS,).
        known: How many corners the polygon of the last round had, (1,); 0 for none.
        basis: Of the linear program of the last round.
        rows: Of a program with one unknown more, (r + 1, 2m).
        strips: Of that program, (3, 2m).
    """

    corners: Array
    labels: Indices
    known: Indices
    basis: Basis
    rows: Array
    strips: Array


@glue
def new_room(method: int, m: int, r: int) -> Room:
    """Memory for m cables, r of them redundant."""
    unknowns = r if method == LOWEST_SUM else r + 1
    return Room(
        np.empty((2 * m + SPARE_CORNERS, 2)),
        np.empty(2 * m + SPARE_CORNERS, dtype=np.int64),
        np.zeros(1, dtype=np.int64),
        no_basis(unknowns),
        np.empty((r + 1, 2 * m)),
        np.empty((STRIP_ROWS, 2 * m)),
    )


@glue
def forget(room: Room) -> None:
    """A new pose: nothing is known from the one before."""
    room.known[0] = 0
    room.basis.labels[0] = -1


@glue
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
        if not share_near_middle(method, strips, null, tension):
            status = share_nearest(strips, null, near, tension)
            status = POSE_NOT_COVERED if status == POSE_SOLVED else status
    else:
        if method == LOWEST_MAXIMUM:
            status = share_lowest_maximum(strips, offset, null, near, room.basis, room.rows, room.strips)
        elif method == LOWEST_SUM:
            status = share_lowest_sum(strips, null, near, room.basis)
        elif method == P_NORM:
            status = share_by_norm(parameter, strips, offset, null, near, room.known)
        elif method == ANALYTIC_CENTER:
            status = share_at_center(strips, null, near.point, room.corners, room.labels, room.known, room.basis)
        elif method == CENTROID or method == POLYGON_WALK:
            status = share_on_polygon(method, parameter, strips, null, near, room.corners, room.labels, room.known)
        if status == POSE_SOLVED:
            set_point(strips, null, near.point, tension)
    return status
