"""Derivatives of the readings of one pose with respect to every unknown: directly, and through platform motion."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.factors import solve_lower, solve_upper
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.stiffness import force_of, force_slopes, plane_of, slopes_over
from sagline.kernels.cable.swivel import DATA, SLOPES, moments_of_swivel, slopes_of_swivel
from sagline.kernels.cable.terms import Model, PlaneVector, material_at
from sagline.kernels.calibration import kinds
from sagline.kernels.calibration.terms import TURNS, CalibrationArrays, Sensing, Unknowns, is_level
from sagline.kernels.forward.platform import end_stiffness, force_on_end, is_on_platform
from sagline.kernels.jit import formula, glue, kernel
from sagline.kernels.statics import Triple, components_along, fill_motion_of_components, is_rotation


class _FrameEndSlopes(NamedTuple):
    """Frame-end tension and its derivatives. All except `along` and `up` hold at a constant platform-end force."""

    tension: float  # T_A [N]
    along: float  # derivative with respect to the horizontal part of the platform-end force, in the cable's plane
    up: float  # derivative with respect to the vertical part of this force
    by_height: float  # derivative with respect to the height of the platform end above the frame anchor [N/m]
    by_length: float  # derivative with respect to the length [N/m]
    by_density: float  # derivative with respect to the density [N m/kg]
    by_stiffness: float  # derivative with respect to EA
    by_radius: float  # derivative with respect to the pulley radius [N/m]
    by_dead: float  # derivative with respect to the dead length [N/m]


@formula
def _frame_end_slopes(model: Model, cables: Array, rows: Array, i: int) -> _FrameEndSlopes:
    """Derivatives of the frame-end tension of cable `i`, from its forces, or zero if its frame-end tension is zero."""
    material = material_at(cables, i)
    gravity = model.gravity if model.code == codes.CATENARY else 0.0
    weight = material.density * gravity
    x, z = rows[g.HORIZONTAL, i], rows[g.VERTICAL, i]
    if model.behind is None:
        length = rows[g.LENGTH, i]
        at_frame = z - weight * length
        tension = math.sqrt(x * x + at_frame * at_frame)
        share = 1.0 / tension if tension > 0.0 else 0.0
        along, up = x * share, at_frame * share
        return _FrameEndSlopes(tension, along, up, 0.0, -up * weight, -up * gravity * length, 0.0, 0.0, 0.0)
    # T + T^2/(2 EA) - w z is equal at the platform end and at the exit point P, which moves on the pulley
    stiffness, pulley = material.stiffness, pulley_at(cables, i)
    leaving, free = rows[g.LEAVING, i], rows[g.FREE_LENGTH, i]
    end = math.sqrt(x * x + z * z)
    if not (leaving > 0.0 and end > 0.0):
        return _FrameEndSlopes(leaving, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    sine, cosine, entry = rows[g.WRAP_SINE, i], rows[g.WRAP_COSINE, i], pulley.entry
    strained = 1.0 + leaving / stiffness
    share = 1.0 / strained
    grown = (1.0 + end / stiffness) / end * share
    lifted = weight * pulley.radius * entry * cosine * share  # derivative with respect to the wrap angle
    turned_x, turned_z = cosine / leaving, -entry * sine / leaving  # derivative of psi with respect to the force at P
    rise = rows[g.FREE_RISE, i]
    return _FrameEndSlopes(
        leaving,
        grown * x + lifted * turned_x,
        grown * z + lifted * turned_z,
        -weight * share,
        -lifted * turned_z * weight,
        -(rise * share + lifted * turned_z * free) * gravity,
        0.5 * (leaving * leaving - end * end) / (stiffness * stiffness) * share,
        weight * entry * sine * share + lifted * turned_z * weight * rows[g.WRAP, i] / strained,
        lifted * turned_z * weight / strained,
    )


@formula
def cross(a: Triple, b: Triple) -> Triple:
    """Cross product a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@formula
def unit_vector(axis: int) -> Triple:
    """Unit vector along an axis."""
    return 1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0


@formula
def _column_of(matrix: Array, k: int) -> Triple:
    """Column `k` of a matrix (3, 3)."""
    return matrix[0, k], matrix[1, k], matrix[2, k]


