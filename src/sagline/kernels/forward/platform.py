"""The platform on cables with given lengths: data of the forward kernels, wrench on the platform, and stiffness.

A motion is a displacement of the center of mass and a rotation vector in world axes. The rotation of a motion follows
the rotation of the pose. The unbalance, minus the total wrench on the platform, is the gradient of the energy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes
from sagline.kernels import tables
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import forces_from_lengths
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.pulley import is_aboard
from sagline.kernels.cable.stiffness import energy_of_cables, plane_of, stiffnesses_in_plane
from sagline.kernels.cable.swivel import moment_on_platform, turn_of_swivel
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import Triple, add_world_force, is_rotation

UNIT_SHARE = 0.2  # displacement with the same weight as a rotation by 1 rad, relative to the mean length

ForwardTerms = tuple[int, float, float, bool | None]  # code, k_h, k_p; True for pulleys or dead lengths, else None
SampleArrays = tuple[Array, Array, Array, Array, Array, Array]  # arrays from Python: plain tuples are fastest
SolutionArrays = tuple[Array, Array, Codes, Array, Codes]
LastEquilibriumArrays = tuple[Array, Array, Array]


class ForwardSamples(NamedTuple):
    """A batch of N samples to solve."""

    freedom: Array  # rows that select the free motions, (n, 6)
    bodies: Array  # body_table, (1 or N, BODY_COLUMNS)
    robots: Array  # cable_table, (1 or N, m, CABLE_COLUMNS)
    lengths: Array  # unstrained lengths [m], (N, m); a row of NaN is skipped
    starts: Array  # pose rows (1 or N, POSE_COLUMNS)
    wrenches: Array  # external plus inertial wrench, about the center of mass, (1 or N, 6)


class Solutions(NamedTuple):
    """Output arrays of a batch."""

    poses: Array  # pose rows (N, POSE_COLUMNS)
    results: Array  # span, rise, length, T_x, T_z, tau, (RESULT_ROWS, N, m)
    statuses: Codes  # status of each cable, (N, m)
    numbers: Array  # energy, residuals, smallest stiffness, iterations, (N, FORWARD_NUMBERS)
    pose_statuses: Codes  # status of each sample, (N,)


class LastEquilibrium(NamedTuple):
    """Last equilibrium of a sequence of samples, kept between calls; NaN if none exists."""

    rows: Array  # rows of the cables, (CABLE_ROWS, m)
    factor: Array  # Cholesky factor of the stiffness, scaled, (n, n)
    last: Array  # pose and wrench, (LAST_COLUMNS,)


class PoseProblem(NamedTuple):
    """Data for finding one pose: cable model, robot and wrench."""

    model: Model  # cable model
    free: Array  # rows that select the free motions, each times the unit of its motion, (n, 6)
    cables: Array  # rows of the cable_table, (m, CABLE_COLUMNS)
    body: Array  # row of the body_table, (BODY_COLUMNS,)
    wrench: Array  # external plus inertial wrench, about the center of mass, (6,)
    unit: float  # norm of the units; a force times this norm is comparable to components along the free motions


class ForwardArrays(NamedTuple):
    """Working memory for m cables and n free motions, filled by `unbalance` and `platform_stiffness`."""

    rows: Array  # (CABLE_ROWS, m)
    rotation: Array  # (3, 3)
    gradient: Array  # (6,)
    stiffness: Array  # (6, 6)
    matrix: Array  # (n, n)
    factor: Array  # (n, n)
    part: Array  # (n,)
    step: Array  # (n,)
    motion: Array  # (6,)
    trial: Array  # (7,)


@glue
def new_forward_arrays(memory: Memory, rows: Array, factor: Array) -> tuple[ForwardArrays, Memory]:
    """Work arrays, and the remaining memory. `rows` and `factor` keep their content between calls."""
    n = factor.shape[0]
    rotation, memory = block(memory, 3, 3)
    gradient, memory = vector(memory, 6)
    stiffness, memory = block(memory, 6, 6)
    matrix, memory = block(memory, n, n)
    part, memory = vector(memory, n)
    step, memory = vector(memory, n)
    motion, memory = vector(memory, 6)
    trial, memory = vector(memory, tables.POSE_COLUMNS)
    return ForwardArrays(rows, rotation, gradient, stiffness, matrix, factor, part, step, motion, trial), memory


@glue
def new_motions(memory: Memory, n: int) -> tuple[Array, Array, Array, Array]:
    """Memory for the free motions (n, 6) in units of steps and in units of stiffness, and for two pose rows."""
    free, memory = block(memory, n, 6)
    arcs, memory = block(memory, n, 6)
    poses, memory = block(memory, 2, tables.POSE_COLUMNS)
    return free, arcs, poses[0], poses[1]


@glue
def row_of(array: Array, p: int) -> Array:
    """Row `p` of an array with N rows, or the only row of an array with one row."""
    return array[min(p, array.shape[0] - 1)]


@glue
def problem_at(model: Model, given: ForwardSamples, p: int, free: Array, arcs: Array) -> PoseProblem:
    """Problem of sample `p` of a batch. The cable model gets the gravity of the robot. Fills the free motions."""
    body, cables = row_of(given.bodies, p), row_of(given.robots, p)
    placed = Model(model.code, model.k_h, model.k_p, body[tables.GRAVITY], model.behind)
    unit = _fill_free(given.freedom, given.lengths[p], free)
    fill_arcs(given.freedom, cables, body, arcs)
    return PoseProblem(placed, free, cables, body, row_of(given.wrenches, p), unit)


@kernel
def _fill_free(freedom: Array, lengths: Array, free: Array) -> float:
    """Fill the free motions in the units of steps, (n, 6). Returns the norm of the units."""
    m = lengths.shape[0]
    total = 0.0
    for i in range(m):
        total += lengths[i]
    units = 0.0
    for j in range(freedom.shape[0]):
        unit = 1.0 if is_rotation(freedom, j) else UNIT_SHARE * total / m
        units += unit * unit
        for a in range(6):
            free[j, a] = freedom[j, a] * unit
    return math.sqrt(units)


@kernel
def fill_arcs(freedom: Array, cables: Array, body: Array, arcs: Array) -> None:
    """Fill the free motions in the units for comparing stiffnesses, (n, 6)."""
    # A rotation is measured by its arc at the root mean square distance of the platform ends from the center of mass,
    # so that every stiffness is in N/m.
    m = cables.shape[0]
    square = 0.0
    for i in range(m):
        for k in range(3):
            lever = cables[i, tables.PLATFORM_X + k] - body[tables.CENTER_X + k]
            square += lever * lever
    radius = math.sqrt(square / m)
    for j in range(freedom.shape[0]):
        arc = 1.0 / radius if is_rotation(freedom, j) and radius > 0.0 else 1.0
        for a in range(6):
            arcs[j, a] = freedom[j, a] * arc


@glue
def clear_solution(found: Solutions, p: int, status: int, cable_status: int) -> None:
    """Fill the arrays of a sample `p` that has no result: NaN as values, zero iterations, and the statuses."""
    found.poses[p] = math.nan
    found.statuses[p] = cable_status
    for row in range(found.results.shape[0]):
        found.results[row, p] = math.nan
    found.numbers[p] = math.nan
    found.numbers[p, tables.ITERATIONS] = 0.0
    found.pose_statuses[p] = status


Six = tuple[float, float, float, float, float, float]


@kernel
def unbalance(
    model: Model, cables: Array, body: Array, wrench: Array, pose: Array, rotation: Array, rows: Array, gradient: Array
) -> float:
    """Fill rotation, geometry, cable forces and statuses at `pose`, and the unbalance `gradient` (6,)."""
    # The rows must contain the lengths. Returns the sum of the tensions and the platform's weight [N]: the reference of
    # a relative unbalance.
    cable_geometry(cables, body, pose, rotation, rows)
    forces_from_lengths(model, cables, rows, model.behind)
    weight = body[tables.MASS] * model.gravity
    for k in range(6):
        gradient[k] = -wrench[k]
    gradient[2] += weight
    size = weight + abs(wrench[0]) + abs(wrench[1]) + abs(wrench[2])
    for i in range(cables.shape[0]):
        x, y, z = force_on_end(cables, rows, i)
        add_world_force(rows, i, (x, y, z), gradient)
        if is_on_platform(cables, i):
            x, y, z = moment_on_platform(model, cables, rows, i)
            gradient[3] -= x
            gradient[4] -= y
            gradient[5] -= z
        size += rows[g.HORIZONTAL, i] + abs(rows[g.VERTICAL, i])
    return size


@formula
def is_on_platform(cables: Array, i: int) -> bool:
    """True if the pulley of cable `i` is on the platform."""
    return tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS and is_aboard(cables, i)


@formula
def force_on_end(cables: Array, rows: Array, i: int) -> Triple:
    """Derivative of the energy of cable `i` by a displacement of its platform end, world axes [N]."""
    # With the pulley on the platform, all weight of the cable is part of the platform's weight; docs/model.md, 10.11.
    size = -rows[g.HORIZONTAL, i] if is_on_platform(cables, i) else rows[g.HORIZONTAL, i]
    up = -rows[g.VERTICAL, i] if is_on_platform(cables, i) else rows[g.VERTICAL, i]
    return size * rows[g.AZIMUTH_X, i], size * rows[g.AZIMUTH_Y, i], up


@formula
def add_force(rows: Array, i: int, horizontal: float, vertical: float, wrench: Array) -> None:
    """Add to `wrench` (6,) a force at the platform end of cable `i`, in the cable's plane."""
    add_world_force(rows, i, (horizontal * rows[g.AZIMUTH_X, i], horizontal * rows[g.AZIMUTH_Y, i], vertical), wrench)


