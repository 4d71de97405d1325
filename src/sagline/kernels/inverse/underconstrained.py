"""Equilibria of platforms with fewer cables than degrees of freedom; docs/model.md, section 5.

As many values are given as there are cables. The given values are coordinates of the platform, and possibly a tension
level. The remaining motions and the chord tensions follow from the balance by Newton steps. The tensions, not the
lengths, are the unknowns, because a length change of a millimeter can change a tension by more than the tension itself.
In the derivatives, the steps neglect the second-order terms of the sag. The balance includes them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Flags, Indices
from sagline.kernels import codes, statics, tables
from sagline.kernels.algebra.factors import copy, dot, solve_general
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.pulley import robots_have_machine
from sagline.kernels.cable.sag_forces import Curves, new_curves, sag_forces_at
from sagline.kernels.cable.states import TensionLimits
from sagline.kernels.cable.terms import Cables, new_cables
from sagline.kernels.inverse import poses as inverse
from sagline.kernels.jit import entry, glue
from sagline.kernels.memory import Memory, block, counters, vector

STEPS = 60  # largest number of steps; taut cables need 4 to 10
CONVERGED = 1e-10  # last step: turn [rad], displacement relative to the lever arm, relative change of the tensions
TURN = 0.3  # largest turn per step [rad]
SHRINK = 0.2  # smallest ratio of a tension to its value before the step
FLOOR = 0.02  # smallest initial tension, relative to the mean load of a cable
RIDGE = 1e-6  # relative regularization of the initial tensions
PATIENCE = 5  # consecutive steps at a smallest tension, after which the search admits smaller tensions, or ends
BELOW = 0.5  # smallest tension of the continued search, relative to the smallest admissible tension
ITERATIONS = 12  # inverse iterations for the tension level; each reduces the error by the ratio of two eigenvalues
WITHIN = 1e-9  # relative violation of a limit that counts as rounding error


class _UnderconstrainedArrays(NamedTuple):
    """Work arrays for m cables and n free motions."""

    jacobian: Array  # derivatives of balance and given values with respect to motion and tensions, (n + m, n + m)
    step: Array  # residuals, then the step, (n + m,)
    stiffness: Array  # derivative of the cables' wrench with respect to the motion, at constant tensions, (6, 6)
    along: Array  # unit vector of the tension level, (m,)
    sag_force: Array  # sag forces [N], (m,)
    gram: Array  # J^T J (m, m), then a work row
    work: Array  # (m, m)
    motion: Array  # (6,)
    moved: Array  # (POSE_COLUMNS,)
    tau: Array  # chord tensions [N], (m,)
    given: Indices  # codes of the given values of the present search, (m,)


class _Search(NamedTuple):
    """Search for the equilibrium of one pose."""

    limits: TensionLimits
    platform: statics.Platform  # platform at the pose with the given values
    curves: Curves
    balance: statics.Balance
    level: float  # tension level [N]
    lever: float  # mean lever arm of the platform ends [m]
    pose: Array  # present pose, (POSE_COLUMNS,)
    blocking: Flags  # True for cables whose limits the equilibrium violates, (m,)


@glue
def _new_underconstrained_arrays(memory: Memory, m: int, n: int) -> tuple[_UnderconstrainedArrays, Memory]:
    """Work arrays, and the remaining memory."""
    jacobian, memory = block(memory, n + m, n + m)
    step, memory = vector(memory, n + m)
    stiffness, memory = block(memory, 6, 6)
    vectors, memory = block(memory, 3, m)
    gram, memory = block(memory, m, m)
    work, memory = block(memory, m, m)
    motion, memory = vector(memory, 6)
    moved, memory = vector(memory, tables.POSE_COLUMNS)
    given, memory = counters(memory, m)
    return _UnderconstrainedArrays(
        jacobian, step, stiffness, vectors[0], vectors[1], gram, work, motion, moved, vectors[2], given
    ), memory


@glue
def _mean_lever(geometry: Array) -> float:
    """Root mean square distance of the platform ends from the center of mass [m]; 1 if all ends are at this center."""
    square = 0.0
    for i in range(geometry.shape[1]):
        x, y, z = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        square += x * x + y * y + z * z
    return math.sqrt(square / geometry.shape[1]) if square > 0.0 else 1.0


@glue
def _fill_gram(freedom: Array, matrix: Array, lever: float, gram: Array) -> None:
    """Fill J^T J (m, m) with moments divided by `lever`, and a small number (ridge) added to the diagonal."""
    m = gram.shape[0]
    trace = 0.0
    for i in range(m):
        for j in range(m):
            gram[i, j] = 0.0
            for k in range(matrix.shape[0]):
                unit = 1.0 / (lever * lever) if statics.is_rotation(freedom, k) else 1.0
                gram[i, j] += unit * matrix[k, i] * matrix[k, j]
        trace += gram[i, i]
    for i in range(m):
        gram[i, i] += RIDGE * trace


@glue
def _fill_tension_level(gram: Array, work: Array, along: Array) -> None:
    """Fill the unit vector (m,) of the tensions with the smallest wrench, with a positive first large entry."""
    m = along.size
    for i in range(m):
        along[i] = (1.0 + 0.1 * i) * (1.0 if i % 2 == 0 else -1.0)
    for _ in range(ITERATIONS):  # the vector grows by at most the factor 1/RIDGE in each iteration
        for i in range(m):
            copy(gram[i], work[i])
        solve_general(work, along)
    square, size = dot(along, along), math.nan
    for i in range(m):
        if math.isnan(size) and along[i] * along[i] > 0.1 * square / m:
            size = math.copysign(1.0 / math.sqrt(square), along[i])
    for i in range(m):
        along[i] *= size


@glue
def _fill_first_tensions(freedom: Array, lever: float, balance: statics.Balance, gram: Array, tau: Array) -> None:
    """Fill tensions whose wrench is close to the needed wrench. Each tension is at least a small part of the load."""
    m = tau.size
    square, _moment = statics.squares_along(freedom, balance.right)
    for i in range(m):
        tau[i] = 0.0
        for k in range(balance.right.size):
            unit = 1.0 / (lever * lever) if statics.is_rotation(freedom, k) else 1.0
            tau[i] += unit * balance.matrix[k, i] * balance.right[k]
    solve_general(gram, tau)
    for i in range(m):
        tau[i] = max(tau[i], FLOOR * math.sqrt(square) / m)


@glue
def _fill_stiffness(cables: Cables, geometry: Array, stiffness: Array) -> None:
    """Fill the derivative of the cables' wrench with respect to the motion at constant tensions, (6, 6)."""
    # The motion is the displacement of the center of mass, then the rotation about it. The sag force is proportional to
    # the chord.
    stiffness[:] = 0.0
    for i in range(cables.tau.size):
        ux = -geometry[g.COSINE, i] * geometry[g.AZIMUTH_X, i]
        uy = -geometry[g.COSINE, i] * geometry[g.AZIMUTH_Y, i]
        uz = -geometry[g.SINE, i]
        x, y, z = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        scale, weight = cables.tau[i] / cables.chord[i], cables.sag_force[i] / cables.chord[i]
        fx, fy, fz = cables.tau[i] * ux, cables.tau[i] * uy, cables.tau[i] * uz - cables.sag_force[i]
        for b in range(6):  # motion of the platform end
            mx = 1.0 if b == 0 else z if b == 4 else -y if b == 5 else 0.0
            my = 1.0 if b == 1 else x if b == 5 else -z if b == 3 else 0.0
            mz = 1.0 if b == 2 else y if b == 3 else -x if b == 4 else 0.0
            near = ux * mx + uy * my + uz * mz
            dx, dy, dz = scale * (ux * near - mx), scale * (uy * near - my), scale * (uz * near - mz) + weight * near
            turn = 1.0 if b >= 3 else 0.0  # the rotation also turns the lever arm
            stiffness[0, b] += dx
            stiffness[1, b] += dy
            stiffness[2, b] += dz
            stiffness[3, b] += y * dz - z * dy + turn * (my * fz - mz * fy)
            stiffness[4, b] += z * dx - x * dz + turn * (mz * fx - mx * fz)
            stiffness[5, b] += x * dy - y * dx + turn * (mx * fy - my * fx)


