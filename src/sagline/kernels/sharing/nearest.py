"""Sharing nearest to a reference: minimum norm, closest to the tensions before, quadratic program.

docs/model.md, section 5. With an orthonormal null-space basis N, the objective (55) of the article, closest to given
tensions, is the projection of lambda_ref = N^T (t_ref - t0) onto the feasible set; the minimum norm is that of 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.algebra.nearest_point import Held, nearest_point, new_held
from sagline.kernels.algebra.strips import HIGH, LOW, START, TOLERANCE, largest_number
from sagline.kernels.codes import CLOSEST, POSE_INFEASIBLE, POSE_SOLVED, QUADRATIC_PROGRAM
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory, block


class Sharing(NamedTuple):
    """How the load is shared.

    Attributes:
        method: Which choice.
        parameter: Its exponent, or which optimum of the polygon walk.
        variable: In which variable.
        weight: Root weights of the cables, (m,).
        goal: Tensions of a quadratic program to be near to [N], (m,).
    """

    method: int
    parameter: float
    variable: int
    weight: Array
    goal: Array


class Nearness(NamedTuple):
    """What the shared tensions are to be near to, in coordinates of the null space.

    Attributes:
        previous: Tensions in the sharing's variable to stay close to (m,), NaN for none.
        reference: lambda_ref, (r,).
        held: The limits that the last projection met.
        point: The last projection, (r,).
    """

    previous: Array
    reference: Array
    held: Held
    point: Array


@glue
def new_nearness(memory: Memory, previous: Array, r: int) -> tuple[Nearness, Memory]:
    """Room for r redundant cables, and the memory that is left."""
    rows, at = block(memory.numbers, 0, 2, r)
    held, rest = new_held(Memory(memory.numbers[at:], memory.counters), r)
    return Nearness(previous, rows[0], held, rows[1]), rest


@glue
def refer(sharing: Sharing, offset: Array, null: Array, near: Nearness) -> None:
    """Fill the point of the null space that the shared tensions shall be nearest to.

    offset: of the sharing's variable (m,).
    """
    from_before = sharing.method == CLOSEST and not math.isnan(near.previous[0])
    for k in range(null.shape[0]):
        near.reference[k] = 0.0
        for i in range(null.shape[1]):
            goal = near.previous[i] if from_before else sharing.goal[i]
            near.reference[k] += null[k, i] * sharing.weight[i] * (goal - offset[i])


@formula
def set_point(strips: Array, null: Array, point: Array, tension: Array) -> None:
    """Fill the tensions (m,) of a point in the null space."""
    for i in range(tension.size):
        tension[i] = strips[START, i]
    for k in range(point.size):
        for i in range(tension.size):
            tension[i] += null[k, i] * point[k]


@formula
def within_limits(strips: Array, tension: Array, slack: float) -> bool:
    """Whether every tension keeps its limits, up to a slack."""
    for i in range(tension.size):
        if not strips[LOW, i] - slack <= tension[i] <= strips[HIGH, i] + slack:
            return False
    return True


@glue
def share_nearest(strips: Array, null: Array, near: Nearness, tension: Array) -> int:
    """Fill the tensions (m,) nearest to the reference; returns POSE_SOLVED or POSE_INFEASIBLE."""
    set_point(strips, null, near.reference, tension)
    if within_limits(strips, tension, 0.0):
        near.held.labels[0] = 0
        return POSE_SOLVED
    slack = TOLERANCE * largest_number(strips)
    if null.shape[0] == 0:
        return POSE_SOLVED if within_limits(strips, tension, slack) else POSE_INFEASIBLE
    if not nearest_point(null, strips, near.reference, slack, near.held, near.point):
        return POSE_INFEASIBLE
    set_point(strips, null, near.point, tension)
    return POSE_SOLVED


@glue
def is_nearest(sharing: Sharing) -> bool:
    """Whether a method shares nearest to a reference."""
    return sharing.method <= QUADRATIC_PROGRAM