@kernel
def platform_energy(
    model: Model, cables: Array, body: Array, wrench: Array, pose: Array, rotation: Array, rows: Array
) -> tuple[float, float]:
    """Energy [J] after `unbalance` at the pose, and the sum of the magnitudes of its terms (a measure of rounding)."""
    # The terms are the energies of cables, weight and given force. The result is NaN if the cable model has no energy.
    # A given moment, which is constant in world axes, has no potential energy. A given moment is therefore not
    # included.
    energy, size = energy_of_cables(model, cables, rows, model.behind)
    for k in range(3):
        center = pose[k]
        for j in range(3):
            center += rotation[k, j] * body[tables.CENTER_X + j]
        given = wrench[k] - (body[tables.MASS] * model.gravity if k == 2 else 0.0)
        energy -= given * center
        size += abs(given * center)
    return energy, size


@formula
def end_stiffness(cables: Array, rows: Array, i: int) -> tuple[Triple, Triple, Triple]:
    """Stiffness of cable `i` at its platform end in world axes [N/m]: nine numbers, row by row."""
    if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        return (
            (rows[g.W_XX, i], rows[g.W_XY, i], rows[g.W_XZ, i]),
            (rows[g.W_XY, i], rows[g.W_YY, i], rows[g.W_YZ, i]),
            (rows[g.W_XZ, i], rows[g.W_YZ, i], rows[g.W_ZZ, i]),
        )
    xx, xz, zx, zz = plane_of(rows, i)
    across = rows[g.ACROSS, i]
    c, s = rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]
    mixed = (xx - across) * c * s
    return (
        (xx * c * c + across * s * s, mixed, xz * c),
        (mixed, xx * s * s + across * c * c, xz * s),
        (zx * c, zx * s, zz),
    )


