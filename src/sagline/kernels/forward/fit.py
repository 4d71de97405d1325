"""Forward kinematics of straight cables: the pose whose distances fit the lengths best, by Levenberg and Marquardt.

For comparison with the exact cable. Straight cables that are too long or too short to meet are not told from taut
ones: every length counts alike, and mirrored poses fit as well as the right one.
"""

from __future__ import annotations

import math

import numpy as np

from sagline.arrays import Array, Codes
from sagline.kernels import tables
from sagline.kernels.algebra.dense import cholesky, solve_lower, solve_upper
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.freedom import norm, project, spread
from sagline.kernels.balance.geometry import cable_geometry
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CABLE_NO_TENSION, FORWARD_FITTED, FORWARD_NO_LENGTHS, FORWARD_NOT_CONVERGED, STRAIGHT
from sagline.kernels.forward.forward import ENERGY, ITERATIONS, fill_scales
from sagline.kernels.forward.platform import moved_pose
from sagline.kernels.forward.problem import Problem, Space, new_space
from sagline.kernels.jit import entry_with_memory, kernel

FIT_STEPS = 200
FIRST_DAMPING = 1e-3  # of the largest diagonal element
SMALL_STEP = 1e-14  # in the units of the scale
NOTHING = 1e-13  # share of the cost whose gain ends a fit


@kernel
def misfit(problem: Problem, pose: Array, space: Space) -> float:
    """Half the sum of squared length errors [m^2] at a pose, whose geometry it fills."""
    cable_geometry(problem.cables, problem.body, pose, space.rotation, space.geometry)
    total = 0.0
    for i in range(problem.lengths.shape[0]):
        error = space.geometry[g.CHORD, i] - problem.lengths[i]
        total += 0.5 * error * error
    return total


@kernel
def normal_equations(problem: Problem, space: Space) -> None:
    """Fill matrix J^T J (n, n) and part J^T e (n,) of the length errors e, scaled."""
    matrix, part, row = space.matrix, space.part, space.step
    geometry = space.geometry
    n = part.shape[0]
    for j in range(n):
        part[j] = 0.0
        for k in range(n):
            matrix[j, k] = 0.0
    for i in range(problem.lengths.shape[0]):
        cosine = geometry[g.COSINE, i]
        x, y, z = cosine * geometry[g.AZIMUTH_X, i], cosine * geometry[g.AZIMUTH_Y, i], geometry[g.SINE, i]
        rx, ry, rz = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        full = space.gradient
        full[0], full[1], full[2] = x, y, z
        full[3], full[4], full[5] = ry * z - rz * y, rz * x - rx * z, rx * y - ry * x
        project(problem.freedom, full, problem.scale, row)
        error = geometry[g.CHORD, i] - problem.lengths[i]
        for j in range(n):
            part[j] += row[j] * error
            for k in range(n):
                matrix[j, k] += row[j] * row[k]


@kernel
def fit_pose(problem: Problem, pose: Array, space: Space):  # type: ignore[no-untyped-def]
    """Move pose to a least-squares fit; returns half the sum of squares [m^2], steps tried, and whether it is a fit."""
    cost = misfit(problem, pose, space)
    normal_equations(problem, space)
    largest = 0.0
    for j in range(space.part.shape[0]):
        largest = max(largest, space.matrix[j, j])
    damping = FIRST_DAMPING * largest
    for iteration in range(FIT_STEPS):
        if not cholesky(space.matrix, damping, space.factor):
            damping = max(10.0 * damping, 1e-15 * largest)
            continue
        solve_lower(space.factor, space.part, space.work)
        solve_upper(space.factor, space.work, space.work)
        length = norm(space.work)
        if length <= SMALL_STEP:
            return cost, iteration, True
        spread(problem.freedom, space.work, problem.scale, space.motion)
        for k in range(6):
            space.motion[k] = -space.motion[k]
        moved_pose(problem.body, pose, space.motion, space.trial)
        new = misfit(problem, space.trial, space)
        if new < cost:
            for k in range(pose.shape[0]):
                pose[k] = space.trial[k]
            gain = cost - new
            cost = new
            damping = 0.1 * damping if damping > 1e-14 * largest else 0.0
            normal_equations(problem, space)
            if gain <= NOTHING * cost:
                return cost, iteration + 1, True
        elif length <= 1e-7:  # squares of errors are rounded off at the root of the last digit
            misfit(problem, pose, space)
            return cost, iteration + 1, True
        else:
            damping = max(10.0 * damping, 1e-12 * largest)
    misfit(problem, pose, space)
    return cost, FIT_STEPS, False


@entry_with_memory
def fit_poses(
    chained: bool,
    freedom: Array,
    bodies: Array,
    robots: Array,
    lengths: Array,
    starts: Array,
    wrenches: Array,
    poses: Array,
    results: Array,
    statuses: Codes,
    numbers: Array,
    pose_statuses: Codes,
) -> None:
    """Fit every sample in turn; arguments as in `forward_poses`. Forces are NaN, energy is half the sum of squares."""
    count, m = lengths.shape
    n = freedom.shape[0]
    space = new_space(m, n)
    scale = np.empty(n)
    arc = np.empty(n)
    pose = np.empty(tables.POSE_COLUMNS)
    last = starts[0].copy()
    for p in range(count):
        cables = robots[min(p, robots.shape[0] - 1)]
        body = bodies[min(p, bodies.shape[0] - 1)]
        results[:, p] = math.nan
        numbers[p, :] = math.nan
        statuses[p, :] = CABLE_NO_TENSION
        if math.isnan(lengths[p, 0]):
            poses[p, :] = math.nan
            numbers[p, ITERATIONS] = 0.0
            pose_statuses[p] = FORWARD_NO_LENGTHS
            continue
        for k in range(tables.POSE_COLUMNS):
            pose[k] = last[k] if chained else starts[min(p, starts.shape[0] - 1), k]
        fill_scales(freedom, cables, body, lengths[p], scale, arc)
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        model = Model(STRAIGHT, 0.0, 0.0, body[tables.GRAVITY])
        problem = Problem(model, freedom, cables, body, lengths[p], wrench, scale)
        numbers[p, ENERGY], numbers[p, ITERATIONS], fitted = fit_pose(problem, pose, space)
        pose_statuses[p] = FORWARD_FITTED if fitted else FORWARD_NOT_CONVERGED
        for k in range(tables.POSE_COLUMNS):
            poses[p, k] = pose[k]
            if fitted:
                last[k] = pose[k]
        for i in range(m):
            results[tables.SPAN, p, i] = space.geometry[g.SPAN, i]
            results[tables.RISE, p, i] = space.geometry[g.RISE, i]
            results[tables.LENGTH, p, i] = lengths[p, i]
