"""Records of the calibration kernels: sensors, readings, unknowns and work arrays."""

from __future__ import annotations

from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.jit import glue
from sagline.kernels.memory import Memory, block, vector

BESIDE = 6  # readings of a pose beside its load cells: position and rotation in the measuring system's axes

SensingArrays = tuple[Array, Array, Array, Array, Array, Array, Array, Array]
ReadingArrays = tuple[Array, Array, Array, Array]
UnknownArrays = tuple[Indices, Array, Array]
LinearizationArrays = tuple[Array, Array, Array, Array, Array, Array]


class Sensing(NamedTuple):
    """The sensors."""

    gain: Array  # of the load cells, (m,)
    bias: Array  # [N], (m,)
    tension_deviation: Array  # [N], (m,); infinite for no cell
    length_deviation: Array  # [m], (m,)
    position_deviation: Array  # [m], (3,); infinite for none
    rotation_deviation: Array  # [rad], (3,); infinite for none
    frame: Array  # pose row of the measuring system in the world
    target: Array  # platform frame [m], (3,)


class PoseReadings(NamedTuple):
    """Readings at N poses; without readings a residual is zero; NaN where a sensor gave none."""

    lengths: Array  # that the winches say [m], (N, m)
    cells: Array  # of the load cells [N], (N, m)
    positions: Array  # [m], (N, 3)
    rotations: Array  # unit quaternions, scalar last, (N, 4)


class Unknowns(NamedTuple):
    """The P numbers that are looked for."""

    where: Indices  # parameter of each row of `kinds`, (KIND_ROWS, m), -1 for none
    scale: Array  # derivative of that row by it, (KIND_ROWS, m)
    paid: Array  # slopes of the lengths that the winches say, by zero, drum radius and EA, (3, N, m)


class Linearization(NamedTuple):
    """Output arrays; rows of a pose are its load cells, three of its position and three of its rotation.

    R is m + 6, or m where no system measures positions or rotations.
    """

    matrix: Array  # whitened slopes, (N, R, P); rows without a reading are zero
    misfit: Array  # whitened residuals, (N, R)
    residual: Array  # as they are, readings less predictions at the lengths given [N, m, rad], (N, m + 6); NaN for none
    back: Array  # change of the true lengths by a whitened residual [m], (N, m, R)
    # of the platform about its center of mass [m, rad], world axes: by each cable's length, and in the last row by the
    # first of the P, (N, m + 1, 6); (0, m + 1, 6) where it is not wanted
    motion: Array
    work: Array  # to work in, slopes of the readings and of the wrench on the platform, (R + 6, P)


class Slopes(NamedTuple):
    """Derivatives by the P numbers at one pose."""

    work: Array  # of the readings, first with the platform held, (R, P)
    wrench: Array  # of the wrench on the held platform about its center of mass, (6, P)


class CalibrationArrays(NamedTuple):
    """Working memory of one pose."""

    rows: Array  # (CABLE_ROWS, m)
    rotation: Array  # (3, 3)
    axes: Array  # of the measuring system, columns, (3, 3)
    stiffness: Array  # (6, 6)
    factor: Array  # (n, n)
    matrix: Array  # (n, n)
    part: Array  # (n,)
    six: Array  # (6,)
    moved: Array  # change of the readings by a wrench on the platform, (R, 6)
    ends: Array  # stiffness of the platform ends, (m, 9)
    shares: Array  # of the frame ends' tensions: by the forces on the platform ends, by height; and they, (m, 5)
    by_wrench: Array  # change of the wrench on the platform by the lengths, (m, 6)
    by_length: Array  # change of the readings by the lengths, A, (m, R)
    whole: Array  # covariance, then the inverse of its factor, (R, R)
    own: Array  # (R, R)
    deviation: Array  # (m + 6,)


@glue
def new_calibration_arrays(memory: Memory, m: int, n: int, readings: int) -> CalibrationArrays:
    """Working memory for m cables, n free motions and so many readings."""
    rows, memory = block(memory, CABLE_ROWS, m)
    rotation, memory = block(memory, 3, 3)
    axes, memory = block(memory, 3, 3)
    stiffness, memory = block(memory, 6, 6)
    factor, memory = block(memory, n, n)
    matrix, memory = block(memory, n, n)
    part, memory = vector(memory, n)
    six, memory = vector(memory, 6)
    moved, memory = block(memory, readings, 6)
    ends, memory = block(memory, m, 9)
    shares, memory = block(memory, m, 5)
    by_wrench, memory = block(memory, m, 6)
    by_length, memory = block(memory, m, readings)
    whole, memory = block(memory, readings, readings)
    own, memory = block(memory, readings, readings)
    deviation, memory = vector(memory, m + BESIDE)
    return CalibrationArrays(
        rows, rotation, axes, stiffness, factor, matrix, part, six, moved, ends, shares, by_wrench, by_length, whole,
        own, deviation,
    )  # fmt: skip
