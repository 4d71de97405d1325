"""Questions about single poses beside their inverse: the polygon of feasible tensions, and margins."""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.null_space import minimum_norm
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.freedom import turns
from sagline.kernels.balance.geometry import cable_geometry
from sagline.kernels.balance.setting import factor_balance, place_cables, scale_tensions
from sagline.kernels.balance.statics import needed_wrench, restrict_needed, restrict_rows, structure_matrix
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import (
    FRAME_END_TENSION,
)
from sagline.kernels.inverse.frame_end import linearize_ends
from sagline.kernels.jit import entry
from sagline.kernels.sharing.feasible_set import feasible_interval
from sagline.kernels.sharing.margin import capacity_margin
from sagline.kernels.sharing.polygon import feasible_polygon


@entry
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
    model = Model(code, k_h, k_p, body[tables.GRAVITY])
    geometry = np.empty((g.GEOMETRY_ROWS, m))
    balance = np.empty((tables.BALANCE_ROWS, 6))
    full = np.empty((6, m))
    matrix = np.empty((n, m))
    reduced = np.empty((n, m))
    q = np.empty((m + 1, m))
    inverse = np.empty((n, m))
    cable_geometry(robot, body, pose, np.empty((3, 3)), geometry)
    place_cables(model, limits_of, validity, robot, geometry, work)
    known = not math.isnan(tensions[0])
    if known:
        work[tables.TAU] = tensions
        work[tables.PULL] = pulls
    scale_tensions(variable, preference, geometry, work)
    if known and variable == FRAME_END_TENSION:
        linearize_ends(model, preference, geometry, work)
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


@entry
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
        translations += 0 if turns(freedom, k) else 1
    for p in range(count):
        margins[p] = math.nan
        robot = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        cable_geometry(robot, body, poses[p], np.empty((3, 3)), geometry)
        model = Model(code, k_h, k_p, body[tables.GRAVITY])
        placed = place_cables(model, limits_of, validity, robot, geometry, work)
        if placed and not math.isnan(pulls[p, 0]):
            work[tables.PULL] = pulls[p]
            needed_wrench(geometry, body, wrench, work, balance)
            restrict_needed(freedom, balance)
            structure_matrix(geometry, full)
            restrict_rows(freedom, full, matrix)
            margins[p] = capacity_margin(
                matrix, balance[tables.RIGHT, :n], work[tables.CHORD_LOW], work[tables.CHORD_HIGH], translations
            )
