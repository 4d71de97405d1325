"""Inverse kinematics of a batch of poses with swivel axes of any direction; docs/model.md, section 10.10.

Each cable is solved as a cable from an eyelet at its exit point. The tensions found determine the next exit points.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes, statics, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.swivel import next_exit, swivel_at
from sagline.kernels.cable.terms import Cables, Model, new_cables
from sagline.kernels.inverse import poses as inverse
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory
from sagline.kernels.tension import nearest
from sagline.kernels.tension.polygon import new_work_arrays

PASSES = 8  # largest number of passes; three are usual
SAME_EXIT = 2e-12  # change of an exit point after which the next change is a rounding error, relative to the free span


@glue
def _move_exits(model: Model, robot: Array, cables: Cables, geometry: Array, eyelets: Array) -> float:
    """Move the frame anchors of `eyelets` to the exit points of the present forces. Returns the largest change."""
    # The change is relative to the free span. `robot`: rows of a cable_table with swivel axes.
    gravity = model.gravity if model.code == codes.CATENARY else 0.0
    change = 0.0
    for i in range(cables.tau.size):
        swivel = swivel_at(robot, i, gravity)
        chord, level = cables.chord[i], cables.tau[i] * cables.cosine[i]
        x, y = level * geometry[g.AZIMUTH_X, i], level * geometry[g.AZIMUTH_Y, i]
        z = cables.tau[i] * cables.sine[i] + cables.sag_force[i] - swivel.weight * cables.ratio[i] * chord
        (x, y, z), _at = next_exit(swivel, robot, i, (x, y, z), eyelets, chord)
        away = abs(x - eyelets[i, 0]) + abs(y - eyelets[i, 1]) + abs(z - eyelets[i, 2])
        change = max(change, away / chord)
        eyelets[i, tables.FRAME_X], eyelets[i, tables.FRAME_Y], eyelets[i, tables.FRAME_Z] = x, y, z
    return change


@entry
def inverse_poses_of_slanted(
    model_terms: inverse.ModelTerms,
    distribution_terms: inverse.DistributionTerms,
    limit_terms: inverse.LimitTerms,
    robot_terms: inverse.Robots,
    swivels: Array,
    poses: Array,
    wrenches: Array,
    previous: Array,
    memory: tuple[Array, Indices],
    answers: inverse.Answers,
    first: int,
    last: int,
) -> None:
    """Solve part of a batch with swivel axes of any direction, pose by pose."""
    # The arguments are the same as in `inverse_poses`, and:
    # `robot_terms`: with the cable_table of the cables from eyelets, (N, m, CABLE_COLUMNS). Its frame anchors are the
    # initial exit points, and are replaced by the exit points found. `swivels`: cable_table with swivel axes, (1 or N,
    # m, SWIVEL_COLUMNS).
    distribution = nearest.Distribution(*distribution_terms)
    limits = TensionLimits(*limit_terms)
    freedom, _bodies, _eyelets = robot_terms
    results, statuses, residuals, needed, pose_statuses = answers
    m, n = statuses.shape[1], freedom.shape[0]
    cables, rest = new_cables(Memory(*memory), m, False)
    balance, rest = statics.new_balance(rest, m, n)
    near, rest = nearest.new_reference_point(rest, previous, m - n)
    others = new_work_arrays(distribution.method, rest, m, m - n)
    for p in range(first, last):
        platform = inverse.platform_at(robot_terms, poses, wrenches, p)
        model = inverse.model_at(model_terms, platform.body)
        robot = swivels[min(p, swivels.shape[0] - 1)]
        status = codes.POSE_NOT_CONVERGED
        for _ in range(PASSES):
            statuses[p] = codes.CABLE_SOLVED
            status = statics.set_pose(
                model, limits, distribution.variable, distribution.weight, platform, cables, balance
            )
            if status == codes.POSE_SOLVED:
                status = inverse.distribute_and_solve_cables(
                    model, distribution, platform, cables, balance, near, others, statuses[p]
                )
            if status != codes.POSE_SOLVED:
                break
            if _move_exits(model, robot, cables, balance.geometry, platform.robot) <= SAME_EXIT:
                break
        if status == codes.POSE_SOLVED:
            inverse.measure_balance(platform, cables, balance, residuals[p])
            if distribution.method == codes.CLOSEST:
                inverse.store_tensions(model, distribution, cables, others, near)
        else:
            residuals[p, inverse.FORCE] = residuals[p, inverse.MOMENT] = math.nan
        for k in range(n):
            supplied = status != codes.POSE_NO_CHORD and status != codes.POSE_SINGULAR
            needed[p, k] = balance.right[k] if supplied else math.nan
        pose_statuses[p] = status
        inverse.write_solution(status == codes.POSE_SOLVED, model, cables, balance, results, p)
