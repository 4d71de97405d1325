"""Inverse kinematics of a batch of poses: tensions that balance the platform, and the lengths to wind.

docs/model.md, sections 4 and 5. For the exact cable the pulls T_z - tau sin phi depend on the
tensions: the balance is solved again with the pulls of the last round until they stand still.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes, Flags
from sagline.kernels import tables
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.geometry import cable_geometry
from sagline.kernels.balance.setting import factor_balance, place_cables, refer, scale_tensions
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import (
    POSE_INFEASIBLE,
    POSE_NO_CHORD,
    POSE_SINGULAR,
    POSE_SOLVED,
)
from sagline.kernels.inverse.answer import (
    FORCE_RESIDUAL,
    MOMENT_RESIDUAL,
    SHORTFALL,
    explain,
    measure_balance,
    store,
)
from sagline.kernels.inverse.rounds import remember, settle
from sagline.kernels.jit import entry
from sagline.kernels.sharing.polygon import SPARE_CORNERS


@entry
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
        model = Model(code, k_h, k_p, body[tables.GRAVITY])
        statuses[p, :] = 0
        blocking[p, :] = False
        numbers[p, SHORTFALL] = 0.0
        numbers[p, FORCE_RESIDUAL] = math.nan
        numbers[p, MOMENT_RESIDUAL] = math.nan
        cable_geometry(robot, body, poses[p], rotation, geometry)
        status = POSE_NO_CHORD
        if place_cables(model, limits_of, validity, robot, geometry, work):
            status = POSE_SINGULAR
            scale_tensions(variable, preference, geometry, work)
            if factor_balance(freedom, geometry, work, full, matrix, reduced, balance, q, inverse, null):
                refer(method, variable, preference, previous, work, null, reference)
                status = settle(
                    model, method, parameter, variable, freedom, preference, previous, body, wrench, geometry,
                    work, full, matrix, reduced, balance, q, inverse, null, reference, corners, labels, statuses[p],
                )  # fmt: skip
        if status == POSE_SOLVED:
            measure_balance(freedom, body, wrench, geometry, work, matrix, balance, numbers, p)
            remember(model, variable, geometry, work, previous)
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
