"""Workspaces of robots with few cables over pulleys that swivel about axes of any direction."""

from __future__ import annotations

import numpy as np

import sagline as sl
from tests.kinematics.test_slanted import four_cables

ROBOT = four_cables().replace(tension_max=120.0)
BOX = sl.PoseBox([-0.9, -0.7, 1.0], [0.9, 0.7, 2.3])


def test_verdicts_and_margins_are_those_of_inverse() -> None:
    space = sl.workspace(ROBOT, BOX, cells=6, refine=False)
    nodes = np.stack(np.meshgrid(space.x, space.y, space.z, indexing="ij"), axis=-1).reshape(-1, 3)
    plan = sl.inverse(ROBOT, sl.Pose.from_quaternion(nodes, np.tile([0.0, 0.0, 0.0, 1.0], (len(nodes), 1))))
    inside = space.level.ravel() >= 0.0
    np.testing.assert_array_equal(inside, plan.solved)
    assert 0 < inside.sum() < inside.size
    tension = plan.chord_tension[inside]
    margin = np.minimum(tension - ROBOT.tension_min, ROBOT.tension_max - tension).min(axis=1)
    scale = space.criteria[0].scale(ROBOT)
    np.testing.assert_allclose(space.level.ravel()[inside] * scale, margin, rtol=1e-9, atol=1e-9)


def test_a_slightly_slanted_axis_continues_the_volume_of_the_vertical_axis() -> None:
    winches = ROBOT.winches
    assert winches is not None
    volumes = [
        sl.workspace(ROBOT.replace(winches=winches.replace(swivel_axis=axis)), BOX, cells=5, refine=False).volume
        for axis in ([1e-9, 0.0, 1.0], [0.0, 0.0, 1.0])
    ]
    np.testing.assert_allclose(volumes[0], volumes[1], rtol=1e-3)
    assert abs(sl.workspace(ROBOT, BOX, cells=5, refine=False).volume / volumes[1] - 1.0) > 1e-3


def test_poses_inside_a_pulley_are_outside() -> None:
    place = ROBOT.frame_anchors[0] - ROBOT.platform_anchors[0] + [0.01, 0.0, -0.01]
    levels = sl.workspace(ROBOT, BOX, cells=4, refine=False).levels()
    assert levels(np.vstack((place, [0.0, 0.0, 1.6])))[0] == -np.inf
