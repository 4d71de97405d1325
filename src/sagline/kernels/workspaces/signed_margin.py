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
from sagline.kernels.jit import entry, formula, glue, kernel
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
from sagline.kernels.workspaces.facets import (
    DEPENDENT,
    LIMIT,
    MEMBERS,
    ORDER,
    START,
    Facets,
    choose_basis,
    new_facets,
    next_subset,
)
from sagline.kernels.workspaces.wrench_set import SetTerms, WrenchSet, new_set, place_set, reach

ALONG = 1e-13  # of the rows that a normal is made of: what a column in the facet itself gives along it by rounding
PURE = 1e-9  # force part of a normal of length 1, moments times the lever arm, below which it is one of moments alone

# Rows of what counts of the cables (COUNT_ROWS, m).
WIDTH = 0  # half the range of the tensions
SLOPE = 1  # half of how far the pull grows from end to end
UNSURE = 2  # half the range of the pull
LEVER_X, LEVER_Y = 3, 4
COLUMN = 5  # of the structure matrix, six rows
COUNT_ROWS = 11

ENDS, RANGES = 0, 1  # rows of the points

# Rows of facets that are measured together (FACET_ROWS, TOGETHER).
NORMAL = 0  # six rows
ROUNDING = 6
BY_ENDS, BY_TENSIONS, BY_PULLS = 7, 8, 9  # what the cables give to either side of the points
AGAINST, FOR = 10, 11  # how far the set reaches
UP, DOWN = 12, 13  # the most that a cable without limit counts to either side
WORK = 14  # two rows
FACET_ROWS = 16
TOGETHER = 32

VALUE, BELOW, ABOVE = 0, 1, 2  # rows of the margins (3, N) [N]

ModelTerms = tuple[int, float, float]  # code, k_h, k_p
LimitTerms = tuple[int, float]  # Limits
Robots = tuple[Array, Array, Array]  # freedom, bodies, robots
Room = tuple[Array, Indices, Codes]  # `memory_for` as many cables, and codes (m,)
Margins = tuple[Array, Array, Indices, Codes]  # margins (3, N), directions (N, 6), cables (N,), statuses (N,)


