"""Inverse kinematics of a batch of poses with swivel axes of any direction; docs/model.md, section 10.10.

Each cable is solved as a cable from an eyelet at its exit point, which moves with the tensions.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import codes, statics, tables
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.terms import new_cables
from sagline.kernels.inverse import poses as inverse
from sagline.kernels.inverse.exits import ROWS, Exits, start_at_tangents, write_behind
from sagline.kernels.inverse.stability import new_stability_arrays, proves_stability
from sagline.kernels.jit import entry
from sagline.kernels.memory import Memory, block
from sagline.kernels.tension import nearest
from sagline.kernels.tension.polygon import new_work_arrays


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
    stability: bool,
    answers: inverse.Answers,
    first: int,
    last: int,
) -> None:
    """Solve part of a batch with swivel axes of any direction, pose by pose."""
    # The arguments are the same as in `inverse_poses`, and:
    # `robot_terms`: with the cable_table of the cables from eyelets, (N, m, CABLE_COLUMNS). Its frame anchors are the
    # initial exit points, NaN for those of straight cables, and are replaced by the exit points found. `swivels`:
    # cable_table with swivel axes, (1 or N, m, SWIVEL_COLUMNS). `stability`: True to prove the stability of each
    # equilibrium. The lengths in `answers` are those of the free spans.
    distribution = nearest.Distribution(*distribution_terms)
    limits = TensionLimits(*limit_terms)
    freedom, _bodies, _eyelets = robot_terms
    results, statuses, residuals, needed, pose_statuses = answers
    m, n = statuses.shape[1], freedom.shape[0]
    cables, rest = new_cables(Memory(*memory), m, False)
    balance, rest = statics.new_balance(rest, m, n)
    near, rest = nearest.new_reference_point(rest, previous, m - n)
    work, rest = block(rest, ROWS, m)
    proof, rest = new_stability_arrays(rest, m, n - statics.translation_count(freedom))
    others = new_work_arrays(distribution.method, rest, m, m - n)
    for p in range(first, last):
        platform = inverse.platform_at(robot_terms, poses, wrenches, p)
        model = inverse.model_at(model_terms, platform.body)
        exits = Exits(swivels[min(p, swivels.shape[0] - 1)], limits, work)
        statuses[p] = codes.CABLE_SOLVED
        if math.isnan(platform.robot[0, tables.FRAME_X]):
            start_at_tangents(exits, platform, balance)
        else:
            cable_geometry(platform.robot, platform.body, platform.pose, balance.rotation, balance.geometry)
        variable, weight = distribution.variable, distribution.weight
        status = statics.set_chords(model, limits, variable, weight, platform, cables, balance)
        if status == codes.POSE_SOLVED:
            status = inverse.distribute_and_solve_cables(
                model, inverse.Method(distribution, near), platform, cables, balance, others, exits, statuses[p]
            )
        if status == codes.POSE_SOLVED:
            inverse.measure_balance(exits, platform, cables, balance, residuals[p])
            if distribution.method == codes.CLOSEST:
                inverse.store_tensions(model, distribution, cables, others, near)
        else:
            residuals[p, inverse.FORCE] = residuals[p, inverse.MOMENT] = math.nan
        for k in range(n):
            supplied = status != codes.POSE_NO_CHORD and status != codes.POSE_SINGULAR
            needed[p, k] = balance.right[k] if supplied else math.nan
        pose_statuses[p] = status
        asked = stability and status == codes.POSE_SOLVED
        if asked and not proves_stability(model, exits, platform, cables, balance, proof):
            pose_statuses[p] = codes.UNPROVED_STABILITY
        inverse.write_solution(status == codes.POSE_SOLVED, model, cables, balance, results, p)
        results[tables.WRAP :, p] = math.nan
        if status == codes.POSE_SOLVED:
            write_behind(model, exits, cables, balance, results, p)
