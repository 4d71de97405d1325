"""Records of the calibration kernels: sensors, readings, unknowns and work arrays."""

from __future__ import annotations

import math
from typing import NamedTuple

from sagline.core.arrays import Array, Indices
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.cable.swivel import DATA, SLOPES
from sagline.kernels.jit import formula, glue
from sagline.kernels.memory import Memory, block, vector

TURNS = DATA + 3  # rows of `moments_of_swivel`
BESIDE = 6  # readings of a pose without load cells: position and rotation in the axes of the measuring system

SensingArrays = tuple[Array, Array, Array, Array, Array, Array, Array, Array]
ReadingArrays = tuple[Array, Array, Array, Array]
UnknownArrays = tuple[Indices, Array, Array]
LinearizationArrays = tuple[Array, Array, Array, Array, Array, Array]


class Sensing(NamedTuple):
    """The sensors."""

    gain: Array  # gain of the load cells, (m,)
    bias: Array  # bias of the load cells [N], (m,)
    tension_deviation: Array  # standard deviations of load cells [N], (m,); infinite without a load cell
    length_deviation: Array  # standard deviations of lengths [m], (m,)
    position_deviation: Array  # standard deviations of positions [m], (3,); infinite if not measured
    # Standard deviations of rotations [rad], (3,); infinite if not measured. If only the third value is infinite, the
    # readings are roll and pitch, which refer to gravity and not to the measuring system.
    rotation_deviation: Array
    frame: Array  # pose row of the measuring system in the world
    target: Array  # measured point, platform frame [m], (3,)


@formula
def is_level(sensing: Sensing) -> bool:
    """True if the yaw is not measured, so that the axes of the rotations are those of the world."""
    return math.isinf(sensing.rotation_deviation[2])


class PoseReadings(NamedTuple):
    """Readings at N poses; NaN for a missing reading, whose residual is zero."""

    lengths: Array  # lengths measured by the winches [m], (N, m)
    cells: Array  # readings of the load cells [N], (N, m)
    positions: Array  # measured positions [m], (N, 3)
    rotations: Array  # measured rotations, unit quaternions, scalar last, (N, 4)


class Unknowns(NamedTuple):
    """The P unknowns."""

    where: Indices  # index of the unknown for each row of `kinds`, (KIND_ROWS, m), -1 if known
    scale: Array  # derivative of each parameter with respect to its unknown, (KIND_ROWS, m)
    paid: Array  # derivatives of the measured lengths by zero, drum radius, EA, scale and clock, (5, N, m)


class Linearization(NamedTuple):
    """Output arrays. The rows of a pose are its load cells, then its position (3) and its rotation (3)."""

    # R is m + 6, or m if neither positions nor rotations are measured.

    matrix: Array  # whitened slopes, (N, R, P); rows without a reading are zero
    misfit: Array  # whitened residuals, (N, R)
    residual: Array  # readings minus predictions at the given lengths [N, m, rad], (N, m + 6); NaN if missing
    back: Array  # change of the true lengths per unit of whitened residual [m], (N, m, R)
    # Motions of the platform about its center of mass [m, rad], world axes, (N, m + 1, 6). The first m rows are motions
    # per meter of each cable; the last row is the motion per unit of the first unknown. A caller that does not need the
    # motions passes the shape (0, m + 1, 6).
    motion: Array
    work: Array  # work array: slopes of the readings and of the wrench on the platform, (R + 6, P)


class CalibrationArrays(NamedTuple):
    """Working memory of one pose."""

    rows: Array  # (CABLE_ROWS, m)
    rotation: Array  # (3, 3)
    axes: Array  # axes of the measuring system as columns, (3, 3)
    stiffness: Array  # (6, 6)
    factor: Array  # (n, n)
    matrix: Array  # (n, n)
    part: Array  # (n,)
    six: Array  # (6,)
    moved: Array  # change of the readings per wrench on the platform, (R, 6)
    ends: Array  # stiffness of the platform ends, (m, 9)
    shares: Array  # derivatives of frame-end tensions by platform-end force and height, and the tensions, (m, 5)
    slopes: Array  # rows of `slopes_of_swivel` of all cables, (SLOPES m, 5); only with swivel axes of any direction
    turns: Array  # rows of `moments_of_swivel` of pulleys on the platform, (TURNS m, 3)
    by_wrench: Array  # change of the wrench on the platform per length, (m, 6)
    by_length: Array  # change of the readings per length, A, (m, R)
    whole: Array  # covariance, then the inverse of its factor, (R, R)
    own: Array  # (R, R)
    deviation: Array  # (m + 6,)
    work: Array  # derivatives of the readings with respect to the P unknowns, (R, P); at first with a fixed platform
    wrench: Array  # derivatives of the wrench on the fixed platform about its center of mass, (6, P)


@glue
def new_calibration_arrays(memory: Memory, m: int, n: int, work: Array) -> CalibrationArrays:
    """Work arrays for `m` cables and `n` free motions. `work`: as in `Linearization`."""
    readings = work.shape[0] - 6
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
    slopes, memory = block(memory, SLOPES * m, 5)
    turns, memory = block(memory, TURNS * m, 3)
    by_wrench, memory = block(memory, m, 6)
    by_length, memory = block(memory, m, readings)
    whole, memory = block(memory, readings, readings)
    own, memory = block(memory, readings, readings)
    deviation, memory = vector(memory, m + BESIDE)
    return CalibrationArrays(
        rows, rotation, axes, stiffness, factor, matrix, part, six, moved, ends, shares, slopes, turns, by_wrench,
        by_length, whole, own, deviation, work[:-6], work[-6:],
    )  # fmt: skip
