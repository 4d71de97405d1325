"""Inverse kinematics of a batch of poses: tensions that balance the platform, and the lengths to wind.

docs/model.md, sections 4 and 5. For the exact cable the pulls T_z - tau sin phi depend on the
tensions: the balance is solved again with the pulls of the last round until they stand still.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes, Flags, Indices
from sagline.kernels import geometry as g
from sagline.kernels import tables
from sagline.kernels.codes import (
    CABLE_NOT_CONVERGED,
    CABLE_TOO_SLACK,
    CATENARY,
    CLOSEST,
    FRAME_END_TENSION,
    HORIZONTAL_TENSION,
    LIMITS_OF_FRAME_END,
    POSE_INFEASIBLE,
    POSE_NO_CHORD,
    POSE_NOT_CONVERGED,
    POSE_SINGULAR,
    POSE_SOLVED,
    POSE_TOO_SLACK,
    QUADRATIC_PROGRAM,
)
from sagline.kernels.geometry import cable_geometry
from sagline.kernels.hanging import NEAR, chord_tension_at_frame_end, frame_end_tension, hang_cables
from sagline.kernels.jit import formula, kernel
from sagline.kernels.margin import capacity_margin
from sagline.kernels.models import pull_of_shallow
from sagline.kernels.null_space import factorize, minimum_norm, orthogonal_factor, pseudo_inverse
from sagline.kernels.polygon import SPARE_CORNERS, feasible_polygon
from sagline.kernels.proof import prove_empty
from sagline.kernels.sharing import feasible_interval, share_load
from sagline.kernels.shortfall import wrench_shortfall
from sagline.kernels.statics import needed_wrench, restrict_needed, restrict_rows, structure_matrix

ROUNDS = 30
FREE_ROUNDS = 8  # then a choice that jumps with the last digits of the pulls is held where it is
SETTLED = 1e-10  # [N]; pulls that change by less, or by 1e-15 of the largest tension, have settled
SHORTEST_CHORD = 1e-9  # [m]
STILL = 1e-9  # relative change of tension at which a sharing in frame-end tensions stands still
SLOPE_STEP = 1e-4  # relative step of the central difference of the frame-end tension

# columns of the numbers that describe one pose's solution
SHORTFALL, FORCE_RESIDUAL, MOMENT_RESIDUAL = 0, 1, 2
POSE_NUMBERS = 3


@formula
def place_cables(
    code: int,
    k_h: float,
    k_p: float,
    limits_of: int,
    validity: float,
    gravity: float,
    robot: Array,
    geometry: Array,
    work: Array,
) -> bool:
    """Fill material, first pulls and limits of the chord tensions at one pose; False where a cable has no chord.

    validity: the article's T_adj of (54) [N], T_x > w D/(2 |tan phi|) + T_adj; NaN leaves the bound out.
    """
    for i in range(robot.shape[0]):
        chord, sine, cosine = geometry[g.CHORD, i], geometry[g.SINE, i], geometry[g.COSINE, i]
        density, stiffness = robot[i, tables.DENSITY], robot[i, tables.STIFFNESS]
        low, high = robot[i, tables.TENSION_MIN], robot[i, tables.TENSION_MAX]
        if not chord >= SHORTEST_CHORD:
            return False
        work[tables.DENSITY_ROW, i] = density
        work[tables.STIFFNESS_ROW, i] = stiffness
        work[tables.HALF_WEIGHT, i] = 0.5 * density * gravity * chord
        work[tables.PULL, i] = pull_of_shallow(code, k_h, chord, density, gravity)
        if limits_of == LIMITS_OF_FRAME_END:
            low = chord_tension_at_frame_end(code, k_h, k_p, gravity, chord, sine, cosine, density, stiffness, low)
            high = chord_tension_at_frame_end(code, k_h, k_p, gravity, chord, sine, cosine, density, stiffness, high)
        if not math.isnan(validity):
            low = max(low, work[tables.HALF_WEIGHT, i] / abs(sine) + validity / cosine)
        work[tables.CHORD_LOW, i] = low
        work[tables.CHORD_HIGH, i] = high
    return True


@formula
def scale_tensions(variable: int, preference: Array, geometry: Array, work: Array) -> None:
    """Fill SCALE, OFFSET, LOW and HIGH: the variable in which the load is shared, and its limits.

    The frame-end tension starts as tau - wD/2 sin phi, its first order.
    """
    for i in range(work.shape[1]):
        scale = preference[tables.ROOT_WEIGHT, i]
        offset = 0.0
        if variable == HORIZONTAL_TENSION:
            scale *= geometry[g.COSINE, i]
        elif variable == FRAME_END_TENSION:
            offset = -work[tables.HALF_WEIGHT, i] * geometry[g.SINE, i]
        work[tables.OFFSET, i] = offset
        limit_variable(scale, work, i)


@formula
def limit_variable(scale: float, work: Array, i: int) -> None:
    """Fill SCALE, LOW and HIGH of one cable."""
    high = work[tables.CHORD_HIGH, i]
    work[tables.SCALE, i] = scale
    work[tables.LOW, i] = work[tables.CHORD_LOW, i] * scale
    work[tables.HIGH, i] = high * scale if high < math.inf else math.inf


@formula
def factor_balance(
    freedom: Array,
    geometry: Array,
    work: Array,
    full: Array,
    matrix: Array,
    reduced: Array,
    balance: Array,
    q: Array,
    inverse: Array,
    null: Array,
) -> bool:
    """Fill the structure matrix, its pseudo-inverse and null space in the sharing's variable; False if rank is lost."""
    n, m = matrix.shape
    structure_matrix(geometry, full)
    restrict_rows(freedom, full, matrix)
    for i in range(m):
        back = 1.0 / work[tables.SCALE, i]
        for k in range(n):
            reduced[k, i] = matrix[k, i] * back
    if not factorize(reduced, balance):
        return False
    orthogonal_factor(reduced, balance, q)
    pseudo_inverse(reduced, balance, q, inverse)
    for k in range(m - n):
        for i in range(m):
            null[k, i] = q[i, n + k]
    return True


