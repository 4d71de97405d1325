"""Stiffness, sensitivities and stability of platforms in equilibrium."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Codes, Indices
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import copy, extreme_eigenvalues, invert_general, orthogonal_factor, reflect_rows
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import forces_from_lengths
from sagline.kernels.cable.geometry import CABLE_ROWS, cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.stiffness import force_of, force_slopes, plane_of, slopes_over
from sagline.kernels.cable.swivel import DATA, SLOPES, TINY, fill_from_results, moments_of_swivel, slopes_of_swivel
from sagline.kernels.cable.terms import Model, PlaneVector, material_at
from sagline.kernels.forward import platform as f
from sagline.kernels.forward.forward import FLAT
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory, block
from sagline.kernels.statics import matrix_along, symmetric_part

# index of the quantity with respect to which the force is differentiated
BY_LENGTH, BY_DENSITY, BY_STIFFNESS, BY_RADIUS, BY_DEAD = 0, 1, 2, 3, 4
MORE = SLOPES + DATA + 3  # rows of slopes of cables with swivel axes


@formula
def _fill_in_world_axes(pair: PlaneVector, rows: Array, i: int, vector: Array) -> None:
    """Fill `vector` (3,) in world axes from its components `pair` in the plane of cable `i`."""
    vector[0] = pair.x * rows[g.AZIMUTH_X, i]
    vector[1] = pair.x * rows[g.AZIMUTH_Y, i]
    vector[2] = pair.z


@glue
def _describe_cable(
    model: Model, cables: Array, rows: Array, i: int, block: Array, slopes: Array, lever: Array, more: Array
) -> None:
    """Fill `block` (3, 3), `slopes` (DATA, m, 3) and `lever` (3,) of cable `i`, after `platform_stiffness`."""
    # With swivel axes of any direction, `more` (MORE, 5) is filled as well; see `slopes_of_swivel`. For a pulley on the
    # platform, the last rows are those of `moments_of_swivel`.
    across = f.end_stiffness(cables, rows, i)
    for j in range(3):
        block[0, j] = across[0][j]
        block[1, j] = across[1][j]
        block[2, j] = across[2][j]
        lever[j] = rows[g.LEVER_X + j, i]
    if model.behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        sign = -1.0 if f.is_on_platform(cables, i) else 1.0
        slopes_of_swivel(model, cables, rows, i, more[:SLOPES])
        for k in range(DATA):
            for j in range(3):
                slopes[k, i, j] = sign * more[k, j]
        if sign < 0.0:
            moments_of_swivel(model, cables, rows, i, more[SLOPES:, :3])
        return
    span, rise, length = rows[g.SPAN, i], rows[g.RISE, i], rows[g.LENGTH, i]
    material, force, plane = material_at(cables, i), force_of(rows, i), plane_of(rows, i)
    free = length if model.behind is None else rows[g.FREE_LENGTH, i]
    over = slopes_over(model, material, pulley_at(cables, i), free, force, plane)
    own = over if model.behind is not None else force_slopes(model, span, rise, material, length, force, plane)
    _fill_in_world_axes(over.by_radius, rows, i, slopes[BY_RADIUS, i])
    _fill_in_world_axes(over.by_dead, rows, i, slopes[BY_DEAD, i])
    _fill_in_world_axes(own.by_length, rows, i, slopes[BY_LENGTH, i])
    _fill_in_world_axes(own.by_density, rows, i, slopes[BY_DENSITY, i])
    _fill_in_world_axes(own.by_stiffness, rows, i, slopes[BY_STIFFNESS, i])


@formula
def _at_frame_end(
    model: Model, cables: Array, rows: Array, i: int, more: Array
) -> tuple[float, float, float, float, float]:
    """Coefficients of the change of the frame-end tension of cable `i`, after `_describe_cable`."""
    # Three for the change of the force on the platform end, world axes; one for the rise of the platform end [N/m]; one
    # for the change of the length [N/m]. H = T + T^2/(2 EA) - w z is constant along a cable.
    if f.is_on_platform(cables, i):  # the force on the end is the tension at the frame anchor
        x, y, z = rows[g.FORCE_X, i], rows[g.FORCE_Y, i], rows[g.FORCE_Z, i]
        inverse = -1.0 / max(math.sqrt(x * x + y * y + z * z), TINY)
        return inverse * x, inverse * y, inverse * z, 0.0, 0.0
    if model.behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        return more[DATA, 3], more[DATA + 1, 3], more[DATA + 2, 3], 0.0, more[BY_LENGTH, 3]
    horizontal, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
    cx, cy = (rows[g.AZIMUTH_X, i], rows[g.AZIMUTH_Y, i]) if horizontal > 0.0 else (0.0, 0.0)
    x, y = horizontal * cx, horizontal * cy
    density, stiffness = material_at(cables, i)
    weight = 0.0 if model.code == codes.ELASTIC else density * model.gravity
    free = rows[g.LENGTH, i] if model.behind is None else rows[g.FREE_LENGTH, i]
    down = z - weight * free
    leaving = math.sqrt(horizontal * horizontal + down * down)
    inverse = 1.0 / max(leaving, TINY)  # no division by zero for a cable without force
    if model.behind is None:
        return x * inverse, y * inverse, down * inverse, 0.0, -weight * down * inverse
    at_end = math.sqrt(horizontal * horizontal + z * z)
    share = 1.0 / (1.0 + leaving / stiffness)
    along = share * (1.0 + at_end / stiffness) / max(at_end, TINY)
    # derivative of the height of the exit point, R cos psi d(psi)
    radius, entering = pulley_at(cables, i).radius, pulley_at(cables, i).entry
    cosine = rows[g.WRAP_COSINE, i]
    raised = radius * entering * cosine * inverse
    rx, ry, rz = raised * cosine * cx, raised * cosine * cy, -raised * entering * rows[g.WRAP_SINE, i]
    lift = share * weight
    return (
        along * x + lift * rx,
        along * y + lift * ry,
        along * z + lift * rz,
        -lift,
        -lift * weight * rz,
    )


class States(NamedTuple):
    """Output arrays of the first derivatives at N equilibria."""

    matrices: Array  # stiffness of the platform, (N, 6, 6)
    blocks: Array  # stiffness of the platform end of each cable in world axes, (N, m, 3, 3)
    slopes: Array  # derivatives of the force T of each cable with respect to its data, (N, DATA, m, 3)
    levers: Array  # vectors from the center of mass to the platform ends, (N, m, 3)
    forces: Array  # forces T on the platform ends, world axes, (N, m, 3)
    tensions: Array  # derivatives of the frame-end tensions by six motions and the cable's length, (N, m, 7)


@kernel
def _fill_tension_slopes(
    parts: tuple[float, float, float, float, float], block: Array, slope: Array, lever: Array, out: Array
) -> None:
    """Fill the derivatives (7,) of a frame-end tension by the platform motion and by the length of the cable."""
    qx, qy, qz, by_rise, by_length = parts
    x = qx * block[0, 0] + qy * block[1, 0] + qz * block[2, 0]
    y = qx * block[0, 1] + qy * block[1, 1] + qz * block[2, 1]
    z = qx * block[0, 2] + qy * block[1, 2] + qz * block[2, 2] + by_rise
    out[0], out[1], out[2] = x, y, z
    out[3] = lever[1] * z - lever[2] * y
    out[4] = lever[2] * x - lever[0] * z
    out[5] = lever[0] * y - lever[1] * x
    out[6] = qx * slope[0] + qy * slope[1] + qz * slope[2] + by_length


@glue
def describe_pose(
    terms: f.ForwardTerms,
    robots: tuple[Array, Array, Array],
    poses: Array,
    results: Array,
    p: int,
    work: tuple[Array, Array, Array],
    out: States,
) -> bool:
    """Fill the outputs of pose `p`. False, and NaN, for straight cables and for a pose without lengths."""
    code, k_h, k_p, behind = terms
    rotation, rows, more = work
    matrix, slopes = out.matrices[p], out.slopes[p]
    if code == codes.STRAIGHT or math.isnan(results[tables.LENGTH, p, 0]):
        matrix[:] = math.nan
        out.blocks[p] = math.nan
        slopes[:] = math.nan
        out.levers[p] = math.nan
        out.forces[p] = math.nan
        out.tensions[p] = math.nan
        return False
    body, cables = f.row_of(robots[1], p), f.row_of(robots[2], p)
    model = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
    _fill_state(model, cables, body, poses[p], results, p, rotation, rows)
    f.platform_stiffness(model, cables, rows, matrix)
    for i in range(rows.shape[1]):
        block, lever, force = out.blocks[p, i], out.levers[p, i], out.forces[p, i]
        _describe_cable(model, cables, rows, i, block, slopes, lever, more)
        force[0], force[1], force[2] = f.force_on_end(cables, rows, i)
        parts = _at_frame_end(model, cables, rows, i, more)
        own = out.tensions[p, i]
        _fill_tension_slopes(parts, block, slopes[BY_LENGTH, i], lever, own)
        if f.is_on_platform(cables, i):
            for k in range(3):
                for j in range(3):
                    own[3 + k] += own[j] * more[SLOPES + DATA + k, j]
    return True


@entry
def describe_states(
    model: f.ForwardTerms,
    robots: tuple[Array, Array, Array],
    poses: Array,
    results: Array,
    memory: tuple[Array, Indices],
    found: tuple[Array, Array, Array, Array, Array, Array],
) -> None:
    """Stiffness and derivatives of cable forces at N equilibria, NaN for straight cables and for lengths that are NaN.

    The arguments are the same as in `stabilities_of_poses`. `found`: arrays of `States`, which are filled.
    """
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, CABLE_ROWS, results.shape[2])
    more, rest = block(rest, MORE, 5)
    for p in range(poses.shape[0]):
        describe_pose(model, robots, poses, results, p, (rotation, rows, more), States(*found))


SINGULAR = 1e-14  # smallest determinant of a regular matrix that is scaled to diagonal elements of 1


class _Sensitivities(NamedTuple):
    """Output arrays of the sensitivities of N poses, which are those of `sagline.statics.Stiffness`."""

    compliances: Array  # (N, 6, 6)
    by_data: Array  # (N, DATA, 6, m)
    by_frame: Array  # (N, 6, 3 m)
    by_platform: Array  # (N, 6, 3 m)
    tensions: Array  # (N, m, m)
    null: Array  # (N, m, m - n)


@kernel
def invert_scaled(matrix: Array, inverse: Array, scale: Array) -> bool:
    """Fill the `inverse` (n, n) of a matrix that is scaled to diagonal elements of 1. False if it is singular."""
    # Destroys `matrix`; `scale`: work array (n,). Forces and moments get similar magnitudes.
    n = matrix.shape[0]
    for j in range(n):
        scale[j] = 1.0 / math.sqrt(abs(matrix[j, j])) if abs(matrix[j, j]) > 0.0 else 1.0
    for j in range(n):
        for k in range(n):
            matrix[j, k] *= scale[j] * scale[k]
    if not abs(invert_general(matrix, inverse)) >= SINGULAR:
        return False
    for j in range(n):
        for k in range(n):
            inverse[j, k] *= scale[j] * scale[k]
    return True


@kernel
def _fill_compliance(free: Array, stiffness: Array, work: Array, compliance: Array) -> bool:
    """Fill the `compliance` (6, 6): inverse of the stiffness for the free motions. False, and NaN, if it is singular.

    `work`: (2 n + 1, n).
    """
    n = free.shape[0]
    matrix, inverse, scale = work[:n], work[n : 2 * n], work[2 * n]
    matrix_along(free, stiffness, matrix)
    if not invert_scaled(matrix, inverse, scale):
        compliance[:] = math.nan
        return False
    for a in range(6):
        for b in range(6):
            total = 0.0
            if n == 6:
                total = free[a, a] * free[b, b] * inverse[a, b]
            else:
                for j in range(n):
                    for k in range(n):
                        total += free[j, a] * inverse[j, k] * free[k, b]
            compliance[a, b] = total
    return True


@kernel
def _multiply(sign: float, matrix: Array, right: Array, product: Array) -> None:
    """Fill `product` (6, q) with `sign` times `matrix` (6, 6) times `right` (6, q)."""
    for a in range(6):
        c0, c1, c2 = sign * matrix[a, 0], sign * matrix[a, 1], sign * matrix[a, 2]
        c3, c4, c5 = sign * matrix[a, 3], sign * matrix[a, 4], sign * matrix[a, 5]
        for j in range(right.shape[1]):
            product[a, j] = (
                c0 * right[0, j] + c1 * right[1, j] + c2 * right[2, j]
                + (c3 * right[3, j] + c4 * right[4, j] + c5 * right[5, j])
            )  # fmt: skip


@formula
def _fill_wrench(wrenches: Array, j: int, lever: Array, x: float, y: float, z: float) -> None:
    """Fill column `j` of `wrenches` (6, q) with the wrench of the force (`x`, `y`, `z`) at the platform end `lever`."""
    wrenches[0, j] = x
    wrenches[1, j] = y
    wrenches[2, j] = z
    wrenches[3, j] = lever[1] * z - lever[2] * y
    wrenches[4, j] = lever[2] * x - lever[0] * z
    wrenches[5, j] = lever[0] * y - lever[1] * x


@kernel
def _add_turn(wrenches: Array, j: int, turned: Array) -> None:
    """Add the moment that the force of column `j` has because a pulley on the platform rotates with the platform."""
    for k in range(3):
        for a in range(3):
            wrenches[3 + k, j] += turned[DATA + k, a] * wrenches[a, j]


@glue
def _fill_anchors(
    p: int, cables: Array, rotation: Array, state: States, turns: Array, wrenches: Array, out: _Sensitivities
) -> None:
    """Fill the sensitivities to frame anchors and to platform anchors. `wrenches`: (6, 3 m)."""
    compliance = out.compliances[p]
    m = state.levers.shape[1]
    for i in range(m):
        k, lever = state.blocks[p, i], state.levers[p, i]
        for c in range(3):  # a motion da of the frame end acts as -da of the platform end
            _fill_wrench(wrenches, 3 * i + c, lever, k[0, c], k[1, c], k[2, c])
            if f.is_on_platform(cables, i):
                _add_turn(wrenches, 3 * i + c, turns[(DATA + 3) * i : (DATA + 3) * (i + 1)])
    _multiply(1.0, compliance, wrenches, out.by_frame[p])
    for i in range(m):
        force, k, lever = state.forces[p, i], state.blocks[p, i], state.levers[p, i]
        for c in range(3):  # a change db shifts the end of the cable and its force by Q db
            x, y, z = rotation[0, c], rotation[1, c], rotation[2, c]
            _fill_wrench(
                wrenches, 3 * i + c, lever,
                k[0, 0] * x + k[0, 1] * y + k[0, 2] * z,
                k[1, 0] * x + k[1, 1] * y + k[1, 2] * z,
                k[2, 0] * x + k[2, 1] * y + k[2, 2] * z,
            )  # fmt: skip
            if f.is_on_platform(cables, i):
                _add_turn(wrenches, 3 * i + c, turns[(DATA + 3) * i : (DATA + 3) * (i + 1)])
            wrenches[3, 3 * i + c] += y * force[2] - z * force[1]
            wrenches[4, 3 * i + c] += z * force[0] - x * force[2]
            wrenches[5, 3 * i + c] += x * force[1] - y * force[0]
    _multiply(-1.0, compliance, wrenches, out.by_platform[p])


@glue
def _fill_null(free: Array, by_length: Array, matrix: Array, q: Array, diagonals: Array, null: Array) -> None:
    """Fill an orthonormal basis (m, m - n) of the length changes that do not move the platform."""
    n, m = matrix.shape
    for j in range(n):
        for i in range(m):
            total = 0.0
            for a in range(6):
                total += free[j, a] * by_length[a, i]
            matrix[j, i] = total
    reflect_rows(matrix, diagonals)
    orthogonal_factor(matrix, diagonals, q)
    for i in range(m):
        for c in range(m - n):
            null[i, c] = q[i, n + c]


@entry
def sensitivities_of_states(
    model: f.ForwardTerms,
    robots: tuple[Array, Array, Array],
    poses: Array,
    results: Array,
    memory: tuple[Array, Indices],
    states: tuple[Array, Array, Array, Array, Array, Array],
    found: tuple[Array, Array, Array, Array, Array, Array],
) -> None:
    """Sensitivities of the pose and of tensions at N equilibria, NaN at a singular stiffness."""
    # The arguments are the same as in `describe_states`. `found`: arrays of `_Sensitivities`, which are filled.
    n, m = robots[0].shape[0], results.shape[2]
    state, out = States(*states), _Sensitivities(*found)
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, CABLE_ROWS, m)
    more, rest = block(rest, MORE, 5)
    work, rest = block(rest, 2 * n + 1, n)
    wrenches, rest = block(rest, 6, m)
    wide, rest = block(rest, 6, 3 * m)
    diagonals, rest = block(rest, 2, n)
    matrix, rest = block(rest, n, m)
    q, rest = block(rest, m + 1, m)
    turns, rest = block(rest, (DATA + 3) * m, 3)
    for p in range(poses.shape[0]):
        known = describe_pose(model, robots, poses, results, p, (rotation, rows, more), state)
        if not known or not _fill_compliance(robots[0], state.matrices[p], work, out.compliances[p]):
            out.compliances[p] = math.nan
            out.by_data[p] = math.nan
            out.by_frame[p] = math.nan
            out.by_platform[p] = math.nan
            out.tensions[p] = math.nan
            out.null[p] = math.nan
            continue
        cables = f.row_of(robots[2], p)
        placed = Model(model[0], model[1], model[2], f.row_of(robots[1], p)[tables.GRAVITY], model[3])
        for i in range(m):
            if f.is_on_platform(cables, i):
                moments_of_swivel(placed, cables, rows, i, turns[(DATA + 3) * i : (DATA + 3) * (i + 1)])
        for k in range(DATA):
            for i in range(m):
                slope = state.slopes[p, k, i]
                _fill_wrench(wrenches, i, state.levers[p, i], slope[0], slope[1], slope[2])
                if f.is_on_platform(cables, i):
                    turned = turns[(DATA + 3) * i : (DATA + 3) * (i + 1)]
                    _add_turn(wrenches, i, turned)
                    for c in range(3):
                        wrenches[3 + c, i] -= turned[k, c]
            _multiply(-1.0, out.compliances[p], wrenches, out.by_data[p, k])
        _fill_anchors(p, cables, rotation, state, turns, wide, out)
        by_length = out.by_data[p, BY_LENGTH]
        for i in range(m):
            own = state.tensions[p, i]
            for j in range(m):
                total = own[6] if i == j else 0.0
                for a in range(6):
                    total += own[a] * by_length[a, j]
                out.tensions[p, i, j] = total
        if m > n:
            _fill_null(robots[0], by_length, matrix, q, diagonals, out.null[p])


@entry
def compliances_of(free: Array, matrices: Array, memory: tuple[Array, Indices], compliances: Array) -> None:
    """Fill the compliances (N, 6, 6) from the stiffnesses `matrices` (N, 6, 6); NaN if a stiffness is singular."""
    work, _rest = block(Memory(*memory), 2 * free.shape[0] + 1, free.shape[0])
    for p in range(matrices.shape[0]):
        _fill_compliance(free, matrices[p], work, compliances[p])


@entry
def least_stiffnesses(free: Array, matrices: Array, memory: tuple[Array, Indices], least: Array) -> None:
    """Fill the stiffnesses (N,) against a force on the center of mass in the softest direction [N/m]; 0 if unstable."""
    # `matrices`: stiffnesses of the platform, (N, 6, 6), or NaN.
    n = free.shape[0]
    work, rest = block(Memory(*memory), 2 * n + 1, n)
    compliance, rest = block(rest, 6, 6)
    soft, rest = block(rest, 3, 3)
    vectors, rest = block(rest, 3, 6)
    for p in range(matrices.shape[0]):
        matrix, scale = work[:n], work[2 * n]
        symmetric_part(free, matrices[p], matrix)
        for j in range(n):  # makes forces and moments comparable
            scale[j] = 1.0 / math.sqrt(abs(matrix[j, j])) if abs(matrix[j, j]) > 0.0 else 1.0
        lost = False
        for j in range(n):
            for k in range(n):
                lost = lost or math.isnan(matrix[j, k])
                matrix[j, k] *= scale[j] * scale[k]
        least[p] = math.nan if lost else 0.0
        low = 0.0
        if not lost:
            low = extreme_eigenvalues(matrix, vectors[0, :n], vectors[1, :n], vectors[2, :n], math.inf)[0]
        if low > 0.0 and _fill_compliance(free, matrices[p], work, compliance):
            for j in range(3):
                for k in range(3):
                    soft[j, k] = 0.5 * (compliance[j, k] + compliance[k, j])
            least[p] = 1.0 / extreme_eigenvalues(soft, vectors[0, :3], vectors[1, :3], vectors[2, :3], math.inf)[1]


@glue
def _fill_state(
    model: Model, cables: Array, body: Array, pose: Array, results: Array, p: int, rotation: Array, rows: Array
) -> None:
    """Fill geometry, lengths and forces of the cables at a solved pose `p`."""
    cable_geometry(cables, body, pose, rotation, rows)
    if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        copy(results[tables.LENGTH, p], rows[g.LENGTH])
        rows[g.PARAMETER] = math.nan  # a result must not depend on the previous sample
        forces_from_lengths(model, cables, rows, model.behind)
    else:
        _fill_rows(model, cables, results, p, rows)


@glue
def _fill_rows(model: Model, cables: Array, results: Array, p: int, rows: Array) -> None:
    """Fill lengths and forces of the cables at pose `p` of a plan, after `cable_geometry`."""
    for k in range(tables.WRAP - tables.LENGTH):  # length and forces have the same order in both arrays
        copy(results[tables.LENGTH + k, p], rows[g.LENGTH + k])
    if model.behind is not None:
        for i in range(rows.shape[1]):
            rows[g.FREE_SPAN, i] = results[tables.SPAN, p, i]
            rows[g.FREE_RISE, i] = results[tables.RISE, p, i]
            rows[g.WRAP, i] = results[tables.WRAP, p, i]
            rows[g.FREE_LENGTH, i] = rows[g.LENGTH, i] - (results[tables.WRAPPED, p, i] + results[tables.DEAD, p, i])
        for i in range(rows.shape[1]):
            # tension and direction at the exit point; a cable of a shallow model leaves its pulley along the chord
            rows[g.LEAVING, i] = rows[g.TENSION, i]
            rows[g.WRAP_SINE, i] = rows[g.COSINE, i]
            rows[g.WRAP_COSINE, i] = pulley_at(cables, i).entry * rows[g.SINE, i]
            if model.code == codes.CATENARY:
                weight = material_at(cables, i).density * model.gravity
                x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i] - weight * rows[g.FREE_LENGTH, i]
                rows[g.LEAVING, i] = math.sqrt(x * x + z * z)
                rows[g.WRAP_SINE, i] = x / rows[g.LEAVING, i]
                rows[g.WRAP_COSINE, i] = pulley_at(cables, i).entry * z / rows[g.LEAVING, i]


@entry
def stabilities_of_poses(
    terms: f.ForwardTerms,
    robots: tuple[Array, Array, Array],
    poses: Array,
    which: Indices,
    memory: tuple[Array, Indices],
    results: Array,
    pose_statuses: Codes,
) -> None:
    """Decide whether the equilibria of solved poses are stable."""
    # The arguments are the same as in `inverse_poses` and `forward_poses`; `which` (K,) are the indices of the poses.
    # The status of each becomes POSE_SOLVED if every free motion has a positive stiffness, else POSE_UNSTABLE. The
    # stiffness of straight cables is undefined. Poses with straight cables therefore count as solved.
    code, k_h, k_p, behind = terms
    freedom, bodies, tables_of_cables = robots
    n, m = freedom.shape[0], results.shape[2]
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, CABLE_ROWS, m)
    stiffness, rest = block(rest, 6, 6)
    arcs, rest = block(rest, n, 6)
    matrix, rest = block(rest, n, n)
    work, rest = block(rest, 3, n)
    for p in which:
        pose_statuses[p] = codes.POSE_SOLVED
        if code == codes.STRAIGHT:
            continue
        body, cables = f.row_of(bodies, p), f.row_of(tables_of_cables, p)
        model = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
            cable_geometry(cables, body, poses[p], rotation, rows)
            fill_from_results(model, cables, results, p, rows)
        else:
            _fill_state(model, cables, body, poses[p], results, p, rotation, rows)
        f.platform_stiffness(model, cables, rows, stiffness)
        f.fill_arcs(freedom, cables, body, arcs)
        symmetric_part(arcs, stiffness, matrix)
        low, high = extreme_eigenvalues(matrix, work[0], work[1], work[2], FLAT)
        if not low > FLAT * high:
            pose_statuses[p] = codes.POSE_UNSTABLE