@formula
def in_axes(axes: Array, vector: Triple) -> Triple:
    """Components of a world vector along the columns of `axes`, (3, 3)."""
    return (
        axes[0, 0] * vector[0] + axes[1, 0] * vector[1] + axes[2, 0] * vector[2],
        axes[0, 1] * vector[0] + axes[1, 1] * vector[1] + axes[2, 1] * vector[2],
        axes[0, 2] * vector[0] + axes[1, 2] * vector[1] + axes[2, 2] * vector[2],
    )


@formula
def opposite(vector: Triple) -> Triple:
    """The vector with opposite sign."""
    return -vector[0], -vector[1], -vector[2]


@formula
def plus(a: Triple, b: Triple) -> Triple:
    """Sum of two vectors."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@glue
def _fill_motion_by_wrench(free: Array, wrench: Array, space: CalibrationArrays, motion: Array) -> None:
    """Fill the `motion` of the platform due to `wrench` on the platform. The stiffness must be factored."""
    components_along(free, wrench, space.part)
    solve_lower(space.factor, space.part)
    solve_upper(space.factor, space.part)
    fill_motion_of_components(free, space.part, motion)


@formula
def _fill_length(space: CalibrationArrays, i: int, force: Triple, moment: Triple, direct: float) -> None:
    """Fill the derivatives of the platform wrench and of all readings with respect to the length of cable `i`."""
    for k in range(3):
        space.by_wrench[i, k], space.by_wrench[i, 3 + k] = force[k], moment[k]
    for j in range(space.moved.shape[0]):
        total = 0.0
        for k in range(6):
            total -= space.moved[j, k] * space.by_wrench[i, k]
        space.by_length[i, j] = total
    space.by_length[i, i] += direct


@glue
def add_motion(space: CalibrationArrays) -> None:
    """Add the change of readings due to platform motion. The wrench changes in the columns cause this motion."""
    for j in range(space.work.shape[0]):
        for k in range(6):
            share = space.moved[j, k]
            for q in range(space.work.shape[1]):
                space.work[j, q] -= share * space.wrench[k, q]


@glue
def fill_motion(free: Array, space: CalibrationArrays, motion: Array) -> None:
    """Fill the platform motions: row i per meter of cable i, and the last row per unit of the first unknown."""
    m = space.by_wrench.shape[0]
    for k in range(6):
        space.six[k] = space.wrench[k, 0]
    for i in range(m + 1):
        _fill_motion_by_wrench(free, space.by_wrench[i] if i < m else space.six, space, motion[i])
        for k in range(6):
            motion[i, k] = -motion[i, k]


@formula
def _lever_of(rows: Array, i: int) -> Triple:
    """Lever from the center of mass to the platform end of cable `i`."""
    return rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]


@formula
def _moment_of(cables: Array, space: CalibrationArrays, i: int, force: Triple) -> Triple:
    """Moment about the center of mass of a change of the force on the platform end of cable `i`."""
    moment = cross(_lever_of(space.rows, i), force)
    if is_on_platform(cables, i):  # its pulley rotates with the platform
        turns = space.turns[TURNS * i + DATA : TURNS * i + TURNS]
        moment = plus(
            moment,
            (
                turns[0, 0] * force[0] + turns[0, 1] * force[1] + turns[0, 2] * force[2],
                turns[1, 0] * force[0] + turns[1, 1] * force[1] + turns[1, 2] * force[2],
                turns[2, 0] * force[0] + turns[2, 1] * force[1] + turns[2, 2] * force[2],
            ),
        )
    return moment


@formula
def _change_by_data(cables: Array, space: CalibrationArrays, i: int, k: int) -> tuple[Triple, Triple, float]:
    """Changes by the data `k` of a cable with a swivel axis: force on its end, moment, and tension at a fixed force."""
    slopes = space.slopes[SLOPES * i + k]
    force, alone, own = (slopes[0], slopes[1], slopes[2]), slopes[3], (0.0, 0.0, 0.0)
    if is_on_platform(cables, i):  # the tension is the force on the frame end
        turns = space.turns[TURNS * i + k]
        force, alone, own = opposite(force), 0.0, (-turns[0], -turns[1], -turns[2])
    return force, plus(_moment_of(cables, space, i, force), own), alone


@formula
def _force_by_motion(ends: Array, i: int, vector: Triple) -> Triple:
    """Change of the force of cable `i` due to the motion `vector` of its platform end."""
    return (
        ends[i, 0] * vector[0] + ends[i, 1] * vector[1] + ends[i, 2] * vector[2],
        ends[i, 3] * vector[0] + ends[i, 4] * vector[1] + ends[i, 5] * vector[2],
        ends[i, 6] * vector[0] + ends[i, 7] * vector[1] + ends[i, 8] * vector[2],
    )


@formula
def _tension_by_motion(ends: Array, i: int, shares: Array) -> Triple:
    """Change of the frame-end tension per horizontal motion of the platform end: K^T times the derivatives by force."""
    x, y, z = shares[i, 0], shares[i, 1], shares[i, 2]
    return (
        ends[i, 0] * x + ends[i, 3] * y + ends[i, 6] * z,
        ends[i, 1] * x + ends[i, 4] * y + ends[i, 7] * z,
        ends[i, 2] * x + ends[i, 5] * y + ends[i, 8] * z,
    )


@formula
def _tension_by_force(shares: Array, i: int, force: Triple) -> float:
    """Change of the frame-end tension due to a change of the force on the platform end."""
    return shares[i, 0] * force[0] + shares[i, 1] * force[1] + shares[i, 2] * force[2]


@formula
def _in_world_axes(rows: Array, i: int, pair: PlaneVector) -> Triple:
    """Convert `pair`, a vector in the plane of cable `i`, to world axes."""
    return pair.x * rows[g.AZIMUTH_X, i], pair.x * rows[g.AZIMUTH_Y, i], pair.z


@formula
def _add_wrench_change(space: CalibrationArrays, at: int, scale: float, force: Triple, moment: Triple) -> None:
    """Add a change of the wrench on the platform to a column."""
    for k in range(3):
        space.wrench[k, at] += scale * force[k]
        space.wrench[3 + k, at] += scale * moment[k]


@formula
def _add_force_change(
    space: CalibrationArrays, i: int, at: int, scale: float, force: Triple, moment: Triple, direct: float
) -> None:
    """Add the effects of one cable force's change to a column: on the wrench, and on the reading of this cable."""
    _add_wrench_change(space, at, scale, force, moment)
    space.work[i, at] += scale * direct


