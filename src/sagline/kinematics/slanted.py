"""Inverse kinematics of robots whose pulleys swivel about axes of any direction; docs/model.md, section 10.

The kernel moves the exit points of the cables together with the tensions. Poses without tensions within their limits
are solved again with wider limits, because exit points of straight cables can make a pose near its limits infeasible.
Platforms on fewer cables than degrees of freedom are solved as cables from eyelets at their exit points. The tensions
found determine new exit points, at which the next pass starts. A pass leaves about (R/D)(wL/T)^2 of the error. Robots
with pulleys on the platform are solved in the same way; each pass also updates the weight that their cables take off
the platform.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels import codes, exits_of_forces, tables
from sagline.kernels.cable import geometry as g
from sagline.kinematics.inverse_rows import SOLVED, InverseRows
from sagline.robot.batch import Robots, cables_of, first_of, has_slanted_axes, on_platform, robots_at
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.statics.tables import check_slanted, chord_geometry, refuse_missing_chords, robot_terms, tangent_exits

if TYPE_CHECKING:
    from sagline.kernels.inverse.poses import Robots as RobotTerms

    # robot arrays, poses, cable_table with swivel axes for exit points that the kernel moves, True for the first pass,
    # which reports its progress, and further wrenches
    Solve = Callable[[RobotTerms, Indices, Array | None, bool, Array | None], tuple[InverseRows, Array]]

PASSES: Final = 30  # three or four are usual
SAME: Final = 1e-13  # change of an exit point at convergence, relative to the free span
CLOSE: Final = 1e-12  # largest accepted change after the last pass
WIDEST, NARROWEST = 0.9, 1e-9  # widening of limits, share of the limits
# statuses of poses that may be feasible at other exit points
SHORT: Final = (codes.POSE_INFEASIBLE, codes.POSE_NOT_CONVERGED, codes.POSE_NOT_COVERED, codes.POSE_BORDERLINE)


class _Pass(NamedTuple):
    """Results of one pass for k poses."""

    found: InverseRows
    rows: Array  # of the found poses, (k, POSE_COLUMNS)
    chord: Array  # from the exit points of the pass to the platform ends, (k, m, 3) [m]
    numbers: Array  # columns of `exits_of_forces` at the tensions found, (k, m, 8); NaN without tensions
    change: Array  # of the exit points, relative to the chord, (k, m); 0 without tensions

    @property
    def solved(self) -> Flags:
        """True for poses with tensions, (k,)."""
        return np.isin(self.found.pose_status, SOLVED)


def solve_slanted_axes(
    robot: Robots, model: CableModel, pose: Pose, solve: Solve, chained: bool
) -> tuple[InverseRows, Array]:
    """Results of the inverse kinematics, and rows of the found poses. `solve`: solver for cables from eyelets."""
    # chained: True if the result of a pose depends on the results of the poses before
    check_slanted(robot, model)
    freedom, bodies, table = robot_terms(robot, slanted=True)
    bare = table[..., : tables.CABLE_COLUMNS].copy()  # cables from eyelets
    bare[..., tables.PULLEY_RADIUS :] = 0.0
    bare[..., tables.ENTRY] = 1.0
    everywhere = np.arange(len(np.atleast_2d(pose.position)))

    def eyelets_of(which: Indices) -> tuple[Array, Array, Array]:
        """Own copies of the rows of `bare`, and the rows of `table` and `bodies`, for the poses `which`."""
        own, body, eyelet = (each[which] if len(each) > 1 else each for each in (table, bodies, bare))
        eyelets = np.empty((len(which), *bare.shape[1:]))
        eyelets[:] = eyelet
        return eyelets, own, body

    def run(exits: Array, which: Indices, wider: ArrayLike) -> _Pass:
        """One pass for the poses `which`, at limits that are wider by the share `wider` of their values."""
        eyelets, own, body = eyelets_of(which)
        eyelets[..., : tables.PLATFORM_X] = exits
        if np.any(wider):
            eyelets[..., tables.TENSION_MIN] *= 1.0 - np.reshape(wider, (-1, 1))
            eyelets[..., tables.TENSION_MAX] *= 1.0 + np.reshape(wider, (-1, 1))
        found, rows = solve((freedom, locked(body), eyelets), which, locked(own), False, None)
        reached = Pose.from_quaternion(rows[:, :3], rows[:, 3:])
        exits = np.ascontiguousarray(eyelets[..., : tables.PLATFORM_X])
        chord = _ends(own, reached.position, reached.matrix) - exits
        size = _norm(chord)
        numbers = _next_exits(robots_at(robot, which), model, own, body, exits, chord, size, found.results)
        return _Pass(found, rows, chord, numbers, np.nan_to_num(_norm(numbers[..., :3] - exits) / size))

    if on_platform(robot).any():
        found, rows = _solve_on_platform(robot, model, pose, solve, (freedom, bodies, table), eyelets_of(everywhere)[0])
    elif is_underconstrained(first_of(robot)):
        found, rows = _pass_by_pass(run, _tangent_exits(robot, pose, table), everywhere)
    else:
        eyelets = eyelets_of(everywhere)[0]
        eyelets[..., tables.FRAME_X] = np.nan
        found, rows = solve((freedom, bodies, eyelets), everywhere, table, True, None)
        lost = ~np.isin(found.pose_status, SOLVED) | found.at_border
        if lost.any():
            which = everywhere if chained else np.flatnonzero(lost)
            exits = np.where(lost[:, None, None], _tangent_exits(robot, pose, table), np.nan)
            repeated = _pass_by_pass(run, exits[which], which)[0]
            found.results[:, which] = repeated.results
            for name in InverseRows._fields[1:]:
                getattr(found, name)[which] = getattr(repeated, name)
    found.results[tables.LENGTH] += found.results[tables.WRAPPED] + found.results[tables.DEAD]
    return found, rows


def _solve_on_platform(
    robot: Robots, model: CableModel, pose: Pose, solve: Solve, terms: RobotTerms, bare: Array
) -> tuple[InverseRows, Array]:
    """Results of robots with pulleys on the platform. `bare`: cables from eyelets, (N, m, CABLE_COLUMNS)."""
    # exit points of pulleys on the platform are in the platform frame
    freedom, bodies, table = terms
    places, matrices = pose.position.reshape(-1, 3), pose.matrix.reshape(-1, 3, 3)
    aboard, moves = table[..., tables.ENTRY, None] == 0.0, is_underconstrained(first_of(robot))
    worlds, ends = _in_world(table, places, matrices)
    geometry = chord_geometry(robot, pose, slanted=True)
    refuse_missing_chords(robot, pose, geometry)
    # the first guess of the free lengths
    weights = _weight_taken(robot, model, worlds, bodies, places, matrices, geometry[:, g.CHORD])

    def run(exits: Array, which: Indices, wider: ArrayLike) -> _Pass:
        """One pass for the poses `which`, at limits that are wider by the share `wider` of their values."""
        own, body = (each[which] if len(each) > 1 else each for each in (table, bodies))
        on = own[..., tables.ENTRY, None] == 0.0
        some, load, eyelets = robots_at(robot, which), weights[which], bare[which]
        frame, platform = eyelets[..., : tables.PLATFORM_X], eyelets[..., tables.PLATFORM_X : tables.DENSITY]
        np.copyto(frame, exits, where=~on)
        np.copyto(platform, exits, where=on)
        eyelets[..., tables.TENSION_MIN] *= 1.0 - np.reshape(wider, (-1, 1))
        eyelets[..., tables.TENSION_MAX] *= 1.0 + np.reshape(wider, (-1, 1))
        found, rows = solve((freedom, locked(body), eyelets), which, None, False, load)
        place, matrix, world, end = places[which], matrices[which], worlds[which], ends[which]
        if moves:
            reached = Pose.from_quaternion(rows[:, :3], rows[:, 3:])
            place, matrix = reached.position, reached.matrix
            world, end = _in_world(own, place, matrix)
        exits = np.where(on, place[:, None] + platform @ np.swapaxes(matrix, -1, -2), frame).copy("C")
        chord = np.subtract(end, exits, order="C")
        np.negative(chord, out=chord, where=on)
        size = _norm(chord)
        numbers = _next_exits(some, model, world, body, exits, chord, size, found.results)
        change, solved = np.nan_to_num(_norm(numbers[..., :3] - exits) / size), np.isin(found.pose_status, SOLVED)
        new = _weight_taken(some, model, world, body, place, matrix, found.results[tables.LENGTH], numbers)
        moved = np.abs(new - load).sum(axis=1) / (body[:, tables.MASS] * body[:, tables.GRAVITY])
        change[solved] = np.maximum(change, moved[:, None])[solved]
        weights[which[solved]] = new[solved]
        np.copyto(numbers[..., :3], (numbers[..., :3] - place[:, None]) @ matrix, where=on)
        return _Pass(found, rows, chord, numbers, change)

    exits = tangent_exits(table, pose, geometry)
    exits = np.where(aboard, (exits - places[:, None]) @ matrices, exits)
    return _pass_by_pass(run, exits, np.arange(len(exits)))


def with_eyelets(state: Equilibrium) -> Equilibrium:
    """Equilibrium of the same cables with eyelets at the exit points; `state` itself if all axes are vertical."""
    # The robot of the result has the chords of the free spans. Its wrench includes the weight that cables take off a
    # platform with winches; see `_weight_taken`.
    robot, pose, cables = state.one_robot, state.pose, state.cables
    if not has_slanted_axes(robot):
        return state
    exits, on, wrench = state.exit_point, on_platform(robot)[:, None], state.wrench
    if on.any():
        _, bodies, table = robot_terms(robot, slanted=True)
        place, matrix = pose.position[None], pose.matrix[None]
        world, ends = _in_world(table, place, matrix)
        chord = np.where(on, -1.0, 1.0) * (ends - exits)
        results = np.full((tables.SWIVEL_ROWS, 1, robot.cable_count), np.nan)
        results[tables.HORIZONTAL], results[tables.VERTICAL] = cables.horizontal_tension, cables.vertical_force
        results[tables.LENGTH] = free = cables.unstrained_length
        model = cables.model
        numbers = _next_exits(robot, model, world, bodies, exits[None].copy(), chord, _norm(chord), results)
        wrench = locked(wrench + _weight_taken(robot, model, world, bodies, place, matrix, free[None], numbers)[0])
    anchors = np.where(on, robot.frame_anchors, exits)
    ends = np.where(on, (exits - pose.position) @ pose.matrix, robot.platform_anchors)
    eyelets = robot.replace(frame_anchors=anchors, platform_anchors=ends, winches=None)
    return Equilibrium(eyelets, pose, wrench, cables)


def _tangent_exits(robot: Robots, pose: Pose, table: Array) -> Array:
    """Exit points (N, m, 3) [m] of straight cables from pulleys at the frame."""
    geometry = chord_geometry(robot, pose, slanted=True)
    refuse_missing_chords(robot, pose, geometry)
    return tangent_exits(table, pose, geometry)


def _pass_by_pass(
    run: Callable[[Array, Indices, ArrayLike], _Pass], exits: Array, which: Indices
) -> tuple[InverseRows, Array]:
    """Results of the poses `which` from passes that start at the exit points `exits`, and rows of the found poses."""
    # Every pass of poses whose exit points are NaN starts at those of straight cables.
    moves = np.isfinite(exits[:, :, :1])
    near, unsure = np.zeros((2, len(exits)), dtype=np.bool_)  # poses whose limits were widened; without a sure verdict
    for _ in range(PASSES):
        last = run(exits, which, 0.0)
        short = np.isin(last.found.pose_status, SHORT)
        fresh = short & ~near
        if not fresh.any() and not (last.change > SAME).any():
            break
        known = np.isfinite(last.numbers[..., :1])
        exits = np.where(known & moves, last.numbers[..., :3], exits)
        unsure |= last.solved & near  # its verdict has changed if it is infeasible at the end
        if fresh.any():
            unsure[_approach_limits(run, exits, which, np.flatnonzero(fresh))] = True
            near |= fresh
    found, solved = last.found, last.solved
    lost = (solved & (last.change > CLOSE).any(axis=-1)) | (short & (unsure | fresh))
    found.pose_status[lost] = codes.POSE_NOT_CONVERGED
    found.brackets[lost] = np.nan
    _write(found.results, last.chord, last.numbers)
    found.results[tables.SINE :, ~solved] = np.nan
    return found, last.rows


def _approach_limits(
    run: Callable[[Array, Indices, Array], _Pass], exits: Array, poses: Indices, which: Indices
) -> Indices:
    """Move the exit points of the infeasible poses `poses[which]` to those at tensions close to the limits."""
    # The limits are widened less and less. A pose stays infeasible if the last change of its exit points is smaller
    # than the widening of the limits that does not make it feasible. Returns the poses at which this remains unknown.
    wider, moved, unsure = np.full(len(which), WIDEST), np.zeros(len(which)), []
    for _ in range(PASSES):
        last = run(exits[which], poses[which], wider)
        solved = last.solved
        new, at = last.numbers[solved, :, :3], which[solved]
        moved[solved] = (_norm(new - exits[at]) / _norm(last.chord[solved])).max(axis=-1)
        exits[at] = new
        infeasible = last.found.pose_status == codes.POSE_INFEASIBLE
        sure = np.where(solved, wider < NARROWEST, infeasible & (moved < wider))
        unsure.append(which[~sure & ~solved & (wider < NARROWEST)])
        left = ~sure & (solved | (wider >= NARROWEST))
        wider = np.where(infeasible, np.minimum(2.0 * wider, WIDEST), 0.25 * wider)
        which, wider, moved = which[left], wider[left], moved[left]
        if not which.size:
            break
    return np.concatenate((*unsure, which))


def _ends(table: Array, position: Array, matrix: Array) -> Array:
    """Platform ends in world axes (N, m, 3) [m]."""
    anchors = table[..., tables.PLATFORM_X : tables.PLATFORM_X + 3]
    return np.asarray(position[:, None] + anchors @ np.swapaxes(matrix, -1, -2))


def _in_world(table: Array, place: Array, matrix: Array) -> tuple[Array, Array]:
    """Table with pulleys on the platform in world axes, and ends of the cables without pulleys, (N, m, 3) [m]."""
    back, on = np.swapaxes(matrix, -1, -2), table[..., tables.ENTRY, None] == 0.0
    anchors, frame = table[..., tables.PLATFORM_X : tables.DENSITY], table[..., : tables.PLATFORM_X]
    ends = np.asarray(place[:, None] + anchors @ back)
    if not on.any():
        return table, ends
    world = np.array(np.broadcast_to(table, (len(place), *table.shape[1:])), order="C")
    np.copyto(world[..., : tables.PLATFORM_X], ends, where=on)
    np.copyto(world[..., tables.AXIS_X :], table[..., tables.AXIS_X :] @ back, where=on)
    rise = world[..., tables.AXIS_Z] * table[..., tables.DEAD_CABLE]
    np.copyto(world[..., tables.DEAD_RISE], rise, where=on[..., 0])
    return locked(world), np.where(on, frame, ends)


def weight_off_platform(
    robot: Robots, model: CableModel, pose: Pose, exits: Array, forces: Array, free: Array
) -> Array:
    """Wrenches (N, 6) by which the cables of winches on the platform reduce its weight, about the center of mass.

    `exits` (N, m, 3) [m]: exit points. `forces` (N, m, 3) [N]: cable forces there, toward the other ends. `free` (N, m)
    [m]: unstrained lengths of the free spans.
    """
    _freedom, bodies, table = robot_terms(robot, slanted=True)
    place, matrix = pose.position.reshape(-1, 3), pose.matrix.reshape(-1, 3, 3)
    world, ends = _in_world(table, place, matrix)
    numbers = np.empty((*free.shape, 8))
    size = _norm(ends - exits)
    exits_of_forces(world, locked(bodies[:, tables.GRAVITY].copy()), forces, exits, size, numbers)
    return _weight_taken(robot, model, world, bodies, place, matrix, free, numbers)


def _weight_taken(
    robot: Robots, model: CableModel, world: Array, bodies: Array, place: Array, matrix: Array, free: Array,
    numbers: Array | None = None,
) -> Array:  # fmt: skip
    """Wrenches (N, 6) about the center of mass by which cables reduce the weight of a platform with their pulleys."""
    # The mass of the platform includes all cable. The free spans, of the unstrained lengths `free` (N, m) [m], pull at
    # the exit points; the cable behind them is not on the drum, but on the pulley and on the axis.
    exact = model.code == codes.CATENARY
    weight = cables_of(robot).linear_density * first_of(robot).gravity * (world[..., tables.ENTRY] == 0.0) * exact
    center = place + (matrix @ bodies[:, tables.CENTER_X :, None])[..., 0]
    first = free[..., None] * (world[..., : tables.FRAME_Z] - center[:, None, :2])
    if numbers is not None:
        dead = world[..., tables.DEAD_CABLE] * (free + numbers[..., 4] + numbers[..., 5])
        first -= numbers[..., 6:] + dead[..., None] * world[..., tables.AXIS_X : tables.AXIS_Z]
    found = np.zeros((len(free), 6))
    found[:, 2] = (weight * free).sum(axis=-1)
    found[:, 3:5] = (weight[..., None] * first).sum(axis=1)[:, ::-1] * [1.0, -1.0]
    return found


def _norm(vectors: Array) -> Array:
    """Lengths of vectors (..., 3); faster than numpy's norm."""
    return np.asarray(np.sqrt(np.einsum("...k,...k->...", vectors, vectors)))


