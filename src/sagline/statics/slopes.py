"""Derivatives of cable forces and tensions with respect to pose, length and material."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sagline.core.arrays import Array, Indices, blocks, rows_of
from sagline.kernels import tables
from sagline.kernels.cable import swivel
from sagline.kernels.forward import sensitivity
from sagline.kernels.memory import memory_for
from sagline.robot import batch
from sagline.robot.batch import has_routing, outward
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.routing import kernel_length
from sagline.statics.tables import pose_rows, robot_terms

if TYPE_CHECKING:
    from sagline.kernels.forward.platform import ForwardTerms

BLOCK = 1 << 12  # number of samples per block, which takes about 0.1 s; Ctrl-C is handled between blocks


class CableSlopes(NamedTuple):
    """Derivatives of the forces that cables exert on their platform ends, in world axes, and of the tensions."""

    matrix: Array  # derivative of the unbalance by platform motion, shape (..., 6, 6)
    blocks: Array  # dT/dB, shape (..., m, 3, 3) [N/m]
    by_length: Array  # dT/dL, shape (..., m, 3) [N/m]
    by_density: Array  # dT/d(rho), shape (..., m, 3) [N m/kg]
    by_stiffness: Array  # dT/d(EA), shape (..., m, 3) [1]
    levers: Array  # vectors from the center of mass to the platform ends, shape (..., m, 3) [m]
    force: Array  # forces T on the platform ends, shape (..., m, 3) [N]
    tension_by_motion: Array  # frame-end tensions by platform motion at fixed lengths, shape (..., m, 6) [N/m, N/rad]
    tension_by_length: Array  # frame-end tensions by the cable's own length, fixed platform, shape (..., m) [N/m]


class KernelStates(NamedTuple):
    """Arguments of kernels about N equilibria, and the arrays that `describe_states` fills."""

    terms: ForwardTerms
    robots: tuple[Array, Array, Array]
    poses: Array
    results: Array
    memory: tuple[Array, Indices]
    found: tuple[Array, ...]

    @classmethod
    def of(cls, state: Equilibrium) -> KernelStates:
        """Arguments for an equilibrium, and empty arrays."""
        cables, contact, robots = state.cables, state.contact, robot_terms(state.robot, slanted=True)
        slanted = robots[2].shape[2] > tables.CABLE_COLUMNS
        length = kernel_length(state) if slanted else state.unstrained_length
        rows = [cables.span, cables.rise, length, cables.horizontal_tension, cables.vertical_force, state.chord_tension]
        if contact is not None:
            rows += [contact.wrap_angle, contact.wrapped_length, contact.dead_length, contact.chord_sine]
        results = np.array(rows).reshape(len(rows), -1, length.shape[-1])
        terms = (cables.model.code, *cables.model.parameters, has_routing(state.robot) or None)
        return cls.of_rows(terms, robots, pose_rows(state.pose), results)

    @classmethod
    def of_rows(
        cls, terms: ForwardTerms, robots: tuple[Array, Array, Array], poses: Array, results: Array
    ) -> KernelStates:
        """Arguments for N results of the kernels, and empty arrays."""
        count, m = results.shape[1:]
        shapes = ((6, 6), (m, 3, 3), (swivel.DATA, m, 3), (m, 3), (m, 3), (m, 7))
        arrays = tuple(np.empty((count, *shape)) for shape in shapes)
        return cls(terms, robots, poses, results, memory_for(m), arrays)

    def parts(self, *more: tuple[Array, ...]) -> Iterator[tuple[Any, ...]]:
        """Arguments of the kernels, block by block. `more`: further arrays to be filled, with one row per state."""
        free, bodies, robots = self.robots
        for part in blocks(len(self.poses), BLOCK):
            robot = free, rows_of(bodies, part), rows_of(robots, part)
            results = np.ascontiguousarray(self.results[:, part])
            found = [tuple(array[part] for array in arrays) for arrays in (self.found, *more)]
            yield (self.terms, robot, self.poses[part], results, self.memory, *found)

    def describe(self) -> KernelStates:
        """Fill the arrays."""
        for arguments in self.parts():
            sensitivity.describe_states(*arguments)
        return self


def stiffness_and_levers(state: Equilibrium) -> tuple[Array, Array]:
    """Derivative (..., 6, 6) of the unbalance by platform motion, and `CableSlopes.levers`."""
    matrix, _, _, levers, *_ = KernelStates.of(state).describe().found
    shape = state.pose.shape
    return matrix.reshape(*shape, 6, 6), levers.reshape(*shape, *levers.shape[1:])


def cable_slopes(state: Equilibrium) -> CableSlopes:
    """Derivatives of the cable forces by platform motion, by cable length and by cable data."""
    matrix, stiffness, slopes, levers, force, tensions = (
        array.reshape(*state.pose.shape, *array.shape[1:]) for array in KernelStates.of(state).describe().found
    )
    by_length, by_density, by_stiffness = (slopes[..., k, :, :] for k in range(3))
    by_tension = tensions[..., :6], tensions[..., 6]
    return CableSlopes(matrix, stiffness, by_length, by_density, by_stiffness, levers, force, *by_tension)


def on_platform(forces: Array, levers: Array) -> Array:
    """Wrenches (..., 6, m) of forces at the platform ends about the center of mass."""
    # forces: (..., m, 3) [N]; levers: vectors from the center of mass to the platform ends, (..., m, 3) [m].
    return np.swapaxes(np.concatenate((forces, np.cross(levers, forces)), axis=-1), -1, -2)


def wrenches_by_length(state: Equilibrium, slopes: CableSlopes) -> Array:
    """Derivatives of the unbalance by the lengths of the cables, at a fixed pose, shape (..., 6, m) [N/m, N]."""
    found, aboard = on_platform(slopes.by_length, slopes.levers), batch.on_platform(state.robot)
    if not aboard.any():
        return found
    # Drum D on the platform: dU/dL = -(T + T^2/(2 EA) + w (z_D - z_B)), with the tension T at the frame anchor B.
    cables, (center,) = state.cables, batch.robot_fields(state.robot, "center_of_mass")
    drums = (batch.drums_on_platform(state.robot) - center[..., None, :]) @ np.swapaxes(state.pose.matrix, -1, -2)
    weight = 0.0 if cables.model.weightless else cables.cable.linear_density * cables.gravity
    strained = 1.0 + cables.frame_end_tension / cables.cable.axial_stiffness
    lifted = np.asarray(weight)[..., None] * motions_of_ends(drums)[..., 2, :]
    energy = strained[..., None] * slopes.tension_by_motion + lifted
    return np.where(aboard[..., None, :], -np.swapaxes(energy, -1, -2), found)


def motions_of_ends(levers: Array) -> Array:
    """Matrices (..., m, 3, 6) that give the displacements of platform ends for a platform motion (6,) [m, rad]."""
    motion = np.eye(6)
    ends = np.swapaxes(motion[:, :3] + np.cross(motion[:, 3:], levers[..., None, :]), -1, -2)
    return np.ascontiguousarray(ends)


def platform_end_forces(state: Equilibrium) -> Array:
    """Forces (..., m, 3) on the cables at their platform ends, world axes [N]."""
    azimuth = None if state.contact is None else state.contact.azimuth
    level = (
        outward(state.robot, state.pose)[..., :2]
        if azimuth is None
        else np.stack((np.cos(azimuth), np.sin(azimuth)), -1)
    )
    sideways = level * state.cables.horizontal_tension[..., None]
    return np.concatenate((sideways, state.cables.vertical_force[..., None]), axis=-1)


def frame_end_forces(state: Equilibrium) -> Array:
    """Forces (..., m, 3) that the free spans exert on the frame at their exit points, world axes [N]."""
    forces = platform_end_forces(state)
    forces[..., 2] -= state.cables.cable_weight
    return forces