@kernel
def _add_parameter_change(
    sought: Unknowns, row: int, i: int, gain: float, change: Triple, moment: Triple, alone: float,
    space: CalibrationArrays,
) -> None:  # fmt: skip
    """Add the effects of a parameter of cable `i` to a column: on its platform-end force and its frame-end tension."""
    at = sought.where[row, i]
    if at >= 0:
        direct = gain * (_tension_by_force(space.shares, i, change) + alone)
        _add_force_change(space, i, at, sought.scale[row, i], change, moment, direct)


@glue
def fill_ends(model: Model, cables: Array, space: CalibrationArrays) -> None:
    """Fill the platform-end stiffness of all cables and the derivatives of the frame-end tensions."""
    for i in range(cables.shape[0]):
        across = end_stiffness(cables, space.rows, i)
        for k in range(3):
            space.ends[i, k], space.ends[i, 3 + k], space.ends[i, 6 + k] = across[0][k], across[1][k], across[2][k]
        if model.behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
            slopes = space.slopes[SLOPES * i : SLOPES * i + SLOPES]
            slopes_of_swivel(model, cables, space.rows, i, slopes)
            for k in range(3):
                space.shares[i, k] = slopes[DATA + k, 3]
            space.shares[i, 3], space.shares[i, 4] = 0.0, space.rows[g.LEAVING, i]
            if is_on_platform(cables, i):
                moments_of_swivel(model, cables, space.rows, i, space.turns[TURNS * i : TURNS * i + TURNS])
                force = force_on_end(cables, space.rows, i)
                tension = math.sqrt(force[0] * force[0] + force[1] * force[1] + force[2] * force[2])
                share = 1.0 / tension if tension > 0.0 else 0.0
                space.shares[i, 0], space.shares[i, 1] = share * force[0], share * force[1]
                space.shares[i, 2], space.shares[i, 4] = share * force[2], tension
            continue
        by = _frame_end_slopes(model, cables, space.rows, i)
        x, y, z = _in_world_axes(space.rows, i, PlaneVector(by.along, by.up))
        space.shares[i, 0], space.shares[i, 1], space.shares[i, 2] = x, y, z
        space.shares[i, 3], space.shares[i, 4] = by.by_height, by.tension


