"""The platform on cables of given lengths: what it feels at a pose, and how that changes when it moves.

A motion is (displacement of the center of mass, rotation vector), world axes: the rotation acts from the left.
The unbalance is minus the whole wrench on the platform, the gradient of the energy.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, Codes
from sagline.kernels import geometry as g
from sagline.kernels import tables
from sagline.kernels.energy import cable_energy
from sagline.kernels.geometry import cable_geometry
from sagline.kernels.jit import kernel
from sagline.kernels.models import from_length
from sagline.kernels.stiffness import cable_stiffness


class Problem(NamedTuple):
    """One pose to find: the cable model, what the robot is, and what is given.

    Attributes:
        code: Cable model.
        k_h: The empirical model's constant.
        k_p: The empirical model's constant.
        freedom: Rows that pick the free motions, (n, 6).
        cables: Rows of the cable_table, (m, CABLE_COLUMNS).
        body: Row of the body_table, (BODY_COLUMNS,).
        lengths: Unstrained lengths [m], (m,).
        wrench: External plus inertial, about the center of mass, (6,).
        scale: Unit of each free motion [m or rad], (n,): what counts as equally far.
    """

    code: int
    k_h: float
    k_p: float
    freedom: Array
    cables: Array
    body: Array
    lengths: Array
    wrench: Array
    scale: Array


class Space(NamedTuple):
    """Working memory for m cables and n free motions; `unbalance` and `platform_stiffness` say what they fill."""

    rotation: Array  # (3, 3)
    geometry: Array  # (GEOMETRY_ROWS, m)
    result: Array  # (RESULT_ROWS, m)
    statuses: Codes  # (m,)
    gradient: Array  # (6,)
    block: Array  # (3, 3)
    stiffness: Array  # (6, 6)
    matrix: Array  # (n, n)
    factor: Array  # (n, n)
    part: Array  # (n,)
    work: Array  # (n,)
    step: Array  # (n,)
    motion: Array  # (6,)
    trial: Array  # (7,)


@kernel
def new_space(m: int, n: int) -> Space:
    """Working memory for m cables and n free motions."""
    return Space(
        np.empty((3, 3)),
        np.empty((g.GEOMETRY_ROWS, m)),
        np.empty((tables.RESULT_ROWS, m)),
        np.empty(m, dtype=np.int8),
        np.empty(6),
        np.empty((3, 3)),
        np.empty((6, 6)),
        np.empty((n, n)),
        np.empty((n, n)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(6),
        np.empty(7),
    )


@kernel
def unbalance(problem: Problem, pose: Array, space: Space) -> float:
    """Fill geometry, cable results and statuses, and the unbalance (6,) as gradient, at a pose.

    Returns the sum of the tensions and the platform's weight [N]: what the unbalance is to be compared with.
    """
    cables, body, wrench = problem.cables, problem.body, problem.wrench
    geometry, result, gradient = space.geometry, space.result, space.gradient
    cable_geometry(cables, body, pose, space.rotation, geometry)
    gravity = body[tables.GRAVITY]
    weight = body[tables.MASS] * gravity
    for k in range(6):
        gradient[k] = -wrench[k]
    gradient[2] += weight
    scale: float = weight + abs(wrench[0]) + abs(wrench[1]) + abs(wrench[2])
    for i in range(cables.shape[0]):
        span = geometry[g.SPAN, i]
        rise = geometry[g.RISE, i]
        horizontal, z, tension, status = from_length(
            problem.code,
            problem.k_h,
            problem.k_p,
            gravity,
            span,
            rise,
            cables[i, tables.DENSITY],
            cables[i, tables.STIFFNESS],
            problem.lengths[i],
        )
        result[tables.SPAN, i] = span
        result[tables.RISE, i] = rise
        result[tables.LENGTH, i] = problem.lengths[i]
        result[tables.HORIZONTAL, i] = horizontal
        result[tables.VERTICAL, i] = z
        result[tables.TENSION, i] = tension
        space.statuses[i] = status
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
    gravity = body[tables.GRAVITY]
    energy = 0.0
    size = 0.0
    for k in range(3):
        center = pose[k]
        for j in range(3):
            center += rotation[k, j] * body[tables.CENTER_X + j]
        force = wrench[k] - (body[tables.MASS] * gravity if k == 2 else 0.0)
        energy -= force * center
        size += abs(force * center)
    for i in range(cables.shape[0]):
        energy += cable_energy(
            problem.code,
            gravity,
            result[tables.SPAN, i],
            result[tables.RISE, i],
            cables[i, tables.DENSITY],
            cables[i, tables.STIFFNESS],
            result[tables.LENGTH, i],
            result[tables.HORIZONTAL, i],
            result[tables.VERTICAL, i],
            result[tables.TENSION, i],
        )
        size += abs(result[tables.HORIZONTAL, i] * result[tables.SPAN, i])
        size += abs(result[tables.VERTICAL, i] * result[tables.RISE, i])
    return energy, size


@kernel
def cable_matrix(problem: Problem, space: Space, i: int) -> None:
    """Fill the stiffness (3, 3) of cable i against displacements of its platform end, world axes, as block."""
    cables, geometry, result, block = problem.cables, space.geometry, space.result, space.block
    tension = result[tables.TENSION, i]
    xx, xz, zx, zz = cable_stiffness(
        problem.code,
        problem.k_h,
        problem.k_p,
        problem.body[tables.GRAVITY],
        geometry[g.SPAN, i],
        geometry[g.RISE, i],
        cables[i, tables.DENSITY],
        cables[i, tables.STIFFNESS],
        result[tables.LENGTH, i],
        result[tables.HORIZONTAL, i],
        result[tables.VERTICAL, i],
        tension,
    )
    across = tension / geometry[g.CHORD, i]
    c, s = geometry[g.AZIMUTH_X, i], geometry[g.AZIMUTH_Y, i]
    block[0, 0] = xx * c * c + across * s * s
    block[0, 1] = (xx - across) * c * s
    block[1, 0] = block[0, 1]
    block[1, 1] = xx * s * s + across * c * c
    block[0, 2] = xz * c
    block[1, 2] = xz * s
    block[2, 0] = zx * c
    block[2, 1] = zx * s
    block[2, 2] = zz


@kernel
def platform_stiffness(problem: Problem, space: Space) -> None:
    """Fill the derivative (6, 6) of the unbalance after `unbalance`: elastic, sag and geometric stiffness together.

    Its skew part is half the moment of the cables' forces: zero in an equilibrium without a given moment.
    """
    geometry, result, block, stiffness = space.geometry, space.result, space.block, space.stiffness
    for j in range(6):
        for k in range(6):
            stiffness[j, k] = 0.0
    for i in range(geometry.shape[1]):
        cable_matrix(problem, space, i)
        rx, ry, rz = geometry[g.LEVER_X, i], geometry[g.LEVER_Y, i], geometry[g.LEVER_Z, i]
        tx = result[tables.HORIZONTAL, i] * geometry[g.AZIMUTH_X, i]
        ty = result[tables.HORIZONTAL, i] * geometry[g.AZIMUTH_Y, i]
        tz = result[tables.VERTICAL, i]
        for j in range(3):
            a, b, c = block[0, j], block[1, j], block[2, j]
            stiffness[0, j] += a
            stiffness[1, j] += b
            stiffness[2, j] += c
            stiffness[3, j] += ry * c - rz * b
            stiffness[4, j] += rz * a - rx * c
            stiffness[5, j] += rx * b - ry * a
        for j in range(3):  # the platform end moves by the rotation's j-th axis times r
            if j == 0:
                dy, dz = -rz, ry
                a, b, c = (
                    block[0, 1] * dy + block[0, 2] * dz,
                    block[1, 1] * dy + block[1, 2] * dz,
                    block[2, 1] * dy + block[2, 2] * dz,
                )
            elif j == 1:
                dx, dz = rz, -rx
                a, b, c = (
                    block[0, 0] * dx + block[0, 2] * dz,
                    block[1, 0] * dx + block[1, 2] * dz,
                    block[2, 0] * dx + block[2, 2] * dz,
                )
            else:
                dx, dy = -ry, rx
                a, b, c = (
                    block[0, 0] * dx + block[0, 1] * dy,
                    block[1, 0] * dx + block[1, 1] * dy,
                    block[2, 0] * dx + block[2, 1] * dy,
                )
            stiffness[0, 3 + j] += a
            stiffness[1, 3 + j] += b
            stiffness[2, 3 + j] += c
            stiffness[3, 3 + j] += ry * c - rz * b
            stiffness[4, 3 + j] += rz * a - rx * c
            stiffness[5, 3 + j] += rx * b - ry * a
        # the force keeps its direction while r turns: r T^T - (r.T) 1
        dot = rx * tx + ry * ty + rz * tz
        stiffness[3, 3] += rx * tx - dot
        stiffness[3, 4] += rx * ty
        stiffness[3, 5] += rx * tz
        stiffness[4, 3] += ry * tx
        stiffness[4, 4] += ry * ty - dot
        stiffness[4, 5] += ry * tz
        stiffness[5, 3] += rz * tx
        stiffness[5, 4] += rz * ty
        stiffness[5, 5] += rz * tz - dot


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
def turned(pose: Array, x: float, y: float, z: float) -> tuple[float, float, float]:
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
