"""Force balance of the platform at one pose: structure matrix, needed wrench, and factors; docs/model.md, section 4.

The rows `free` (n, 6) select the free motions, translations first. Each row has one nonzero entry, the unit of its
motion. The tension distribution methods use the variable t = scale tau + offset, where tau is the chord tension. The
variable is a chord, horizontal or frame-end tension, possibly weighted. Limits and minimum-norm tensions are stored as
t - offset.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array
from sagline.kernels import codes, tables
from sagline.kernels.algebra.bounds import HIGH, LOW, START, STRIP_ROWS
from sagline.kernels.algebra.factors import factorize, minimum_norm, orthogonal_factor, pseudo_inverse
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.models import shallow_sag_force
from sagline.kernels.cable.pulley import pulley_at
from sagline.kernels.cable.states import TensionLimits, fill_admissible_tensions, is_limited_by_strain
from sagline.kernels.cable.terms import Cables, Model, material_at
from sagline.kernels.jit import entry, formula, glue, kernel
from sagline.kernels.memory import Memory, block, vector


@glue
def translation_count(freedom: Array) -> int:
    """Number of free translations, which are listed before the free rotations."""
    count = 0
    for k in range(freedom.shape[0]):
        count += 0 if is_rotation(freedom, k) else 1
    return count


@formula
def is_rotation(freedom: Array, k: int) -> bool:
    """True if free motion `k` of the platform is a rotation. The translations are listed first."""
    return freedom[k, 3] * freedom[k, 3] + freedom[k, 4] * freedom[k, 4] + freedom[k, 5] * freedom[k, 5] > 0.5


@formula
def squares_along(freedom: Array, part: Array) -> tuple[float, float]:
    """Two sums of squares of the components `part` (n,): over the free translations, and over the free rotations."""
    translations, rotations = 0.0, 0.0
    for k in range(freedom.shape[0]):
        if is_rotation(freedom, k):
            rotations += part[k] * part[k]
        else:
            translations += part[k] * part[k]
    return translations, rotations


@kernel
def symmetric_part(free: Array, full: Array, matrix: Array) -> None:
    """Fill `matrix` (n, n) with the symmetric part of free K free^T, where K is `full`."""
    matrix_along(free, full, matrix)
    for j in range(matrix.shape[0]):
        for k in range(j):
            mean = 0.5 * (matrix[j, k] + matrix[k, j])
            matrix[j, k] = mean
            matrix[k, j] = mean


@formula
def matrix_along(free: Array, full: Array, matrix: Array) -> None:
    """Fill `matrix` (n, n) with free K free^T, where K is `full`."""
    n = free.shape[0]
    for j in range(n):
        for k in range(n):
            if n == 6:
                matrix[j, k] = full[j, k] * free[j, j] * free[k, k]
                continue
            total = 0.0
            for a in range(6):
                for b in range(6):
                    total += free[j, a] * full[a, b] * free[k, b]
            matrix[j, k] = total


@kernel
def components_along(free: Array, full: Array, part: Array) -> float:
    """Fill the components `part` (n,) of the wrench `full` (6,) along the free motions. Returns their norm."""
    square = 0.0
    for j in range(free.shape[0]):
        total = 0.0
        for a in range(6):
            total += free[j, a] * full[a]
        part[j] = total
        square += total * total
    return math.sqrt(square)


@formula
def fill_motion_of_components(free: Array, part: Array, motion: Array) -> None:
    """Fill `motion` (6,) from its components `part` (n,) along the free motions."""
    motion[:] = 0.0
    for j in range(free.shape[0]):
        for a in range(6):
            motion[a] += free[j, a] * part[j]


@formula
def fill_structure_matrix(geometry: Array, matrix: Array) -> None:
    """Fill J (6, m). Column i is (u; r x u), where u is the unit vector from platform end to frame end of cable i."""
    for i in range(geometry.shape[1]):
        x = -geometry[g.COSINE, i] * geometry[g.AZIMUTH_X, i]
        y = -geometry[g.COSINE, i] * geometry[g.AZIMUTH_Y, i]
        z = -geometry[g.SINE, i]
        rx, ry, rz = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        matrix[0, i] = x
        matrix[1, i] = y
        matrix[2, i] = z
        matrix[3, i] = ry * z - rz * y
        matrix[4, i] = rz * x - rx * z
        matrix[5, i] = rx * y - ry * x


@formula
def needed_wrench(geometry: Array, body: Array, wrench: Array, sag_force: Array, needed: Array) -> None:
    """Fill the wrench (6,) that the chord tensions must supply: J tau = needed."""
    # The needed wrench balances three loads. The first load is the platform's weight, which no other argument includes.
    # The second load is `wrench`, external plus inertial, about the center of mass. The third load are the sag forces
    # T_z - tau sin phi (m,) of the cables, which act at the platform ends.
    fz = body[tables.MASS] * body[tables.GRAVITY] - wrench[2]
    mx = -wrench[3]
    my = -wrench[4]
    for i in range(geometry.shape[1]):
        fz += sag_force[i]
        mx += geometry[g.LEVER_Y, i] * sag_force[i]
        my -= geometry[g.LEVER_X, i] * sag_force[i]
    needed[0] = -wrench[0]
    needed[1] = -wrench[1]
    needed[2] = fz
    needed[3] = mx
    needed[4] = my
    needed[5] = -wrench[5]


@formula
def along_freedom(freedom: Array, full: Array, part: Array) -> None:
    """Fill the components `part` (n,) of the wrench `full` (6,) along the platform's free motions (n, 6)."""
    n = freedom.shape[0]
    for k in range(n):
        if n == 6:  # all motions are free
            part[k] = full[k]
        else:
            part[k] = 0.0
            for j in range(6):
                part[k] += freedom[k, j] * full[j]