@formula
def _add_row(target: Array, share: float, row: Six) -> None:
    """Add `share` times the six numbers `row` to `target` (6,)."""
    target[0] += share * row[0]
    target[1] += share * row[1]
    target[2] += share * row[2]
    target[3] += share * row[3]
    target[4] += share * row[4]
    target[5] += share * row[5]


@kernel
def platform_stiffness(model: Model, cables: Array, rows: Array, stiffness: Array) -> None:
    """Fill the derivative (6, 6) of the unbalance after `unbalance`: the sum of elastic, sag and geometric stiffness.

    The skew part of the stiffness is half the moment of the cable forces. This part is zero in equilibrium without a
    given moment.
    """
    stiffnesses_in_plane(model, cables, rows, model.behind)
    stiffness[:] = 0.0
    for i in range(cables.shape[0]):
        (kxx, kxy, kxz), (kyx, kyy, kyz), (kzx, kzy, kzz) = end_stiffness(cables, rows, i)
        x, y, z = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
        # a rotation about an axis e moves the platform end by e x r
        by_x = (kxx, kxy, kxz, kxz * y - kxy * z, kxx * z - kxz * x, kxy * x - kxx * y)
        by_y = (kyx, kyy, kyz, kyz * y - kyy * z, kyx * z - kyz * x, kyy * x - kyx * y)
        by_z = (kzx, kzy, kzz, kzz * y - kzy * z, kzx * z - kzz * x, kzy * x - kzx * y)
        _add_row(stiffness[0], 1.0, by_x)
        _add_row(stiffness[1], 1.0, by_y)
        _add_row(stiffness[2], 1.0, by_z)
        _add_row(stiffness[3], y, by_z)
        _add_row(stiffness[3], -z, by_y)
        _add_row(stiffness[4], z, by_x)
        _add_row(stiffness[4], -x, by_z)
        _add_row(stiffness[5], x, by_y)
        _add_row(stiffness[5], -y, by_x)
        # a constant force while r turns: r T^T - (r.T) 1
        tx, ty, tz = force_on_end(cables, rows, i)
        stiffness[3, 3] -= y * ty + z * tz
        stiffness[3, 4] += x * ty
        stiffness[3, 5] += x * tz
        stiffness[4, 3] += y * tx
        stiffness[4, 4] -= x * tx + z * tz
        stiffness[4, 5] += y * tz
        stiffness[5, 3] += z * tx
        stiffness[5, 4] += z * ty
        stiffness[5, 5] -= x * tx + y * ty
        if is_on_platform(cables, i) and rows[g.LEAVING, i] > 0.0:
            _add_turns(model, cables, rows, i, stiffness)


