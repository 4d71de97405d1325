"""What is given at one pose: cables in place, their limits, and the balance factorized."""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.algebra.null_space import factorize, orthogonal_factor, pseudo_inverse
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.statics import restrict_rows, structure_matrix
from sagline.kernels.cable.hanging import chord_tension_at_frame_end
from sagline.kernels.cable.models import pull_of_shallow
from sagline.kernels.cable.terms import Chord, Material, Model
from sagline.kernels.codes import (
    CLOSEST,
    FRAME_END_TENSION,
    HORIZONTAL_TENSION,
    LIMITS_OF_FRAME_END,
    QUADRATIC_PROGRAM,
)
from sagline.kernels.jit import formula

SHORTEST_CHORD = 1e-9  # [m]


@formula
def place_cables(
    model: Model,
    limits_of: int,
    validity: float,
    robot: Array,
    geometry: Array,
    work: Array,
) -> bool:
    """Fill material, first pulls and limits of the chord tensions at one pose; False where a cable has no chord.

    validity: the article's T_adj of (54) [N], T_x > w D/(2 |tan phi|) + T_adj; NaN leaves the bound out.
    """
    for i in range(robot.shape[0]):
        chord, sine, cosine = geometry[g.CHORD, i], geometry[g.SINE, i], geometry[g.COSINE, i]
        density, stiffness = robot[i, tables.DENSITY], robot[i, tables.STIFFNESS]
        low, high = robot[i, tables.TENSION_MIN], robot[i, tables.TENSION_MAX]
        if not chord >= SHORTEST_CHORD:
            return False
        work[tables.DENSITY_ROW, i] = density
        work[tables.STIFFNESS_ROW, i] = stiffness
        work[tables.HALF_WEIGHT, i] = 0.5 * density * model.gravity * chord
        work[tables.PULL, i] = pull_of_shallow(model, chord, density)
        if limits_of == LIMITS_OF_FRAME_END:
            line, material = Chord(chord, sine, cosine), Material(density, stiffness)
            low = chord_tension_at_frame_end(model, line, material, low)
            high = chord_tension_at_frame_end(model, line, material, high)
        if not math.isnan(validity):
            low = max(low, work[tables.HALF_WEIGHT, i] / abs(sine) + validity / cosine)
        work[tables.CHORD_LOW, i] = low
        work[tables.CHORD_HIGH, i] = high
    return True


@formula
def scale_tensions(variable: int, preference: Array, geometry: Array, work: Array) -> None:
    """Fill SCALE, OFFSET, LOW and HIGH: the variable in which the load is shared, and its limits.

    The frame-end tension starts as tau - wD/2 sin phi, its first order.
    """
    for i in range(work.shape[1]):
        scale = preference[tables.ROOT_WEIGHT, i]
        offset = 0.0
        if variable == HORIZONTAL_TENSION:
            scale *= geometry[g.COSINE, i]
        elif variable == FRAME_END_TENSION:
            offset = -work[tables.HALF_WEIGHT, i] * geometry[g.SINE, i]
        work[tables.OFFSET, i] = offset
        limit_variable(scale, work, i)


@formula
def limit_variable(scale: float, work: Array, i: int) -> None:
    """Fill SCALE, LOW and HIGH of one cable."""
    high = work[tables.CHORD_HIGH, i]
    work[tables.SCALE, i] = scale
    work[tables.LOW, i] = work[tables.CHORD_LOW, i] * scale
    work[tables.HIGH, i] = high * scale if high < math.inf else math.inf


@formula
def factor_balance(
    freedom: Array,
    geometry: Array,
    work: Array,
    full: Array,
    matrix: Array,
    reduced: Array,
    balance: Array,
    q: Array,
    inverse: Array,
    null: Array,
) -> bool:
    """Fill the structure matrix, its pseudo-inverse and null space in the sharing's variable; False if rank is lost."""
    n, m = matrix.shape
    structure_matrix(geometry, full)
    restrict_rows(freedom, full, matrix)
    for i in range(m):
        back = 1.0 / work[tables.SCALE, i]
        for k in range(n):
            reduced[k, i] = matrix[k, i] * back
    if not factorize(reduced, balance):
        return False
    orthogonal_factor(reduced, balance, q)
    pseudo_inverse(reduced, balance, q, inverse)
    for k in range(m - n):
        for i in range(m):
            null[k, i] = q[i, n + k]
    return True


@formula
def refer(
    method: int, variable: int, preference: Array, previous: Array, work: Array, null: Array, reference: Array
) -> None:
    """Fill the point of the null space that the shared tensions shall be nearest to, (r,)."""
    for k in range(null.shape[0]):
        reference[k] = 0.0
    from_before = method == CLOSEST and not math.isnan(previous[0])
    if not (from_before or method == QUADRATIC_PROGRAM or variable == FRAME_END_TENSION):
        return
    for k in range(null.shape[0]):
        for i in range(null.shape[1]):
            goal = preference[tables.GOAL, i]
            if from_before:
                goal = previous[i]
            reference[k] += null[k, i] * preference[tables.ROOT_WEIGHT, i] * (goal - work[tables.OFFSET, i])