class Count(NamedTuple):
    """What counts at the facets of one pose.

    Attributes:
        rows: Of the cables, (COUNT_ROWS, m).
        points: What the cables give in the middle of their ends, and of their pulls' ranges, less the demand, (2, 6).
        high: Upper limits [N], (m,).
        endless: Whether a cable has none.
        arm: Lever arm of the norm [m].
        lever: Mean lever arm [m], by which moments are divided while normals are looked for; 1 without any.
    """

    rows: Array
    points: Array
    high: Array
    endless: bool
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
    facets, rest = new_facets(rest, n, m)
    wrenches, rest = new_set(set_terms, rest)
    rotation, at = block(rest.numbers, 0, 3, 3)
    found, at = block(rest.numbers, at, 1, 3)
    points, at = block(rest.numbers, at, 2, 6)
    measured, at = block(rest.numbers, at, FACET_ROWS, TOGETHER)
    rows, at = block(rest.numbers, at, g.GEOMETRY_ROWS + BAND_ROWS + COUNT_ROWS, m)
    rest = Memory(rest.numbers[at:], rest.counters)
    geometry, bands = rows[: g.GEOMETRY_ROWS], rows[g.GEOMETRY_ROWS : g.GEOMETRY_ROWS + BAND_ROWS]
    counted = rows[g.GEOMETRY_ROWS + BAND_ROWS :]
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
        fill_structure_matrix(geometry, counted[COLUMN:])
        lever = arms[1][p * arms[1].size // count]
        first_table(freedom, counted[COLUMN:], lever, facets.table)
        if not choose_basis(facets, n, m):
            statuses[p] = MARGIN_SINGULAR
            continue
        curves, left = new_curves(model, cables, room[2], rest)
        if not fill_bands(curves, bands, left):
            statuses[p] = MARGIN_TOO_SLACK
            continue
        place_set(set_terms, body, inertias[p * inertias.shape[0] // count], rotation, wrenches)
        endless = fill_count(body, set_terms[0], geometry, bands, counted, points)
        counts = Count(counted, points, bands[HIGH], endless, arms[0][p * arms[0].size // count], lever)
        walk(facets, n, m, counts, wrenches, measured, found[0], directions[p])
        for k in range(3):
            values[k, p] = found[0, k]
        limiting[p] = steepest(counts, directions[p]) if found[0, VALUE] < math.inf else -1
        statuses[p] = status_of(found[0])


@glue
def first_table(freedom: Array, full: Array, lever: float, table: Array) -> None:
    """Fill the table to choose a basis from: a row for each free motion, moments over the mean lever arm."""
    m = full.shape[1]
    rows_along_freedom(freedom, full, table)
    for k in range(freedom.shape[0]):
        unit = 1.0 / lever if turns(freedom, k) else 1.0
        for i in range(m):
            table[k, i] *= unit
        for a in range(6):
            table[k, m + a] = freedom[k, a] * unit


@glue
def fill_count(body: Array, center: Array, geometry: Array, bands: Array, rows: Array, points: Array) -> bool:
    """Fill what counts at every facet; returns whether a cable has no upper limit."""
    endless = False
    for a in range(6):
        points[ENDS, a] = points[RANGES, a] = center[a]
    points[ENDS, 2] = points[RANGES, 2] = center[2] - body[tables.MASS] * body[tables.GRAVITY]
    for i in range(bands.shape[1]):
        limited = bands[HIGH, i] < math.inf
        endless = endless or not limited
        rows[WIDTH, i] = 0.5 * (bands[HIGH, i] - bands[LOW, i]) if limited else 0.0
        rows[SLOPE, i] = 0.5 * (bands[PULL_HIGH, i] - bands[PULL_LOW, i]) if limited else 0.0
        rows[UNSURE, i] = 0.5 * (bands[MOST, i] - bands[LEAST, i])
        x, y = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i]
        rows[LEVER_X, i] = x
        rows[LEVER_Y, i] = y
        for a in range(6):
            given = rows[COLUMN + a, i] * (bands[LOW, i] + rows[WIDTH, i])
            points[ENDS, a] += given
            points[RANGES, a] += given
        take_pull(points[ENDS], bands[PULL_LOW, i] + rows[SLOPE, i], x, y)
        take_pull(points[RANGES], 0.5 * (bands[LEAST, i] + bands[MOST, i]), x, y)
    return endless


@glue
def take_pull(point: Array, pull: float, x: float, y: float) -> None:
    """Take what a cable's pull hangs on the platform at a lever from what the cables give, (6,)."""
    point[2] -= pull
    point[3] -= pull * y
    point[4] += pull * x


@glue
def walk(
    facets: Facets,
    n: int,
    m: int,
    counts: Count,
    wrenches: WrenchSet,
    measured: Array,
    margin: Array,
    direction: Array,
) -> None:
    """Fill the margin over all facets (3,), and the normal of the least (6,)."""
    for k in range(3):
        margin[k] = math.inf
    facets.minors[0, 0] = 1.0
    depth = 0
    held = 0
    for _ in range(LIMIT):
        for s in range(START[n, depth + 1], START[n, depth + 2]):
            if add_normal(facets, depth, ORDER[n, s], m, counts.lever, measured, held):
                held += 1
            if held == TOGETHER:
                measure(counts, wrenches, held, measured, margin, direction)
                held = 0
        depth = next_subset(facets, n, depth)
        if depth < 0:
            break
    measure(counts, wrenches, held, measured, margin, direction)


@formula
def add_normal(facets: Facets, depth: int, rows: int, m: int, lever: float, measured: Array, b: int) -> bool:
    """Fill the normal that a set of rows, one more than the present subset has columns, makes; False for none."""
    table, minors = facets.table, facets.minors[depth]
    x = y = z = u = v = w = 0.0
    sign = 1.0
    largest = 0.0
    rounding = 0.0
    for j in range(depth + 1):
        k = MEMBERS[rows, j]
        factor = sign * minors[rows ^ (1 << k)]
        sign = -sign
        row = table[k, m:]
        largest = max(largest, abs(factor))
        rounding += abs(factor) * (
            abs(row[0]) + abs(row[1]) + abs(row[2]) + lever * (abs(row[3]) + abs(row[4]) + abs(row[5]))
        )
        x += factor * row[0]
        y += factor * row[1]
        z += factor * row[2]
        u += factor * row[3]
        v += factor * row[4]
        w += factor * row[5]
    measured[NORMAL, b] = x
    measured[NORMAL + 1, b] = y
    measured[NORMAL + 2, b] = z
    measured[NORMAL + 3, b] = u
    measured[NORMAL + 4, b] = v
    measured[NORMAL + 5, b] = w
    measured[ROUNDING, b] = rounding
    return largest > DEPENDENT


@kernel
def measure(counts: Count, wrenches: WrenchSet, held: int, measured: Array, margin: Array, direction: Array) -> None:
    """Let both sides of the facets held lower the margin (3,), and its normal (6,)."""
    sum_cables(counts, held, measured)
    reach(wrenches, measured[NORMAL : NORMAL + 6], held, measured[WORK:], measured[AGAINST], measured[FOR])
    for b in range(held):
        y = measured[:6, b]
        force = y[0] * y[0] + y[1] * y[1] + y[2] * y[2]
        moment = y[3] * y[3] + y[4] * y[4] + y[5] * y[5]
        length = math.sqrt(force + counts.arm * counts.arm * moment)
        pure = counts.arm == 0.0 and not force > PURE * PURE * (force + counts.lever * counts.lever * moment)
        inverse = math.inf if pure else 1.0 / length
        ends = ranges = 0.0
        for k in range(6):
            ends += counts.points[ENDS, k] * y[k]
            ranges += counts.points[RANGES, k] * y[k]
        small = ALONG * measured[ROUNDING, b]
        for side in range(2):
            sign = 1.0 if side == 0 else -1.0
            if counts.endless and measured[UP if side == 0 else DOWN, b] > small:
                continue
            demand = measured[AGAINST if side == 0 else FOR, b]
            value = over(measured[BY_ENDS, b] + sign * ends - demand, inverse)
            middle = measured[BY_TENSIONS, b] + sign * ranges - demand
            margin[BELOW] = min(margin[BELOW], over(middle - measured[BY_PULLS, b], inverse))
            margin[ABOVE] = min(margin[ABOVE], over(middle + measured[BY_PULLS, b], inverse))
            if value < margin[VALUE]:
                margin[VALUE] = value
                for k in range(6):
                    direction[k] = sign * y[k] * (1.0 / math.sqrt(moment) if pure else inverse)


@glue
def sum_cables(counts: Count, held: int, measured: Array) -> None:
    """Fill what the cables give to either side of the points along the normals held."""
    rows = counts.rows
    for b in range(held):
        measured[BY_ENDS, b] = measured[BY_TENSIONS, b] = measured[BY_PULLS, b] = 0.0
        measured[UP, b] = measured[DOWN, b] = 0.0
    for i in range(rows.shape[1]):
        width, slope, unsure = rows[WIDTH, i], rows[SLOPE, i], rows[UNSURE, i]
        x, y = rows[LEVER_X, i], rows[LEVER_Y, i]
        j0, j1, j2 = rows[COLUMN, i], rows[COLUMN + 1, i], rows[COLUMN + 2, i]
        j3, j4, j5 = rows[COLUMN + 3, i], rows[COLUMN + 4, i], rows[COLUMN + 5, i]
        for b in range(held):
            along = (
                j0 * measured[NORMAL, b]
                + j1 * measured[NORMAL + 1, b]
                + j2 * measured[NORMAL + 2, b]
                + j3 * measured[NORMAL + 3, b]
                + j4 * measured[NORMAL + 4, b]
                + j5 * measured[NORMAL + 5, b]
            )
            hanging = measured[NORMAL + 2, b] + y * measured[NORMAL + 3, b] - x * measured[NORMAL + 4, b]
            measured[BY_ENDS, b] += abs(along * width - hanging * slope)
            measured[BY_TENSIONS, b] += abs(along) * width
            measured[BY_PULLS, b] += abs(hanging) * unsure
            measured[WORK, b] = along
        if counts.high[i] == math.inf:
            for b in range(held):
                measured[UP, b] = max(measured[UP, b], measured[WORK, b])
                measured[DOWN, b] = max(measured[DOWN, b], -measured[WORK, b])


@glue
def steepest(counts: Count, direction: Array) -> int:
    """The cable that counts most along a direction."""
    cable = -1
    most = 0.0
    for i in range(counts.rows.shape[1]):
        along = 0.0
        for k in range(6):
            along += counts.rows[COLUMN + k, i] * direction[k]
        if abs(along) > most:
            most = abs(along)
            cable = i
    return cable


@glue
def status_of(margin: Array) -> int:
    """What a bracket (3,) says."""
    if margin[BELOW] >= 0.0:
        return MARGIN_FEASIBLE
    return MARGIN_INFEASIBLE if margin[ABOVE] < 0.0 else MARGIN_OPEN


@glue
def over(spare: float, inverse: float) -> float:
    """A distance from what is spare along a normal; infinite, or nothing at all, where it has no force part."""
    if inverse < math.inf:
        return spare * inverse
    return -math.inf if spare < 0.0 else math.inf