@kernel
def _add_turns(model: Model, cables: Array, rows: Array, i: int, stiffness: Array) -> None:
    """Add the part of the stiffness due to the rotation of a pulley with the platform."""
    (kxx, kxy, kxz), (kyx, kyy, kyz), (kzx, kzy, kzz) = end_stiffness(cables, rows, i)
    x, y, z = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
    along_x, by_x = turn_of_swivel(model, cables, rows, i, (1.0, 0.0, 0.0))
    along_y, by_y = turn_of_swivel(model, cables, rows, i, (0.0, 1.0, 0.0))
    along_z, by_z = turn_of_swivel(model, cables, rows, i, (0.0, 0.0, 1.0))
    for a in range(3):
        ex, ey, ez = along_x if a == 0 else along_y if a == 1 else along_z
        mx, my, mz = by_x if a == 0 else by_y if a == 1 else by_z
        fx, fy, fz = kxx * ex + kxy * ey + kxz * ez, kyx * ex + kyy * ey + kyz * ez, kzx * ex + kzy * ey + kzz * ez
        force = (fx, fy, fz, y * fz - z * fy, z * fx - x * fz, x * fy - y * fx)
        _add_row(stiffness[3 + a], 1.0, force)
        for k in range(6):
            stiffness[k, 3 + a] += force[k]
        stiffness[3, 3 + a] += along_x[0] * fx + along_x[1] * fy + along_x[2] * fz - mx
        stiffness[4, 3 + a] += along_y[0] * fx + along_y[1] * fy + along_y[2] * fz - my
        stiffness[5, 3 + a] += along_z[0] * fx + along_z[1] * fy + along_z[2] * fz - mz