@glue
def _fill_system(search: _Search, space: _UnderconstrainedArrays) -> None:
    """Fill Jacobian and residuals of the balance and of the given values."""
    platform, balance, cables, given = search.platform, search.balance, search.curves.cables, space.given
    pose, start, level = search.pose, platform.pose, search.level
    freedom, jacobian, step = platform.freedom, space.jacobian, space.step
    n, m = balance.matrix.shape
    _fill_stiffness(cables, balance.geometry, space.stiffness)
    statics.matrix_along(freedom, space.stiffness, jacobian)
    for k in range(n):
        step[k] = balance.right[k]
        for i in range(m):
            jacobian[k, n + i] = balance.matrix[k, i]
            step[k] -= balance.matrix[k, i] * cables.tau[i]
    center = statics.turned(
        pose, platform.body[tables.CENTER_X], platform.body[tables.CENTER_Y], platform.body[tables.CENTER_Z]
    )
    forward = statics.turned(pose, 1.0, 0.0, 0.0)
    wanted = statics.turned(start, 1.0, 0.0, 0.0)
    for c in range(m):
        for i in range(m):
            jacobian[n + c, n + i] = space.along[i] if given[c] == codes.LEVEL else 0.0
        space.motion[:] = 0.0
        if given[c] == codes.LEVEL:
            step[n + c] = level
            for i in range(m):
                step[n + c] -= space.along[i] * cables.tau[i]
        elif given[c] == codes.YAW:
            level_square = forward[0] * forward[0] + forward[1] * forward[1]
            space.motion[3] = -forward[0] * forward[2] / level_square
            space.motion[4] = -forward[1] * forward[2] / level_square
            space.motion[5] = 1.0
            step[n + c] = math.atan2(
                forward[0] * wanted[1] - forward[1] * wanted[0], forward[0] * wanted[0] + forward[1] * wanted[1]
            )
        else:  # displacement of the origin: displacement of the center of mass - rotation x center
            space.motion[given[c]] = 1.0
            if given[c] == 0:
                space.motion[4], space.motion[5] = -center[2], center[1]
            elif given[c] == 1:
                space.motion[3], space.motion[5] = center[2], -center[0]
            else:
                space.motion[3], space.motion[4] = -center[1], center[0]
            step[n + c] = start[given[c]] - pose[given[c]]
        statics.components_along(freedom, space.motion, jacobian[n + c])