@formula
def refer(
    method: int, variable: int, preference: Array, previous: Array, work: Array, null: Array, reference: Array
) -> None:
    """Fill the point of the null space that the shared tensions shall be nearest to, (r,)."""
    for k in range(null.shape[0]):
        reference[k] = 0.0
    from_before = method == CLOSEST and not math.isnan(previous[0])
    if not (from_before or method == QUADRATIC_PROGRAM or variable == FRAME_END_TENSION):
        return
    for k in range(null.shape[0]):
        for i in range(null.shape[1]):
            goal = preference[tables.GOAL, i]
            if from_before:
                goal = previous[i]
            reference[k] += null[k, i] * preference[tables.ROOT_WEIGHT, i] * (goal - work[tables.OFFSET, i])


@kernel
def linearize_ends(
    code: int, k_h: float, k_p: float, preference: Array, gravity: float, geometry: Array, work: Array
) -> None:
    """Fill SCALE, OFFSET, LOW and HIGH of the frame-end tensions as they run near the present chord tensions."""
    ends = np.empty(3)
    for i in range(work.shape[1]):
        tau = work[tables.TAU, i]
        for k in range(3):
            ends[k] = frame_end_tension(
                code,
                k_h,
                k_p,
                gravity,
                geometry[g.CHORD, i],
                geometry[g.SINE, i],
                geometry[g.COSINE, i],
                work[tables.DENSITY_ROW, i],
                work[tables.STIFFNESS_ROW, i],
                tau * (1.0 + (k - 1) * SLOPE_STEP),
            )
        slope = (ends[2] - ends[0]) / (2.0 * SLOPE_STEP * tau)
        work[tables.OFFSET, i] = ends[1] - slope * tau
        limit_variable(slope * preference[tables.ROOT_WEIGHT, i], work, i)


@kernel
def relinearize(
    code: int,
    k_h: float,
    k_p: float,
    method: int,
    freedom: Array,
    preference: Array,
    previous: Array,
    gravity: float,
    geometry: Array,
    work: Array,
    full: Array,
    matrix: Array,
    reduced: Array,
    balance: Array,
    q: Array,
    inverse: Array,
    null: Array,
    reference: Array,
) -> bool:
    """Set the balance up again, in frame-end tensions as they run near the present chord tensions; False: rank lost."""
    linearize_ends(code, k_h, k_p, preference, gravity, geometry, work)
    if not factor_balance(freedom, geometry, work, full, matrix, reduced, balance, q, inverse, null):
        return False
    refer(method, FRAME_END_TENSION, preference, previous, work, null, reference)
    return True