@formula
def rows_along_freedom(freedom: Array, full: Array, part: Array) -> None:
    """Fill the rows `part` (n, m) of the structure matrix `full` (6, m) along the platform's free motions (n, 6)."""
    n = freedom.shape[0]
    for k in range(n):
        for i in range(full.shape[1]):
            if n == 6:
                part[k, i] = full[k, i]
            else:
                part[k, i] = 0.0
                for j in range(6):
                    part[k, i] += freedom[k, j] * full[j, i]


@entry
def structure_matrices(geometries: Array, matrices: Array) -> None:
    """Fill J of N poses, (N, 6, m), from their geometry rows, (N, GEOMETRY_ROWS, m)."""
    for p in range(geometries.shape[0]):
        fill_structure_matrix(geometries[p], matrices[p])


Triple = tuple[float, float, float]


@formula
def add_world_force(rows: Array, i: int, force: Triple, wrench: Array) -> None:
    """Add to `wrench` (6,) a `force` at the platform end of cable `i`, world axes [N]."""
    x, y, z = force
    rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
    wrench[0] += x
    wrench[1] += y
    wrench[2] += z
    wrench[3] += ry * z - rz * y
    wrench[4] += rz * x - rx * z
    wrench[5] += rx * y - ry * x


@kernel
def step_pose(free: Array, body: Array, pose: Array, step: Array, motion: Array, moved: Array) -> None:
    """Fill the pose `moved` after `step` (n,) along the free motions, and the `motion` (6,) of this step."""
    fill_motion_of_components(free, step, motion)
    moved_pose(body, pose, motion, moved)


@formula
def moved_pose(body: Array, pose: Array, motion: Array, moved: Array) -> None:
    """Fill the pose `moved` after `motion` (6,): displacement of the center of mass, and rotation about this point."""
    angle2 = motion[3] * motion[3] + motion[4] * motion[4] + motion[5] * motion[5]
    angle = math.sqrt(angle2)
    w = math.cos(0.5 * angle)
    half = math.sin(0.5 * angle) / angle if angle > 1e-8 else 0.5
    x, y, z = half * motion[3], half * motion[4], half * motion[5]
    qx, qy, qz, qw = pose[3], pose[4], pose[5], pose[6]
    ax = w * qx + x * qw + y * qz - z * qy
    ay = w * qy - x * qz + y * qw + z * qx
    az = w * qz + x * qy - y * qx + z * qw
    aw = w * qw - x * qx - y * qy - z * qz
    scale = 1.0 / math.sqrt(ax * ax + ay * ay + az * az + aw * aw)
    moved[3], moved[4], moved[5], moved[6] = ax * scale, ay * scale, az * scale, aw * scale
    # displacement of the origin: that of the center of mass, plus d = Q c - Q' c due to the rotation
    cx, cy, cz = body[tables.CENTER_X], body[tables.CENTER_Y], body[tables.CENTER_Z]
    before = turned(pose, cx, cy, cz)
    after = turned(moved, cx, cy, cz)
    for k in range(3):
        moved[k] = pose[k] + (motion[k] + (before[k] - after[k]))


