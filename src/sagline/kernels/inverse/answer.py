"""What is told of one pose: its residuals, why it is infeasible, and its numbers."""

from __future__ import annotations

import math

from sagline.arrays import Array, Flags
from sagline.kernels import tables
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.freedom import turns
from sagline.kernels.balance.statics import needed_wrench, restrict_needed
from sagline.kernels.jit import formula, kernel
from sagline.kernels.sharing.proof import prove_empty
from sagline.kernels.sharing.shortfall import wrench_shortfall

# columns of the numbers that describe one pose's solution
SHORTFALL, FORCE_RESIDUAL, MOMENT_RESIDUAL = 0, 1, 2
POSE_NUMBERS = 3


@formula
def measure_balance(
    freedom: Array,
    body: Array,
    wrench: Array,
    geometry: Array,
    work: Array,
    matrix: Array,
    balance: Array,
    numbers: Array,
    p: int,
) -> None:
    """Fill the norms of the unbalanced force [N] and moment [N m] along the platform's free motions."""
    needed_wrench(geometry, body, wrench, work, balance)
    restrict_needed(freedom, balance)
    force = 0.0
    moment = 0.0
    for k in range(matrix.shape[0]):
        total = -balance[tables.RIGHT, k]
        for i in range(matrix.shape[1]):
            total += matrix[k, i] * work[tables.TAU, i]
        if turns(freedom, k):
            moment += total * total
        else:
            force += total * total
    numbers[p, FORCE_RESIDUAL] = math.sqrt(force)
    numbers[p, MOMENT_RESIDUAL] = math.sqrt(moment)


@kernel
def explain(
    freedom: Array, work: Array, matrix: Array, balance: Array, inverse: Array, null: Array, blocking: Flags
) -> float:
    """Shortfall [N] of an infeasible pose; fills its proof and the cables that block it."""
    n = freedom.shape[0]
    translations = 0
    for k in range(n):
        translations += 0 if turns(freedom, k) else 1
    prove_empty(work, inverse, null, translations, balance, blocking)
    return wrench_shortfall(
        matrix, balance[tables.RIGHT, :n], work[tables.CHORD_LOW], work[tables.CHORD_HIGH], translations
    )


@formula
def store(solved: bool, work: Array, geometry: Array, results: Array, p: int) -> None:
    """Write one pose's answer; no plausible numbers where there is none: span and rise stay, the rest is NaN."""
    for i in range(geometry.shape[1]):
        tension = work[tables.TAU, i] if solved else math.nan
        results[tables.SPAN, p, i] = geometry[g.SPAN, i]
        results[tables.RISE, p, i] = geometry[g.RISE, i]
        results[tables.LENGTH, p, i] = work[tables.RATIO, i] * geometry[g.CHORD, i] if solved else math.nan
        results[tables.HORIZONTAL, p, i] = tension * geometry[g.COSINE, i]
        results[tables.VERTICAL, p, i] = tension * geometry[g.SINE, i] + work[tables.PULL, i]
        results[tables.TENSION, p, i] = tension