@glue
def _take_step(search: _Search, space: _UnderconstrainedArrays, floor: float) -> tuple[float, bool]:
    """Move pose and tensions by the shortened step. Returns the step size, and True if a tension is too small."""
    # `floor`: smallest tension of a cable, relative to its smallest admissible tension. `search.blocking` is filled:
    # True for the cables that the step would take below this tension.
    platform, cables, pose, tau = search.platform, search.curves.cables, search.pose, space.tau
    freedom, step, n = platform.freedom, space.step, platform.freedom.shape[0]
    shift, square = statics.squares_along(freedom, step)
    turn = math.sqrt(square)
    size = max(turn, math.sqrt(shift) / search.lever)
    share = TURN / turn if turn > TURN else 1.0
    for k in range(step.size):
        step[k] *= share
    statics.step_pose(freedom, platform.body, pose, step[:n], space.motion, space.moved)
    copy(space.moved, pose)
    short = False
    for i in range(tau.size):
        size = max(size, abs(step[n + i]) / tau[i])
        wanted = max(tau[i] + step[n + i], SHRINK * tau[i])
        least = floor * cables.low[i]
        search.blocking[i] = wanted < least * (1.0 - WITHIN)
        short = short or search.blocking[i]
        tau[i] = max(wanted, least)
    return size, short


@glue
def _find_equilibrium(search: _Search, space: _UnderconstrainedArrays) -> int:
    """Take Newton steps until the balance holds. Returns POSE_SOLVED or the failure."""
    # The pose of `search` and the tensions of `space` contain the initial values, and at the end the last values. Steps
    # that stop at a smallest admissible tension can miss an equilibrium slightly above it; the search continues below.
    model, cables, tau = search.curves.model, search.curves.cables, space.tau
    status = codes.POSE_NO_EQUILIBRIUM
    waited, floor = 0, 1.0
    for step in range(STEPS):
        if not statics.place_platform(model, search.limits, search.platform, search.pose, cables, search.balance):
            break
        sag_forces_at(search.curves, tau, space.sag_force)
        statics.fill_needed_wrench(search.platform, cables, search.balance)
        if status == codes.POSE_SOLVED:  # the arrays of the cables belong to the last step
            break
        _fill_system(search, space)
        if not solve_general(space.jacobian, space.step):
            return codes.POSE_SINGULAR
        size, short = _take_step(search, space, floor)
        waited = waited + 1 if short else 0
        if waited == PATIENCE:
            if floor == BELOW:
                return codes.POSE_INFEASIBLE
            waited, floor = 0, BELOW
        if size != size:
            break
        if size <= CONVERGED and step < STEPS - 1:
            status = codes.POSE_SOLVED
    infeasible = False
    for i in range(tau.size):
        outside = tau[i] > cables.high[i] * (1.0 + WITHIN) or tau[i] < cables.low[i] * (1.0 - WITHIN)
        search.blocking[i] = outside and status == codes.POSE_SOLVED
        infeasible = infeasible or search.blocking[i]
    return codes.POSE_INFEASIBLE if infeasible else status


