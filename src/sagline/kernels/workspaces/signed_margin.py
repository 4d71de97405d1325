"""Signed margin of a pose for a set of loads; negative if the set is not within the available wrench set.

The margin is the least signed distance between the set and the facets of the available wrench set; docs/model.md,
section 13. The sag forces depend on the tensions, which vary within their limits. The least favorable sag forces give a
lower bound of the margin, and the most favorable sag forces give an upper bound. The value between the bounds uses the
sag forces at the tension limits, and is continuous in the pose.

Source:
    Bouchard, Gosselin & Moore 2010, "On the ability of a cable-driven robot to generate a prescribed set of wrenches";
    Guay, Cardou, Cruz-Ruiz & Caro 2014, "Measuring how well a structure supports varying external wrenches".
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import copy
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.pulley import robots_have_machine
from sagline.kernels.cable.sag_forces import Curves, new_curves
from sagline.kernels.cable.states import TensionLimits, cable_without_tension, least_of_sag
from sagline.kernels.cable.terms import new_cables
from sagline.kernels.inverse.poses import LimitTerms, ModelTerms, Robots, model_at
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import Platform, fill_structure_matrix, is_rotation, place_cables, rows_along_freedom
from sagline.kernels.workspaces import facets, wrench_set
from sagline.kernels.workspaces import sag_force_bounds as sag
from sagline.kernels.workspaces.exact_margin import ABOVE, BELOW, VALUE, LimitingFacet, settle_margin

# rounding error of the product of a normal with a column in its facet, relative to the terms of the product
ALONG = 1e-13
# a secant counts as part of the facet if its product with the normal is smaller, relative to the terms of the product
IN_PLANE = 1e-10
PURE = 1e-9  # a unit normal (moments times lever arm) with a smaller force part counts as a pure moment

# Facets that are measured together: rows in flat memory. Loops over facets vectorize, because the positions of the rows
# are known at compile time.
TOGETHER = 64
NORMAL = 0  # six rows
ROUNDING = 6 * TOGETHER
BY_ENDS = 7 * TOGETHER  # half ranges of the cables' wrenches
# largest decrease and increase of the wrenches because the sag forces differ from their secants
DECREASE, INCREASE = 8 * TOGETHER, 9 * TOGETHER
IN_FACET = 2 * TOGETHER  # two rows further: the same quantities for cables whose secants are in the facet
AGAINST, FOR = 12 * TOGETHER, 13 * TOGETHER  # extent of the set in both directions of the normal
# largest contributions of cables without upper limit, in both directions of the normal
UP, DOWN = 14 * TOGETHER, 15 * TOGETHER
WORK = 16 * TOGETHER  # two rows
LENGTH = 18 * TOGETHER  # inverse of the normal's length
MARGINS = 19 * TOGETHER  # three rows: VALUE, BELOW, ABOVE
FACET_SIZE = 22 * TOGETHER
AS_GOOD_AS_INFINITE = 1e250
BEYOND = 1e300  # inverse of the length zero; products with this number count as infinite


def margin_memory(n: int, m: int) -> int:
    """Numbers of `signed_margins` for n free motions and m cables, in addition to the memory of a kernel."""
    # Python calls this function; it cannot call `most_subsets`, which numba compiles for other kernels only
    return FACET_SIZE + ((1 << n) + 1) * max(math.comb(m - n, k) for k in range(4))


MarginMemory = tuple[Array, Indices, Codes]
Margins = tuple[Array, Array, Indices, Codes]  # margins (3, N), directions (N, 6), cables (N,), statuses (N,)


@entry
def signed_margins(
    model_terms: ModelTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    set_terms: wrench_set.SetTerms,
    arms: tuple[Array, Array],
    poses: Array,
    memory: MarginMemory,
    margins: Margins,
    first: int,
    last: int,
) -> None:
    """Fill the margins of poses."""
    # model_terms: Cable model: code, k_h, k_p.
    # limit_terms: Limits of the tensions: `TensionLimits`.
    # robot_terms: Rows that select the free motions, translations first, (n, 6); body_table, (1 or R, BODY_COLUMNS);
    #   cable_table, (1 or R, m, CABLE_COLUMNS). N/R successive poses belong to each robot.
    # set_terms: The set of loads.
    # arms: Lever arm of the norm, and mean lever arm [m], (1 or R,) each.
    # poses: Rows (N, POSE_COLUMNS).
    # memory: Two times the work arrays from `memory_for`, `margin_memory` numbers, and codes of the cables (m,).
    # margins: Filled with value, lower and upper bound [N], (3, N); normal of the facet with the least distance, in
    #   world axes, of length 1 with moments divided by the lever arm, (N, 6); index of the cable whose limit has the
    #   largest effect on the value, or -1, (N,); status from the two bounds, (N,).
    # first: Index of the first pose.
    # last: Index after the last pose.
    limits = TensionLimits(*limit_terms)
    freedom, bodies, robots = robot_terms
    values, directions, limiting, statuses = margins
    inertias = set_terms[7]
    count, m, n = poses.shape[0], robots.shape[1], freedom.shape[0]
    cables, rest = new_cables(Memory(memory[0], memory[1]), m, robots_have_machine(robots))
    walk, rest = facets.new_facets(rest, n, m)
    bounds, rest = facets.new_bounds(rest, n, m)
    wrenches, rest = wrench_set.new_set(set_terms, rest)
    rotation, rest = block(rest, 3, 3)
    found, rest = vector(rest, 3)
    middle, rest = vector(rest, 6)
    wrench, rest = vector(rest, 6)
    measured, rest = vector(rest, FACET_SIZE)
    rows, rest = block(rest, g.GEOMETRY_ROWS + sag.BAND_ROWS + facets.COUNT_ROWS, m)
    geometry, bands = rows[: g.GEOMETRY_ROWS], rows[g.GEOMETRY_ROWS : g.GEOMETRY_ROWS + sag.BAND_ROWS]
    counted = rows[g.GEOMETRY_ROWS + sag.BAND_ROWS :]
    for p in range(first, last):
        values[VALUE, p] = values[BELOW, p] = values[ABOVE, p] = -math.inf
        directions[p] = 0.0
        body, robot = bodies[p * bodies.shape[0] // count], robots[p * robots.shape[0] // count]
        arm, lever = arms[0][p * arms[0].size // count], arms[1][p * arms[1].size // count]
        platform = Platform(freedom, body, robot, poses[p], wrench)
        curves, left = new_curves(model_at(model_terms, body), cables, memory[2], rest)
        statuses[p], limiting[p] = _set_pose(limits, platform, lever, curves, walk, rotation, rows, left)
        if statuses[p] != codes.MARGIN_OPEN:
            continue
        wrench_set.place_set(set_terms, body, inertias[p * inertias.shape[0] // count], rotation, wrenches)
        counts = _facet_weights(body, set_terms[0], geometry, bands, counted, middle, arm, lever)
        if curves.model.code != codes.STRAIGHT:
            _fill_facet_table(freedom, counted[facets.COLUMN :], lever, walk.table)
            facets.choose_basis(walk, n, m, lever, True)
        _measure_all_facets(walk, bounds, m, counts, wrenches, measured, found, directions[p])
        limiting[p] = _limiting_cable(counts, directions[p]) if found[VALUE] < math.inf else -1
        statuses[p] = _margin_status(found)
        if counts.curved and statuses[p] == codes.MARGIN_OPEN:
            facet = _limiting_facet(counts, bands, wrenches, set_terms[0], directions[p], wrench)
            statuses[p] = settle_margin(curves.model, limits, platform, facet, curves, found, left)
        for k in range(3):
            values[k, p] = found[k]


@glue
def _set_pose(
    limits: TensionLimits,
    platform: Platform,
    lever: float,
    curves: Curves,
    walk: facets.Facets,
    rotation: Array,
    rows: Array,
    memory: Memory,
) -> tuple[int, int]:
    """Fill geometry, structure matrix, basis and bands. Returns a status, and a cable without tensions, or -1."""
    # `rows`: filled with geometry, bands, and the structure matrix in the rows of the facets. The status is MARGIN_OPEN
    # if the pose can be measured.
    model, cables = curves.model, curves.cables
    geometry, bands = rows[: g.GEOMETRY_ROWS], rows[g.GEOMETRY_ROWS : g.GEOMETRY_ROWS + sag.BAND_ROWS]
    columns = rows[g.GEOMETRY_ROWS + sag.BAND_ROWS + facets.COLUMN :]
    cable_geometry(platform.robot, platform.body, platform.pose, rotation, geometry)
    if not place_cables(model, limits, platform.robot, geometry, cables):
        return codes.MARGIN_NO_CHORD, -1
    fill_structure_matrix(geometry, columns)
    _fill_facet_table(platform.freedom, columns, lever, walk.table)
    if not facets.choose_basis(walk, walk.basis.size, cables.low.size, lever, model.code == codes.STRAIGHT):
        return codes.MARGIN_SINGULAR, -1
    i = cable_without_tension(cables)
    if i >= 0:
        slack = cables.high[i] < least_of_sag(model, cables.half_weight[i])
        return codes.MARGIN_TOO_SLACK if slack else codes.MARGIN_INFEASIBLE, i
    return codes.MARGIN_OPEN if sag.fill_bands(curves, bands, memory) else codes.MARGIN_TOO_SLACK, -1


@glue
def _limiting_facet(
    counts: facets.FacetWeights,
    bands: Array,
    wrenches: wrench_set.WrenchSetArrays,
    center: Array,
    direction: Array,
    wrench: Array,
) -> LimitingFacet:
    """Facet with the normal `direction`, for the margin with exact sag forces; `wrench` (6,) is filled."""
    rows = counts.rows
    single = wrench_set.worst_wrench(center, wrenches, direction, wrench)
    for k in range(6):
        counts.middle[k] -= center[k]
    levers = rows[facets.LEVER_X : facets.LEVER_Y + 1]
    return LimitingFacet(
        direction, rows[facets.COLUMN :], rows[facets.WIDTH], levers, counts.middle, bands, counts.arm, single
    )


@glue
def _fill_facet_table(freedom: Array, full: Array, lever: float, table: Array) -> None:
    """Fill the table from which a basis is selected: one row per free motion, moments divided by the mean lever arm."""
    m = full.shape[1]
    rows_along_freedom(freedom, full, table)
    for k in range(freedom.shape[0]):
        unit = 1.0 / lever if is_rotation(freedom, k) else 1.0
        for i in range(m):
            table[k, i] *= unit
        for a in range(6):
            table[k, m + a] = freedom[k, a] * unit
        table[k, m + 6] = 0.0


@glue
def _facet_weights(
    body: Array, center: Array, geometry: Array, bands: Array, rows: Array, middle: Array, arm: float, lever: float
) -> facets.FacetWeights:
    """Weights of the cables for all facets; `rows` and `middle` are filled."""
    endless = curved = False
    copy(center, middle)
    middle[2] -= body[tables.MASS] * body[tables.GRAVITY]
    for i in range(bands.shape[1]):
        limited = bands[sag.HIGH, i] < math.inf
        endless = endless or not limited
        rows[facets.WIDTH, i] = 0.5 * (bands[sag.HIGH, i] - bands[sag.LOW, i]) if limited else 0.0
        rows[facets.BELOW_SECANT, i], rows[facets.ABOVE_SECANT, i] = bands[sag.UNDER, i], bands[sag.OVER, i]
        curved = curved or bands[sag.UNDER, i] < bands[sag.OVER, i]
        x, y = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i]
        rows[facets.LEVER_X, i] = x
        rows[facets.LEVER_Y, i] = y
        for a in range(6):
            middle[a] += rows[facets.COLUMN + a, i] * (bands[sag.LOW, i] + rows[facets.WIDTH, i])
        rise = 0.5 * (bands[sag.SAG_FORCE_HIGH, i] - bands[sag.SAG_FORCE_LOW, i]) if limited else 0.0
        sag_force = bands[sag.SAG_FORCE_LOW, i] + rise
        slope = bands[sag.SLOPE, i]
        middle[2] -= sag_force
        middle[3] -= sag_force * y
        middle[4] += sag_force * x
        rows[facets.COLUMN + 2, i] -= slope
        rows[facets.COLUMN + 3, i] -= slope * y
        rows[facets.COLUMN + 4, i] += slope * x
    return facets.FacetWeights(rows, middle, bands[sag.HIGH], endless, curved, arm, lever)


@glue
def _measure_all_facets(
    walk: facets.Facets,
    bounds: facets.Bounds,
    m: int,
    counts: facets.FacetWeights,
    wrenches: wrench_set.WrenchSetArrays,
    measured: Array,
    margin: Array,
    direction: Array,
) -> None:
    """Fill the margin over all facets (3,), and the normal of the facet with the least value (6,)."""
    # As soon as the first facets are measured, bounds exclude most of the others.
    margin[:] = math.inf
    walk.minors[0, 0] = 1.0
    n, size, count, c, held = walk.basis.size, 0, 1, 0, 0
    s, slack, limit = facets.START[n, 1], math.inf, math.inf
    for _ in range(facets.LIMIT):
        for t in range(s, facets.START[n, size + 2]):
            s = t
            if c == 0:
                limit = margin[VALUE] + slack
                if limit < math.inf:
                    facets.measure_bounds(walk.minors, facets.ORDER[n, s], size + 1, count, limit, bounds)
            first, c = c, 0
            for b in range(first, count):
                if limit < math.inf and bounds.excess[b] > 0.0:
                    continue
                if _add_normal(walk, size, facets.ORDER[n, s], b, m, measured, held):
                    held += 1
                    if held == TOGETHER:
                        c = b + 1
                        break
            if c > 0:
                break
        if c == 0:
            size, count = facets.next_subsets(walk, n, size)
            s = facets.START[n, size + 1]
        if c > 0 or size < 0:
            _measure_facets(counts, wrenches, held, measured, margin, direction)
            held = 0
            if size < 0:
                break
            if slack == math.inf and counts.arm > 0.0:
                slack = facets.fill_bounds(walk, m, counts, wrenches, bounds.terms)
    margin[BELOW] = min(margin[BELOW], margin[VALUE])  # true except for rounding errors
    margin[ABOVE] = max(margin[ABOVE], margin[VALUE])
    for k in range(3):
        if abs(margin[k]) >= AS_GOOD_AS_INFINITE:
            margin[k] = math.copysign(math.inf, margin[k])


@formula
def _add_normal(walk: facets.Facets, size: int, rows: int, c: int, m: int, measured: Array, b: int) -> bool:
    """Fill the normal from `rows` and the subset `c` of `size` columns, one less. False if the normal is zero."""
    x = y = z = u = v = w = 0.0
    sign = 1.0
    largest = 0.0
    rounding = 0.0
    for j in range(size + 1):
        k = facets.MEMBERS[rows, j]
        factor = sign * walk.minors[rows ^ (1 << k), c]
        sign = -sign
        row = walk.table[k, m:]
        x += factor * row[0]
        y += factor * row[1]
        z += factor * row[2]
        u += factor * row[3]
        v += factor * row[4]
        w += factor * row[5]
        rounding += abs(factor) * row[6]
        largest = max(largest, abs(factor))
    measured[NORMAL + b] = x
    measured[NORMAL + TOGETHER + b] = y
    measured[NORMAL + 2 * TOGETHER + b] = z
    measured[NORMAL + 3 * TOGETHER + b] = u
    measured[NORMAL + 4 * TOGETHER + b] = v
    measured[NORMAL + 5 * TOGETHER + b] = w
    measured[ROUNDING + b] = rounding
    return largest > facets.DEPENDENT


@kernel
def _measure_facets(
    counts: facets.FacetWeights,
    wrenches: wrench_set.WrenchSetArrays,
    held: int,
    measured: Array,
    margin: Array,
    direction: Array,
) -> None:
    """Update the margin (3,) and its normal (6,) if a side of a stored facet has a smaller margin."""
    _sum_cables(counts, held, measured)
    normals, work = measured[: 6 * TOGETHER].reshape((6, TOGETHER)), measured[WORK : WORK + 2 * TOGETHER]
    wrench_set.reach_of_set(wrenches, normals, held, work.reshape((2, TOGETHER)), measured[AGAINST:], measured[FOR:])
    if counts.endless:
        for b in range(held):
            if measured[UP + b] > ALONG * measured[ROUNDING + b]:
                measured[AGAINST + b] = -math.inf
            if measured[DOWN + b] > ALONG * measured[ROUNDING + b]:
                measured[FOR + b] = -math.inf
    _measure_lengths(counts, held, measured)
    _measure_sides(counts.middle, held, measured)
    best = -1
    for b in range(held):
        if measured[MARGINS + b] < margin[VALUE]:
            margin[VALUE] = measured[MARGINS + b]
            best = b
        margin[BELOW] = min(margin[BELOW], measured[MARGINS + TOGETHER + b])
        margin[ABOVE] = min(margin[ABOVE], measured[MARGINS + 2 * TOGETHER + b])
    if best >= 0:
        _write_normal(counts, measured, normals, best, direction)


@glue
def _sum_cables(counts: facets.FacetWeights, held: int, measured: Array) -> None:
    """Along the stored normals, fill half the ranges of the cables' wrenches, and the changes due to secant errors."""
    rows = counts.rows
    for b in range(held):
        measured[BY_ENDS + b] = 0.0
        measured[DECREASE + b] = measured[INCREASE + b] = 0.0
        measured[DECREASE + IN_FACET + b] = measured[INCREASE + IN_FACET + b] = 0.0
        measured[UP + b] = measured[DOWN + b] = 0.0
    for i in range(rows.shape[1]):
        width, under, over = rows[facets.WIDTH, i], rows[facets.BELOW_SECANT, i], rows[facets.ABOVE_SECANT, i]
        x, y = rows[facets.LEVER_X, i], rows[facets.LEVER_Y, i]
        j0, j1, j2 = rows[facets.COLUMN, i], rows[facets.COLUMN + 1, i], rows[facets.COLUMN + 2, i]
        j3, j4, j5 = rows[facets.COLUMN + 3, i], rows[facets.COLUMN + 4, i], rows[facets.COLUMN + 5, i]
        for b in range(held):
            along = (
                j0 * measured[b]
                + j1 * measured[TOGETHER + b]
                + j2 * measured[2 * TOGETHER + b]
                + j3 * measured[3 * TOGETHER + b]
                + j4 * measured[4 * TOGETHER + b]
                + j5 * measured[5 * TOGETHER + b]
            )
            measured[BY_ENDS + b] += abs(along) * width
            measured[WORK + b] = along
        if under < over:
            for b in range(held):
                hanging = (
                    measured[2 * TOGETHER + b] + y * measured[3 * TOGETHER + b] - x * measured[4 * TOGETHER + b]
                )  # fmt: skip
                inside = 1.0 if abs(measured[WORK + b]) <= IN_PLANE * measured[ROUNDING + b] else 0.0
                decrease, increase = max(hanging * under, hanging * over), max(-hanging * under, -hanging * over)
                measured[DECREASE + b] += decrease
                measured[INCREASE + b] += increase
                measured[DECREASE + IN_FACET + b] += inside * decrease
                measured[INCREASE + IN_FACET + b] += inside * increase
        if counts.high[i] == math.inf:
            for b in range(held):
                measured[UP + b] = max(measured[UP + b], measured[WORK + b])
                measured[DOWN + b] = max(measured[DOWN + b], -measured[WORK + b])


