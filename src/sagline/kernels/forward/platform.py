"""The platform on cables of given lengths: what it feels at a pose, and how that changes when it moves.

A motion is (displacement of the center of mass, rotation vector), world axes: the rotation acts from the left.
The unbalance is minus the whole wrench on the platform, the gradient of the energy.
"""

from __future__ import annotations

import math

from sagline.arrays import Array
from sagline.kernels import tables
from sagline.kernels.balance import geometry as g
from sagline.kernels.balance.geometry import cable_geometry
from sagline.kernels.cable.energy import cable_energy
from sagline.kernels.cable.forces import cable_forces
from sagline.kernels.cable.stiffness import cable_stiffness
from sagline.kernels.cable.terms import Force, Material
from sagline.kernels.forward.problem import Problem, Space
from sagline.kernels.jit import formula, kernel

Triple = tuple[float, float, float]


@kernel
def unbalance(problem: Problem, pose: Array, space: Space) -> float:
    """Fill geometry, cable results and statuses, and the unbalance (6,) as gradient, at a pose.

    Returns the sum of the tensions and the platform's weight [N]: what the unbalance is to be compared with.
    """
    cables, body, wrench = problem.cables, problem.body, problem.wrench
    geometry, result, gradient = space.geometry, space.result, space.gradient
    cable_geometry(cables, body, pose, space.rotation, geometry)
    cable_forces(problem.model, cables, problem.lengths, geometry, space.memory, result, space.statuses)
    weight = body[tables.MASS] * problem.model.gravity
    for k in range(6):
        gradient[k] = -wrench[k]
    gradient[2] += weight
    scale: float = weight + abs(wrench[0]) + abs(wrench[1]) + abs(wrench[2])
    for i in range(cables.shape[0]):
        result[tables.SPAN, i] = geometry[g.SPAN, i]
        result[tables.RISE, i] = geometry[g.RISE, i]
        result[tables.LENGTH, i] = problem.lengths[i]
        horizontal = result[tables.HORIZONTAL, i]
        z = result[tables.VERTICAL, i]
        x = horizontal * geometry[g.AZIMUTH_X, i]
        y = horizontal * geometry[g.AZIMUTH_Y, i]
        rx, ry, rz = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        gradient[0] += x
        gradient[1] += y
        gradient[2] += z
        gradient[3] += ry * z - rz * y
        gradient[4] += rz * x - rx * z
        gradient[5] += rx * y - ry * x
        scale += horizontal + abs(z)
    return scale


@kernel
def platform_energy(problem: Problem, pose: Array, space: Space):  # type: ignore[no-untyped-def]
    """Energy [J] of cables, weight and given force after `unbalance`, and the size of what was added up.

    The work of a given moment is left out: constant in world axes, it has none but along a motion.
    """
    cables, body, wrench = problem.cables, problem.body, problem.wrench
    rotation, result = space.rotation, space.result
    energy = 0.0
    size = 0.0
    for k in range(3):
        center = pose[k]
        for j in range(3):
            center += rotation[k, j] * body[tables.CENTER_X + j]
        given = wrench[k] - (body[tables.MASS] * problem.model.gravity if k == 2 else 0.0)
        energy -= given * center
        size += abs(given * center)
    for i in range(cables.shape[0]):
        span, rise = result[tables.SPAN, i], result[tables.RISE, i]
        material = Material(cables[i, tables.DENSITY], cables[i, tables.STIFFNESS])
        force = Force(result[tables.HORIZONTAL, i], result[tables.VERTICAL, i], result[tables.TENSION, i])
        energy += cable_energy(problem.model, span, rise, material, result[tables.LENGTH, i], force)
        size += abs(force.horizontal * span) + abs(force.vertical * rise)
    return energy, size


@kernel
def end_stiffness(problem: Problem, space: Space, i: int):  # type: ignore[no-untyped-def]
    """Stiffness of cable i against displacements of its platform end in world axes, row by row: nine numbers [N/m]."""
    cables, geometry, result = problem.cables, space.geometry, space.result
    material = Material(cables[i, tables.DENSITY], cables[i, tables.STIFFNESS])
    force = Force(result[tables.HORIZONTAL, i], result[tables.VERTICAL, i], result[tables.TENSION, i])
    xx, xz, zx, zz = cable_stiffness(
        problem.model, geometry[g.SPAN, i], geometry[g.RISE, i], material, result[tables.LENGTH, i], force
    )
    across = force.tension / geometry[g.CHORD, i]
    c, s = geometry[g.AZIMUTH_X, i], geometry[g.AZIMUTH_Y, i]
    mixed = (xx - across) * c * s
    return (
        (xx * c * c + across * s * s, mixed, xz * c),
        (mixed, xx * s * s + across * c * c, xz * s),
        (zx * c, zx * s, zz),
    )