@glue
def _solve_in_stages(search: _Search, space: _UnderconstrainedArrays, given: Indices, level_first: bool) -> int:
    """Find the equilibrium with the `given` values, after the one with the level instead of the yaw if `level_first`.

    Returns POSE_SOLVED or the failure.
    """
    status = codes.POSE_SOLVED
    for stage in range(0 if level_first else 1, 2):
        if status == codes.POSE_SOLVED:
            for i in range(given.size):
                space.given[i] = codes.LEVEL if stage == 0 and given[i] == codes.YAW else given[i]
            status = _find_equilibrium(search, space)
    return status


@glue
def _contains(given: Indices, code: int) -> bool:
    """True if `code` is one of the given values."""
    found = False
    for i in range(given.size):
        found = found or given[i] == code
    return found


@entry
def underconstrained_poses(
    model_terms: inverse.ModelTerms,
    limit_terms: inverse.LimitTerms,
    robot_terms: inverse.Robots,
    starts: Array,
    wrenches: Array,
    given: Indices,
    level: float,
    chained: bool,
    memory: tuple[Array, Indices],
    answers: inverse.Answers,
    poses: Array,
    blocking: Flags,
    first: int,
    last: int,
) -> None:
    """Solve part of a batch of platforms with fewer cables than degrees of freedom."""
    # The arguments are the same as in `inverse_poses`, with m < n, and:
    # `starts`: rows with the given coordinates, (N, POSE_COLUMNS); their other coordinates are initial values. `given`:
    # codes of the given values, (m,): 0, 1 and 2 for coordinates of the origin, YAW, LEVEL. `level`: tension level [N],
    # component of the chord tensions along a unit vector: the tensions with the smallest wrench at the initial pose.
    # `chained`: True to start each pose at rotation and tensions of the previous pose. `poses`: filled with the poses;
    # a pose without a solution is the start. `blocking`: filled, (N, m): cables with violated limits.
    limits = TensionLimits(*limit_terms)
    freedom, _bodies, robots = robot_terms
    results, statuses, residuals, needed, pose_statuses = answers
    m, n = statuses.shape[1], freedom.shape[0]
    cables, rest = new_cables(Memory(*memory), m, robots_have_machine(robots))
    balance, rest = statics.new_balance(rest, m, n)
    space, rest = _new_underconstrained_arrays(rest, m, n)
    # Without a level, the tensions must turn the platform to its yaw. The search starts at the solution for level 0.
    has_yaw, has_level = _contains(given, codes.YAW), _contains(given, codes.LEVEL)
    turned_by_tensions = has_yaw and not has_level
    for p in range(first, last):
        platform = inverse.platform_at(robot_terms, starts, wrenches, p)
        model = inverse.model_at(model_terms, platform.body)
        pose = poses[p]
        copy(starts[p], pose)
        statuses[p] = codes.CABLE_SOLVED
        blocking[p] = False
        status = codes.POSE_NO_CHORD
        if statics.place_platform(model, limits, platform, pose, cables, balance):
            lever = _mean_lever(balance.geometry)
            _fill_gram(freedom, balance.matrix, lever, space.gram)
            if has_yaw or has_level:
                _fill_tension_level(space.gram, space.work, space.along)
            statics.fill_needed_wrench(platform, cables, balance)
            follows = chained and p > 0 and pose_statuses[p - 1] == codes.POSE_SOLVED
            _fill_first_tensions(freedom, lever, balance, space.gram, space.sag_force)
            copy(results[tables.TENSION, p - 1] if follows else space.sag_force, space.tau)
            for k in range(3 if follows else pose.size, pose.size):
                pose[k] = poses[p - 1, k]
            curves, _left = new_curves(model, cables, statuses[p], rest)
            search = _Search(limits, platform, curves, balance, level, lever, pose, blocking[p])
            status = _solve_in_stages(search, space, given, turned_by_tensions)
        solved = status == codes.POSE_SOLVED
        if solved:
            inverse.measure_balance(None, platform, cables, balance, residuals[p])
        else:
            residuals[p, inverse.FORCE] = residuals[p, inverse.MOMENT] = math.nan
            copy(starts[p], pose)
        for k in range(n):
            needed[p, k] = balance.right[k] if solved else math.nan
        pose_statuses[p] = status
        inverse.write_solution(solved, model, cables, balance, results, p)