@glue
def _measure_lengths(counts: facets.FacetWeights, held: int, measured: Array) -> None:
    """Fill the inverse lengths of the stored normals."""
    arm, lever = counts.arm * counts.arm, counts.lever * counts.lever
    for b in range(held):
        x, y, z = measured[b], measured[TOGETHER + b], measured[2 * TOGETHER + b]
        u, v, w = measured[3 * TOGETHER + b], measured[4 * TOGETHER + b], measured[5 * TOGETHER + b]
        force, moment = x * x + y * y + z * z, u * u + v * v + w * w
        pure = arm == 0.0 and not force > PURE * PURE * (force + lever * moment)
        measured[LENGTH + b] = BEYOND if pure else 1.0 / math.sqrt(force + arm * moment)


@glue
def _measure_sides(middle: Array, held: int, measured: Array) -> None:
    """Fill the margins of the stored facets, each from the nearer side of the facet."""
    e0, e1, e2 = middle[0], middle[1], middle[2]
    e3, e4, e5 = middle[3], middle[4], middle[5]
    for b in range(held):
        x, y, z = measured[b], measured[TOGETHER + b], measured[2 * TOGETHER + b]
        u, v, w = measured[3 * TOGETHER + b], measured[4 * TOGETHER + b], measured[5 * TOGETHER + b]
        along = e0 * x + e1 * y + e2 * z + e3 * u + e4 * v + e5 * w
        ahead = measured[BY_ENDS + b] + (along - measured[AGAINST + b])
        back = measured[BY_ENDS + b] + (-along - measured[FOR + b])
        inverse = measured[LENGTH + b]
        measured[MARGINS + b] = min(ahead, back) * inverse
        measured[MARGINS + TOGETHER + b] = inverse * min(
            ahead - measured[DECREASE + IN_FACET + b], back - measured[INCREASE + IN_FACET + b]
        )
        measured[MARGINS + 2 * TOGETHER + b] = inverse * min(
            ahead + measured[INCREASE + b], back + measured[DECREASE + b]
        )


