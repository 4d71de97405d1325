"""Stiffness of the platform on its cables, what its pose is sensitive to, and how it vibrates."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, locked
from sagline.kernels.forward.sensitivity import BY_DENSITY, BY_LENGTH, BY_STIFFNESS, describe_states
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.several import bodies_of, first_of
from sagline.statics.tables import body_table, cable_table, pose_rows

_SINGULAR = 1e-14  # determinant, at diagonal elements of 1


class CableSlopes(NamedTuple):
    """How every cable's force on its platform end changes, world axes.

    Attributes:
        matrix: Derivative of the platform's unbalance by its motion, shape (..., 6, 6).
        blocks: dT/dB, shape (..., m, 3, 3) [N/m].
        by_length: dT/dL, shape (..., m, 3) [N/m].
        by_density: dT/d(rho), shape (..., m, 3) [N m/kg].
        by_stiffness: dT/d(EA), shape (..., m, 3) [1].
        levers: From the center of mass to the platform ends, shape (..., m, 3) [m].
    """

    matrix: Array
    blocks: Array
    by_length: Array
    by_density: Array
    by_stiffness: Array
    levers: Array


@dataclass(frozen=True, slots=True, eq=False)
class Stiffness:
    """Result of `stiffness`, single or with a leading axis N.

    Motions are (displacement of the center of mass [m], rotation vector [rad]), wrenches (force [N], moment [N m])
    about it, all in world axes. Sensitivities are zero in motions that the robot's pattern does not have, and NaN where
    the stiffness is singular.

    Attributes:
        state: The state it belongs to.
        matrix: -d(wrench of the cables)/d(motion) at fixed lengths: elastic, sag and geometric stiffness, shape
            (..., 6, 6). Symmetric but for half the given moment, whose direction does not turn with the platform.
        compliance: d(motion)/d(wrench on the platform), shape (..., 6, 6).
        length_sensitivity: d(motion)/dL of each cable, shape (..., 6, m) [m/m, rad/m].
        density_sensitivity: d(motion)/d(linear density) of each cable, shape (..., 6, m) [m^2/kg, rad m/kg].
        stiffness_sensitivity: d(motion)/d(axial stiffness) of each cable, shape (..., 6, m) [m/N, rad/N].
    """

    state: Equilibrium
    matrix: Array
    compliance: Array
    length_sensitivity: Array
    density_sensitivity: Array
    stiffness_sensitivity: Array


@dataclass(frozen=True, slots=True, eq=False)
class Modes:
    """Result of `modes`, single or with a leading axis N; n is the number of free motions.

    Attributes:
        state: The state it belongs to.
        frequency: Natural frequencies [Hz], ascending, shape (..., n); NaN for a motion that the state does not hold.
        shape: Motions (displacement of the center of mass, rotation vector, world axes) of unit modal mass, one a
            column, shape (..., 6, n) [m/sqrt(kg), rad/(sqrt(kg) m)].
    """

    state: Equilibrium
    frequency: Array
    shape: Array


def stiffness(state: Equilibrium) -> Stiffness:
    """Stiffness of the platform at fixed unstrained lengths, and what its pose is sensitive to; all analytic.

    Args:
        state: An equilibrium, single or N of them, from `inverse` or `forward`.

    Returns:
        Stiffness; NaN where the state has no lengths, and for straight cables, which have none.

    Examples:
        How far 100 N upwards lift the platform, and how far 1 mm more of cable 0 does:

        >>> import numpy as np
        >>> import sagline as sl
        >>> plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((1.0, 0.5, 1.5), np.eye(3)))
        >>> found = sl.stiffness(plan.state)
        >>> print(f"{1e3 * 100.0 * found.compliance[2, 2]:.3f} mm")
        1.438 mm
        >>> print(f"{1e3 * 1e-3 * found.length_sensitivity[2, 0]:.3f} mm")
        -0.303 mm

    Source:
        docs/model.md, section 6.
    """
    slopes = cable_slopes(state)
    compliance = _compliance(first_of(state.robot).freedom, slopes.matrix)
    return Stiffness(
        state=state,
        matrix=locked(slopes.matrix),
        compliance=locked(compliance),
        length_sensitivity=locked(-compliance @ on_platform(slopes.by_length, slopes.levers)),
        density_sensitivity=locked(-compliance @ on_platform(slopes.by_density, slopes.levers)),
        stiffness_sensitivity=locked(-compliance @ on_platform(slopes.by_stiffness, slopes.levers)),
    )


def modes(state: Equilibrium) -> Modes:
    """Natural frequencies and shapes of the platform on its cables, whose own mass does not swing.

    Args:
        state: An equilibrium, single or N of them. Its pattern's motions must have mass: give an inertia.

    Returns:
        Modes; NaN where the state has no lengths.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> plan = sl.inverse(sl.load_robot("cogiro"), sl.Pose((1.0, 0.5, 1.5), np.eye(3)))
        >>> print(sl.modes(plan.state).frequency.round(2), "Hz")
        [ 4.38  5.31  6.93  8.05 10.88 13.17] Hz
    """
    freedom = first_of(state.robot).freedom
    matrix = freedom @ cable_slopes(state).matrix @ freedom.T
    lower = np.linalg.cholesky(freedom @ _mass_matrix(state) @ freedom.T)
    inverse = np.linalg.inv(lower)
    scaled = inverse @ (0.5 * (matrix + np.swapaxes(matrix, -1, -2))) @ np.swapaxes(inverse, -1, -2)
    absent = np.asarray(np.isnan(scaled).any(axis=(-1, -2), keepdims=True))
    squares, vectors = np.linalg.eigh(np.where(absent, 0.0, scaled))
    shape = freedom.T @ np.swapaxes(inverse, -1, -2) @ vectors
    held = np.asarray((squares > 0.0) & ~absent[..., 0])
    frequency = np.where(held, np.sqrt(np.where(held, squares, 0.0)) / (2.0 * np.pi), np.nan)
    return Modes(state, locked(frequency), locked(np.where(absent, np.nan, shape)))


def cable_slopes(state: Equilibrium) -> CableSlopes:
    """How the cables' forces change with the platform's motion and with their own data.

    Args:
        state: An equilibrium, single or N of them.

    Returns:
        The slopes; NaN where the state has no lengths.
    """
    shared, cables = first_of(state.robot), state.cables
    shape, m = state.pose.shape, shared.cable_count
    lengths = np.atleast_2d(cables.unstrained_length)
    count = len(lengths)
    matrices = np.empty((count, 6, 6))
    blocks = np.empty((count, m, 3, 3))
    slopes = np.empty((count, 3, m, 3))
    levers = np.empty((count, m, 3))
    describe_states(
        cables.model.code,
        *cables.model.parameters,
        shared.freedom,
        body_table(state.robot),
        cable_table(state.robot),
        locked(lengths.view()),
        pose_rows(state.pose),
        locked(np.atleast_2d(state.wrench).view()),
        matrices,
        blocks,
        slopes,
        levers,
    )
    return CableSlopes(
        matrices.reshape(*shape, 6, 6),
        blocks.reshape(*shape, m, 3, 3),
        slopes[:, BY_LENGTH].reshape(*shape, m, 3),
        slopes[:, BY_DENSITY].reshape(*shape, m, 3),
        slopes[:, BY_STIFFNESS].reshape(*shape, m, 3),
        levers.reshape(*shape, m, 3),
    )


def on_platform(forces: Array, levers: Array) -> Array:
    """Forces at the platform ends as wrenches about the center of mass.

    Args:
        forces: Of each cable, world axes [N] or N by something, shape (..., m, 3).
        levers: From the center of mass to the platform ends [m], shape (..., m, 3).

    Returns:
        Columns of force and moment, shape (..., 6, m).
    """
    return np.swapaxes(np.concatenate((forces, np.cross(levers, forces)), axis=-1), -1, -2)


def _compliance(freedom: Array, matrix: Array) -> Array:
    """Inverse on the free motions, zero on the others; NaN where it is singular."""
    return freedom.T @ _inverse(freedom @ matrix @ freedom.T) @ freedom


def _inverse(matrix: Array) -> Array:
    """Inverse of each matrix; NaN where it is singular or NaN."""
    unit = np.eye(matrix.shape[-1])
    known = np.where(np.isnan(matrix).any(axis=(-1, -2), keepdims=True), 0.0, matrix)
    diagonal = np.abs(np.einsum("...ii->...i", known))
    scale = np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    balanced = known / (scale[..., :, None] * scale[..., None, :])  # newtons and newton meters alike
    lost = np.abs(np.linalg.det(balanced))[..., None, None] < _SINGULAR
    inverse: Array = np.linalg.inv(np.where(lost, unit, known))
    return np.where(lost, np.nan, inverse)


def _mass_matrix(state: Equilibrium) -> Array:
    """Mass and inertia about the center of mass in world axes, shape (..., 6, 6)."""
    rotation = state.pose.matrix
    body = bodies_of(state.robot)
    mass = np.zeros((*state.pose.shape, 6, 6))
    mass[..., :3, :3] = body.mass[..., None, None] * np.eye(3)
    mass[..., 3:, 3:] = rotation @ body.inertia @ np.swapaxes(rotation, -1, -2)
    return mass