def _next_exits(
    robot: Robots,
    model: CableModel,
    table: Array,
    bodies: Array,
    exits: Array,
    chord: Array,
    size: Array,
    results: Array,
) -> Array:
    """Columns of `exits_of_forces` at the found forces; NaN if there is none. `chord` (N, m, 3), `size` (N, m) [m]."""
    weightless, on = model.code == codes.ELASTIC, table[..., tables.ENTRY, None] == 0.0
    weight = 0.0 if weightless else cables_of(robot).linear_density * first_of(robot).gravity
    force = np.empty(chord.shape)
    horizontal = results[tables.HORIZONTAL] / np.maximum(np.hypot(chord[..., 0], chord[..., 1]), 1e-300)
    force[..., :2] = horizontal[..., None] * chord[..., :2]
    force[..., 2] = results[tables.VERTICAL] - weight * results[tables.LENGTH]
    # on the platform, the force is that toward the frame anchor
    force[..., 2] = np.where(on[..., 0], results[tables.VERTICAL], force[..., 2])
    np.negative(force, out=force, where=on)
    numbers = np.empty((*size.shape, 8))
    acting = bodies[:, tables.GRAVITY] * (0.0 if weightless else 1.0)
    exits_of_forces(table, locked(acting), force, exits, size, numbers)
    return numbers


def _write(results: Array, chord: Array, numbers: Array) -> None:
    """Write exit points to the results of cables from eyelets."""
    results[tables.WRAP], results[tables.WRAPPED], results[tables.DEAD] = np.moveaxis(numbers[..., 3:6], -1, 0)
    results[tables.SINE] = chord[..., 2] / _norm(chord)
    results[tables.AZIMUTH] = np.arctan2(chord[..., 1], chord[..., 0])