@glue
def _write_normal(counts: facets.FacetWeights, measured: Array, normals: Array, b: int, direction: Array) -> None:
    """Fill the unit normal (6,) of a stored facet, directed to its nearer side."""
    along = 0.0
    moment = 0.0
    for k in range(6):
        along += counts.middle[k] * normals[k, b]
        moment += normals[k, b] * normals[k, b] if k >= 3 else 0.0
    forward = along - measured[AGAINST + b] <= -along - measured[FOR + b]
    pure = measured[LENGTH + b] == BEYOND
    size = 1.0 / math.sqrt(moment) if pure else measured[LENGTH + b]
    for k in range(6):
        direction[k] = 0.0 if pure and k < 3 else normals[k, b] * (size if forward else -size)


@glue
def _limiting_cable(counts: facets.FacetWeights, direction: Array) -> int:
    """Index of the cable with the largest contribution along `direction`."""
    cable = -1
    most = 0.0
    for i in range(counts.rows.shape[1]):
        along = wrench_set.dot6(counts.rows[facets.COLUMN :, i], direction)
        if abs(along) > most:
            most = abs(along)
            cable = i
    return cable


@glue
def _margin_status(margin: Array) -> int:
    """Status that follows from the bounds of `margin` (3,)."""
    if margin[BELOW] >= 0.0:
        return codes.MARGIN_FEASIBLE
    return codes.MARGIN_INFEASIBLE if margin[ABOVE] < 0.0 else codes.MARGIN_OPEN
