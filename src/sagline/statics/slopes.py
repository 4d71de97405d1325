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

BLOCK = 1 << 12  # number of samples per block, which takes about 0.1 s; Ctrl-C is handled between blocks
_TINY = 1e-300


class CableSlopes(NamedTuple):
    """Derivatives of the forces that cables exert on their platform ends, in world axes."""

    matrix: Array  # derivative of the unbalance by platform motion, shape (..., 6, 6)
    blocks: Array  # dT/dB, shape (..., m, 3, 3) [N/m]
    by_length: Array  # dT/dL, shape (..., m, 3) [N/m]
    by_density: Array  # dT/d(rho), shape (..., m, 3) [N m/kg]
    by_stiffness: Array  # dT/d(EA), shape (..., m, 3) [1]
    by_radius: Array  # dT/dR of the pulley, shape (..., m, 3) [N/m]
    by_dead: Array  # dT/d(dead length), shape (..., m, 3) [N/m]
    levers: Array  # vectors from the center of mass to the platform ends, shape (..., m, 3) [m]
    force: Array  # forces T on the platform ends, shape (..., m, 3) [N]


def cable_slopes(state: Equilibrium) -> CableSlopes:
    """Derivatives of the cable forces by platform motion, by cable length and by cable data."""
    shared, cables = first_of(state.robot), state.cables
    bodies, robots = body_table(state.robot), cable_table(state.robot, slanted=True)
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
    # avoid division by zero for a vertical cable
    level = reach[..., :2] / np.maximum(np.hypot(reach[..., 0], reach[..., 1]), _TINY)[..., None]
    if state.contact is not None and state.contact.azimuth is not None:
        level = np.stack((np.cos(state.contact.azimuth), np.sin(state.contact.azimuth)), axis=-1)
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
    """Vectors in world axes, (N, 3), from vectors in the platform frame, (1 or N, 3)."""
    turned: Array = (state.pose.matrix.reshape(-1, 3, 3) @ vectors[..., None])[..., 0]
    return turned


def on_platform(forces: Array, levers: Array) -> Array:
    """Wrenches (..., 6, m) of forces at the platform ends about the center of mass.

    forces: (..., m, 3) [N]; levers: vectors from the center of mass to the platform ends, (..., m, 3) [m].
    """
    return np.swapaxes(np.concatenate((forces, np.cross(levers, forces)), axis=-1), -1, -2)


def motions_of_ends(levers: Array) -> Array:
    """Matrices (..., m, 3, 6) that give the displacements of platform ends for a platform motion (6,) [m, rad]."""
    motion = np.eye(6)
    ends = np.swapaxes(motion[:, :3] + np.cross(motion[:, 3:], levers[..., None, :]), -1, -2)
    return np.ascontiguousarray(ends)


def platform_end_forces(state: Equilibrium) -> Array:
    """Forces (m, 3) on the cables at their platform ends, world axes [N]; for a state with a single pose."""
    reach = (state.pose.transform(state.one_robot.platform_anchors) - state.exit_point)[:, :2]
    level = reach / np.maximum(np.hypot(reach[:, 0], reach[:, 1]), _TINY)[:, None]
    return np.column_stack((level * state.cables.horizontal_tension[:, None], state.cables.vertical_force))


def frame_end_forces(state: Equilibrium) -> Array:
    """Forces (m, 3) that cables exert on their frame ends, world axes [N]; for a state with a single pose."""
    weight = state.cables.cable_weight[:, None] * np.array([0.0, 0.0, 1.0])
    return np.asarray(platform_end_forces(state) - weight)


_LONGER = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])  # change of the cable length by 1 m, after six motions


