"""Stiffness of the platform on its cables, sensitivities of the pose, and natural modes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sagline.core.arguments import check_memory
from sagline.core.arrays import Array, Flags, locked
from sagline.core.results import Columns, Result, Tabular
from sagline.kernels.cable import swivel
from sagline.kernels.forward import sensitivity
from sagline.kernels.memory import memory_for
from sagline.robot.batch import first_of, robot_fields
from sagline.robot.equilibrium import Equilibrium, of_equilibrium
from sagline.statics.slopes import KernelStates, stiffness_and_levers
from sagline.statics.strings import strings_below, strings_of

# A squared frequency counts as zero if it is smaller than this share of the largest.
NEUTRAL, UNSTABLE = 1e-13, 1e-10
_STIFFNESS_BYTES, _MODES_BYTES = 2500.0, 800.0  # [bytes], memory per cable and pose


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Stiffness(Result):
    """Result of `stiffness`, single or with a leading axis N.

    A motion is (displacement of the center of mass [m], rotation vector [rad]) in world axes. A wrench is (force [N],
    moment [N m]) about the center of mass in world axes. Sensitivities of motions that the motion pattern does not
    allow are zero. All sensitivities are NaN if the stiffness is singular.

    Attributes:
        state: Equilibrium at which the stiffness is computed.
        matrix: -d(wrench of the cables)/d(motion) at fixed lengths, shape (..., 6, 6): the sum of elastic, sag and
            geometric stiffness. The skew part is half of the external moment, which does not rotate with the platform.
        compliance: d(motion)/d(wrench on the platform), shape (..., 6, 6).
        length_sensitivity: d(motion)/dL of each cable, shape (..., 6, m) [m/m, rad/m].
        density_sensitivity: d(motion)/d(linear density) of each cable, shape (..., 6, m) [m^2/kg, rad m/kg].
        stiffness_sensitivity: d(motion)/d(axial stiffness) of each cable, shape (..., 6, m) [m/N, rad/N].
        pulley_radius_sensitivity: d(motion)/d(pulley radius) of each cable at constant length off the drum, shape (...,
            6, m) [m/m, rad/m].
        dead_cable_sensitivity: d(motion)/d(dead length) of each cable at constant length off the drum, shape (..., 6,
            m) [m/m, rad/m].
        cable_stiffness: dT/dB of each cable; T is the force on the platform end, B the position of the platform end,
            world axes, shape (..., m, 3, 3) [N/m].
        frame_anchor_sensitivity: d(motion)/d(frame anchor, world axes) at fixed lengths, shape (..., 6, m, 3)
            [m/m, rad/m].
        platform_anchor_sensitivity: d(motion)/d(platform anchor, platform frame) at fixed lengths, shape (..., 6, m, 3)
            [m/m, rad/m].
        tension_sensitivity: d(tension at the frame end of cable i)/dL_j with the platform in equilibrium, shape (...,
            m, m) [N/m].
        null_lengths: Orthonormal columns of length changes that do not move the platform to first order, shape (..., m,
            m - n), where n is the number of free motions; no columns if m <= n.
    """

    state: Equilibrium
    matrix: Array
    compliance: Array
    length_sensitivity: Array
    density_sensitivity: Array
    stiffness_sensitivity: Array
    pulley_radius_sensitivity: Array
    dead_cable_sensitivity: Array
    cable_stiffness: Array
    frame_anchor_sensitivity: Array
    platform_anchor_sensitivity: Array
    tension_sensitivity: Array
    null_lengths: Array


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Modes(Result, Tabular):
    """Result of `modes`, single or with a leading axis N; n is the number of free motions.

    Attributes:
        state: Equilibrium about which the platform vibrates.
        frequency: Natural frequencies [Hz], ascending, shape (..., n); 0 without stiffness, NaN for unstable motions.
        shape: Mode shapes, scaled to a modal mass of 1, as columns (displacement of the center of mass, rotation
            vector) in world axes, shape (..., 6, n) [m/sqrt(kg), rad/(sqrt(kg) m)].
    """

    _columns: ClassVar[Columns] = ("state.pose", "f#=frequency")

    state: Equilibrium
    frequency: Array
    shape: Array

    @property
    def above_strings(self) -> Flags:
        """True (..., n) for each mode with a frequency above the lowest frequency of any cable with fixed ends.

        A mode above this frequency is not a good approximation, because cables also vibrate (see `vibration`). The
        result is False for a motion without stiffness.
        """
        frequency = np.nan_to_num(self.frequency.reshape(-1, self.frequency.shape[-1]))
        below = strings_below(strings_of(self.state), frequency)
        return locked(np.asarray((below > 0).any(axis=-1)).reshape(self.frequency.shape))


@of_equilibrium
def stiffness(state: Equilibrium) -> Stiffness:
    """Compute the stiffness of the platform at fixed unstrained lengths, and sensitivities of the pose.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments: robot, poses.

    Returns:
        Stiffness; NaN at a pose without a solution, and for straight cables, whose stiffness is undefined.

    Raises:
        InvalidValueError: If `state` has another type.

    Examples:
        Change of the platform height due to an upward force of 100 N, and due to 1 mm more length of cable 0:

        >>> import numpy as np
        >>> import sagline as sl
        >>> pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
        >>> plan = sl.inverse(sl.load_robot("cogiro"), pose)
        >>> found = sl.stiffness(plan.state)
        >>> print(f"{1e3 * 100.0 * found.compliance[2, 2]:.3f} mm")
        1.438 mm
        >>> print(f"{1e3 * 1e-3 * found.length_sensitivity[2, 0]:.3f} mm")
        -0.303 mm

    Source:
        docs/model.md, section 6.
    """
    _check_state(state, _STIFFNESS_BYTES)
    given, arrays, m = KernelStates.of(state), sensitivity_arrays(state), state.cables.shape[-1]
    for arguments in given.parts(arrays):
        sensitivity.sensitivities_of_states(*arguments)
    shape = state.pose.shape
    compliance, by_data, by_frame, by_platform, tensions, null = arrays
    data = [by_data[:, k].reshape(*shape, 6, m) for k in range(swivel.DATA)]
    anchors = [array.reshape(*shape, 6, m, 3) for array in (by_frame, by_platform)]
    return Stiffness(
        state=state,
        matrix=locked(given.found[0].reshape(*shape, 6, 6)),
        compliance=locked(compliance.reshape(*shape, 6, 6)),
        length_sensitivity=locked(data[sensitivity.BY_LENGTH]),
        density_sensitivity=locked(data[sensitivity.BY_DENSITY]),
        stiffness_sensitivity=locked(data[sensitivity.BY_STIFFNESS]),
        pulley_radius_sensitivity=locked(data[sensitivity.BY_RADIUS]),
        dead_cable_sensitivity=locked(data[sensitivity.BY_DEAD]),
        cable_stiffness=locked(given.found[1].reshape(*shape, m, 3, 3)),
        frame_anchor_sensitivity=locked(anchors[0]),
        platform_anchor_sensitivity=locked(anchors[1]),
        tension_sensitivity=locked(tensions.reshape(*shape, m, m)),
        null_lengths=locked(null.reshape(*shape, m, null.shape[-1])),
    )


def sensitivity_arrays(state: Equilibrium) -> tuple[Array, ...]:
    """Empty arrays that `sensitivities_of_states` fills."""
    shape, n = state.cables.shape, first_of(state.robot).degrees_of_freedom
    count, m = math.prod(shape[:-1]), shape[-1]
    shapes = ((6, 6), (swivel.DATA, 6, m), (6, 3 * m), (6, 3 * m), (m, m), (m, max(m - n, 0)))
    return tuple(np.empty((count, *one)) for one in shapes)


@of_equilibrium
def modes(state: Equilibrium) -> Modes:
    """Compute natural frequencies and mode shapes of the platform on massless cables.

    Args:
        state: An equilibrium, single or N of them. Also accepted: a plan, a solution, or two arguments: robot, poses.
            The free motions must have mass; rotations require an inertia.

    Returns:
        Modes; NaN at a pose without a solution.

    Raises:
        InvalidValueError: If `state` has another type.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
        >>> plan = sl.inverse(sl.load_robot("cogiro"), pose)
        >>> print(sl.modes(plan.state).frequency.round(2), "Hz")
        [ 4.38  5.31  6.93  8.05 10.88 13.17] Hz
    """
    _check_state(state, _MODES_BYTES)
    freedom = first_of(state.robot).freedom
    matrix = freedom @ stiffness_and_levers(state)[0] @ freedom.T
    lower = np.linalg.cholesky(freedom @ mass_matrix(state) @ freedom.T)
    inverse = np.linalg.inv(lower)
    scaled = inverse @ (0.5 * (matrix + np.swapaxes(matrix, -1, -2))) @ np.swapaxes(inverse, -1, -2)
    absent = np.asarray(np.isnan(scaled).any(axis=(-1, -2), keepdims=True))
    squares, vectors = np.linalg.eigh(np.where(absent, 0.0, scaled))
    shape = freedom.T @ np.swapaxes(inverse, -1, -2) @ vectors
    frequency = np.where(absent[..., 0], np.nan, natural_frequency(squares))
    return Modes(state, locked(frequency), locked(np.where(absent, np.nan, shape)))


def smallest_stiffness(state: Equilibrium) -> Array:
    """Smallest stiffness of the platform against its free motions [N/m], shape (...,); NaN without a solution."""
    # The size of a rotation is its arc at the root mean square distance of the platform ends from the center of mass.
    _check_state(state, _MODES_BYTES)
    (whole, levers), freedom = stiffness_and_levers(state), first_of(state.robot).freedom
    radius = np.sqrt((levers**2).sum(axis=-1).mean(axis=-1))[..., None]
    turning = np.abs(freedom[:, 3:]).max(axis=1) > 0.0
    unit = np.where(turning & (radius > 0.0), 1.0 / np.where(radius > 0.0, radius, 1.0), 1.0)
    matrix = unit[..., :, None] * (freedom @ whole @ freedom.T) * unit[..., None, :]
    absent = np.asarray(np.isnan(matrix).any(axis=(-1, -2)))
    symmetric = 0.5 * (matrix + np.swapaxes(matrix, -1, -2))
    values = np.linalg.eigvalsh(np.where(absent[..., None, None], 0.0, symmetric))[..., 0]
    return locked(np.where(absent, np.nan, values))


def natural_frequency(squares: Array) -> Array:
    """Frequencies [Hz] from squared angular frequencies `squares`, shape (..., n)."""
    # A motion without stiffness, such as the rotation about a single rope, gets 0 Hz, because its squared frequency is
    # only a rounding error. An unstable motion gets NaN.
    largest = np.abs(squares).max(axis=-1, keepdims=True, initial=0.0)
    known = np.where(squares > NEUTRAL * largest, squares, np.where(squares < -UNSTABLE * largest, np.nan, 0.0))
    return np.asarray(np.sqrt(known) / (2.0 * np.pi))


def _check_state(state: Equilibrium, cable_bytes: float) -> None:
    size = state.cables.unstrained_length.size
    check_memory("state", cable_bytes * size, "Split the poses into parts: state[:1000].")


def compliance_of(freedom: Array, matrix: Array) -> Array:
    """Compliances (N, 6, 6): inverses of stiffnesses for the free motions, zero for all other motions."""
    # NaN for a matrix that is singular or contains NaN.
    found = np.empty(matrix.shape)
    sensitivity.compliances_of(freedom, locked(np.ascontiguousarray(matrix)), memory_for(1), found)
    return found


def least_stiffness(freedom: Array, matrix: Array) -> Array:
    """Stiffness against a force on the center of mass, in the softest direction [N/m], (N,); 0 if unstable."""
    # Arguments: `freedom`, free motions (n, 6); `matrix`, stiffnesses of the platform in world axes (N, 6, 6), or NaN.
    found = np.empty(len(matrix))
    sensitivity.least_stiffnesses(freedom, locked(np.ascontiguousarray(matrix)), memory_for(1), found)
    return found


def mass_matrix(state: Equilibrium) -> Array:
    """Mass matrix (..., 6, 6) of the platform about the center of mass, in world axes [kg, kg m^2]."""
    rotation = state.pose.matrix
    own, inertia = robot_fields(state.robot, "mass", "inertia")
    mass = np.zeros((*state.pose.shape, 6, 6))
    mass[..., :3, :3] = own[..., None, None] * np.eye(3)
    mass[..., 3:, 3:] = rotation @ inertia @ np.swapaxes(rotation, -1, -2)
    return mass
