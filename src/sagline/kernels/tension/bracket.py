"""Feasibility of a wrench with tensions within their limits, decided with the exact sag forces of the cables.

Tensions that balance the wrench prove its feasibility. A direction y can prove that the wrench is infeasible. Along y,
the contribution of each cable has a largest value. If the sum of these values is less than the demand, no tensions
balance the wrench. If the sum is larger, each contribution must be close to its largest value, which narrows the
tension range. If the ranges do not become narrower, the range with the most uncertain sag force is split in two.

The shortfall has two bounds. The lower bound is the demand minus this sum in the first proof. The upper bound is the
residual of the least change of the wrench.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array
from sagline.kernels import codes
from sagline.kernels.algebra.factors import copy, dot, factorize, orthogonal_factor, pseudo_inverse
from sagline.kernels.cable import sag_forces
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.tension.least_change import Demand, TensionChange, least_change, norm_of_part

PLENTY = 1e6  # largest tension of a cable without limit, relative to the largest force
FEASIBLE = 1e-9  # a residual of the balance below this share of the largest force counts as zero
CERTAIN = 1e-14  # a gap below this share of the terms of the sum may be a rounding error
NODES = 300  # largest number of examined ranges; then the search ends without a result
DEPTH = 40  # largest number of waiting ranges
STANDSTILL = 0.7  # a range is split if more than this share of its uncertainty remains after narrowing

# Rows of a range (RANGE_ROWS, m): least and largest tensions, and the sag forces at them.
LEAST, LARGEST, AT_LEAST, AT_LARGEST = 0, 1, 2, 3
RANGE_ROWS = 4


@glue
def _section_of(range_: Array, i: int) -> sag_forces.Section:
    """The tensions of cable `i` in `range_`."""
    return sag_forces.Section(range_[LEAST, i], range_[LARGEST, i], range_[AT_LEAST, i], range_[AT_LARGEST, i])


@formula
def component_along(columns: Array, direction: Array, i: int) -> float:
    """Component of column `i` of a matrix along `direction`."""
    return dot(direction, columns[:, i])


@kernel
def _spare_capacity(curves: sag_forces.Curves, demand: Demand, range_: Array, direction: Array, tops: Array) -> float:
    """Largest force [N] of the cables along `direction`, minus the demand. A negative value proves infeasibility."""
    # The value is an upper bound that includes rounding errors. tops: filled with the largest contribution of each
    # cable, (m,).
    spare = 0.0
    size = 0.0
    for k in range(direction.size):
        spare -= direction[k] * demand.right[k]
        size += abs(direction[k] * demand.right[k])
    for i in range(tops.size):
        a, b = component_along(demand.matrix, direction, i), component_along(demand.hanging, direction, i)
        tops[i] = sag_forces.most_along(curves, i, _section_of(range_, i), a, b)
        spare += tops[i]
        size += abs(a) * range_[LARGEST, i] + abs(b) * max(abs(range_[AT_LEAST, i]), abs(range_[AT_LARGEST, i]))
    return spare + CERTAIN * size


@kernel
def _narrow_range(
    curves: sag_forces.Curves, demand: Demand, range_: Array, direction: Array, spare: float, tops: Array
) -> bool:
    """Remove from `range_` the tensions at which a cable is below its largest contribution by more than `spare`."""
    # Returns False if the range becomes empty.
    if not spare < math.inf:
        return True
    for i in range(tops.size):
        a, b = component_along(demand.matrix, direction, i), component_along(demand.hanging, direction, i)
        least, most = sag_forces.sag_force_range(curves, i, _section_of(range_, i))
        needed = tops[i] - spare + min(b * least, b * most)
        if a > 0.0 and needed / a > range_[LEAST, i]:
            if needed / a > range_[LARGEST, i]:
                return False
            range_[LEAST, i] = needed / a
            range_[AT_LEAST, i] = sag_forces.sag_force_at(curves, i, range_[LEAST, i])
        elif a < 0.0 and needed / a < range_[LARGEST, i]:
            if needed / a < range_[LEAST, i]:
                return False
            range_[LARGEST, i] = needed / a
            range_[AT_LARGEST, i] = sag_forces.sag_force_at(curves, i, range_[LARGEST, i])
    return True


@kernel
def _narrow_free(
    curves: sag_forces.Curves, demand: Demand, range_: Array, change: TensionChange, tops: Array, memory: Memory
) -> bool:
    """Narrow a range along directions to which only one of the cables between their limits contributes."""
    # Returns False if the range becomes empty.
    n, m = demand.matrix.shape
    count = 0
    for i in range(m):
        count += 1 if range_[LEAST, i] < change.tau[i] < range_[LARGEST, i] else 0
    if count == 0 or count > n:
        return True
    rows, memory = block(memory, 2 * count + n + 2, n)
    diagonals, memory = block(memory, 2, count)
    reduced, inverse = rows[:count], rows[count : 2 * count]
    sag_forces.slopes_at(curves, change.tau, tops, curves.cables.slackness)
    count = 0
    for i in range(m):
        if range_[LEAST, i] < change.tau[i] < range_[LARGEST, i]:
            for k in range(n):
                reduced[count, k] = demand.matrix[k, i] - demand.hanging[k, i] * tops[i]
            count += 1
    if not factorize(reduced, diagonals):
        return True
    q = rows[2 * count : 2 * count + n + 1]
    orthogonal_factor(reduced, diagonals, q)
    pseudo_inverse(reduced, diagonals, q, inverse)
    direction = rows[2 * count + n + 1]
    for c in range(2 * count):
        for k in range(n):
            direction[k] = inverse[c // 2, k] if c % 2 == 0 else -inverse[c // 2, k]
        spare = _spare_capacity(curves, demand, range_, direction, tops)
        if spare < 0.0 or not _narrow_range(curves, demand, range_, direction, spare, tops):
            return False
    return True


@glue
def _least_certain(curves: sag_forces.Curves, range_: Array) -> tuple[int, float]:
    """Cable with the most uncertain sag force in `range_`, and sum of the uncertainties of all sag forces [N]."""
    worst = -1
    largest = 0.0
    total = 0.0
    for i in range(range_.shape[1]):
        least, most = sag_forces.sag_force_range(curves, i, _section_of(range_, i))
        total += most - least
        if most - least > largest:
            worst, largest = i, most - least
    return worst, total


@glue
def _split_range(curves: sag_forces.Curves, waiting: Array, top: int, i: int, tau: float) -> None:
    """Split the tension range of cable `i` in two. The half that contains the tension `tau` is examined next."""
    for row in range(RANGE_ROWS):
        copy(waiting[top, row], waiting[top + 1, row])
    low, high = waiting[top, LEAST, i], waiting[top, LARGEST, i]
    middle = math.sqrt(low * high) if low > 0.0 else 0.5 * high
    sag_force = sag_forces.sag_force_at(curves, i, middle)
    lower, upper = (top + 1, top) if tau <= middle else (top, top + 1)
    waiting[lower, LARGEST, i] = middle
    waiting[lower, AT_LARGEST, i] = sag_force
    waiting[upper, LEAST, i] = middle
    waiting[upper, AT_LEAST, i] = sag_force


@glue
def _first_range(curves: sag_forces.Curves, size: float, range_: Array) -> None:
    """Fill the first range with all admissible tensions. The upper end is finite, even for a cable without a limit."""
    cables = curves.cables
    for i in range(cables.low.size):
        low, high = cables.low[i], cables.high[i]
        if high == math.inf:
            high = max(low, PLENTY * size)
        range_[LEAST, i] = low
        range_[LARGEST, i] = high
        range_[AT_LEAST, i] = sag_forces.sag_force_at(curves, i, low)
        range_[AT_LARGEST, i] = sag_forces.sag_force_at(curves, i, high)


@glue
def _approach_demand(
    curves: sag_forces.Curves, demand: Demand, range_: Array, trial: TensionChange, memory: Memory
) -> tuple[float, bool]:
    """Compute the tensions in `range_` whose wrench is closest to `demand`."""
    # Returns the residual force [N], and True if the moments balance. If the moments cannot balance, the force is
    # infinite, and the direction has only a moment part.
    n, m = demand.matrix.shape
    first = demand.soft
    for i in range(m):
        trial.tau[i] = min(max(trial.tau[i], range_[LEAST, i]), range_[LARGEST, i])
    left = math.inf
    if first > 0:
        left = least_change(curves, demand, range_, trial, memory)
    if left < math.inf or left != left:
        return left, norm_of_part(trial.residual, first, n) <= FEASIBLE * demand.size
    moments = Demand(demand.matrix[first:], demand.hanging[first:], demand.right[first:], n - first, demand.size)
    part = TensionChange(trial.tau, trial.sag_force, trial.residual[first:], trial.direction[first:])
    least_change(curves, moments, range_, part, memory)
    trial.direction[:first] = 0.0
    return math.inf, False


@glue
def decide_feasibility(
    curves: sag_forces.Curves, demand: Demand, nodes: int, change: TensionChange, memory: Memory
) -> tuple[int, float, float, bool]:
    """Decide whether tensions within the cables' limits can supply `demand`."""
    # `nodes`: largest number of examined ranges. `change`: initial tensions, overwritten with the tensions with the
    # least residual, this residual and its direction. Returns POSE_SOLVED, POSE_INFEASIBLE, POSE_BORDERLINE, or
    # POSE_NOT_CONVERGED after an arithmetic failure; the lower and upper bound of the shortfall [N]; and True if a
    # single direction proves infeasibility for the whole first range.
    n, m = demand.matrix.shape
    tops, rest = vector(memory, m)  # largest contribution of each cable along a direction [N]
    waiting, rest = block(rest, DEPTH, RANGE_ROWS * m)
    ranges = waiting.reshape((DEPTH, RANGE_ROWS, m))  # waiting ranges; the last one is examined next
    sag_force, rest = vector(rest, m)
    tau, rest = block(rest, 3, max(m, n))
    trial = TensionChange(tau[0, :m], sag_force, tau[1, :n], tau[2, :n])
    _first_range(curves, demand.size, ranges[0])
    sag_forces.find_extrema(curves, ranges[0, LEAST], ranges[0, LARGEST], rest)
    copy(change.tau, trial.tau)
    enough = math.inf
    top = 0
    for node in range(nodes):
        range_ = ranges[top]
        left, balanced = _approach_demand(curves, demand, range_, trial, rest)
        if node == 0 and not (demand.size < math.inf and left == left):
            return codes.POSE_NOT_CONVERGED, 0.0, math.inf, False
        if node == 0 or (balanced and left < enough):
            copy(trial.tau, change.tau)
            copy(trial.residual, change.residual)
        if balanced:
            enough = min(enough, left)
        if balanced and left <= FEASIBLE * demand.size:
            return codes.POSE_SOLVED, 0.0, 0.0, False
        spare = _spare_capacity(curves, demand, range_, trial.direction, tops)
        if node == 0:
            copy(trial.direction, change.direction)
            if spare < 0.0:
                return codes.POSE_INFEASIBLE, -spare if left < math.inf else math.inf, enough, True
        _, before = _least_certain(curves, range_)
        possible = spare >= 0.0 and _narrow_range(curves, demand, range_, trial.direction, spare, tops)
        possible = possible and _narrow_free(curves, demand, range_, trial, tops, rest)
        if possible:
            worst, after = _least_certain(curves, range_)
            if after > STANDSTILL * before or worst < 0:
                if worst < 0 or top + 1 >= DEPTH:
                    break
                _split_range(curves, ranges, top, worst, trial.tau[worst])
                top += 1
        else:
            top -= 1
            if top < 0:
                return codes.POSE_INFEASIBLE, 0.0, enough, False
    return codes.POSE_BORDERLINE, 0.0, enough, False
