"""Whitened residuals and derivatives of readings at equilibria, and initial lengths; docs/model.md, section 14.

The true lengths are also unknown. These lengths are eliminated pose by pose: the errors of the measured lengths are
treated as noise of the residual. The covariance of the residual is then diag(sigma^2) + sigma_L^2 A A^T.
"""

from __future__ import annotations

import math

from sagline.core.arrays import Array, Indices
from sagline.kernels import tables
from sagline.kernels.algebra.factors import dot, factor_positive, solve_lower, solve_upper
from sagline.kernels.algebra.functions import angle
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import GEOMETRY_ROWS, cable_geometry
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.states import chord_tension_at_frame_end, hold_cable
from sagline.kernels.cable.swivel import DATA, SLOPES, slopes_of_swivel, stiffness_of_swivel, swivel_in
from sagline.kernels.cable.terms import Model, Pulley, Terms, chord_at, material_at, model_of
from sagline.kernels.calibration import columns
from sagline.kernels.calibration import terms as t
from sagline.kernels.forward import platform
from sagline.kernels.jit import entry, formula, glue
from sagline.kernels.memory import Memory, block, vector
from sagline.kernels.statics import Triple, components_along, symmetric_part, turned


@glue
def _whiten(sensing: t.Sensing, residual: Array, space: t.CalibrationArrays) -> None:
    """Omit missing readings, and fill W so that W^T W is the inverse of the covariance."""
    readings, m = space.work.shape[0], residual.size - t.BESIDE
    for j in range(residual.size):
        if not (abs(residual[j]) < math.inf and space.deviation[j] < math.inf):
            residual[j] = math.nan
            if j >= readings:
                continue
            space.by_length[:, j] = 0.0
            space.work[j] = 0.0
            space.deviation[j] = 1.0
    for j in range(readings):
        for k in range(j + 1):
            total = space.deviation[j] * space.deviation[j] if k == j else 0.0
            for i in range(m):
                deviation = sensing.length_deviation[i]
                total += space.by_length[i, j] * space.by_length[i, k] * deviation * deviation
            space.whole[j, k] = total
            space.whole[k, j] = total
    factor_positive(space.whole, 0.0, space.own)
    for k in range(readings):  # store all of W, column by column
        space.whole[:, k] = 0.0
        space.whole[k, k] = 1.0 / space.own[k, k]
        for j in range(k + 1, readings):
            total = 0.0
            for q in range(k, j):
                total += space.own[j, q] * space.whole[q, k]
            space.whole[j, k] = -total / space.own[j, j]


@glue
def _store_linearization(
    sensing: t.Sensing,
    answer: t.Linearization,
    p: int,
    reading_arrays: Array,
    lengths: Array,
    space: t.CalibrationArrays,
) -> None:
    """Store the linearization of pose `p`."""
    residual, matrix, whole = answer.residual[p], answer.matrix[p], space.whole
    readings, m = matrix.shape[0], lengths.size
    for j in range(readings):
        total = residual[j]
        for i in range(m):
            total -= space.by_length[i, j] * (reading_arrays[i] - lengths[i])
        space.deviation[j] = 0.0 if math.isnan(residual[j]) else total
    for j in range(readings):
        total = 0.0
        matrix[j] = 0.0
        for k in range(j + 1):
            total += whole[j, k] * space.deviation[k]
            for q in range(matrix.shape[1]):
                matrix[j, q] += whole[j, k] * answer.work[k, q]
        answer.misfit[p, j] = total
    for i in range(m):
        square = sensing.length_deviation[i] * sensing.length_deviation[i]
        for j in range(readings):
            total = 0.0
            for k in range(j + 1):
                total += whole[j, k] * space.by_length[i, k]
            answer.back[p, i, j] = square * total