@glue
def fill_readings_by_wrench(
    sensing: Sensing, free: Array, cables: Array, reach: Triple, space: CalibrationArrays
) -> None:
    """Fill the change of every reading per unit wrench on the platform. The stiffness must be factored."""
    m = cables.shape[0]
    for j in range(space.moved.shape[0]):
        six = space.six
        if j < m:
            own = plus(_tension_by_motion(space.ends, j, space.shares), (0.0, 0.0, space.shares[j, 3]))
            force = (sensing.gain[j] * own[0], sensing.gain[j] * own[1], sensing.gain[j] * own[2])
            moment = _moment_of(cables, space, j, force)
        elif j < m + 3:
            force = _column_of(space.axes, j - m)
            moment = cross(reach, force)
        else:
            force = (0.0, 0.0, 0.0)
            moment = _column_of(space.axes, j - m - 3)
            if is_level(sensing):
                moment = unit_vector(j - m - 3)
        six[0], six[1], six[2] = force
        six[3], six[4], six[5] = moment
        _fill_motion_by_wrench(free, six, space, space.moved[j])


@glue
def _fill_material(
    model: Model, cables: Array, gain: float, sought: Unknowns, i: int, space: CalibrationArrays
) -> tuple[Triple, float]:
    """Add material and pulley of cable `i` to the columns. Changes of force and tension per length are returned."""
    rows, by, lever = space.rows, _frame_end_slopes(model, cables, space.rows, i), _lever_of(space.rows, i)
    span, rise, length = rows[g.SPAN, i], rows[g.RISE, i], rows[g.LENGTH, i]
    material, pulled, plane = material_at(cables, i), force_of(rows, i), plane_of(rows, i)
    if model.behind is None:
        own = force_slopes(model, span, rise, material, length, pulled, plane)
    else:
        free = rows[g.FREE_LENGTH, i]
        own = slopes_over(model, material, pulley_at(cables, i), free, pulled, plane)
        change = _in_world_axes(rows, i, own.by_radius)
        _add_parameter_change(sought, kinds.RADIUS, i, gain, change, cross(lever, change), by.by_radius, space)
        change = _in_world_axes(rows, i, own.by_dead)
        _add_parameter_change(sought, kinds.DEAD, i, gain, change, cross(lever, change), by.by_dead, space)
    change = _in_world_axes(rows, i, own.by_density)
    _add_parameter_change(sought, kinds.DENSITY, i, gain, change, cross(lever, change), by.by_density, space)
    change = _in_world_axes(rows, i, own.by_stiffness)
    _add_parameter_change(sought, kinds.STIFFNESS, i, gain, change, cross(lever, change), by.by_stiffness, space)
    return _in_world_axes(rows, i, own.by_length), by.by_length


@glue
def fill_cable(
    model: Model, cables: Array, gain: float, sought: Unknowns, p: int, i: int, space: CalibrationArrays
) -> None:
    """Add the unknowns of cable `i` to the columns, and fill the derivatives with respect to the cable's length."""
    where, scale, rows, ends, shares = sought.where, sought.scale, space.rows, space.ends, space.shares
    force = force_on_end(cables, rows, i)
    for axis in range(3):
        at = where[kinds.FRAME + axis, i]
        if at >= 0:
            change = opposite(_force_by_motion(ends, i, unit_vector(axis)))
            fall = shares[i, 3] if axis == 2 else 0.0
            direct = gain * (_tension_by_force(shares, i, change) - fall)
            moment = _moment_of(cables, space, i, change)
            _add_force_change(space, i, at, scale[kinds.FRAME + axis, i], change, moment, direct)
        at = where[kinds.PLATFORM + axis, i]
        if at >= 0:
            moved = _column_of(space.rotation, axis)
            change = _force_by_motion(ends, i, moved)
            moment = plus(cross(moved, force), _moment_of(cables, space, i, change))
            _add_wrench_change(space, at, scale[kinds.PLATFORM + axis, i], change, moment)
            direct = gain * (_tension_by_force(shares, i, change) + shares[i, 3] * moved[2])
            space.work[i, at] += scale[kinds.PLATFORM + axis, i] * direct
    if model.behind is not None and tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        for k in range(1, DATA):  # the rows of `kinds` have the same order
            pulled, turned, alone = _change_by_data(cables, space, i, k)
            _add_parameter_change(sought, kinds.DENSITY + k - 1, i, gain, pulled, turned, alone, space)
        change, by_length, alone = _change_by_data(cables, space, i, 0)
    else:
        change, alone = _fill_material(model, cables, gain, sought, i, space)
        by_length = cross(_lever_of(rows, i), change)
    direct = gain * (_tension_by_force(shares, i, change) + alone)
    _fill_length(space, i, change, by_length, direct)
    for k in range(5):
        row = kinds.ZERO + k if k < 2 else (kinds.STIFFNESS if k == 2 else kinds.SCALE + k - 3)
        at = where[row, i]
        if at >= 0:
            _add_force_change(space, i, at, scale[row, i] * sought.paid[k, p, i], change, by_length, direct)
    if where[kinds.GAIN, i] >= 0:
        space.work[i, where[kinds.GAIN, i]] += scale[kinds.GAIN, i] * shares[i, 4]
    if where[kinds.BIAS, i] >= 0:
        space.work[i, where[kinds.BIAS, i]] += scale[kinds.BIAS, i]


