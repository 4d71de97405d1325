"""Records of the forward kernels: a batch and its results, one pose to find, and work arrays."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes
from sagline.kernels import tables
from sagline.kernels.balance.wrench import is_rotation
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import glue, kernel
from sagline.kernels.memory import Memory, block, vector

UNIT_SHARE = 0.2  # relative to the mean length; a displacement of this size has the same weight as a rotation by 1 rad

# columns of the numbers that describe one solution
ENERGY, FORCE_RESIDUAL, MOMENT_RESIDUAL, STIFFNESS_MIN, ITERATIONS = 0, 1, 2, 3, 4
FORWARD_NUMBERS = 5

# columns of the state of a chain of samples: pose, then wrench
LAST_WRENCH = tables.POSE_COLUMNS
LAST_COLUMNS = LAST_WRENCH + 6

ForwardTerms = tuple[int, float, float, bool | None]  # code, k_h, k_p; True for pulleys or dead lengths, else None
SampleArrays = tuple[Array, Array, Array, Array, Array, Array]  # as Python passes it: plain tuples are fastest
SolutionArrays = tuple[Array, Array, Codes, Array, Codes]
LastEquilibriumArrays = tuple[Array, Array, Array]


class ForwardSamples(NamedTuple):
    """A batch of N samples to solve."""

    freedom: Array  # rows that select the free motions, (n, 6)
    bodies: Array  # body_table, (1 or N, BODY_COLUMNS)
    robots: Array  # cable_table, (1 or N, m, CABLE_COLUMNS)
    lengths: Array  # unstrained lengths [m], (N, m); a row of NaN is skipped
    starts: Array  # pose rows (1 or N, POSE_COLUMNS)
    wrenches: Array  # external plus inertial wrench, about the center of mass, (1 or N, 6)


class Solutions(NamedTuple):
    """Output arrays of a batch."""

    poses: Array  # pose rows (N, POSE_COLUMNS)
    results: Array  # span, rise, length, T_x, T_z, tau, (RESULT_ROWS, N, m)
    statuses: Codes  # status of each cable, (N, m)
    numbers: Array  # energy, residuals, smallest stiffness, iterations, (N, FORWARD_NUMBERS)
    pose_statuses: Codes  # status of each sample, (N,)


class LastEquilibrium(NamedTuple):
    """Last equilibrium of a sequence of samples, kept between calls; NaN if none exists."""

    rows: Array  # rows of the cables, (CABLE_ROWS, m)
    factor: Array  # Cholesky factor of the stiffness, scaled, (n, n)
    last: Array  # pose and wrench, (LAST_COLUMNS,)


class PoseProblem(NamedTuple):
    """Data for finding one pose: cable model, robot and wrench."""

    model: Model  # cable model
    free: Array  # rows that select the free motions, each times the unit of its motion, (n, 6)
    cables: Array  # rows of the cable_table, (m, CABLE_COLUMNS)
    body: Array  # row of the body_table, (BODY_COLUMNS,)
    wrench: Array  # external plus inertial wrench, about the center of mass, (6,)
    unit: float  # norm of the units; a sum of forces times this norm is comparable to components along the free motions


class ForwardArrays(NamedTuple):
    """Working memory for m cables and n free motions, filled by `unbalance` and `platform_stiffness`."""

    rows: Array  # (CABLE_ROWS, m)
    rotation: Array  # (3, 3)
    gradient: Array  # (6,)
    stiffness: Array  # (6, 6)
    matrix: Array  # (n, n)
    factor: Array  # (n, n)
    part: Array  # (n,)
    step: Array  # (n,)
    motion: Array  # (6,)
    trial: Array  # (7,)


@glue
def new_forward_arrays(memory: Memory, rows: Array, factor: Array) -> tuple[ForwardArrays, Memory]:
    """Work arrays, and the remaining memory; the given rows and factor keep their content between calls."""
    n = factor.shape[0]
    rotation, memory = block(memory, 3, 3)
    gradient, memory = vector(memory, 6)
    stiffness, memory = block(memory, 6, 6)
    matrix, memory = block(memory, n, n)
    part, memory = vector(memory, n)
    step, memory = vector(memory, n)
    motion, memory = vector(memory, 6)
    trial, memory = vector(memory, tables.POSE_COLUMNS)
    return ForwardArrays(rows, rotation, gradient, stiffness, matrix, factor, part, step, motion, trial), memory


@glue
def new_motions(memory: Memory, n: int) -> tuple[Array, Array, Array, Array]:
    """Arrays: free motions (n, 6) in the units of steps, free motions in the units of stiffness, and two pose rows."""
    free, memory = block(memory, n, 6)
    arcs, memory = block(memory, n, 6)
    poses, memory = block(memory, 2, tables.POSE_COLUMNS)
    return free, arcs, poses[0], poses[1]


@glue
def row_of(array: Array, p: int) -> Array:
    """Row p of an array with N rows; the only row of an array with one row."""
    return array[min(p, array.shape[0] - 1)]


@glue
def problem_at(model: Model, given: ForwardSamples, p: int, free: Array, arcs: Array) -> PoseProblem:
    """Problem of sample `p` of a batch. Its model has the gravity of its robot. Fills the free motions."""
    body, cables = row_of(given.bodies, p), row_of(given.robots, p)
    placed = Model(model.code, model.k_h, model.k_p, body[tables.GRAVITY], model.behind)
    unit = _fill_free(given.freedom, given.lengths[p], free)
    fill_arcs(given.freedom, cables, body, arcs)
    return PoseProblem(placed, free, cables, body, row_of(given.wrenches, p), unit)


@kernel
def _fill_free(freedom: Array, lengths: Array, free: Array) -> float:
    """Fill the free motions in the units of steps, (n, 6). Returns the norm of these units."""
    m = lengths.shape[0]
    total = 0.0
    for i in range(m):
        total += lengths[i]
    units = 0.0
    for j in range(freedom.shape[0]):
        unit = 1.0 if is_rotation(freedom, j) else UNIT_SHARE * total / m
        units += unit * unit
        for a in range(6):
            free[j, a] = freedom[j, a] * unit
    return math.sqrt(units)


@kernel
def fill_arcs(freedom: Array, cables: Array, body: Array, arcs: Array) -> None:
    """Fill the free motions in the units for comparing stiffnesses, (n, 6).

    A rotation is measured by its arc at the root mean square distance of the platform ends from the center of mass, so
    that every stiffness is in N/m.
    """
    m = cables.shape[0]
    square = 0.0
    for i in range(m):
        for k in range(3):
            lever = cables[i, tables.PLATFORM_X + k] - body[tables.CENTER_X + k]
            square += lever * lever
    radius = math.sqrt(square / m)
    for j in range(freedom.shape[0]):
        arc = 1.0 / radius if is_rotation(freedom, j) and radius > 0.0 else 1.0
        for a in range(6):
            arcs[j, a] = freedom[j, a] * arc


@kernel
def copy_pose(source: Array, target: Array) -> None:
    """Copy the pose row `source` to `target`."""
    for k in range(tables.POSE_COLUMNS):
        target[k] = source[k]


@glue
def clear_solution(found: Solutions, p: int, status: int, cable_status: int) -> None:
    """Fill the arrays for sample `p` without a result: NaN as values, zero iterations, and the statuses."""
    for k in range(tables.POSE_COLUMNS):
        found.poses[p, k] = math.nan
    for i in range(found.statuses.shape[1]):
        found.statuses[p, i] = cable_status
        for row in range(found.results.shape[0]):
            found.results[row, p, i] = math.nan
    for k in range(FORWARD_NUMBERS):
        found.numbers[p, k] = math.nan
    found.numbers[p, ITERATIONS] = 0.0
    found.pose_statuses[p] = status