def tension_slopes(state: Equilibrium, slopes: CableSlopes) -> tuple[Array, Array]:
    """Derivatives of the frame-end tensions by platform motion, (..., m, 6), and by cable length, (..., m).

    The motion is (displacement of the center of mass, rotation vector) at fixed lengths [N/m, N/rad]. The length is the
    length of the cable itself, with a fixed platform [N/m].
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
    """Derivatives of frame-end tensions without pulleys; forces: changes (..., m, 7, 3) of platform-end forces."""
    cables = state.cables
    at_frame, forces = slopes.force.copy(), forces.copy()
    at_frame[..., 2] -= cables.cable_weight
    forces[..., 2] -= _weight(state)[..., None] * _LONGER
    # avoid division by zero for a cable without force
    direction = at_frame / np.maximum(np.linalg.norm(at_frame, axis=-1, keepdims=True), _TINY)
    slope: Array = np.einsum("...ik,...ijk->...ij", direction, forces)
    return slope


def _leaving(state: Equilibrium, slopes: CableSlopes, forces: Array, ends: Array) -> Array:
    """Derivatives of the frame-end tensions of cables with pulleys.

    H = T + T^2/(2 EA) - w z is constant along a cable. forces: changes (..., m, 7, 3) of the platform-end forces.
    """
    cables, contact = state.cables, state.contact
    assert contact is not None
    stiffness, weight = cables.cable.axial_stiffness, _weight(state)
    at_end, leaving = cables.platform_end_tension, cables.frame_end_tension
    by_end = np.einsum("...ik,...ijk->...ij", slopes.force / np.maximum(at_end, _TINY)[..., None], forces)
    whole = (1.0 + at_end / stiffness)[..., None] * by_end - weight[..., None] * ends[..., 2]
    turned = forces.copy()
    turned[..., 2] -= weight[..., None] * _LONGER
    if contact.azimuth is not None:
        lifted = weight[..., None] * _rise_of_exit(state, slopes, turned)
        return np.asarray((whole + lifted) / (1.0 + leaving / stiffness)[..., None])
    radius, entry = pulleys_of(state.robot)
    sine, cosine = np.sin(contact.wrap_angle), np.cos(contact.wrap_angle)
    level = slopes.force[..., :2] / np.maximum(cables.horizontal_tension, _TINY)[..., None]
    around = np.concatenate((level * cosine[..., None], (-entry * sine)[..., None]), axis=-1)
    angle = np.einsum("...ik,...ijk->...ij", around / np.maximum(leaving, _TINY)[..., None], turned)
    raised = (weight * radius * entry * cosine)[..., None] * angle
    slope: Array = (whole + raised) / (1.0 + leaving / stiffness)[..., None]
    return slope


def _rise_of_exit(state: Equilibrium, slopes: CableSlopes, changes: Array) -> Array:
    """Rise of the exit points (..., m, k) [m] for `changes` (..., m, k, 3) of the forces at the exit points [N]."""
    table = cable_table(state.robot, slanted=True)
    table = table if state.pose.shape else table[0]
    axis, radius = table[..., tables.AXIS_X :], table[..., tables.PULLEY_RADIUS]
    force = slopes.force.copy()
    force[..., 2] -= state.cables.cable_weight
    along = (force * axis).sum(axis=-1)
    outward = force - along[..., None] * axis
    across, tension = np.linalg.norm(outward, axis=-1), np.linalg.norm(force, axis=-1)
    outward = outward / np.maximum(across, _TINY)[..., None]
    sine, cosine = across / np.maximum(tension, _TINY), along / np.maximum(tension, _TINY)
    normal = sine[..., None] * axis - cosine[..., None] * outward
    turn = -np.einsum("...ik,...ijk->...ij", normal / np.maximum(tension, _TINY)[..., None], changes)
    sideways = np.cross(axis, outward)
    # v/|F_p| = R tan(psi/2)/T is regular for a cable along its axis
    swing = np.tan(0.5 * np.arctan2(across, along)) / np.maximum(tension, _TINY) * sideways[..., 2]
    rise = (sine * outward[..., 2] + cosine * axis[..., 2])[..., None] * turn
    return np.asarray(
        radius[..., None] * (rise + np.einsum("...ik,...ijk->...ij", swing[..., None] * sideways, changes))
    )


def _weight(state: Equilibrium) -> Array:
    """Cable weight per length [N/m], shape (..., m); zero in the weightless models."""
    cables = state.cables
    weight = 0.0 if cables.model.weightless else cables.cable.linear_density * cables.gravity
    return np.broadcast_to(weight, cables.shape)
