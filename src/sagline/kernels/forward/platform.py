"""The platform on cables of given lengths: wrench at a pose, and derivatives of the wrench with respect to motions.

A motion is a displacement of the center of mass and a rotation vector in world axes. Its rotation is applied after the
rotation of the pose. The unbalance is minus the total wrench on the platform: the gradient of the energy.
"""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels import tables
from sagline.kernels.balance.pose import Triple
from sagline.kernels.cable import geometry as g
from sagline.kernels.cable.forces import forces_from_lengths
from sagline.kernels.cable.geometry import cable_geometry
from sagline.kernels.cable.stiffness import energy_of_cables, plane_of, stiffnesses_in_plane
from sagline.kernels.cable.terms import Model
from sagline.kernels.jit import formula, kernel

Six = tuple[float, float, float, float, float, float]


@kernel
def unbalance(
    model: Model, cables: Array, body: Array, wrench: Array, pose: Array, rotation: Array, rows: Array, gradient: Array
) -> float:
    """Fill rotation, geometry, cable forces, statuses and unbalance (6,) at `pose`. It is the energy's gradient.

    The rows must contain the lengths. Returns the sum of the tensions and the platform's weight [N], to which the
    unbalance is relative.
    """
    cable_geometry(cables, body, pose, rotation, rows)
    forces_from_lengths(model, cables, rows, model.behind)
    weight = body[tables.MASS] * model.gravity
    for k in range(6):
        gradient[k] = -wrench[k]
    gradient[2] += weight
    size = weight + abs(wrench[0]) + abs(wrench[1]) + abs(wrench[2])
    for i in range(cables.shape[0]):
        add_force(rows, i, rows[g.HORIZONTAL, i], rows[g.VERTICAL, i], gradient)
        size += rows[g.HORIZONTAL, i] + abs(rows[g.VERTICAL, i])
    return size


@formula
def add_force(rows: Array, i: int, horizontal: float, vertical: float, wrench: Array) -> None:
    """Add to `wrench` (6,) a force at the platform end of cable `i`, in the cable's plane."""
    x = horizontal * rows[g.AZIMUTH_X, i]
    y = horizontal * rows[g.AZIMUTH_Y, i]
    rx, ry, rz = rows[g.LEVER_X, i], rows[g.LEVER_Y, i], rows[g.LEVER_Z, i]
    wrench[0] += x
    wrench[1] += y
    wrench[2] += vertical
    wrench[3] += ry * vertical - rz * y
    wrench[4] += rz * x - rx * vertical
    wrench[5] += rx * y - ry * x


@kernel
def platform_energy(
    model: Model, cables: Array, body: Array, wrench: Array, pose: Array, rotation: Array, rows: Array
) -> tuple[float, float]:
    """Energy [J] after `unbalance` at the pose, and the sum of the magnitudes of its terms (a measure of rounding).

    The terms are the energies of cables, weight and given force. The result is NaN if the cable model has no energy. A
    given moment, which is constant in world axes, has no potential energy. It is therefore not included.
    """
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
def end_stiffness(rows: Array, i: int) -> tuple[Triple, Triple, Triple]:
    """Stiffness of cable `i` at its platform end in world axes [N/m]: nine numbers, row by row."""
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

    Its skew part is half the moment of the cable forces. This part is zero in equilibrium without a given moment.
    """
    stiffnesses_in_plane(model, cables, rows, model.behind)
    for j in range(6):
        for k in range(6):
            stiffness[j, k] = 0.0
    for i in range(cables.shape[0]):
        (kxx, kxy, kxz), (kyx, kyy, kyz), (kzx, kzy, kzz) = end_stiffness(rows, i)
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
        # the force keeps its direction while r turns: r T^T - (r.T) 1
        tx = rows[g.HORIZONTAL, i] * rows[g.AZIMUTH_X, i]
        ty = rows[g.HORIZONTAL, i] * rows[g.AZIMUTH_Y, i]
        tz = rows[g.VERTICAL, i]
        stiffness[3, 3] -= y * ty + z * tz
        stiffness[3, 4] += x * ty
        stiffness[3, 5] += x * tz
        stiffness[4, 3] += y * tx
        stiffness[4, 4] -= x * tx + z * tz
        stiffness[4, 5] += y * tz
        stiffness[5, 3] += z * tx
        stiffness[5, 4] += z * ty
        stiffness[5, 5] -= x * tx + y * ty
