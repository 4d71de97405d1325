"""Questions about poses beside their inverse: the polygon of feasible tensions, and margins."""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.bounds import STRIP_ROWS
from sagline.kernels.balance.freedom import translation_count
from sagline.kernels.balance.setting import (
    Platform,
    TensionLimits,
    fill_needed_wrench,
    new_balance,
    set_pose,
    start_from_minimum_norm,
)
from sagline.kernels.cable.cables import new_cables
from sagline.kernels.cable.pulley import robots_have_machine
from sagline.kernels.cable.terms import Model
from sagline.kernels.codes import CHORD_TENSION, FRAME_END_TENSION, POSE_NO_CHORD
from sagline.kernels.inverse.frame_end import linearize_ends
from sagline.kernels.inverse.poses import DistributionTerms, LimitTerms, ModelTerms, Robots
from sagline.kernels.jit import entry
from sagline.kernels.memory import Memory, block
from sagline.kernels.tension.margin import capacity_margin
from sagline.kernels.tension.nearest import Distribution
from sagline.kernels.tension.on_polygon import feasible_interval
from sagline.kernels.tension.polygon import feasible_polygon


@entry
def polygon_of_pose(
    model_terms: ModelTerms,
    distribution_terms: DistributionTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    pose: Array,
    wrench: Array,
    carried: tuple[Array, Array],
    room: tuple[Array, Indices],
    polygon: tuple[Array, Array, Array, Array, Array, Indices],
) -> int:
    """The feasible set of one pose with the pulls that its cables have at given chord tensions; number of corners.

    Args:
        model_terms: As in `inverse_poses`.
        distribution_terms: As in `inverse_poses`; its variable counts.
        limit_terms: As in `inverse_poses`.
        robot_terms: As in `inverse_poses`, of one robot.
        pose: Row (POSE_COLUMNS,).
        wrench: External plus inertial, about the center of mass, (6,).
        carried: Chord tensions and pulls of the cables, (m,) each; NaN for pulls of first order.
        room: `memory_for` as many cables.
        polygon: Filled: scale and offset of the variable, (m,) each; minimum norm and limits, (3, m); null space
            (r, m); for r = 2 corners and labels as `feasible_polygon`; for r = 1 corners[0, 0] and corners[1, 0] are
            the ends of the interval (infinite where it has none); for r = 0 nothing more.
    """
    distribution = Distribution(*distribution_terms)
    freedom, bodies, robots = robot_terms
    tensions, pulls = carried
    scale, offset, bounds, null, corners, labels = polygon
    r, m = null.shape
    cables, rest = new_cables(Memory(*room), m, robots_have_machine(robots))
    balance, rest = new_balance(rest, m, freedom.shape[0])
    platform = Platform(freedom, bodies[0], robots[0], pose, wrench)
    model = Model(model_terms[0], model_terms[1], model_terms[2], bodies[0, tables.GRAVITY], None)
    set_pose(model, TensionLimits(*limit_terms), distribution.variable, distribution.weight, platform, cables, balance)
    if not math.isnan(tensions[0]):
        for i in range(m):
            cables.tau[i] = tensions[i]
            cables.pull[i] = pulls[i]
        if distribution.variable == FRAME_END_TENSION:
            linearize_ends(model, distribution, cables, balance)
    fill_needed_wrench(platform, cables, balance)
    start_from_minimum_norm(balance)
    for i in range(m):
        scale[i] = balance.scale[i]
        offset[i] = balance.offset[i]
        for row in range(STRIP_ROWS):
            bounds[row, i] = balance.bounds[row, i]
        for k in range(r):
            null[k, i] = balance.null[k, i]
    count = 1
    if r == 1:
        corners[0, 0], corners[1, 0] = feasible_interval(bounds, null)
        count = 2
    elif r == 2:
        count = feasible_polygon(bounds, null, corners, labels)
    return count


@entry
def margins_of_poses(
    model_terms: ModelTerms,
    limit_terms: LimitTerms,
    robot_terms: Robots,
    poses: Array,
    wrenches: Array,
    pulls: Array,
    room: tuple[Array, Indices],
    margins: Array,
) -> None:
    """Fill the capacity margins [N] (N,) of poses whose cables have given pulls (N, m); NaN where they have none."""
    limits = TensionLimits(*limit_terms)
    freedom, bodies, robots = robot_terms
    count, m = pulls.shape
    n = freedom.shape[0]
    cables, rest = new_cables(Memory(*room), m, robots_have_machine(robots))
    balance, rest = new_balance(rest, m, n)
    weights, at = block(rest.numbers, 0, 1, m)
    weight = weights[0]
    rest = Memory(rest.numbers[at:], rest.counters)
    for i in range(m):
        weight[i] = 1.0
    translations = translation_count(freedom)
    for p in range(count):
        margins[p] = math.nan
        body = bodies[min(p, bodies.shape[0] - 1)]
        wrench = wrenches[min(p, wrenches.shape[0] - 1)]
        platform = Platform(freedom, body, robots[min(p, robots.shape[0] - 1)], poses[p], wrench)
        model = Model(model_terms[0], model_terms[1], model_terms[2], body[tables.GRAVITY], None)
        placed = set_pose(model, limits, CHORD_TENSION, weight, platform, cables, balance) != POSE_NO_CHORD
        if placed and not math.isnan(pulls[p, 0]):
            for i in range(m):
                cables.pull[i] = pulls[p, i]
            fill_needed_wrench(platform, cables, balance)
            margins[p] = capacity_margin(balance.matrix, balance.right, cables.low, cables.high, translations, rest)