@formula
def remember(
    code: int, k_h: float, k_p: float, variable: int, gravity: float, geometry: Array, work: Array, previous: Array
) -> None:
    """Keep the tensions, in the variable they were shared in, for the pose that follows."""
    for i in range(previous.size):
        tau = work[tables.TAU, i]
        previous[i] = tau
        if variable == HORIZONTAL_TENSION:
            previous[i] = tau * geometry[g.COSINE, i]
        elif variable == FRAME_END_TENSION:
            previous[i] = frame_end_tension(
                code,
                k_h,
                k_p,
                gravity,
                geometry[g.CHORD, i],
                geometry[g.SINE, i],
                geometry[g.COSINE, i],
                work[tables.DENSITY_ROW, i],
                work[tables.STIFFNESS_ROW, i],
                tau,
            )


@kernel
def keep_near(work: Array, null: Array, reference: Array) -> None:
    """Let the point to be near to be that of the tensions just shared."""
    for k in range(null.shape[0]):
        reference[k] = 0.0
        for i in range(null.shape[1]):
            reference[k] += null[k, i] * work[tables.SHARED, i]


@formula
def settle(
    code: int,
    k_h: float,
    k_p: float,
    method: int,
    parameter: float,
    variable: int,
    freedom: Array,
    preference: Array,
    previous: Array,
    body: Array,
    wrench: Array,
    geometry: Array,
    work: Array,
    full: Array,
    matrix: Array,
    reduced: Array,
    balance: Array,
    q: Array,
    inverse: Array,
    null: Array,
    reference: Array,
    corners: Array,
    labels: Indices,
    statuses: Codes,
) -> int:
    """Share the load and hang the cables until their pulls stand still; returns the pose's status."""
    m = work.shape[1]
    near = False
    way = method
    for k in range(ROUNDS):
        if k >= FREE_ROUNDS and method > CLOSEST:
            way = CLOSEST
            keep_near(work, null, reference)
        needed_wrench(geometry, body, wrench, work, balance)
        restrict_needed(freedom, balance)
        minimum_norm(inverse, balance, work)
        status = share_load(way, parameter, work, null, reference, corners, labels)
        if status != POSE_SOLVED:
            return status
        largest = 0.0
        moved = 0.0
        for i in range(m):
            new = work[tables.SHARED, i] / work[tables.SCALE, i]
            moved = max(moved, abs(new - work[tables.TAU, i]) / new)
            largest = max(largest, new)
            work[tables.TAU, i] = new
            work[tables.LAST_PULL, i] = work[tables.PULL, i]
        gravity = body[tables.GRAVITY]
        gravest = hang_cables(code, k_h, k_p, gravity, geometry, work, statuses, near and moved < NEAR)
        if gravest == CABLE_TOO_SLACK:
            return POSE_TOO_SLACK
        if gravest == CABLE_NOT_CONVERGED:
            return POSE_NOT_CONVERGED
        change = 0.0
        for i in range(m):
            change = max(change, abs(work[tables.PULL, i] - work[tables.LAST_PULL, i]))
        stands = code != CATENARY or change <= SETTLED + 1e-15 * largest
        if stands and (variable != FRAME_END_TENSION or (near and moved <= STILL)):
            return POSE_SOLVED
        near = True
        if variable == FRAME_END_TENSION and not relinearize(
            code, k_h, k_p, method, freedom, preference, previous, gravity,
            geometry, work, full, matrix, reduced, balance, q, inverse, null, reference,
        ):  # fmt: skip
            return POSE_SINGULAR
    return POSE_NOT_CONVERGED


@formula
def is_rotation(freedom: Array, k: int) -> bool:
    """Whether free motion k of the platform turns it; the others, which come first, are translations."""
    return freedom[k, 3] * freedom[k, 3] + freedom[k, 4] * freedom[k, 4] + freedom[k, 5] * freedom[k, 5] > 0.5


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
        if is_rotation(freedom, k):
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
        translations += 0 if is_rotation(freedom, k) else 1
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


