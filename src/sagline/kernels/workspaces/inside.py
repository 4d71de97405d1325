"""Proof that a tension policy keeps the limits all over a box of poses: the robot can work there."""

from __future__ import annotations

from typing import NamedTuple

from sagline.kernels.algebra.cholesky import solve_lower, solve_upper
from sagline.kernels.cable.sag_forces import Curves
from sagline.kernels.jit import kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.workspaces.box_tensions import Ranges, in_wrench_space, spread_of_slopes
from sagline.kernels.workspaces.centered import Centered, factor_normal
from sagline.kernels.workspaces.loads import Loads, dot6, reach_of_loads
from sagline.kernels.workspaces.pose_box import MOTIONS, CablesInBox, PoseRange, most_of_linear, norm3
from sagline.kernels.workspaces.sag_force_bounds import fall_rate, pull_slope, rise_rate

POOREST_INVERSE = 1e-6  # error of the pseudo-inverse above which nothing is proved: the place is all but singular
HEADROOM = 1.2  # a box of tensions is tried that much larger than a first estimate
ROUNDS = 3  # of that estimate


class Precision(NamedTuple):
    """Allowances of the proofs; tests switch them off.

    Attributes:
        bends: How much of what the slopes leave out is counted: 1.
        rounding: Error of a sum, of the sum of its parts' sizes.
    """

    bends: float
    rounding: float


@kernel
def proves_inside(
    place: CablesInBox, box: PoseRange, curves: Curves, loads: Loads, centered: Centered, ranges: Ranges, precision: Precision,
    memory: Memory,
) -> bool:  # fmt: skip
    """True if the policy tau + J^+ z stays within the limits all over a box; z is the demand of box and loads.

    Also fills centered.give with what the set of wrenches alone changes of each tension [N].
    """
    n, m = place.matrix.shape
    inverse, at = block(memory.numbers, 0, m, n)
    change, at = block(memory.numbers, at, m, m)
    hanging, at = block(memory.numbers, at, m, m)
    rows, at = block(memory.numbers, at, 7, m)
    slopes, _ = block(memory.numbers, at, MOTIONS + 2, 6)
    slack, sum_, trial, low, pull, size, weight = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6]
    along, coefficients = slopes[MOTIONS], slopes[MOTIONS + 1]
    tau = centered.tau
    for i in range(m):
        slack[i] = min(tau[i] - ranges.low[i], ranges.high[i] - tau[i])
        down, up = tau[i] - centered.low[i], centered.high[i] - tau[i]
        weight[i] = 1.0 / (1.0 / (down * down) + 1.0 / (up * up))
        if not slack[i] > 0.0:
            slack[i] = 0.0
    if not factor_normal(place.matrix, weight, 0.0, centered.normal):
        return False
    spread_of_slopes(place, box, centered, ranges, slopes)
    largest = 0.0
    for k in range(n):
        numbers = abs(centered.right[k])
        for i in range(m):
            numbers += abs(place.matrix[k, i]) * tau[i]
        largest = max(largest, numbers)
    for i in range(m):
        row = inverse[i]
        for k in range(n):
            row[k] = place.matrix[k, i]
        solve_lower(centered.normal, row)
        solve_upper(centered.normal, row)
        size[i] = 0.0
        for k in range(n):
            row[k] *= weight[i]
            size[i] += abs(row[k])
    error = 0.0
    reaching = 0.0
    for k in range(n):
        off = 0.0
        for j in range(n):
            total = -1.0 if j == k else 0.0
            for i in range(m):
                total += place.matrix[k, i] * inverse[i, j]
            off += abs(total)
        error = max(error, off)
    for k in range(n):
        for i in range(m):
            reaching = max(reaching, abs(place.matrix[k, i]))
    error += precision.rounding
    possible = error < POOREST_INVERSE
    for i in range(m):
        in_wrench_space(place.rows, inverse[i], along)
        for motion in range(MOTIONS):
            coefficients[motion] = dot6(slopes[motion], along)
        first = most_of_linear(box, coefficients)
        left = 0.0
        for k in range(n):
            left += inverse[i, k] * centered.left[k]
        first += abs(left) + precision.rounding * size[i] * largest
        arm = norm3(along[3], along[4], along[5])
        bends = 0.0
        inexact = size[i] * error / (1.0 - error) * reaching
        for j in range(m):
            x = along[0] + along[4] * place.lever[2, j] - along[5] * place.lever[1, j]
            y = along[1] + along[5] * place.lever[0, j] - along[3] * place.lever[2, j]
            z = along[2] + along[3] * place.lever[1, j] - along[4] * place.lever[0, j]
            length = norm3(x, y, z)
            bends += tau[j] * (length * place.bent[j] + arm * (place.swung[j] * place.turned[j] + place.curled[j]))
            bends += abs(ranges.pull[j]) * arm * place.curled[j]
            change[i, j] = precision.bends * (length * place.turned[j] + arm * place.swung[j]) + inexact
            hanging[i, j] = abs(z) + arm * place.swung[j]
        most = reach_of_loads(loads, along)
        for a in range(6):
            along[a] = -along[a]
        centered.give[i] = max(most, reach_of_loads(loads, along))
        sum_[i] = (first + precision.bends * bends + centered.give[i]) * (1.0 + precision.rounding)
        possible = possible and sum_[i] < slack[i]
    if not possible:
        return False
    for i in range(m):
        trial[i] = sum_[i]
    for _ in range(ROUNDS):
        for i in range(m):
            low[i] = sum_[i]
            for j in range(m):
                low[i] += change[i, j] * trial[j]
        for i in range(m):
            trial[i] = low[i]
    for i in range(m):
        trial[i] = min(slack[i], HEADROOM * trial[i])
        low[i] = tau[i] - trial[i]
    for j in range(m):
        moved = place.way[j] * pull_slope(curves, j, place.way[j], low[j])
        pull[j] = moved + trial[j] * max(fall_rate(curves, j, low[j]), rise_rate(curves, j, low[j]))
    for i in range(m):
        total = sum_[i]
        for j in range(m):
            total += change[i, j] * trial[j] + hanging[i, j] * pull[j]
        possible = possible and total * (1.0 + precision.rounding) < trial[i]
    return possible
