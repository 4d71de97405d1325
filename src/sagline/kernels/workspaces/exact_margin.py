"""Margin with the exact sag forces of the cables, for poses where bounds of the sag forces do not decide its sign.

Let y be the normal of the limiting facet, and e the load with y . e = 1 N. The margin near zero is the largest multiple
of e that the cables can supply in addition to the demand. Newton steps with the exact sag forces find local maxima of
this multiple from several initial tensions. All components of the balance are hard equations, except the component
along e. The feasibility decision of `inverse` confirms the sign: a positive multiple does not prove that the cables can
supply the demand itself. If this decision has no result, the distribution iterations of `inverse` are tried.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.bounds import START
from sagline.kernels.algebra.factors import copy, dot, norm, solve_general
from sagline.kernels.cable.sag_forces import Curves, sag_forces_at
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.terms import Model
from sagline.kernels.inverse.feasibility import demand_of_pose, new_demand
from sagline.kernels.inverse.poses import Method, distribute_and_solve_cables
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import Balance, Platform, along_freedom, new_balance, set_pose
from sagline.kernels.tension.bracket import NODES, decide_feasibility
from sagline.kernels.tension.least_change import Demand, TensionChange, least_change
from sagline.kernels.tension.nearest import Distribution, new_reference_point
from sagline.kernels.workspaces.sag_force_bounds import HIGH, LOW, SAG_FORCE_LOW, SLOPE

EXACT = 1e-5  # bound of the error of a margin with exact sag forces, relative to the largest force
NARROW = 1e-3  # if the bounds are closer, relative to the largest force, the margin in the limiting facet is used
CLOSE = 1e-3  # the sign of a smaller negative margin, relative to the largest force, is not proved
NEAR = 1e-2  # a smaller negative margin, relative to the largest force, is proved by a short search
SHORT = 4  # largest number of examined ranges of a short search; other searches have that of `inverse`
HARDLY = 1e-9  # value, relative to the largest force, if the decision contradicts the sign of the margin
FURTHER = 1.01  # initial value of the search, relative to the upper bound of the margin
IN_FACET = 1e-9  # a secant is in the facet if its relative product with the normal is smaller

VALUE, BELOW, ABOVE = 0, 1, 2  # rows of a margin (3,) [N]


class LimitingFacet(NamedTuple):
    """The limiting facet of a pose at which the bounds of the margin do not decide its sign."""

    direction: Array  # unit normal y, (6,)
    columns: Array  # wrench of the secants per newton of chord tension, (6, m)
    width: Array  # half the ranges of the tensions [N], (m,)
    levers: Array  # platform anchors along x and y from the center of mass [m], (2, m)
    middle: Array  # wrench of the cables at the middle of their secants, minus the weight, (6,)
    bands: Array  # filled by `fill_bands`
    arm: float  # lever arm of the norm [m]
    single: bool  # True if the least favorable wrench is the only wrench of the set


@kernel
def settle_margin(
    model: Model,
    limits: TensionLimits,
    platform: Platform,
    facet: LimitingFacet,
    curves: Curves,
    margin: Array,
    memory: Memory,
) -> int:
    """Replace `margin` (3,) by the margin with exact sag forces. Returns the status of the new margin."""
    # `platform`: contains the least favorable wrench of the set.
    cables = curves.cables
    m, n = cables.low.size, platform.freedom.shape[0]
    load, rest = vector(memory, n)
    _fill_load(platform.freedom, facet, load)
    size = platform.body[tables.MASS] * platform.body[tables.GRAVITY]
    for i in range(m):
        size = max(size, cables.half_weight[i])
    if margin[ABOVE] - margin[BELOW] <= NARROW * size:
        exact = _margin_in_facet(platform, facet, curves, load, rest)
        if abs(exact) < math.inf:
            _write_value(margin, exact, EXACT * size)
            return codes.MARGIN_OPEN
    balance, rest = new_balance(rest, m, n)
    space, change, weight, rest = new_demand(rest, m, platform.freedom)
    set_pose(model, limits, codes.CHORD_TENSION, weight, platform, cables, balance)
    demand, lever = demand_of_pose(platform, cables, balance, space, change)
    for k in range(demand.soft, n):
        load[k] /= lever
    exact, enough, verdict = -math.inf, math.inf, codes.POSE_BORDERLINE
    for search in range(3):
        if search != 1:  # the second search starts at the tensions of the multiple
            copy(balance.bounds[START], change.tau)
        nodes = 1 if search == 0 else SHORT if -NEAR * size <= exact < 0.0 else NODES
        verdict, _, enough, _ = decide_feasibility(curves, demand, nodes, change, rest)
        exact = _largest_multiple(curves, demand, facet.bands, load, margin[ABOVE], change.tau, rest)
        if verdict != codes.POSE_BORDERLINE or -CLOSE * size <= exact < 0.0:
            break
    open_ = verdict == codes.POSE_BORDERLINE and not -EXACT * size <= exact < 0.0
    if open_ and _distributes_tensions(curves, limits, platform, balance, change.tau, rest):
        verdict = codes.POSE_SOLVED
        exact = max(exact, _largest_multiple(curves, demand, facet.bands, load, margin[ABOVE], change.tau, rest))
    if verdict == codes.POSE_SOLVED and (exact >= 0.0 or exact < -EXACT * size):
        _write_value(margin, exact if exact >= 0.0 else HARDLY * size, EXACT * size)
        if facet.single:
            margin[BELOW] = max(margin[BELOW], 0.0)
            return codes.MARGIN_FEASIBLE
        return codes.MARGIN_OPEN
    if exact >= 0.0 and enough < math.inf:
        exact = -enough
    if not abs(exact) < math.inf:
        exact = margin[VALUE]
    if verdict == codes.POSE_INFEASIBLE:
        _write_value(margin, min(exact, -HARDLY * size), EXACT * size)
        margin[ABOVE] = min(margin[ABOVE], margin[VALUE])
        return codes.MARGIN_INFEASIBLE
    _write_value(margin, exact, EXACT * size)
    return codes.MARGIN_OPEN


@glue
def _distributes_tensions(
    curves: Curves, limits: TensionLimits, platform: Platform, balance: Balance, tau: Array, memory: Memory
) -> bool:
    """True if the distribution iterations of `inverse` balance the demand. Then `tau` (m,) is filled."""
    m = tau.size
    rows, rest = block(memory, 2, m)
    weight, goal = rows[0], rows[1]
    weight[:] = 1.0
    goal[:] = 0.0
    distribution = Distribution(codes.MINIMUM_NORM, 0.0, codes.CHORD_TENSION, weight, goal)
    near, rest = new_reference_point(rest, goal, m - platform.freedom.shape[0])
    status = set_pose(curves.model, limits, codes.CHORD_TENSION, weight, platform, curves.cables, balance)
    if status == codes.POSE_SOLVED:
        status = distribute_and_solve_cables(
            curves.model, Method(distribution, near), platform, curves.cables, balance, None, None, curves.statuses
        )
    if status == codes.POSE_SOLVED:
        copy(curves.cables.tau, tau)
    return status == codes.POSE_SOLVED


@glue
def _write_value(margin: Array, exact: float, error: float) -> None:
    """Fill value and bounds of `margin` from `exact`, the margin with exact sag forces [N]."""
    # The value has the sign of the exact margin. The value is continuous where the bounds begin to decide the sign.
    share = 0.0
    if exact > 0.0:
        share = max(1.0 + margin[BELOW] / exact, 0.0)
    elif exact < 0.0:
        share = max(1.0 + margin[ABOVE] / exact, 0.0)
    value = exact + share * (margin[VALUE] - exact) if share > 0.0 else exact
    margin[VALUE] = min(max(value, margin[BELOW]), margin[ABOVE])
    if abs(exact) <= error:
        margin[BELOW] = max(margin[BELOW], exact - error)
        margin[ABOVE] = min(margin[ABOVE], exact + error)


@glue
def _margin_in_facet(platform: Platform, facet: LimitingFacet, curves: Curves, load: Array, memory: Memory) -> float:
    """Margin with exact sag forces from the tensions where the load meets the facet. NaN if it misses the facet."""
    # The tensions follow from the secants. If the bounds are narrow, errors of the tensions have a second-order effect.
    columns, y, bands = facet.columns, facet.direction, facet.bands
    n, m = platform.freedom.shape[0], columns.shape[1]
    matrix, rest = block(memory, n, n)
    right, rest = vector(rest, n)
    wrench, rest = vector(rest, 6)
    rows, rest = block(rest, 2, m)
    tau, sag_force = rows[0], rows[1]
    for a in range(6):
        wrench[a] = -facet.middle[a] - platform.wrench[a]
    count = 0
    for i in range(m):
        along = terms = 0.0
        for a in range(6):
            along += columns[a, i] * y[a]
            terms += abs(columns[a, i] * y[a])
        inside = abs(along) <= IN_FACET * terms
        tau[i] = math.nan if inside else bands[LOW, i] + (2.0 * facet.width[i] if along > 0.0 else 0.0)
        if inside:
            count += 1
            if count < n:
                for k in range(n):
                    matrix[k, count - 1] = dot(platform.freedom[k], columns[:, i])
        else:
            for a in range(6):
                wrench[a] -= columns[a, i] * math.copysign(facet.width[i], along)
    if count != n - 1:
        return math.nan
    along_freedom(platform.freedom, wrench, right)
    for k in range(n):
        matrix[k, n - 1] = -load[k]
    if not solve_general(matrix, right):
        return math.nan
    count = 0
    for i in range(m):
        if math.isnan(tau[i]):
            tau[i] = bands[LOW, i] + facet.width[i] + right[count]
            count += 1
            if not bands[LOW, i] <= tau[i] <= bands[HIGH, i]:
                return math.nan
    sag_forces_at(curves, tau, sag_force)
    margin = right[n - 1]
    for i in range(m):
        secant = bands[SAG_FORCE_LOW, i] + bands[SLOPE, i] * (tau[i] - bands[LOW, i])
        hanging = y[2] + y[3] * facet.levers[1, i] - y[4] * facet.levers[0, i]
        margin -= hanging * (sag_force[i] - secant)
    return margin


@glue
def _fill_load(freedom: Array, facet: LimitingFacet, load: Array) -> None:
    """Fill the load e (n,) along the free motions, with y . e = 1. The load is a moment if y has no force part."""
    y = facet.direction
    pure = y[0] == 0.0 and y[1] == 0.0 and y[2] == 0.0
    weight = 1.0 if pure else facet.arm * facet.arm
    for k in range(freedom.shape[0]):
        load[k] = 0.0
        for a in range(6):
            load[k] += freedom[k, a] * y[a] * (1.0 if a < 3 else weight)


@glue
def _largest_multiple(
    curves: Curves, demand: Demand, bands: Array, load: Array, above: float, tau: Array, memory: Memory
) -> float:
    """Largest multiple of `load` that the cables supply in addition to `demand`. Infinite or NaN if not found."""
    # A reflection turns the load to the first component. Only this component is soft. The searches start at `above`,
    # beyond the upper bound: from `tau`, from equal high tensions, and from the best tensions with one cable at its
    # lower limit. The first multiple that is certainly positive ends the search.
    # `tau`: overwritten with the tensions that supply the multiple.
    n, m = demand.matrix.shape
    rows, rest = block(memory, 2 * n + 4, m)
    vectors, rest = block(rest, 4, n)
    mirror, right = vectors[0], vectors[1]
    length = norm(load)
    further = max(FURTHER * above, demand.size * EXACT)
    if not further < math.inf or not length > 0.0:
        return math.nan
    for k in range(n):
        mirror[k] = load[k] / length
        right[k] = demand.right[k] + further * load[k]
    mirror[0] += math.copysign(1.0, mirror[0])
    square = 2.0 * abs(mirror[0])
    _reflect_vector(mirror, square, right)
    for i in range(m):
        for k in range(n):
            rows[k, i] = demand.matrix[k, i]
            rows[n + k, i] = demand.hanging[k, i]
        _reflect_vector(mirror, square, rows[:n, i])
        _reflect_vector(mirror, square, rows[n : 2 * n, i])
        rows[2 * n, i], rows[2 * n + 1, i] = bands[LOW, i], bands[HIGH, i]
    turned = Demand(rows[:n], rows[n : 2 * n], right, 1, demand.size)
    change = TensionChange(rows[2 * n + 2], rows[2 * n + 3], vectors[2], vectors[3])
    best = math.inf
    for start in range(m + 2):
        if start >= 2 and not tau[start - 2] > bands[LOW, start - 2]:
            continue
        for i in range(m):
            first = demand.size if start == 1 else 0.0 if start == i + 2 else tau[i]
            change.tau[i] = min(max(first, bands[LOW, i]), bands[HIGH, i])
        left = least_change(curves, turned, rows[2 * n : 2 * n + 2], change, rest)
        for k in range(1, n):
            if not abs(change.residual[k]) <= HARDLY * demand.size:
                left = math.inf
        if left < best:
            best = left
            copy(change.tau, tau)
        if further - best / length > EXACT * demand.size:
            break
    return further - best / length


@glue
def _reflect_vector(mirror: Array, square: float, vector: Array) -> None:
    """Reflect `vector` at the plane with the normal `mirror` (n,), whose squared length is `square`."""
    along = dot(mirror, vector) * (2.0 / square)
    for k in range(vector.size):
        vector[k] -= along * mirror[k]
