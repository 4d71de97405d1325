"""Rounds of sharing and hanging, until the cables' pulls stand still; docs/model.md, section 5."""

from __future__ import annotations

from sagline.arrays import Array, Codes, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.null_space import minimum_norm
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.statics import needed_wrench, restrict_needed
from sagline.kernels.cable.hanging import NEAR, frame_end_tension, hang_cables
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.codes import (
    CABLE_NOT_CONVERGED,
    CABLE_TOO_SLACK,
    CATENARY,
    CLOSEST,
    FRAME_END_TENSION,
    HORIZONTAL_TENSION,
    POSE_NOT_CONVERGED,
    POSE_SINGULAR,
    POSE_SOLVED,
    POSE_TOO_SLACK,
)
from sagline.kernels.inverse.frame_end import STILL, relinearize
from sagline.kernels.jit import formula, kernel
from sagline.kernels.sharing.sharing import share_load

ROUNDS = 30
FREE_ROUNDS = 8  # then a choice that jumps with the last digits of the pulls is held where it is
SETTLED = 1e-10  # [N]; pulls that change by less, or by 1e-15 of the largest tension, have settled


@formula
def remember(model: Model, variable: int, geometry: Array, work: Array, previous: Array) -> None:
    """Keep the tensions, in the variable they were shared in, for the pose that follows."""
    for i in range(previous.size):
        tau = work[tables.TAU, i]
        previous[i] = tau
        if variable == HORIZONTAL_TENSION:
            previous[i] = tau * geometry[g.COSINE, i]
        elif variable == FRAME_END_TENSION:
            previous[i] = frame_end_tension(
                model,
                Chord(geometry[g.CHORD, i], geometry[g.SINE, i], geometry[g.COSINE, i]),
                Material(work[tables.DENSITY_ROW, i], work[tables.STIFFNESS_ROW, i]),
                tau,
            )


@kernel
def keep_near(work: Array, null: Array, reference: Array) -> None:
    """Let the point to be near to be that of the tensions just shared."""
    for k in range(null.shape[0]):
        reference[k] = 0.0
        for i in range(null.shape[1]):
            reference[k] += null[k, i] * work[tables.SHARED, i]


@formula
def settle(
    model: Model,
    method: int,
    parameter: float,
    variable: int,
    freedom: Array,
    preference: Array,
    previous: Array,
    body: Array,
    wrench: Array,
    geometry: Array,
    work: Array,
    full: Array,
    matrix: Array,
    reduced: Array,
    balance: Array,
    q: Array,
    inverse: Array,
    null: Array,
    reference: Array,
    corners: Array,
    labels: Indices,
    statuses: Codes,
) -> int:
    """Share the load and hang the cables until their pulls stand still; returns the pose's status."""
    m = work.shape[1]
    near = False
    way = method
    for k in range(ROUNDS):
        if k >= FREE_ROUNDS and method > CLOSEST:
            way = CLOSEST
            keep_near(work, null, reference)
        needed_wrench(geometry, body, wrench, work, balance)
        restrict_needed(freedom, balance)
        minimum_norm(inverse, balance, work)
        status = share_load(way, parameter, work, null, reference, corners, labels)
        if status != POSE_SOLVED:
            return status
        largest = 0.0
        moved = 0.0
        for i in range(m):
            new = work[tables.SHARED, i] / work[tables.SCALE, i]
            moved = max(moved, abs(new - work[tables.TAU, i]) / new)
            largest = max(largest, new)
            work[tables.TAU, i] = new
            work[tables.LAST_PULL, i] = work[tables.PULL, i]
        gravest = hang_cables(model, geometry, work, statuses, near and moved < NEAR)
        if gravest == CABLE_TOO_SLACK:
            return POSE_TOO_SLACK
        if gravest == CABLE_NOT_CONVERGED:
            return POSE_NOT_CONVERGED
        change = 0.0
        for i in range(m):
            change = max(change, abs(work[tables.PULL, i] - work[tables.LAST_PULL, i]))
        stands = model.code != CATENARY or change <= SETTLED + 1e-15 * largest
        if stands and (variable != FRAME_END_TENSION or (near and moved <= STILL)):
            return POSE_SOLVED
        near = True
        if variable == FRAME_END_TENSION and not relinearize(
            model, method, freedom, preference, previous,
            geometry, work, full, matrix, reduced, balance, q, inverse, null, reference,
        ):  # fmt: skip
            return POSE_SINGULAR
    return POSE_NOT_CONVERGED
