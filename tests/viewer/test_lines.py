"""Cables as lines in the world."""

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import lines

ROBOT = sl.load_robot("article-suspended")
POSE = sl.Pose.from_euler([1.0, -0.7, 2.1], 0.1, -0.05, 0.08)


@pytest.mark.parametrize("sag_scale", [0.0, 1.0, 7.0])
def test_cables_are_drawn_from_anchor_to_anchor(sag_scale: float) -> None:
    plan = sl.inverse(ROBOT, POSE)
    drawn = lines.hanging(lines.chords(ROBOT, POSE), plan.state.cables, sag_scale)
    ends = POSE.position + (POSE.rotation.as_matrix() @ ROBOT.platform_anchors.T).T
    assert np.abs(drawn[:, 0] - ROBOT.frame_anchors).max() < 1e-12
    assert np.abs(drawn[:, -1] - ends).max() < 1e-9


def test_drawn_sag_is_the_sag_times_its_scale() -> None:
    plan = sl.inverse(ROBOT, POSE)
    ends = lines.chords(ROBOT, POSE)
    for sag_scale in (1.0, 5.0):
        drawn = lines.hanging(ends, plan.state.cables, sag_scale)
        run = ends[:, 1] - ends[:, 0]
        share = ((drawn - ends[:, :1])[..., :2] @ run[:, :2, None])[..., 0] / (run[:, :2] ** 2).sum(1)[:, None]
        drop = ends[:, 0, 2:] + share * run[:, 2:] - drawn[..., 2]
        # 41 points do not meet the lowest one: a parabola loses at most 1/40^2 of its sag
        assert drop.max(axis=1) == pytest.approx(sag_scale * plan.state.cables.sag, rel=2e-3)


def test_cable_length_along_the_line_is_the_stretched_length() -> None:
    state = sl.inverse(ROBOT, POSE).state.cables
    drawn = lines.hanging(lines.chords(ROBOT, POSE), state, 1.0)
    along = np.linalg.norm(np.diff(drawn, axis=1), axis=2).sum(axis=1)
    strain = 0.5 * (state.frame_end_tension + state.platform_end_tension) / ROBOT.cables.axial_stiffness
    assert along == pytest.approx(state.unstrained_length * (1.0 + strain), rel=1e-5)


def test_vertical_cable_is_drawn_upright() -> None:
    robot = sl.load_robot("article-suspended")
    corner = robot.frame_anchors[0] - robot.platform_anchors[0]
    pose = sl.Pose(corner - [0.0, 0.0, 3.0], np.eye(3))
    ends = lines.chords(robot, pose)
    state = sl.Catenary().from_tension(
        robot.cables, np.hypot(*(ends[:, 1] - ends[:, 0])[:, :2].T), (ends[:, 1] - ends[:, 0])[:, 2], 100.0
    )
    drawn = lines.hanging(ends, state, 20.0)[0]
    assert np.ptp(drawn[:, :2], axis=0) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert np.all(np.diff(drawn[:, 2]) < 0.0)


def test_dashes_are_every_other_segment() -> None:
    points = lines.straight(lines.chords(ROBOT, POSE))
    solid, dashed = (lines.segments(points, dashed=dashed) for dashed in (False, True))
    sizes = np.linalg.norm(dashed[:, 1] - dashed[:, 0], axis=1).reshape(8, -1)
    assert np.all(sizes[:, 1::2] == 0.0)
    assert np.array_equal(dashed.reshape(8, -1, 2, 3)[:, ::2], solid.reshape(8, -1, 2, 3)[:, ::2])
