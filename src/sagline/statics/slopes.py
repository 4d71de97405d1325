"""Derivatives of cable forces and tensions with respect to pose, length and material."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.progress import blocks, rows_of
from sagline.kernels import tables
from sagline.kernels.forward import sensitivity
from sagline.kernels.memory import memory_for
from sagline.robot.batch import first_of, has_routing, pulleys_of
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.routing import kernel_length
from sagline.statics.tables import body_table, cable_table, pose_rows

BLOCK = 1 << 12  # samples per block, about 0.1 s; interrupts are handled between blocks
_TINY = 1e-300


class CableSlopes(NamedTuple):
    """Derivatives of the force of every cable on its platform end, world axes."""

    matrix: Array  # derivative of the unbalanced wrench with respect to platform motion, shape (..., 6, 6)
    blocks: Array  # dT/dB, shape (..., m, 3, 3) [N/m]
    by_length: Array  # dT/dL, shape (..., m, 3) [N/m]
    by_density: Array  # dT/d(rho), shape (..., m, 3) [N m/kg]
    by_stiffness: Array  # dT/d(EA), shape (..., m, 3) [1]
    by_radius: Array  # dT/dR of the pulley, shape (..., m, 3) [N/m]
    by_dead: Array  # dT/d(dead length), shape (..., m, 3) [N/m]
    levers: Array  # levers from the center of mass to the platform ends, shape (..., m, 3) [m]
    force: Array  # forces T on the platform ends, shape (..., m, 3) [N]


def cable_slopes(state: Equilibrium) -> CableSlopes:
    """Derivatives of the cable forces with respect to platform motion and to cable data."""
    shared, cables = first_of(state.robot), state.cables
    bodies, robots = body_table(state.robot), cable_table(state.robot)
    poses, lengths = pose_rows(state.pose), np.atleast_2d(kernel_length(state))
    behind = has_routing(state.robot) or None
    shape, (count, m) = state.pose.shape, lengths.shape
    matrices = np.empty((count, 6, 6))
    stiffness = np.empty((count, m, 3, 3))
    slopes = np.empty((count, sensitivity.DATA, m, 3))
    levers = np.empty((count, m, 3))
    lengths, wrenches = locked(lengths.view()), locked(np.atleast_2d(state.wrench).view())
    code, memory = (cables.model.code, *cables.model.parameters, behind), memory_for(m)
    for part in blocks(count, BLOCK):
        own = (rows_of(bodies, part), rows_of(robots, part), lengths[part], poses[part], rows_of(wrenches, part))
        found = (matrices[part], stiffness[part], slopes[part], levers[part])
        sensitivity.describe_states(code, (shared.freedom, *own), memory, *found)
    centers = poses[:, :3] + _turned(state, bodies[:, tables.CENTER_X :])
    reach = (centers[:, None] + levers - robots[:, :, : tables.PLATFORM_X]).reshape(*shape, m, 3)
    # a vertical cable has no horizontal direction
    level = reach[..., :2] / np.maximum(np.hypot(reach[..., 0], reach[..., 1]), _TINY)[..., None]
    sideways = level * cables.horizontal_tension[..., None]
    return CableSlopes(
        matrices.reshape(*shape, 6, 6),
        stiffness.reshape(*shape, m, 3, 3),
        slopes[:, sensitivity.BY_LENGTH].reshape(*shape, m, 3),
        slopes[:, sensitivity.BY_DENSITY].reshape(*shape, m, 3),
        slopes[:, sensitivity.BY_STIFFNESS].reshape(*shape, m, 3),
        slopes[:, sensitivity.BY_RADIUS].reshape(*shape, m, 3),
        slopes[:, sensitivity.BY_DEAD].reshape(*shape, m, 3),
        levers.reshape(*shape, m, 3),
        np.concatenate((sideways, cables.vertical_force[..., None]), axis=-1),
    )


def _turned(state: Equilibrium, vectors: Array) -> Array:
    """Convert vectors (1 or N, 3) from the platform frame to world axes, (N, 3)."""
    turned: Array = (state.pose.matrix.reshape(-1, 3, 3) @ vectors[..., None])[..., 0]
    return turned


def on_platform(forces: Array, levers: Array) -> Array:
    """Forces at the platform ends as wrenches about the center of mass.

    Shapes: forces (..., m, 3) [N]; levers (..., m, 3) [m]; returns (..., 6, m).
    """
    return np.swapaxes(np.concatenate((forces, np.cross(levers, forces)), axis=-1), -1, -2)


def motions_of_ends(levers: Array) -> Array:
    """Matrices (..., m, 3, 6) that convert a platform motion (6,) [m, rad] to displacements of the platform ends."""
    motion = np.eye(6)
    ends = np.swapaxes(motion[:, :3] + np.cross(motion[:, 3:], levers[..., None, :]), -1, -2)
    return np.ascontiguousarray(ends)


def platform_end_forces(state: Equilibrium) -> Array:
    """Forces on the cables of a single state at their platform ends, world axes [N], (m, 3)."""
    reach = (state.pose.transform(state.one_robot.platform_anchors) - state.exit_point)[:, :2]
    level = reach / np.maximum(np.hypot(reach[:, 0], reach[:, 1]), _TINY)[:, None]
    return np.column_stack((level * state.cables.horizontal_tension[:, None], state.cables.vertical_force))


def frame_end_forces(state: Equilibrium) -> Array:
    """Forces of the cables of a single state on their frame ends, toward the platform, world axes [N], (m, 3)."""
    weight = state.cables.cable_weight[:, None] * np.array([0.0, 0.0, 1.0])
    return np.asarray(platform_end_forces(state) - weight)


_LONGER = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])  # the last column is a change of the cable length by 1 m


def tension_slopes(state: Equilibrium, slopes: CableSlopes) -> tuple[Array, Array]:
    """Derivatives of the tensions at the frame ends with respect to motion and length.

    The motion is (displacement of the center of mass, rotation vector) at fixed lengths, shape (..., m, 6) [N/m,
    N/rad]. The length is that of the same cable, with a fixed platform, shape (..., m) [N/m].
    """
    unit = np.eye(6)
    ends = unit[:, :3] + np.cross(unit[:, 3:], slopes.levers[..., None, :])
    forces = np.concatenate((ends @ np.swapaxes(slopes.blocks, -1, -2), slopes.by_length[..., None, :]), axis=-2)
    if state.contact is None:
        found = _at_anchors(state, slopes, forces)
    else:
        ends = np.concatenate((ends, np.zeros_like(slopes.levers)[..., None, :]), axis=-2)
        found = _leaving(state, slopes, forces, ends)
    return found[..., :6], found[..., 6]


def _at_anchors(state: Equilibrium, slopes: CableSlopes, forces: Array) -> Array:
    """Derivatives of the tension if there are no pulleys, from force changes (..., m, 7, 3) at the platform ends."""
    cables = state.cables
    at_frame, forces = slopes.force.copy(), forces.copy()
    at_frame[..., 2] -= cables.cable_weight
    forces[..., 2] -= _weight(state)[..., None] * _LONGER
    # a cable without force has no direction
    direction = at_frame / np.maximum(np.linalg.norm(at_frame, axis=-1, keepdims=True), _TINY)
    slope: Array = np.einsum("...ik,...ijk->...ij", direction, forces)
    return slope


def _leaving(state: Equilibrium, slopes: CableSlopes, forces: Array, ends: Array) -> Array:
    """Derivatives of the tension if there are pulleys. H = T + T^2/(2 EA) - w z is constant along a cable.

    Shapes: forces (..., m, 7, 3).
    """
    cables, contact = state.cables, state.contact
    assert contact is not None
    stiffness, weight = cables.cable.axial_stiffness, _weight(state)
    at_end, leaving = cables.platform_end_tension, cables.frame_end_tension
    by_end = np.einsum("...ik,...ijk->...ij", slopes.force / np.maximum(at_end, _TINY)[..., None], forces)
    whole = (1.0 + at_end / stiffness)[..., None] * by_end - weight[..., None] * ends[..., 2]
    radius, entry = pulleys_of(state.robot)
    turned = forces.copy()
    turned[..., 2] -= weight[..., None] * _LONGER
    sine, cosine = np.sin(contact.wrap_angle), np.cos(contact.wrap_angle)
    level = slopes.force[..., :2] / np.maximum(cables.horizontal_tension, _TINY)[..., None]
    around = np.concatenate((level * cosine[..., None], (-entry * sine)[..., None]), axis=-1)
    angle = np.einsum("...ik,...ijk->...ij", around / np.maximum(leaving, _TINY)[..., None], turned)
    raised = (weight * radius * entry * cosine)[..., None] * angle
    slope: Array = (whole + raised) / (1.0 + leaving / stiffness)[..., None]
    return slope


def _weight(state: Equilibrium) -> Array:
    """Cable weight per length in the cable model [N/m], shape (..., m)."""
    cables = state.cables
    weight = 0.0 if cables.model.weightless else cables.cable.linear_density * cables.gravity
    return np.broadcast_to(weight, cables.shape)