@formula
def _free_displacement(free: Array, vector: Triple) -> Triple:
    """The part of the displacement `vector` that the platform's free motions allow."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(free.shape[0]):
        if not is_rotation(free, k):
            share = free[k, 0] * vector[0] + free[k, 1] * vector[1] + free[k, 2] * vector[2]
            x, y, z = x + share * free[k, 0], y + share * free[k, 1], z + share * free[k, 2]
    return x, y, z


@glue
def _fill_center(
    cables: Array, sensing: Sensing, sought: Unknowns, free: Array, axis: int, space: CalibrationArrays
) -> None:
    """Add to the columns the effect of a shift of the center of mass, the reference point of platform motion."""
    # Only the part of the shift along free motions is added, because a planar platform stays in its plane.
    m = cables.shape[0]
    at, scale = sought.where[kinds.CENTER + axis, 0], sought.scale[kinds.CENTER + axis, 0]
    back = opposite(_free_displacement(free, _column_of(space.rotation, axis)))
    for i in range(m):
        change = _force_by_motion(space.ends, i, back)
        moment = plus(cross(back, force_on_end(cables, space.rows, i)), _moment_of(cables, space, i, change))
        _add_wrench_change(space, at, scale, change, moment)
        own = _tension_by_force(space.shares, i, change) + space.shares[i, 3] * back[2]
        space.work[i, at] += scale * sensing.gain[i] * own
    if space.work.shape[0] == m:
        return
    shifted = in_axes(space.axes, back)
    for k in range(3):
        space.work[m + k, at] += scale * shifted[k]


@glue
def fill_platform(
    model: Model,
    cables: Array,
    sensing: Sensing,
    sought: Unknowns,
    free: Array,
    from_system: Triple,
    space: CalibrationArrays,
) -> None:
    """Add the unknowns of the platform and of the measuring system to the columns."""
    m = cables.shape[0]
    where, scale = sought.where, sought.scale
    if where[kinds.MASS, 0] >= 0:
        none = (0.0, 0.0, 0.0)
        _add_wrench_change(space, where[kinds.MASS, 0], scale[kinds.MASS, 0], (0.0, 0.0, model.gravity), none)
    for axis in range(3):
        if where[kinds.CENTER + axis, 0] >= 0:
            _fill_center(cables, sensing, sought, free, axis, space)
        if space.work.shape[0] == m:
            continue
        unit = unit_vector(axis)
        shifted, around = in_axes(space.axes, unit), in_axes(space.axes, cross(from_system, unit))
        outward = in_axes(space.axes, _column_of(space.rotation, axis))
        for k in range(3):
            at = where[kinds.SHIFT + axis, 0]
            if at >= 0:
                space.work[m + k, at] -= scale[kinds.SHIFT + axis, 0] * shifted[k]
            at = where[kinds.TURN + axis, 0]
            if at >= 0:
                space.work[m + k, at] += scale[kinds.TURN + axis, 0] * around[k]
                if not is_level(sensing):
                    space.work[m + 3 + k, at] -= scale[kinds.TURN + axis, 0] * shifted[k]
            at = where[kinds.TARGET + axis, 0]
            if at >= 0:
                space.work[m + k, at] += scale[kinds.TARGET + axis, 0] * outward[k]
