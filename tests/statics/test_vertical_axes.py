"""The kernel for swivel axes of any direction, with vertical axes, compared with the kernel for vertical axes."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.kernels import codes, tables
from sagline.statics.slopes import KernelStates
from sagline.statics.tables import body_table, cable_table, slanted_rows

SLOPES, LEVERS, FORCES = 2, 3, 4  # arrays of `describe_states`


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_vertical_axes_in_the_general_kernel_give_the_forces_of_the_other_kernel(up: float) -> None:
    cogiro = sl.load_robot("cogiro")
    robot = cogiro.replace(
        winches=sl.Winch(0.05, swivel_axis=[0.0, 0.0, up], dead_cable=3.0, dead_rise=[1.0, -2.0] * 4)
    )
    state = sl.inverse(robot, sl.Pose.from_euler([1.0, 1.0, 2.0], 0.1, 0.0, 0.2)).state
    found = []
    given = KernelStates.of(state)
    for table in (cable_table(robot), slanted_rows(robot)[None]):
        terms, robots = (codes.CATENARY, 0.0, 0.0, True), (robot.freedom, body_table(robot), table)
        found.append(KernelStates.of_rows(terms, robots, given.poses, given.results).describe().found)
    assert table.shape[2] == tables.SWIVEL_COLUMNS
    exact = {LEVERS: 1e-15, FORCES: 1e-11, SLOPES: 1e-7}  # slopes by data are differences in the general kernel
    for k, (one, other) in enumerate(zip(*found, strict=True)):
        assert np.isfinite(one).all()
        np.testing.assert_allclose(other, one, rtol=0.0, atol=exact.get(k, 1e-9) * np.abs(one).max())