@kernel
def inverse_poses(
    code: int,
    k_h: float,
    k_p: float,
    method: int,
    parameter: float,
    variable: int,
    limits_of: int,
    validity: float,
    preference: Array,
    freedom: Array,
    bodies: Array,
    robots: Array,
    poses: Array,
    wrenches: Array,
    previous: Array,
    results: Array,
    statuses: Codes,
    numbers: Array,
    proofs: Array,
    pose_statuses: Codes,
    blocking: Flags,
) -> None:
    """Solve every pose in turn; with CLOSEST each feasible pose's tensions are the reference of the next.

    Args:
        code: Cable model.
        k_h: The empirical model's constant.
        k_p: The empirical model's constant.
        method: How the load is shared.
        parameter: The method's exponent, or which optimum.
        variable: In which variable, CHORD_TENSION, HORIZONTAL_TENSION or FRAME_END_TENSION.
        limits_of: Which quantity the limits name.
        validity: T_adj of the article's bound (54) [N], or NaN for none.
        preference: Root weights and goals of the cables, (PREFERENCE_ROWS, m); ones and zeros but for a
            QUADRATIC_PROGRAM.
        freedom: Rows of the structure matrix that count, translations first, (n, 6).
        bodies: body_table, (1 or N, BODY_COLUMNS).
        robots: cable_table, (1 or N, m, CABLE_COLUMNS).
        poses: Rows (N, POSE_COLUMNS).
        wrenches: External plus inertial, about the center of mass, (1 or N, 6).
        previous: Tensions in the variable (m,) to stay close to, NaN for the minimum norm; the last feasible ones on
            return.
        results: Filled: span, rise, length, T_x, T_z, tau, (RESULT_ROWS, N, m).
        statuses: Filled: status of each cable, (N, m).
        numbers: Filled: shortfall and residuals, (N, POSE_NUMBERS).
        proofs: Filled: Farkas vector of an infeasible pose and the wrench J tau must supply, (N, 2, n).
        pose_statuses: Filled, (N,).
        blocking: Filled: whether a cable stands against the needed wrench, (N, m).
    """
    count, m = statuses.shape
    n = freedom.shape[0]
    rotation = np.empty((3, 3))
    geometry = np.empty((g.GEOMETRY_ROWS, m))
    work = np.empty((tables.WORK_ROWS, m))
    balance = np.empty((tables.BALANCE_ROWS, 6))
    full = np.empty((6, m))
    matrix = np.empty((n, m))
    reduced = np.empty((n, m))
    q = np.empty((m + 1, m))
    inverse = np.empty((n, m))
    null = np.empty((m - n, m))
    reference = np.empty(m - n)
    corners = np.empty((2 * m + SPARE_CORNERS, 2))
    labels = np.empty(2 * m + SPARE_CORNERS, dtype=np.int64)
    for p in range(count):
        robot = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        gravity = body[tables.GRAVITY]
        statuses[p, :] = 0
        blocking[p, :] = False
        numbers[p, SHORTFALL] = 0.0
        numbers[p, FORCE_RESIDUAL] = math.nan
        numbers[p, MOMENT_RESIDUAL] = math.nan
        cable_geometry(robot, body, poses[p], rotation, geometry)
        status = POSE_NO_CHORD
        if place_cables(code, k_h, k_p, limits_of, validity, gravity, robot, geometry, work):
            status = POSE_SINGULAR
            scale_tensions(variable, preference, geometry, work)
            if factor_balance(freedom, geometry, work, full, matrix, reduced, balance, q, inverse, null):
                refer(method, variable, preference, previous, work, null, reference)
                status = settle(
                    code, k_h, k_p, method, parameter, variable, freedom, preference, previous, body, wrench, geometry,
                    work, full, matrix, reduced, balance, q, inverse, null, reference, corners, labels, statuses[p],
                )  # fmt: skip
        if status == POSE_SOLVED:
            measure_balance(freedom, body, wrench, geometry, work, matrix, balance, numbers, p)
            remember(code, k_h, k_p, variable, gravity, geometry, work, previous)
        elif status == POSE_INFEASIBLE:
            numbers[p, SHORTFALL] = explain(freedom, work, matrix, balance, inverse, null, blocking[p])
        else:
            numbers[p, SHORTFALL] = math.nan
        for k in range(n):
            proofs[p, 0, k] = balance[tables.FARKAS, k] if status == POSE_INFEASIBLE else math.nan
            proofs[p, 1, k] = (
                balance[tables.RIGHT, k] if status != POSE_NO_CHORD and status != POSE_SINGULAR else math.nan
            )
        pose_statuses[p] = status
        store(status == POSE_SOLVED, work, geometry, results, p)