@formula
def add_column(stiffness: Array, j: int, r: Triple, a: float, b: float, c: float) -> None:
    """Add to column j what the change (a, b, c) of a cable's force at lever r does to the platform."""
    stiffness[0, j] += a
    stiffness[1, j] += b
    stiffness[2, j] += c
    stiffness[3, j] += r[1] * c - r[2] * b
    stiffness[4, j] += r[2] * a - r[0] * c
    stiffness[5, j] += r[0] * b - r[1] * a


@kernel
def platform_stiffness(problem: Problem, space: Space) -> None:
    """Fill the derivative (6, 6) of the unbalance after `unbalance`: elastic, sag and geometric stiffness together.

    Its skew part is half the moment of the cables' forces: zero in an equilibrium without a given moment.
    """
    geometry, result, stiffness = space.geometry, space.result, space.stiffness
    for j in range(6):
        for k in range(6):
            stiffness[j, k] = 0.0
    for i in range(geometry.shape[1]):
        (kxx, kxy, kxz), (kyx, kyy, kyz), (kzx, kzy, kzz) = end_stiffness(problem, space, i)
        x, y, z = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        r = (x, y, z)
        add_column(stiffness, 0, r, kxx, kyx, kzx)
        add_column(stiffness, 1, r, kxy, kyy, kzy)
        add_column(stiffness, 2, r, kxz, kyz, kzz)
        # a rotation about an axis e moves the platform end by e x r
        add_column(stiffness, 3, r, kxz * y - kxy * z, kyz * y - kyy * z, kzz * y - kzy * z)
        add_column(stiffness, 4, r, kxx * z - kxz * x, kyx * z - kyz * x, kzx * z - kzz * x)
        add_column(stiffness, 5, r, kxy * x - kxx * y, kyy * x - kyx * y, kzy * x - kzx * y)
        # the force keeps its direction while r turns: r T^T - (r.T) 1
        tx = result[tables.HORIZONTAL, i] * geometry[g.AZIMUTH_X, i]
        ty = result[tables.HORIZONTAL, i] * geometry[g.AZIMUTH_Y, i]
        tz = result[tables.VERTICAL, i]
        stiffness[3, 3] -= y * ty + z * tz
        stiffness[3, 4] += x * ty
        stiffness[3, 5] += x * tz
        stiffness[4, 3] += y * tx
        stiffness[4, 4] -= x * tx + z * tz
        stiffness[4, 5] += y * tz
        stiffness[5, 3] += z * tx
        stiffness[5, 4] += z * ty
        stiffness[5, 5] -= x * tx + y * ty


@kernel
def moved_pose(body: Array, pose: Array, motion: Array, moved: Array) -> None:
    """Fill the pose after a motion (6,): the center of mass displaced, the platform turned about it."""
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
    # the origin goes with the center of mass, less what its lever turned: d = Q c - Q' c
    cx, cy, cz = body[tables.CENTER_X], body[tables.CENTER_Y], body[tables.CENTER_Z]
    before = turned(pose, cx, cy, cz)
    after = turned(moved, cx, cy, cz)
    for k in range(3):
        moved[k] = pose[k] + (motion[k] + (before[k] - after[k]))


@kernel
def turned(pose: Array, x: float, y: float, z: float) -> Triple:
    """A vector of the platform frame in world axes."""
    qx, qy, qz, qw = pose[3], pose[4], pose[5], pose[6]
    tx = 2.0 * (qy * z - qz * y)
    ty = 2.0 * (qz * x - qx * z)
    tz = 2.0 * (qx * y - qy * x)
    return (
        x + qw * tx + qy * tz - qz * ty,
        y + qw * ty + qz * tx - qx * tz,
        z + qw * tz + qx * ty - qy * tx,
    )