@formula
def turned(pose: Array, x: float, y: float, z: float) -> Triple:
    """Convert the vector (x, y, z) from the platform frame to world axes."""
    qx, qy, qz, qw = pose[3], pose[4], pose[5], pose[6]
    tx = 2.0 * (qy * z - qz * y)
    ty = 2.0 * (qz * x - qx * z)
    tz = 2.0 * (qx * y - qy * x)
    return (x + qw * tx + qy * tz - qz * ty, y + qw * ty + qz * tx - qx * tz, z + qw * tz + qx * ty - qy * tx)


class Platform(NamedTuple):
    """Platform and loads at one pose."""

    freedom: Array  # rows that select the platform's free motions, translations first, (n, 6)
    body: Array  # row of the body_table, (BODY_COLUMNS,)
    robot: Array  # rows of the cable_table, (m, CABLE_COLUMNS)
    pose: Array  # row of the poses, (POSE_COLUMNS,)
    wrench: Array  # external plus inertial wrench, about the center of mass, (6,)


class Balance(NamedTuple):
    """The balance of one pose, for m cables, n free motions and r = m - n redundant cables."""

    rotation: Array  # platform -> world, (3, 3)
    geometry: Array  # rows of `cable_geometry`, (GEOMETRY_ROWS, m)
    full: Array  # structure matrix, (6, m)
    matrix: Array  # structure matrix along the free motions, (n, m)
    # structure matrix for the distribution's variable, overwritten by its Householder reflections, (n, m)
    reduced: Array
    diagonals: Array  # diagonals of the QR factors, (2, n)
    q: Array  # orthogonal factor and one work row, (m + 1, m)
    inverse: Array  # transposed pseudo-inverse in the distribution's variable, (n, m)
    null: Array  # orthonormal null-space basis in the distribution's variable, one vector per row, (r, m)
    needed: Array  # wrench that the chord tensions must supply, (6,)
    right: Array  # components of `needed` along the free motions, (n,)
    scale: Array  # scale of the distribution's variable, (m,)
    offset: Array  # offset of the distribution's variable [N], (m,)
    bounds: Array  # minimum-norm tensions (row START) and limits, in the distribution's variable, (3, m)
    tension: Array  # distributed tensions, in the distribution's variable minus its offset [N], (m,)


@glue
def new_balance(memory: Memory, m: int, n: int) -> tuple[Balance, Memory]:
    """Work arrays for m cables and n free motions, and the remaining memory."""
    rotation, memory = block(memory, 3, 3)
    geometry, memory = block(memory, g.GEOMETRY_ROWS, m)
    full, memory = block(memory, 6, m)
    matrix, memory = block(memory, n, m)
    reduced, memory = block(memory, n, m)
    diagonals, memory = block(memory, 2, n)
    q, memory = block(memory, m + 1, m)
    inverse, memory = block(memory, n, m)
    null, memory = block(memory, max(m - n, 0), m)
    needed, memory = vector(memory, 6)
    right, memory = vector(memory, n)
    bounds, memory = block(memory, STRIP_ROWS, m)
    others, memory = block(memory, 3, m)
    scale, offset, tension = others[0], others[1], others[2]
    balance = Balance(
        rotation, geometry, full, matrix, reduced, diagonals, q, inverse, null, needed, right, scale, offset, bounds,
        tension,
    )  # fmt: skip
    return balance, memory


@glue
def set_pose(
    model: Model,
    limits: TensionLimits,
    variable: int,
    weight: Array,
    platform: Platform,
    cables: Cables,
    balance: Balance,
) -> int:
    """Fill `cables` and `balance` of one pose, with first-order sag forces. Returns POSE_SOLVED or a status of failure.

    `weight`: square roots of the weighting factors of the cables in the tension distribution, (m,).
    """
    cable_geometry(platform.robot, platform.body, platform.pose, balance.rotation, balance.geometry)
    return set_chords(model, limits, variable, weight, platform, cables, balance)


@glue
def set_chords(
    model: Model,
    limits: TensionLimits,
    variable: int,
    weight: Array,
    platform: Platform,
    cables: Cables,
    balance: Balance,
) -> int:
    """`set_pose` with a known geometry."""
    if not _place_chords(model, limits, platform, cables, balance):
        return codes.POSE_NO_CHORD
    _choose_variable(variable, weight, cables, balance)
    return codes.POSE_SOLVED if factor_balance(balance) else codes.POSE_SINGULAR