@formula
def _rotation_between(reading_arrays: Array, pose: Array, frame: Array, level: bool) -> Triple:
    """Rotation vector from the predicted to the measured platform rotation, in the measuring system's axes."""
    # level: world axes, and the yaw of the reading is replaced by the yaw for which the vector is horizontal.
    # predicted rotation reading: conj(frame) * pose
    fx, fy, fz, fw = -frame[3], -frame[4], -frame[5], frame[6]
    if level:
        fx, fy, fz, fw = 0.0, 0.0, 0.0, 1.0
    ax = fw * pose[3] + fx * pose[6] + fy * pose[5] - fz * pose[4]
    ay = fw * pose[4] + fy * pose[6] + fz * pose[3] - fx * pose[5]
    az = fw * pose[5] + fz * pose[6] + fx * pose[4] - fy * pose[3]
    aw = fw * pose[6] - fx * pose[3] - fy * pose[4] - fz * pose[5]
    # measured rotation * conj(predicted)
    rx, ry, rz, rw = reading_arrays[0], reading_arrays[1], reading_arrays[2], reading_arrays[3]
    x = -rw * ax + rx * aw - ry * az + rz * ay
    y = -rw * ay + ry * aw - rz * ax + rx * az
    z = -rw * az + rz * aw - rx * ay + ry * ax
    w = rw * aw + rx * ax + ry * ay + rz * az
    if level:  # a rotation about the vertical in front of this rotation makes z zero
        whole = math.sqrt(z * z + w * w)
        if whole > 0.0:
            x, y = (w * x + z * y) / whole, (w * y - z * x) / whole
        z, w = 0.0, whole
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    sine = math.sqrt(x * x + y * y + z * z)
    factor = 2.0 * math.atan2(sine, w) / sine if sine > 0.0 else 2.0
    return factor * x, factor * y, factor * z


@glue
def _fill_residual(
    sensing: t.Sensing,
    readings: t.PoseReadings,
    p: int,
    pose: Array,
    from_system: Triple,
    space: t.CalibrationArrays,
    residual: Array,
) -> None:
    """Fill readings minus predictions, and the standard deviations. A missing reading has an infinite deviation."""
    m = residual.size - t.BESIDE
    for i in range(m):
        residual[i] = readings.cells[p, i] - (sensing.gain[i] * space.shares[i, 4] + sensing.bias[i])
        space.deviation[i] = sensing.tension_deviation[i]
    place = columns.in_axes(space.axes, from_system)
    turn = _rotation_between(readings.rotations[p], pose, sensing.frame, t.is_level(sensing))
    for k in range(3):
        residual[m + k] = readings.positions[p, k] - place[k]
        residual[m + 3 + k] = turn[k]
        space.deviation[m + k] = sensing.position_deviation[k]
        space.deviation[m + 3 + k] = sensing.rotation_deviation[k]


@entry
def observe(
    model: platform.ForwardTerms,
    given: platform.SampleArrays,
    sensing: t.SensingArrays,
    reading_arrays: t.ReadingArrays,
    unknown_arrays: t.UnknownArrays,
    memory: tuple[Array, Indices],
    found: t.LinearizationArrays,
) -> None:
    """Residuals and derivatives at N equilibria; NaN at unstable equilibria."""
    # model: Cable model as in `forward_poses`: the exact or the weightless model.
    # given: `ForwardSamples`, whose initial poses are equilibria at the lengths.
    # sensing: `Sensing`.
    # reading_arrays: `PoseReadings`.
    # unknown_arrays: `Unknowns`.
    # memory: Work arrays from `memory_for`, for the number of cables.
    # found: `Linearization`, which is filled.
    batch, sensors = platform.ForwardSamples(*given), t.Sensing(*sensing)
    readings, sought, answer = t.PoseReadings(*reading_arrays), t.Unknowns(*unknown_arrays), t.Linearization(*found)
    code, k_h, k_p, behind = model
    count, m = batch.lengths.shape
    free = batch.freedom
    space = t.new_calibration_arrays(Memory(*memory), m, free.shape[0], answer.work)
    for axis in range(3):
        unit = columns.unit_vector(axis)
        x, y, z = turned(sensors.frame, unit[0], unit[1], unit[2])
        space.axes[0, axis], space.axes[1, axis], space.axes[2, axis] = x, y, z
    for p in range(count):
        body, cables, pose = platform.row_of(batch.bodies, p), platform.row_of(batch.robots, p), batch.starts[p]
        placed = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        for i in range(m):
            space.rows[g.LENGTH, i] = batch.lengths[p, i]
            space.rows[g.PARAMETER, i] = math.nan  # a result must not depend on the previous sample
        wrench = platform.row_of(batch.wrenches, p)
        platform.unbalance(placed, cables, body, wrench, pose, space.rotation, space.rows, space.six)
        platform.platform_stiffness(placed, cables, space.rows, space.stiffness)
        symmetric_part(free, space.stiffness, space.matrix)
        if not factor_positive(space.matrix, 0.0, space.factor):
            answer.matrix[p] = math.nan
            answer.misfit[p] = math.nan
            answer.residual[p] = math.nan
            answer.back[p] = math.nan
            if answer.motion.shape[0] > 0:
                answer.motion[p] = math.nan
            continue
        center = turned(pose, body[tables.CENTER_X], body[tables.CENTER_Y], body[tables.CENTER_Z])
        target = turned(pose, sensors.target[0], sensors.target[1], sensors.target[2])
        reach = columns.plus(target, columns.opposite(center))
        shift = (sensors.frame[0], sensors.frame[1], sensors.frame[2])
        from_system = columns.plus(columns.plus((pose[0], pose[1], pose[2]), target), columns.opposite(shift))
        columns.fill_ends(placed, cables, space)
        columns.fill_readings_by_wrench(sensors, free, cables, reach, space)
        answer.work[:] = 0.0
        for i in range(m):
            columns.fill_cable(placed, cables, sensors.gain[i], sought, p, i, space)
        columns.fill_platform(placed, cables, sensors, sought, free, from_system, space)
        if answer.motion.shape[0] > 0:
            columns.fill_motion(free, space, answer.motion[p])
        columns.add_motion(space)
        _fill_residual(sensors, readings, p, pose, from_system, space, answer.residual[p])
        _whiten(sensors, answer.residual[p], space)
        _store_linearization(sensors, answer, p, readings.lengths[p], batch.lengths[p], space)


