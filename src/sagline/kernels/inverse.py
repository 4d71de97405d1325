"""Inverse kinematics of a batch of poses: tensions that balance the platform, and the lengths to wind.

docs/model.md, sections 4 and 5. For the exact cable the pulls T_z - tau sin phi depend on the
tensions: the balance is solved again with the pulls of the last round until they stand still.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes, Flags
from sagline.kernels import geometry as g
from sagline.kernels import tables
from sagline.kernels.codes import (
    CABLE_NOT_CONVERGED,
    CABLE_TOO_SLACK,
    CATENARY,
    CLOSEST,
    HORIZONTAL_TENSION,
    LIMITS_OF_FRAME_END,
    POSE_INFEASIBLE,
    POSE_NO_CHORD,
    POSE_NOT_CONVERGED,
    POSE_SINGULAR,
    POSE_SOLVED,
    POSE_TOO_SLACK,
)
from sagline.kernels.geometry import cable_geometry
from sagline.kernels.hanging import chord_tension_at_frame_end, hang_cables
from sagline.kernels.jit import kernel
from sagline.kernels.models import pull_of_shallow
from sagline.kernels.null_space import factorize, minimum_norm
from sagline.kernels.polygon import SPARE_CORNERS
from sagline.kernels.sharing import nearest_tensions
from sagline.kernels.shortfall import wrench_shortfall
from sagline.kernels.statics import needed_wrench, restrict_rows, restrict_vector, structure_matrix

ROUNDS = 30
SETTLED = 1e-11  # [N]; pulls that change by less, or by 1e-15 of the largest tension, have settled
SHORTEST_CHORD = 1e-9  # [m]

# columns of the numbers that describe one pose's solution
SHORTFALL, FORCE_RESIDUAL, MOMENT_RESIDUAL = 0, 1, 2
POSE_NUMBERS = 3


@kernel
def chord_limits(
    code: int,
    k_h: float,
    k_p: float,
    gravity: float,
    limits_of: int,
    validity: float,
    cables: Array,
    geometry: Array,
    low: Array,
    high: Array,
) -> None:
    """Fill the limits of the chord tensions (m,) at one pose.

    validity: the article's T_adj of (54) [N], T_x > w D/(2 |tan phi|) + T_adj; NaN leaves the bound out.
    """
    for i in range(low.shape[0]):
        low[i] = cables[i, tables.TENSION_MIN]
        high[i] = cables[i, tables.TENSION_MAX]
        chord = geometry[g.CHORD, i]
        sine = geometry[g.SINE, i]
        cosine = geometry[g.COSINE, i]
        density = cables[i, tables.DENSITY]
        stiffness = cables[i, tables.STIFFNESS]
        if limits_of == LIMITS_OF_FRAME_END:
            low[i] = chord_tension_at_frame_end(
                code, k_h, k_p, gravity, chord, sine, cosine, density, stiffness, low[i]
            )
            high[i] = chord_tension_at_frame_end(
                code, k_h, k_p, gravity, chord, sine, cosine, density, stiffness, high[i]
            )
        if not math.isnan(validity):
            bound = 0.5 * density * gravity * chord / abs(sine) + validity / cosine
            low[i] = max(low[i], bound)


@kernel
def is_rotation(motion: Array) -> bool:
    """Whether a free motion (6,) of the platform turns it; the others, which come first, are translations."""
    return motion[3] * motion[3] + motion[4] * motion[4] + motion[5] * motion[5] > 0.5


@kernel
def balance_residual(freedom: Array, matrix: Array, needed: Array, tensions: Array, numbers: Array) -> None:
    """Fill the norms of the unbalanced force [N] and moment [N m] along the platform's free motions."""
    n = matrix.shape[0]
    force = 0.0
    moment = 0.0
    for k in range(n):
        total = -needed[k]
        for i in range(tensions.shape[0]):
            total += matrix[k, i] * tensions[i]
        if is_rotation(freedom[k]):
            moment += total * total
        else:
            force += total * total
    numbers[FORCE_RESIDUAL] = math.sqrt(force)
    numbers[MOMENT_RESIDUAL] = math.sqrt(moment)


@kernel
def forget(result: Array, numbers: Array) -> None:
    """No plausible numbers where there is no answer: span and rise stay, the rest is NaN."""
    for row in range(tables.LENGTH, tables.RESULT_ROWS):
        for i in range(result.shape[1]):
            result[row, i] = math.nan
    numbers[FORCE_RESIDUAL] = math.nan
    numbers[MOMENT_RESIDUAL] = math.nan