@kernel
def polygon_of_pose(
    code: int,
    k_h: float,
    k_p: float,
    method: int,
    parameter: float,
    variable: int,
    limits_of: int,
    validity: float,
    preference: Array,
    freedom: Array,
    body: Array,
    robot: Array,
    pose: Array,
    wrench: Array,
    tensions: Array,
    pulls: Array,
    work: Array,
    null: Array,
    corners: Array,
    labels: Indices,
) -> int:
    """The feasible set of one pose with the pulls that its cables have at given chord tensions; number of corners.

    Where these are NaN, the pulls are those of the first order.

    Fills work (WORK_ROWS, m), the null space (r, m) and, for r = 2, corners and labels as `feasible_polygon`; for
    r = 1 corners[0, 0] and corners[1, 0] are the ends of the interval (infinite where it has none); for r = 0
    nothing more.
    """
    r, m = null.shape
    n = freedom.shape[0]
    gravity = body[tables.GRAVITY]
    geometry = np.empty((g.GEOMETRY_ROWS, m))
    balance = np.empty((tables.BALANCE_ROWS, 6))
    full = np.empty((6, m))
    matrix = np.empty((n, m))
    reduced = np.empty((n, m))
    q = np.empty((m + 1, m))
    inverse = np.empty((n, m))
    cable_geometry(robot, body, pose, np.empty((3, 3)), geometry)
    place_cables(code, k_h, k_p, limits_of, validity, gravity, robot, geometry, work)
    known = not math.isnan(tensions[0])
    if known:
        work[tables.TAU] = tensions
        work[tables.PULL] = pulls
    scale_tensions(variable, preference, geometry, work)
    if known and variable == FRAME_END_TENSION:
        linearize_ends(code, k_h, k_p, preference, gravity, geometry, work)
    factor_balance(freedom, geometry, work, full, matrix, reduced, balance, q, inverse, null)
    needed_wrench(geometry, body, wrench, work, balance)
    restrict_needed(freedom, balance)
    minimum_norm(inverse, balance, work)
    if r == 0:
        return 1
    if r == 1:
        corners[0, 0], corners[1, 0] = feasible_interval(work, null)
        return 2
    return feasible_polygon(work, null, corners, labels)


@kernel
def margins_of_poses(
    code: int,
    k_h: float,
    k_p: float,
    limits_of: int,
    validity: float,
    freedom: Array,
    bodies: Array,
    robots: Array,
    poses: Array,
    wrenches: Array,
    pulls: Array,
    margins: Array,
) -> None:
    """Fill the capacity margins [N] (N,) of poses whose cables have given pulls (N, m); NaN where they have none."""
    count, m = pulls.shape
    n = freedom.shape[0]
    geometry = np.empty((g.GEOMETRY_ROWS, m))
    work = np.empty((tables.WORK_ROWS, m))
    balance = np.empty((tables.BALANCE_ROWS, 6))
    full = np.empty((6, m))
    matrix = np.empty((n, m))
    translations = 0
    for k in range(n):
        translations += 0 if is_rotation(freedom, k) else 1
    for p in range(count):
        margins[p] = math.nan
        robot = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        cable_geometry(robot, body, poses[p], np.empty((3, 3)), geometry)
        placed = place_cables(code, k_h, k_p, limits_of, validity, body[tables.GRAVITY], robot, geometry, work)
        if placed and not math.isnan(pulls[p, 0]):
            work[tables.PULL] = pulls[p]
            needed_wrench(geometry, body, wrench, work, balance)
            restrict_needed(freedom, balance)
            structure_matrix(geometry, full)
            restrict_rows(freedom, full, matrix)
            margins[p] = capacity_margin(
                matrix, balance[tables.RIGHT, :n], work[tables.CHORD_LOW], work[tables.CHORD_HIGH], translations
            )