@entry
def swivel_readings(
    model: platform.ForwardTerms, given: platform.SampleArrays, memory: tuple[Array, Indices], found: Array
) -> None:
    """Directions of pulleys with swivel axes of any direction at N equilibria, and derivatives of the swivel angles."""
    # The arguments are the same as in `observe`. `found` (N, m, SWIVEL_NUMBERS), to be filled: unit vector from the
    # axis to the center of the pulley; derivatives of the angle about the axis by the platform end [rad/m], and by the
    # cable's length, density, EA, pulley radius and dead length.
    batch = platform.ForwardSamples(*given)
    code, k_h, k_p, behind = model
    count, m = batch.lengths.shape
    rotation, rest = block(Memory(*memory), 3, 3)
    rows, rest = block(rest, g.CABLE_ROWS, m)
    slopes, rest = block(rest, SLOPES, 5)
    six, rest = vector(rest, 6)
    for p in range(count):
        body, cables, pose = platform.row_of(batch.bodies, p), platform.row_of(batch.robots, p), batch.starts[p]
        placed = Model(code, k_h, k_p, body[tables.GRAVITY], behind)
        for i in range(m):
            rows[g.LENGTH, i] = batch.lengths[p, i]
            rows[g.PARAMETER, i] = math.nan  # a result must not depend on the previous sample
        platform.unbalance(placed, cables, body, platform.row_of(batch.wrenches, p), pose, rotation, rows, six)
        for i in range(m):
            stiffness_of_swivel(placed, cables, rows, i)
            slopes_of_swivel(placed, cables, rows, i, slopes)
            own, turn = found[p, i], (slopes[DATA, 4], slopes[DATA + 1, 4], slopes[DATA + 2, 4])
            own[0], own[1], own[2] = rows[g.CENTER_X, i], rows[g.CENTER_Y, i], rows[g.CENTER_Z, i]
            own[3] = rows[g.W_XX, i] * turn[0] + rows[g.W_XY, i] * turn[1] + rows[g.W_XZ, i] * turn[2]
            own[4] = rows[g.W_XY, i] * turn[0] + rows[g.W_YY, i] * turn[1] + rows[g.W_YZ, i] * turn[2]
            own[5] = rows[g.W_XZ, i] * turn[0] + rows[g.W_YZ, i] * turn[1] + rows[g.W_ZZ, i] * turn[2]
            for k in range(DATA):
                own[6 + k] = slopes[k, 4] + slopes[k, 0] * turn[0] + slopes[k, 1] * turn[1] + slopes[k, 2] * turn[2]


SWIVEL_NUMBERS = 6 + DATA  # per cable in the result of `swivel_readings`
ITERATIONS = 3  # iterations of the force balance; few suffice, because the sag forces depend weakly on the tensions
LEAST = 0.2  # smallest ratio of a corrected tension to the measured tension


@glue
def _move_into_balance(along: Array, factor: Array, load: Array, tau: Array, least: Array) -> None:
    """Make the smallest change of the tensions `tau` (m,) that balances `load` (n,), but not below `least` (m,)."""
    # `along`: unit chord wrenches (m, n). `factor`: Cholesky factor of `along`^T `along`. `load` is overwritten.
    m, n = along.shape
    for i in range(m):
        for j in range(n):
            load[j] += along[i, j] * tau[i]
    solve_lower(factor, load)
    solve_upper(factor, load)
    for i in range(m):
        tau[i] = max(tau[i] - dot(along[i], load), least[i])


