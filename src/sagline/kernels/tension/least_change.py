"""Least change of a wrench that makes it feasible, with tensions within their limits and exact sag forces.

The wrench of cable i on the platform is the curve J_i tau - G_i s_i(tau) with the sag force s_i. Newton steps replace
the curves by their tangents. Each step is a least-squares problem within limits. The moments must balance exactly (hard
rows), so that the residual is only a force. A small weight on the change of the tensions makes the solution unique.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels.algebra import factors
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS, TOLERANCE, inward, largest_bound
from sagline.kernels.algebra.programs import ActiveSet, nearest_point, new_active_set
from sagline.kernels.cable.sag_forces import Curves, sag_forces_at, slopes_at
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector

NEWTON_STEPS = 40
HALVINGS = 12
STEADINESS = 1e-8  # weight of the squared change of a tension, relative to the weight of the squared wrench
DECREASE = 1e-4  # a step must reach this share of its predicted decrease
STIFFEST = 1e3  # largest weight of a curvature; a larger weight would make the normal matrix ill-conditioned
STANDS = 1e-13  # the search ends if the predicted decrease is below this share of the largest force
# tensions that change less, relative to the residual, do not change the direction of the residual
STEADY = 1e-6


class Demand(NamedTuple):
    """Demand on the cables of one pose. Moments are divided by the lever arm, so that every row is in newtons."""

    matrix: Array  # J, wrench per chord tension, (n, m)
    hanging: Array  # G, wrench per sag force, which is subtracted, (n, m)
    right: Array  # wrench that the cables must supply, without sag forces, (n,)
    soft: int  # number of soft rows, which are the first rows; the other rows are hard
    size: float  # largest force [N], the reference of tolerances


class TensionChange(NamedTuple):
    """State of the search, for m cables and n rows."""

    tau: Array  # chord tensions [N], (m,)
    sag_force: Array  # their sag forces [N], (m,)
    residual: Array  # residual of the demand [N], moments per lever arm, (n,)
    direction: Array  # direction y of the residual; moments per lever arm, (n,)


class _Tangents(NamedTuple):
    """One Newton step, with h hard and k soft rows and d = m - h unknowns."""

    matrix: Array  # J - G dsag_force/dtau, (n, m)
    reduced: Array  # hard rows of `matrix`, overwritten by their Householder reflections, (h, m)
    diagonals: Array  # diagonals of their QR factors, (2, h)
    q: Array  # orthogonal factor, and a work row, (m + 1, m)
    inverse: Array  # transposed pseudo-inverse of the hard rows, (h, m)
    soft: Array  # soft rows along the null space of the hard rows, (k, d)
    normal: Array  # normal matrix of `soft` and of the weights of change, overwritten by its factor, (d, d)
    rows: Array  # derivatives of the tensions with respect to the unknowns, (d, m)
    bounds: Array  # optimal tensions without limits, and the limits, (3, m)
    unknowns: Array  # right side, a target of zeros, and the point, (3, d)
    held: ActiveSet  # active limits of the last point
    push: Array  # slopes of the sag forces, overwritten by the multipliers of the limits, (m,)
    bend: Array  # weights of the squared changes of the tensions, (m,)
    multipliers: Array  # residual of the last step, and multipliers of its hard rows [N], (n,)
    trial: tuple[Array, Array, Array]  # tensions, (m,), sag forces, (m,), and residual, (n,), of a trial step


@glue
def _new_tangents(memory: Memory, n: int, m: int, hard: int) -> tuple[_Tangents, Memory]:
    """Work arrays for a step with `hard` hard rows, and the remaining memory."""
    d = m - hard
    matrix, memory = block(memory, n, m)
    reduced, memory = block(memory, hard, m)
    diagonals, memory = block(memory, 2, hard)
    q, memory = block(memory, m + 1, m)
    inverse, memory = block(memory, hard, m)
    soft, memory = block(memory, n - hard, d)
    normal, memory = block(memory, d, d)
    rows, memory = block(memory, d, m)
    bounds, memory = block(memory, STRIP_ROWS, m)
    unknowns, memory = block(memory, 3, d)
    wide, memory = block(memory, 4, m)
    multipliers, memory = vector(memory, n)
    residual, memory = vector(memory, n)
    active, memory = new_active_set(memory, d)
    active.labels[0] = 0
    tangents = _Tangents(
        matrix, reduced, diagonals, q, inverse, soft, normal, rows, bounds, unknowns, active, wide[0], wide[1],
        multipliers, (wide[2], wide[3], residual),
    )  # fmt: skip
    return tangents, memory


@glue
def _fill_residual(curves: Curves, demand: Demand, tau: Array, sag_force: Array, residual: Array) -> None:
    """Fill the sag forces (m,) at the tensions `tau` (m,), and the residual of the demand (n,)."""
    sag_forces_at(curves, tau, sag_force)
    for k in range(residual.size):
        residual[k] = demand.right[k]
        for i in range(tau.size):
            residual[k] += demand.hanging[k, i] * sag_force[i] - demand.matrix[k, i] * tau[i]


@formula
def norm_of_part(vector: Array, first: int, last: int) -> float:
    """Euclidean length of the entries `first` to `last` - 1 of `vector`."""
    return factors.norm(vector[first:last])


@glue
def _set_tangents(curves: Curves, demand: Demand, tau: Array, multipliers: Array, step: _Tangents) -> bool:
    """Fill the tangents at `tau`, and the normal matrix. False if the hard rows are linearly dependent."""
    # The normal matrix includes the second derivatives of the curves, times the multipliers (n,) of the previous step,
    # if they make the matrix more positive definite. Without them, steps would oscillate.
    n, m = step.matrix.shape
    soft = demand.soft
    hard = n - soft
    d = m - hard
    slopes_at(curves, tau, step.push, step.bend)
    for i in range(m):
        along = 0.0
        for k in range(n):
            step.matrix[k, i] = demand.matrix[k, i] - demand.hanging[k, i] * step.push[i]
            along += demand.hanging[k, i] * multipliers[k]
        step.bend[i] = min(max(along * step.bend[i], 0.0), STIFFEST) + STEADINESS
        for k in range(hard):
            step.reduced[k, i] = step.matrix[soft + k, i]
    if not factors.factorize(step.reduced, step.diagonals):
        return False
    factors.orthogonal_factor(step.reduced, step.diagonals, step.q)
    factors.pseudo_inverse(step.reduced, step.diagonals, step.q, step.inverse)
    for k in range(soft):
        for j in range(d):
            step.soft[k, j] = 0.0
            for i in range(m):
                step.soft[k, j] += step.matrix[k, i] * step.q[i, hard + j]
    for j in range(d):
        for b in range(d):
            step.normal[j, b] = 0.0
            for k in range(soft):
                step.normal[j, b] += step.soft[k, j] * step.soft[k, b]
            for i in range(m):
                step.normal[j, b] += step.q[i, hard + j] * step.bend[i] * step.q[i, hard + b]
    return factors.factor_positive(step.normal, 0.0, step.normal)


@glue
def _find_step(demand: Demand, ranges: Array, change: TensionChange, step: _Tangents) -> bool:
    """Fill tensions after a full step and multipliers of the limits. False if hard rows contradict the limits."""
    n, m = step.matrix.shape
    soft = demand.soft
    hard = n - soft
    d = m - hard
    base, z = step.bounds[START], step.unknowns[0]
    factors.minimum_norm(step.inverse, change.residual[soft:], base)
    for j in range(d):
        z[j] = 0.0
        step.unknowns[1, j] = 0.0
    for k in range(soft):
        left = change.residual[k]
        for i in range(m):
            left -= step.matrix[k, i] * base[i]
        for j in range(d):
            z[j] += step.soft[k, j] * left
    for j in range(d):
        for i in range(m):
            z[j] -= step.q[i, hard + j] * step.bend[i] * base[i]
    factors.solve_lower(step.normal, z)
    factors.solve_upper(step.normal, z)
    for i in range(m):
        base[i] += change.tau[i]
        for j in range(d):
            base[i] += step.q[i, hard + j] * z[j]
        step.bounds[LOW, i] = ranges[0, i]
        step.bounds[HIGH, i] = ranges[1, i]
        for j in range(d):
            step.rows[j, i] = step.q[i, hard + j]
            for b in range(j):
                step.rows[j, i] -= step.normal[j, b] * step.rows[b, i]
            step.rows[j, i] /= step.normal[j, j]
    slack = TOLERANCE * largest_bound(step.bounds)
    if not nearest_point(step.rows, step.bounds, step.unknowns[1], slack, step.held, step.unknowns[2]):
        return False
    trial = step.trial[0]
    for i in range(m):
        step.push[i] = 0.0
        trial[i] = base[i]
        for j in range(d):
            trial[i] += step.unknowns[2, j] * step.rows[j, i]
        trial[i] = min(max(trial[i], ranges[0, i]), ranges[1, i])
    for c in range(step.held.labels[0]):
        label = step.held.labels[1 + c]
        step.push[label // 2] += inward(label) * step.held.pushes[0, c]
    return True


@glue
def _point_along(soft: int, change: TensionChange, step: _Tangents) -> float:
    """Fill the direction of the residual after a full step. The soft rows of the direction have length 1."""
    # Returns the length of the soft rows before this scaling [N].
    # The direction is perpendicular to the tangents of cables between their limits. For a cable at a limit, the
    # direction points beyond the limit.
    n, m = step.matrix.shape
    hard = n - soft
    y, along, trial = change.direction, step.bounds[START], step.trial[0]
    for k in range(soft):
        y[k] = change.residual[k]
        for i in range(m):
            y[k] -= step.matrix[k, i] * (trial[i] - change.tau[i])
    for i in range(m):
        along[i] = step.push[i] - step.bend[i] * (trial[i] - change.tau[i])
        for k in range(soft):
            along[i] += y[k] * step.matrix[k, i]
    rest = norm_of_part(y, 0, soft)
    for k in range(hard):
        y[soft + k] = 0.0
        for i in range(m):
            y[soft + k] -= step.inverse[k, i] * along[i]
    for k in range(n):
        y[k] = y[k] / rest if rest > 0.0 else 0.0
    return rest


@glue
def _line_search(curves: Curves, demand: Demand, rest: float, change: TensionChange, step: _Tangents) -> bool:
    """Halve a step until it gives the required decrease. False if no step does so, or if the result is worse."""
    # The weight of the hard residual exceeds the multipliers of the hard rows. A larger hard residual is therefore
    # never accepted in exchange for a smaller soft residual.
    n, m = demand.matrix.shape
    soft = demand.soft
    trial, trial_sag_force, left = step.trial
    known = STANDS * demand.size
    price = 1.0
    for k in range(soft, n):
        price = max(price, 2.0 * abs(change.direction[k]))
    before = norm_of_part(change.residual, 0, soft) + price * norm_of_part(change.residual, soft, n)
    moved = 0.0
    for i in range(m):
        moved = max(moved, abs(trial[i] - change.tau[i]))
    if before - rest <= known and (moved <= STEADY * rest or rest <= known):
        return False
    share = 1.0
    after = math.inf
    for _ in range(HALVINGS):
        _fill_residual(curves, demand, trial, trial_sag_force, left)
        after = norm_of_part(left, 0, soft) + price * norm_of_part(left, soft, n)
        if after <= before - DECREASE * share * (before - rest) + known:
            break
        share *= 0.5
        for i in range(m):
            trial[i] = 0.5 * (trial[i] + change.tau[i])
    if not after <= before + known:
        return False
    for i in range(m):
        change.tau[i] = trial[i]
        change.sag_force[i] = trial_sag_force[i]
    factors.copy(left, change.residual)
    return True


@kernel
def least_change(curves: Curves, demand: Demand, ranges: Array, change: TensionChange, memory: Memory) -> float:
    """Change tensions within their ranges until the residual of the demand is least. Returns its length [N]."""
    # ranges: least and largest tensions, rows 0 and 1; change: start of the search, overwritten with the result. The
    # returned length [N] is the length of the soft residual: infinite if the tangents of the hard rows contradict the
    # ranges, and NaN if the hard rows are linearly dependent.
    n, m = demand.matrix.shape
    soft = demand.soft
    step, _ = _new_tangents(memory, n, m, n - soft)
    _fill_residual(curves, demand, change.tau, change.sag_force, change.residual)
    step.multipliers[:] = 0.0
    for _ in range(NEWTON_STEPS):
        if not _set_tangents(curves, demand, change.tau, step.multipliers, step):
            return math.nan
        if not _find_step(demand, ranges, change, step):
            return math.inf
        rest = _point_along(soft, change, step)
        for k in range(n):
            step.multipliers[k] = rest * change.direction[k]
        if not _line_search(curves, demand, rest, change, step):
            break
    return norm_of_part(change.residual, 0, soft)
