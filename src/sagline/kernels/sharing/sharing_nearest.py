"""Sharing nearest to a reference: its projection onto the feasible set."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels.algebra.linear import limit_rows
from sagline.kernels.algebra.projection import project
from sagline.kernels.codes import (
    POSE_INFEASIBLE,
    POSE_SOLVED,
)
from sagline.kernels.jit import kernel
from sagline.kernels.sharing.feasible_set import feasible_corners, set_point, within_limits
from sagline.kernels.sharing.polygon import (
    TOLERANCE,
    largest_tension,
    nearest_point,
)
from sagline.kernels.tables import SHARED, START


@kernel
def share_nearest_of_many(work: Array, null: Array, reference: Array) -> int:
    """The same for more than two redundant cables, by the active-set method."""
    r, m = null.shape
    rows = np.empty((2 * m, r))
    sides = np.empty(2 * m)
    count = limit_rows(work, null, rows, sides, np.empty(2 * m, dtype=np.int64))
    point = np.empty(r)
    if not project(rows, sides, count, reference, TOLERANCE * largest_tension(work), point):
        return POSE_INFEASIBLE
    set_point(work, null, point)
    return POSE_SOLVED


@kernel
def share_at_limits(work: Array, null: Array, reference: Array, corners: Array, labels: Indices) -> int:
    """The nearest tensions where the reference itself is not feasible: its projection onto the feasible set."""
    r, m = null.shape
    if r == 0:
        return POSE_SOLVED if within_limits(work, TOLERANCE * largest_tension(work)) else POSE_INFEASIBLE
    if r > 2:
        return share_nearest_of_many(work, null, reference)
    count = feasible_corners(work, null, corners, labels)
    if count == 0:
        return POSE_INFEASIBLE
    x, y = nearest_point(corners, count, reference[0], reference[1] if r == 2 else 0.0)
    for i in range(m):
        work[SHARED, i] = work[START, i] + null[0, i] * x
        if r == 2:
            work[SHARED, i] += null[1, i] * y
    return POSE_SOLVED