@formula
def _pulley_without_axis(cables: Array, i: int) -> Pulley:
    """Pulley of cable `i`; none with swivel axes of any direction."""
    if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
        return Pulley(0.0, 1.0, 0.0, 0.0)
    return pulley_at(cables, i)


@formula
def _length_to_drum(cables: Array, geometry: Array, i: int, tension: float) -> float:
    """Unstrained length [m] of a weightless cable between the tangent and the drum, with a swivel axis."""
    swivel, chord = swivel_in(geometry, cables, i, 0.0), chord_at(geometry, i)
    across = geometry[g.AZIMUTH_X, i] * swivel.x + geometry[g.AZIMUTH_Y, i] * swivel.y
    along = chord.cosine * across + chord.sine * swivel.z
    wrap = angle(math.sqrt(max(1.0 - along * along, 0.0)), along)
    return (swivel.radius * wrap + swivel.dead) / (1.0 + tension / swivel.stiffness)


@entry
def starting_lengths(
    terms: Terms,
    freedom: Array,
    cables: Array,
    body: Array,
    poses: Array,
    tension: Array,
    memory: tuple[Array, Indices],
    length_out: Array,
) -> None:
    """Fill the unstrained lengths off the drums [m] that balance the platform with tensions near `tension`."""
    # The chord tensions are changed as little as possible to balance the platform.
    # terms: Terms of the cable model.
    # freedom: Rows that select the free motions, (n, 6).
    # cables: Row of the cable_table, (m, CABLE_COLUMNS).
    # body: Row of the body_table.
    # poses: Pose rows (N, POSE_COLUMNS).
    # tension: Tensions at the frame ends [N], (N, m).
    # memory: Work arrays from `memory_for`, for the number of cables.
    # length_out: Filled, (N, m).
    model = model_of(terms)
    count, m = tension.shape
    n = freedom.shape[0]
    rest = Memory(*memory)
    rotation, rest = block(rest, 3, 3)
    geometry, rest = block(rest, GEOMETRY_ROWS, m)
    along, rest = block(rest, m, n)
    matrix, rest = block(rest, n, n)
    factor, rest = block(rest, n, n)
    wide, rest = block(rest, 3, m)
    six, rest = vector(rest, 6)
    part, rest = vector(rest, n)
    tau, sag_force, least = wide[0], wide[1], wide[2]
    for p in range(count):
        cable_geometry(cables, body, poses[p], rotation, geometry)
        for i in range(m):
            chord, material = chord_at(geometry, i), material_at(cables, i)
            tau[i] = chord_tension_at_frame_end(model, chord, material, _pulley_without_axis(cables, i), tension[p, i])
            least[i] = LEAST * max(tau[i], 0.5 * material.density * model.gravity * chord.length)
            tau[i] = max(tau[i], least[i])
            six[:] = 0.0
            sign = -1.0 if platform.is_on_platform(cables, i) else 1.0
            platform.add_force(geometry, i, sign * chord.cosine, sign * chord.sine, six)
            components_along(freedom, six, along[i])
        for j in range(n):
            for k in range(n):
                matrix[j, k] = 0.0
                for i in range(m):
                    matrix[j, k] += along[i, j] * along[i, k]
        positive = factor_positive(matrix, 0.0, factor)
        for _ in range(ITERATIONS):
            six[:] = 0.0
            six[2] = body[tables.MASS] * model.gravity
            for i in range(m):
                chord, material = chord_at(geometry, i), material_at(cables, i)
                pulley = _pulley_without_axis(cables, i)
                length_out[p, i], sag_force[i], _tension = hold_cable(model, chord, material, pulley, tau[i])
                sign = -1.0 if platform.is_on_platform(cables, i) else 1.0
                platform.add_force(geometry, i, 0.0, sign * sag_force[i], six)
            components_along(freedom, six, part)
            if not positive:
                break
            _move_into_balance(along, factor, part, tau, least)
        for i in range(m):
            chord, material = chord_at(geometry, i), material_at(cables, i)
            length_out[p, i] = hold_cable(model, chord, material, _pulley_without_axis(cables, i), tau[i])[0]
            if tables.SWIVELS and cables.shape[1] > tables.CABLE_COLUMNS:
                length_out[p, i] += _length_to_drum(cables, geometry, i, tau[i])
            if not length_out[p, i] > 0.0:
                length_out[p, i] = math.nan
