"""Motion of the platform by a wrench on it, and its effect on the readings of one pose."""

from __future__ import annotations

from sagline.core.arrays import Array
from sagline.kernels.algebra.cholesky import solve_lower, solve_upper
from sagline.kernels.balance.freedom import components_along, motion_along
from sagline.kernels.calibration.terms import CalibrationArrays, Slopes
from sagline.kernels.forward.platform import Triple
from sagline.kernels.jit import formula, glue


@glue
def fill_motion_by_wrench(free: Array, wrench: Array, space: CalibrationArrays, motion: Array) -> None:
    """Fill the motion of the platform that a wrench on it causes; needs the factor."""
    components_along(free, wrench, space.part)
    solve_lower(space.factor, space.part)
    solve_upper(space.factor, space.part)
    motion_along(free, space.part, motion)


@formula
def fill_length(space: CalibrationArrays, i: int, force: Triple, moment: Triple, direct: float) -> None:
    """Fill what the length of cable i changes: the wrench on the platform, and all readings."""
    for k in range(3):
        space.by_wrench[i, k], space.by_wrench[i, 3 + k] = force[k], moment[k]
    for j in range(space.moved.shape[0]):
        total = 0.0
        for k in range(6):
            total -= space.moved[j, k] * space.by_wrench[i, k]
        space.by_length[i, j] = total
    space.by_length[i, i] += direct


@glue
def add_motion(space: CalibrationArrays, slopes: Slopes) -> None:
    """Add to the columns what the changes of the wrench do to the readings, by the platform's motion."""
    for j in range(slopes.work.shape[0]):
        for k in range(6):
            share = space.moved[j, k]
            for q in range(slopes.work.shape[1]):
                slopes.work[j, q] -= share * slopes.pull[k, q]


@glue
def fill_motion(free: Array, space: CalibrationArrays, slopes: Slopes, motion: Array) -> None:
    """Fill how the platform moves by each length, and in the last row by the first of the columns."""
    m = space.by_wrench.shape[0]
    for k in range(6):
        space.six[k] = slopes.pull[k, 0]
    for i in range(m + 1):
        fill_motion_by_wrench(free, space.by_wrench[i] if i < m else space.six, space, motion[i])
        for k in range(6):
            motion[i, k] = -motion[i, k]