@glue
def place_platform(
    model: Model, limits: TensionLimits, platform: Platform, pose: Array, cables: Cables, balance: Balance
) -> bool:
    """Fill cables, geometry and structure matrix at `pose`. False if a cable has no chord."""
    cable_geometry(platform.robot, platform.body, pose, balance.rotation, balance.geometry)
    return _place_chords(model, limits, platform, cables, balance)


@glue
def _place_chords(model: Model, limits: TensionLimits, platform: Platform, cables: Cables, balance: Balance) -> bool:
    """`place_platform` with a known geometry."""
    if not place_cables(model, limits, platform.robot, balance.geometry, cables):
        return False
    fill_structure_matrix(balance.geometry, balance.full)
    rows_along_freedom(platform.freedom, balance.full, balance.matrix)
    return True


@glue
def place_cables(model: Model, limits: TensionLimits, robot: Array, geometry: Array, cables: Cables) -> bool:
    """Fill chords, material, first-order sag forces and admissible tensions. False if a cable has no chord."""
    for i in range(robot.shape[0]):
        chord = geometry[g.CHORD, i]
        if not chord >= tables.SHORTEST_CHORD:
            return False
        cables.chord[i], cables.sine[i], cables.cosine[i] = chord, geometry[g.SINE, i], geometry[g.COSINE, i]
        cables.density[i], cables.stiffness[i] = material_at(robot, i)
        cables.radius[i], cables.entry[i], cables.dead[i], cables.rise[i] = pulley_at(robot, i)
        cables.half_weight[i] = 0.5 * robot[i, tables.DENSITY] * model.gravity * chord
        cables.sag_force[i] = shallow_sag_force(model, chord, robot[i, tables.DENSITY])
        low, high = robot[i, tables.TENSION_MIN], robot[i, tables.TENSION_MAX]
        fill_admissible_tensions(model, limits, low, high, cables, i)
    return True


@glue
def _choose_variable(variable: int, weight: Array, cables: Cables, balance: Balance) -> None:
    """Fill scale, offset and limits of the variable of the tension distribution."""
    # The initial frame-end tension is its first-order value tau - wD/2 sin phi.
    for i in range(weight.size):
        scale = weight[i]
        offset = 0.0
        if variable == codes.HORIZONTAL_TENSION:
            scale *= cables.cosine[i]
        elif variable == codes.FRAME_END_TENSION:
            offset = -cables.half_weight[i] * cables.sine[i]
        balance.scale[i] = scale
        balance.offset[i] = offset
        scale_limits(cables, balance, i)


@glue
def scale_limits(cables: Cables, balance: Balance, i: int) -> None:
    """Fill the limits of cable `i` in the distribution's variable. The limit of the strain is not included."""
    limited = cables.high[i] < math.inf and not is_limited_by_strain(cables, i)
    balance.bounds[LOW, i] = cables.low[i] * balance.scale[i]
    balance.bounds[HIGH, i] = cables.high[i] * balance.scale[i] if limited else math.inf


@glue
def factor_balance(balance: Balance) -> bool:
    """Fill pseudo-inverse and null space for the distribution's variable. False if its rank is not full."""
    n, m = balance.matrix.shape
    matrix, reduced, q = balance.matrix, balance.reduced, balance.q
    for i in range(m):
        back = 1.0 / balance.scale[i]
        for k in range(n):
            reduced[k, i] = matrix[k, i] * back
    if not factorize(reduced, balance.diagonals):
        return False
    orthogonal_factor(reduced, balance.diagonals, q)
    pseudo_inverse(reduced, balance.diagonals, q, balance.inverse)
    for k in range(m - n):
        for i in range(m):
            balance.null[k, i] = q[i, n + k]
    return True


@glue
def fill_needed_wrench(platform: Platform, cables: Cables, balance: Balance) -> None:
    """Fill the needed wrench of `balance` from the present sag forces."""
    needed_wrench(balance.geometry, platform.body, platform.wrench, cables.sag_force, balance.needed)
    along_freedom(platform.freedom, balance.needed, balance.right)


@glue
def start_from_minimum_norm(balance: Balance) -> None:
    """Fill row START of the limits with the minimum-norm tensions that supply the needed wrench."""
    minimum_norm(balance.inverse, balance.right, balance.bounds[START])
