"""The kernel for swivel axes of any direction, with vertical axes, compared with the kernel for vertical axes."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline.kernels import tables
from sagline.kernels.forward.sensitivity import DATA, describe_states
from sagline.kernels.memory import memory_for
from sagline.statics.tables import body_table, cable_table, pose_rows, slanted_rows


@pytest.mark.parametrize("up", [1.0, -1.0])
def test_vertical_axes_in_the_general_kernel_give_the_forces_of_the_other_kernel(up: float) -> None:
    cogiro = sl.load_robot("cogiro")
    robot = cogiro.replace(
        winches=sl.Winch(0.05, swivel_axis=[0.0, 0.0, up], dead_cable=3.0, dead_rise=[1.0, -2.0] * 4)
    )
    state = sl.inverse(robot, sl.Pose.from_euler([1.0, 1.0, 2.0], 0.1, 0.0, 0.2)).state
    found = []
    for table in (cable_table(robot), slanted_rows(robot)[None]):
        arrays = np.empty((1, 6, 6)), np.empty((1, 8, 3, 3)), np.empty((1, DATA, 8, 3)), np.empty((1, 8, 3))
        given = (robot.freedom, body_table(robot), table, state.unstrained_length[None], pose_rows(state.pose))
        describe_states((0, 0.0, 0.0, True), (*given, np.zeros((1, 6))), memory_for(8), *arrays)
        found.append(arrays)
    assert table.shape[2] == tables.SWIVEL_COLUMNS
    for one, other in zip(*found, strict=True):
        exact = one is not found[0][2]
        np.testing.assert_allclose(other, one, rtol=0.0, atol=(1e-11 if exact else 1e-7) * np.abs(one).max())