@kernel
def inverse_poses(
    code: int,
    k_h: float,
    k_p: float,
    method: int,
    variable: int,
    limits_of: int,
    validity: float,
    freedom: Array,
    bodies: Array,
    robots: Array,
    poses: Array,
    wrenches: Array,
    previous: Array,
    results: Array,
    statuses: Codes,
    numbers: Array,
    pose_statuses: Codes,
    blocking: Flags,
) -> None:
    """Solve every pose in turn; with CLOSEST each feasible pose's tensions are the reference of the next.

    Args:
        code: Cable model.
        k_h: The empirical model's constant.
        k_p: The empirical model's constant.
        method: How the load is shared.
        variable: In which variable, CHORD_TENSION or HORIZONTAL_TENSION.
        limits_of: Which quantity the limits name.
        validity: T_adj of the article's bound (54) [N], or NaN for none.
        freedom: Rows of the structure matrix that count, (n, 6).
        bodies: body_table, (1 or N, BODY_COLUMNS).
        robots: cable_table, (1 or N, m, CABLE_COLUMNS).
        poses: Rows (N, POSE_COLUMNS).
        wrenches: External plus inertial, about the center of mass, (1 or N, 6).
        previous: Chord tensions (m,) to stay close to, NaN for the minimum norm; the last feasible ones on return.
        results: Filled: span, rise, length, T_x, T_z, tau, (RESULT_ROWS, N, m).
        statuses: Filled: status of each cable, (N, m).
        numbers: Filled: shortfall and residuals, (N, POSE_NUMBERS).
        pose_statuses: Filled, (N,).
        blocking: Filled: whether a cable stands against the needed wrench, (N, m).
    """
    count, m = statuses.shape
    n = freedom.shape[0]
    r = m - n
    translations = 0
    for k in range(n):
        translations += 0 if is_rotation(freedom[k]) else 1
    rotation = np.empty((3, 3))
    geometry = np.empty((g.GEOMETRY_ROWS, m))
    full = np.empty((6, m))
    matrix = np.empty((n, m))
    scaled = np.empty((n, m))
    triangle = np.empty((n, n))
    basis = np.empty((m, m))
    order = np.empty(n, dtype=np.int64)
    null = np.empty((m, r))
    needed = np.empty(6)
    right = np.empty(n)
    farkas = np.empty(n)
    reference = np.empty(r)
    corners = np.empty((2 * m + SPARE_CORNERS, 2))
    labels = np.empty(2 * m + SPARE_CORNERS, dtype=np.int64)
    low, high, start, shared, tensions, lengths, pulls, new_pulls, scale, result_low, result_high = np.empty((11, m))
    for p in range(count):
        cables = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        gravity = body[tables.GRAVITY]
        result = results[:, p]
        cable_geometry(cables, body, poses[p], rotation, geometry)
        shortest = math.inf
        for i in range(m):
            result[tables.SPAN, i] = geometry[g.SPAN, i]
            result[tables.RISE, i] = geometry[g.RISE, i]
            shortest = min(shortest, geometry[g.CHORD, i])
            blocking[p, i] = False
            statuses[p, i] = 0
            pulls[i] = pull_of_shallow(code, k_h, geometry[g.CHORD, i], cables[i, tables.DENSITY], gravity)
        numbers[p, SHORTFALL] = 0.0
        if shortest < SHORTEST_CHORD:
            pose_statuses[p] = POSE_NO_CHORD
            forget(result, numbers[p])
            continue
        structure_matrix(geometry, full)
        restrict_rows(freedom, full, matrix)
        chord_limits(code, k_h, k_p, gravity, limits_of, validity, cables, geometry, low, high)
        for i in range(m):
            scale[i] = geometry[g.COSINE, i] if variable == HORIZONTAL_TENSION else 1.0
            result_low[i] = low[i] * scale[i]
            result_high[i] = high[i] * scale[i] if high[i] < math.inf else math.inf
            for k in range(n):
                scaled[k, i] = matrix[k, i] / scale[i]
        if not factorize(scaled, triangle, basis, order):
            pose_statuses[p] = POSE_SINGULAR
            forget(result, numbers[p])
            continue
        for k in range(r):
            reference[k] = 0.0
            for i in range(m):
                null[i, k] = basis[i, n + k]
                if method == CLOSEST and not math.isnan(previous[i]):
                    reference[k] += null[i, k] * previous[i] * scale[i]
        pose_statuses[p] = POSE_NOT_CONVERGED
        for _ in range(ROUNDS):
            needed_wrench(geometry, body, wrench, pulls, needed)
            restrict_vector(freedom, needed, right)
            minimum_norm(triangle, basis, order, right, start)
            if not nearest_tensions(start, null, result_low, result_high, reference, corners, labels, shared):
                pose_statuses[p] = POSE_INFEASIBLE
                break
            largest = 0.0
            for i in range(m):
                tensions[i] = shared[i] / scale[i]
                largest = max(largest, tensions[i])
            hang_cables(code, k_h, k_p, gravity, cables, geometry, tensions, lengths, new_pulls, statuses[p])
            change = 0.0
            worst = 0
            for i in range(m):
                worst = max(worst, statuses[p, i])
                change = max(change, abs(new_pulls[i] - pulls[i]))
                pulls[i] = new_pulls[i]
            if worst == CABLE_TOO_SLACK:
                pose_statuses[p] = POSE_TOO_SLACK
                break
            if worst == CABLE_NOT_CONVERGED:
                break
            if code != CATENARY or change <= SETTLED + 1e-15 * largest:
                pose_statuses[p] = POSE_SOLVED
                break
        if pose_statuses[p] == POSE_INFEASIBLE:
            numbers[p, SHORTFALL] = wrench_shortfall(matrix, right, low, high, translations, farkas, blocking[p])
        if pose_statuses[p] != POSE_SOLVED:
            forget(result, numbers[p])
            continue
        needed_wrench(geometry, body, wrench, pulls, needed)
        restrict_vector(freedom, needed, right)
        balance_residual(freedom, matrix, right, tensions, numbers[p])
        for i in range(m):
            result[tables.LENGTH, i] = lengths[i]
            result[tables.HORIZONTAL, i] = tensions[i] * geometry[g.COSINE, i]
            result[tables.VERTICAL, i] = tensions[i] * geometry[g.SINE, i] + pulls[i]
            result[tables.TENSION, i] = tensions[i]
            previous[i] = tensions[i]
