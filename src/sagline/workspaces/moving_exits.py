"""Margins of cables with mass whose exit points move with the tensions; docs/model.md, section 13.2.

The margin is computed with the exit points of straight cables. This module bounds the error. Where the bounds do not
decide the sign of the margin, `inverse` decides.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Indices, locked
from sagline.kernels import codes, tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.workspaces.wrench_set import SetTerms
from sagline.kinematics.inverse import inverse
from sagline.kinematics.slanted import weight_off_platform
from sagline.kinematics.status import PoseStatus
from sagline.robot.batch import Robots, on_platform, robots_at
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose

# for limits of chord tensions and of frame-end tensions: largest wD/(2 tau) with a bound; factor of the bound, which
# includes the motion of the limit; largest difference between both tensions, relative to wD/2
SLACKEST: Final = {codes.LIMITS_OF_CHORD: (1.0, 1.0, 0.0), codes.LIMITS_OF_FRAME_END: (0.5, 3.3, 0.61)}
PULLEY: Final = 10.4  # bound of the change of the first moment of the cable on a pulley of radius 1
STRETCH: Final = 0.02  # largest wD/(2 EA) with a bound
STEEPEST: Final = 1.14  # largest slope of a sag force by the exit point, up to wD/(2 tau) = 1, in units of w
BEND: Final = 1.1  # bound of asin(y)/y up to y = 0.7
TURN: Final = 0.02  # [rad], added to the largest turn of the force
HARDLY: Final = 1e-9  # [N], smallest distance of the margin of an infeasible pose from zero


class Bracket(NamedTuple):
    """Margins of N poses with their bounds. `Margin` has the same fields, and also the robot and the poses."""

    value: Array  # continuous margin between `low` and `high` [N], (N,)
    low: Array  # lower bound of the margin for all sag forces [N], (N,)
    high: Array  # upper bound [N], (N,)
    cable: Indices  # cable whose limit has the largest effect on the value, -1 for none, (N,)
    status: Codes  # codes of `MarginStatus`, (N,)
    direction: Array  # normal of the nearest facet, (N, 6)


class Errors(NamedTuple):
    """Bounds of the errors of cables with the exit points of straight cables, (N, m) each; infinite if unknown."""

    force: Array  # of the force on the platform [N]
    moment: Array  # of its moment, in addition to that of the force at the exit point [N m]


def errors_of_exits(table: Array, gravity: float, geometry: Array, limited: int) -> Errors:
    """Bounds for `table` (1 or N, m, SWIVEL_COLUMNS) and `geometry` (N, GEOMETRY_ROWS, m)."""
    radius, low, weight = table[..., tables.PULLEY_RADIUS], table[..., tables.TENSION_MIN], table[..., tables.DENSITY]
    weight, chord, cosine = weight * gravity, geometry[:, g.CHORD], geometry[:, g.COSINE]
    tangent = cosine * geometry[:, g.AZIMUTH_X], cosine * geometry[:, g.AZIMUTH_Y], geometry[:, g.SINE]
    axis, stiffness = geometry[:, g.AXIS_X : g.AXIS_Z + 1], table[..., tables.STIFFNESS]
    with np.errstate(all="ignore"):
        half, (slackest, factor, apart) = 0.5 * weight * (chord + 4.0 * radius), SLACKEST[limited]
        low = low - apart * half
        x = half / low
        sag_force = half * (np.sinh(x) / x + x / 3.0)  # at the exit point
        turn = np.arcsin(sag_force / low)  # largest angle between force and chord
        straight = np.arccos(np.clip(sum(axis[:, k] * tangent[k] for k in range(3)), -1.0, 1.0))
        wrap = straight + 2.0 * turn + TURN  # largest wrap angle
        weighs = weight * radius * (wrap - np.sin(wrap)) / ((low - sag_force) * (1.0 - np.cos(wrap)) * np.sin(wrap))
        swings = weighs / (1.0 - weighs)  # tangent of the turn due to the weight on the pulley
        steepness = np.maximum(1.0, np.tan(0.5 * wrap))
        feedback = BEND * radius * steepness / chord
        moved = radius * (steepness * turn + (1.0 - np.cos(wrap)) * swings + swings**2) / (1.0 - feedback)
        fits = (wrap < np.pi) & (weighs < 0.3) & (feedback < 0.5) & (moved < 0.5 * chord)
        fits &= BEND * moved / chord <= turn + TURN
        moved = np.where(radius == 0.0, 0.0, np.where(fits, moved, np.inf))
        force = factor * (BEND * low / chord + STEEPEST * weight) * moved
        # winches on the platform: the cable off the drum, which is part of the mass of the platform
        most = (table[..., tables.TENSION_MAX] + sag_force) / stiffness
        stretch = np.where(most < np.inf, most / (1.0 + most), 1.0)
        free = moved + chord * np.maximum(np.sinh(x) / x - 1.0, stretch)
        dead = table[..., tables.DEAD_CABLE]
        behind = free + radius * (2.0 * turn + TURN + wrap * stretch) + 2.0 * dead * stretch
        lever = np.linalg.norm(geometry[:, g.LEVER_X : g.LEVER_Z + 1], axis=1)
        moment = moved * (low + sag_force) + weight * (free * lever + dead * behind + PULLEY * radius**2)
        aboard = table[..., tables.ENTRY] == 0.0
        force, moment = np.where(aboard, force + weight * free, force), np.where(aboard, moment, 0.0)
        known = (low > 0.0) & (x <= slackest) & (half <= STRETCH * stiffness)
    bounds = (np.where(weight == 0.0, 0.0, np.where(known, bound, np.inf)) for bound in (force, moment))
    return Errors(*bounds)


Measure = Callable[..., Bracket]
Terms = tuple[int, Array, Array, Array, Array]


def with_moving_exits(
    robots: Robots, model: CableModel, pose: Pose, exits: Array, terms: Terms, loads: SetTerms, at_exits: Measure
) -> Bracket:
    """Margins of N poses. `robots`: one robot, or one per pose. `exits` (N, m, 3) [m]: those of straight cables."""
    # terms: tension that the limits apply to; `body_table`, `cable_table`, geometry and lever arm of every pose. Body,
    # table and lever arm have one row if they are the same at all poses. at_exits: margins of some of the poses with
    # fixed exit points, and with further wrenches of winches on the platform.
    limited, bodies, table, geometry, arm = terms
    gravity, aboard = float(bodies[0, tables.GRAVITY]), bool(on_platform(robots).any())
    off = _weight_off_straight(robots, model, pose, exits, table, geometry, gravity) if aboard else None
    found = at_exits(exits, off)
    levers = np.linalg.norm(geometry[:, g.LEVER_X : g.LEVER_Z + 1], axis=1)
    levers = levers + 4.0 * table[..., tables.PULLEY_RADIUS] * (table[..., tables.ENTRY] == 0.0)
    force, moment = errors_of_exits(table, gravity, geometry, limited)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = np.where(force > 0.0, force * np.hypot(1.0, levers / arm[:, None]), 0.0)
        error = (error + np.where(moment > 0.0, moment / arm[:, None], 0.0)).sum(axis=1)
    known = np.isfinite(found.value)
    found.low[known] -= error[known]
    found.high[known] += error[known]
    verdict = np.where(found.high < 0.0, codes.MARGIN_INFEASIBLE, codes.MARGIN_OPEN)
    found.status[known] = np.where(found.low >= 0.0, codes.MARGIN_FEASIBLE, verdict)[known]
    left = np.flatnonzero(known & (found.status == codes.MARGIN_OPEN))
    if not left.size:
        return found
    at, mass = pose[left], bodies[left % len(bodies), tables.MASS]
    wrench = _worst_wrenches(loads, found.direction[left], at.matrix, mass, left % len(loads[-1]))
    plan = inverse(robots_at(robots, left), at, model, wrench=locked(wrench), stability=False)
    solved = plan.status == PoseStatus.SOLVED
    yes, no = left[solved], left[plan.status == PoseStatus.INFEASIBLE]
    if yes.size:
        state = plan.state[solved]
        off = _weight_off_state(state, model, plan.free_length[solved]) if aboard else None
        found.value[yes] = np.clip(at_exits(state.exit_point, off, yes).value, 0.0, found.high[yes])
    # continuous at the boundary of feasibility, where the exit points of the found tensions and the shortfall are exact
    short = np.maximum(plan.shortfall[plan.status == PoseStatus.INFEASIBLE], HARDLY)
    short[np.isnan(short)] = np.inf
    beyond = np.where(short < np.inf, found.low[no], -HARDLY)
    found.value[no] = np.maximum(-short, np.where(found.value[no] < 0.0, found.value[no], beyond))
    found.high[no] = np.minimum(found.high[no], found.value[no])
    found.status[no] = codes.MARGIN_INFEASIBLE
    if _is_single(loads):
        found.low[yes] = np.maximum(found.low[yes], 0.0)
        found.status[yes] = codes.MARGIN_FEASIBLE
    return found


def _weight_off_straight(
    robots: Robots, model: CableModel, pose: Pose, exits: Array, table: Array, geometry: Array, gravity: float
) -> Array:
    """`weight_off_platform` of nearly straight cables."""
    chord, level = geometry[:, g.CHORD], geometry[:, g.COSINE]
    half = 0.5 * table[..., tables.DENSITY] * gravity * chord
    tension = np.maximum(table[..., tables.TENSION_MIN], half)
    x, y = level * geometry[:, g.AZIMUTH_X], level * geometry[:, g.AZIMUTH_Y]
    forces = np.stack((tension * x, tension * y, tension * geometry[:, g.SINE] - half), axis=-1)
    return weight_off_platform(robots, model, pose, exits, forces, chord)


def _weight_off_state(state: Equilibrium, model: CableModel, free: Array) -> Array:
    """`weight_off_platform` at the forces of `state`."""
    assert state.contact is not None
    assert state.contact.azimuth is not None
    azimuth, size = state.contact.azimuth, -state.cables.horizontal_tension
    forces = np.stack((size * np.cos(azimuth), size * np.sin(azimuth), -state.cables.vertical_force), axis=-1)
    return weight_off_platform(state.robot, model, state.pose, state.exit_point, forces, free)


def _worst_wrenches(loads: SetTerms, direction: Array, matrix: Array, mass: Array, robot: Indices) -> Array:
    """Wrenches (K, 6) of a set with the smallest components along `direction` (K, 6). `robot`: rows of inertias."""
    center, half, segments, ellipsoids, corners, sizes, (linear, angular), inertias = loads
    found = center - np.sign(direction) * half - np.sign(direction @ segments.T) @ segments
    found[:, :3] -= linear * mass[:, None] * np.sign(direction[:, :3])
    spins = angular * matrix @ inertias[robot] @ np.swapaxes(matrix, 1, 2)
    along = np.sign((spins @ direction[:, 3:, None])[..., 0])
    found[:, 3:] -= np.einsum("kj,kjl->kl", along, spins)
    for axes in ellipsoids:
        along = direction @ axes.T
        found -= along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300) @ axes
    for own in np.split(corners, np.cumsum(sizes)[:-1]) if len(sizes) else ():
        found += own[np.argmin(direction @ own.T, axis=1)]
    return found


def _is_single(loads: SetTerms) -> bool:
    """True if the set has only one wrench."""
    _center, half, segments, ellipsoids, _corners, sizes, accelerations, _inertias = loads
    return not (half.any() or len(segments) or len(ellipsoids) or (sizes > 1).any() or accelerations.any())
