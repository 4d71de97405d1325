"""How much more load a pose can take than a whole set of loads, and below zero how much too much the set is.

docs/model.md, section 13: the least distance of the set to the facets of what the cables can exert, signed. Weight
makes the pulls of the cables uncertain while their tensions are: with the pulls that hurt the margin is a lower end,
with those that help an upper one, and between them lies that of the end tensions with their own pulls, which is
continuous.

Source:
    Bouchard, Gosselin & Moore 2010, "On the ability of a cable-driven robot to generate a prescribed set of wrenches";
    Guay, Cardou, Cruz-Ruiz & Caro 2014, "Measuring how well a structure supports varying external wrenches".
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.arrays import Array, Codes, Indices
from sagline.kernels import tables
from sagline.kernels.balance.freedom import turns
from sagline.kernels.balance.setting import Limits, place_cables
from sagline.kernels.balance.wrench import fill_structure_matrix, rows_along_freedom
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.cables import new_cables
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.pulley import robots_have_machine
from sagline.kernels.cable.pulls import new_curves
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import (
    MARGIN_FEASIBLE,
    MARGIN_INFEASIBLE,
    MARGIN_NO_CHORD,
    MARGIN_OPEN,
    MARGIN_SINGULAR,
    MARGIN_TOO_SLACK,
)
from sagline.kernels.jit import entry, glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.workspaces.bands import (
    BAND_ROWS,
    HIGH,
    LEAST,
    LOW,
    MOST,
    PULL_HIGH,
    PULL_LOW,
    fill_bands,
)
from sagline.kernels.workspaces.facets import DEPENDENT, LIMIT, Facets, eliminate, new_facets
from sagline.kernels.workspaces.wrench_set import SetTerms, WrenchSet, has_rest, new_set, place_set, reach_of_rest

ALONG = 1e-12  # of a normal of length 1 and a column, moments over the lever arm: a column in the facet itself
PURE = 1e-9  # force part of such a normal, below which it is one of moments alone

# Further columns of the facets' tables, after those of the m cables and the six of the normal.
ENDS, RANGES = 0, 1  # what the cables give in the middle of their ends, and of their pulls' ranges, less the demand
OTHERS = 2

# Rows of what counts at a facet (COUNT_ROWS, m).
WIDTH = 0  # half the range of the tensions
SLOPE = 1  # half of how far the pull grows from end to end
UNSURE = 2  # half the range of the pull
LEVER_X, LEVER_Y = 3, 4
COUNT_ROWS = 5

VALUE, BELOW, ABOVE = 0, 1, 2  # rows of the margins (3, N) [N]

ModelTerms = tuple[int, float, float]  # code, k_h, k_p
LimitTerms = tuple[int, float]  # Limits
Robots = tuple[Array, Array, Array]  # freedom, bodies, robots
Room = tuple[Array, Indices, Codes]  # `memory_for` as many cables, and codes (m,)
Margins = tuple[Array, Array, Indices, Codes]  # margins (3, N), directions (N, 6), cables (N,), statuses (N,)


class Count(NamedTuple):
    """What counts at the facets of one pose.

    Attributes:
        rows: (COUNT_ROWS, m).
        endless: Whether a cable has no upper limit.
        unsure: Whether the pulls change with the tensions.
        high: Upper limits [N], (m,).
        arm: Lever arm of the norm [m].
        lever: Mean lever arm [m], by which moments are divided while normals are looked for; 1 without any.
    """

    rows: Array
    endless: bool
    unsure: bool
    high: Array
    arm: float
    lever: float


@entry
def signed_margins(
    model_terms: ModelTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    set_terms: SetTerms,
    arms: tuple[Array, Array],
    poses: Array,
    room: Room,
    margins: Margins,
    first: int,
    last: int,
) -> None:
    """Fill the margins of poses.

    Args:
        model_terms: Cable model: code, k_h, k_p.
        limit_terms: What tensions must keep: `Limits`.
        robot_terms: Rows of the structure matrix that count, translations first, (n, 6); body_table, (1 or R,
            BODY_COLUMNS); cable_table, (1 or R, m, CABLE_COLUMNS); the first N/R poses are the first robot's and so on.
        set_terms: The set of loads.
        arms: Lever arm of the norm, and mean lever arm [m], (1 or R,) each.
        poses: Rows (N, POSE_COLUMNS).
        room: Memory.
        margins: Filled: value, lower and upper end [N], (3, N); normal of the facet of the value, along which the
            cables give too little first, in world axes, of length 1 where moments are divided by the lever arm, (N, 6);
            the cable whose limit moves it fastest, -1 for none, (N,); what the bracket says, (N,).
        first: Pose to begin with.
        last: Pose to end before.
    """
    limits = Limits(*limit_terms)
    freedom, bodies, robots = robot_terms
    values, directions, limiting, statuses = margins
    inertias = set_terms[7]
    count, m, n = poses.shape[0], robots.shape[1], freedom.shape[0]
    cables, rest = new_cables(Memory(room[0], room[1]), m, robots_have_machine(robots))
    facets, rest = new_facets(rest, n, m + 6 + OTHERS)
    wrenches, rest = new_set(set_terms, rest)
    rotation, at = block(rest.numbers, 0, 3, 3)
    found, at = block(rest.numbers, at, 1, 3)
    rows, at = block(rest.numbers, at, g.GEOMETRY_ROWS + 6 + BAND_ROWS + COUNT_ROWS, m)
    rest = Memory(rest.numbers[at:], rest.counters)
    geometry, full = rows[: g.GEOMETRY_ROWS], rows[g.GEOMETRY_ROWS : g.GEOMETRY_ROWS + 6]
    bands, counted = rows[g.GEOMETRY_ROWS + 6 :][:BAND_ROWS], rows[g.GEOMETRY_ROWS + 6 + BAND_ROWS :]
    for p in range(first, last):
        values[VALUE, p] = values[BELOW, p] = values[ABOVE, p] = -math.inf
        limiting[p] = -1
        for k in range(6):
            directions[p, k] = 0.0
        body, robot = bodies[p * bodies.shape[0] // count], robots[p * robots.shape[0] // count]
        model = Model(model_terms[0], model_terms[1], model_terms[2], body[tables.GRAVITY], None)
        cable_geometry(robot, body, poses[p], rotation, geometry)
        if not place_cables(model, limits, robot, geometry, cables):
            statuses[p] = MARGIN_NO_CHORD
            continue
        fill_structure_matrix(geometry, full)
        curves, left = new_curves(model, cables, room[2], rest)
        if not fill_bands(curves, bands, left):
            statuses[p] = MARGIN_TOO_SLACK
            continue
        place_set(set_terms, body, inertias[p * inertias.shape[0] // count], rotation, wrenches)
        lever = arms[1][p * arms[1].size // count]
        counts = count_of(bands, geometry, counted, arms[0][p * arms[0].size // count], lever)
        rows_along_freedom(freedom, full, facets.tables[0])
        first_table(freedom, body, set_terms[0], full, bands, counts, facets)
        statuses[p] = walk(facets, n, m, counts, wrenches, found[0], directions[p], limiting[p : p + 1])
        for k in range(3):
            values[k, p] = found[0, k]


@glue
def count_of(bands: Array, geometry: Array, rows: Array, arm: float, lever: float) -> Count:
    """Fill what counts at every facet."""
    endless = False
    unsure = False
    for i in range(bands.shape[1]):
        limited = bands[HIGH, i] < math.inf
        endless = endless or not limited
        rows[WIDTH, i] = 0.5 * (bands[HIGH, i] - bands[LOW, i]) if limited else 0.0
        rows[SLOPE, i] = 0.5 * (bands[PULL_HIGH, i] - bands[PULL_LOW, i]) if limited else 0.0
        rows[UNSURE, i] = 0.5 * (bands[MOST, i] - bands[LEAST, i])
        unsure = unsure or rows[UNSURE, i] > 0.0
        rows[LEVER_X, i] = geometry[g.LEVER_X, i]
        rows[LEVER_Y, i] = geometry[g.LEVER_Y, i]
    return Count(rows, endless, unsure, bands[HIGH], arm, lever)


@glue
def first_table(
    freedom: Array, body: Array, center: Array, full: Array, bands: Array, counts: Count, facets: Facets
) -> None:
    """Fill the table of depth 0: a row for each free motion, moments over the mean lever arm."""
    n, m = freedom.shape[0], bands.shape[1]
    table, rows = facets.tables[0], counts.rows
    weight = body[tables.MASS] * body[tables.GRAVITY]
    for k in range(n):
        unit = 1.0 / counts.lever if turns(freedom, k) else 1.0
        ends = freedom[k, 2] * -weight
        for a in range(6):
            ends += freedom[k, a] * center[a]
        ranges = ends
        for i in range(m):
            along = table[k, i]
            hanging = freedom[k, 2] + freedom[k, 3] * rows[LEVER_Y, i] - freedom[k, 4] * rows[LEVER_X, i]
            given = along * (bands[LOW, i] + rows[WIDTH, i])
            ends += given - hanging * (bands[PULL_LOW, i] + rows[SLOPE, i])
            ranges += given - hanging * 0.5 * (bands[LEAST, i] + bands[MOST, i])
            table[k, i] = along * unit
        for a in range(6):
            table[k, m + a] = freedom[k, a] * unit
        table[k, m + 6 + ENDS] = ends * unit
        table[k, m + 6 + RANGES] = ranges * unit


@kernel
def walk(
    facets: Facets,
    n: int,
    m: int,
    counts: Count,
    wrenches: WrenchSet,
    margin: Array,
    direction: Array,
    cable: Indices,
) -> int:
    """Fill the margin over all facets (3,), the normal of the least (6,) and its cable (1,); returns the status."""
    tables_, chosen = facets
    rest = has_rest(wrenches)
    for k in range(3):
        margin[k] = math.inf
    resists = False
    depth = 0
    chosen[0] = -1
    for _ in range(LIMIT):
        chosen[depth] += 1
        c = chosen[depth]
        if c > m - n + 1 + depth:
            depth -= 1
            if depth < 0:
                break
            continue
        if not eliminate(tables_[depth], n - depth, c, DEPENDENT, tables_[depth + 1]):
            continue
        if depth < n - 2:
            depth += 1
            chosen[depth] = c
            continue
        resists = measure(tables_[depth + 1, 0], m, counts, wrenches, rest, margin, direction, cable) or resists
    if not resists:
        for k in range(3):
            margin[k] = -math.inf
        return MARGIN_SINGULAR
    if margin[BELOW] >= 0.0:
        return MARGIN_FEASIBLE
    return MARGIN_INFEASIBLE if margin[ABOVE] < 0.0 else MARGIN_OPEN


@glue
def measure(
    row: Array,
    m: int,
    counts: Count,
    wrenches: WrenchSet,
    rest: bool,
    margin: Array,
    direction: Array,
    cable: Indices,
) -> bool:
    """Let both sides of one facet lower the margin (3,); returns whether any cable pulls along its normal."""
    rows = counts.rows
    y = row[m : m + 6]
    force = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
    moment = y[3] * y[3] + y[4] * y[4] + y[5] * y[5]
    size = math.sqrt(force + counts.lever * counts.lever * moment)
    length = math.sqrt(force + counts.arm * counts.arm * moment)
    ends = 0.0
    tensions = 0.0
    pulls = 0.0
    largest = 0.0
    for i in range(m):
        along = row[i]
        hanging = y[2] + y[3] * rows[LEVER_Y, i] - y[4] * rows[LEVER_X, i]
        ends += abs(along * rows[WIDTH, i] - hanging * rows[SLOPE, i])
        tensions += abs(along) * rows[WIDTH, i]
        pulls += abs(hanging) * rows[UNSURE, i]
        largest = max(largest, abs(along))
    small = ALONG * size
    if not largest > small:
        return False
    forward = True
    backward = True
    if counts.endless:
        for i in range(m):
            if counts.high[i] == math.inf:
                forward = forward and not row[i] > small
                backward = backward and not row[i] < -small
    against = 0.0
    for k in range(6):
        against += wrenches.half[k] * abs(y[k])
    along_set = against
    if rest:
        further, other = reach_of_rest(wrenches, y)
        against += further
        along_set += other
    inverse = 1.0 / length if force > PURE * PURE * size * size or counts.arm > 0.0 else math.inf
    for side in range(2):
        if not (forward if side == 0 else backward):
            continue
        sign = 1.0 if side == 0 else -1.0
        demand = against if side == 0 else along_set
        value = over(ends + sign * row[m + 6 + ENDS] - demand, inverse)
        middle = tensions + sign * row[m + 6 + RANGES] - demand
        margin[BELOW] = min(margin[BELOW], over(middle - pulls, inverse))
        margin[ABOVE] = min(margin[ABOVE], over(middle + pulls, inverse))
        if value < margin[VALUE]:
            margin[VALUE] = value
            most = 0.0
            for k in range(6):
                direction[k] = sign * y[k] * (inverse if inverse < math.inf else 1.0 / math.sqrt(moment))
            for i in range(m):
                if abs(row[i]) > most:
                    most = abs(row[i])
                    cable[0] = i
    return True


@glue
def over(spare: float, inverse: float) -> float:
    """A distance from what is spare along a normal; infinite, or nothing at all, where it has no force part."""
    if inverse < math.inf:
        return spare * inverse
    return -math.inf if spare < 0.0 else math.inf
