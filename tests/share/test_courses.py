"""Points of cables in shared pages: those of the solved states, and straight lines without tensions."""

import numpy as np
import pytest

import sagline as sl
from sagline.robot.reach import home_pose
from sagline.share.machine import courses_at
from sagline.viewer.snapshot import Snapshot


@pytest.mark.parametrize(
    ("name", "low"), [("cogiro", 100.0), ("cogiro", 3.0), ("ipanema-2-pulleys", 50.0), ("ipanema-2-pulleys", 20.0)]
)
def test_points_are_those_of_the_solved_state(name: str, low: float) -> None:
    robot = sl.load_robot(name).replace(tension_min=low)
    pose = home_pose(robot)
    plan = sl.inverse(robot, pose)
    expected = Snapshot(robot, pose, plan, None).courses(1.0)
    np.testing.assert_allclose(courses_at(robot, pose, plan.chord_tension), expected, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", ["cogiro", "ipanema-2-pulleys"])
def test_a_cable_without_a_tension_follows_its_chord(name: str) -> None:
    robot = sl.load_robot(name)
    pose = home_pose(robot)
    tension = sl.inverse(robot, pose).chord_tension.copy()
    taut = courses_at(robot, pose, tension)
    tension[2] = np.nan
    found, straight = courses_at(robot, pose, tension), Snapshot(robot, pose, None, None).courses(1.0)
    np.testing.assert_allclose(found[2], straight[2], rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(np.delete(found, 2, axis=0), np.delete(taut, 2, axis=0))


def test_a_cable_without_a_chord_goes_from_anchor_to_platform_end() -> None:
    robot = sl.load_robot("ipanema-2-pulleys")
    inside = robot.frame_anchors[3] - robot.platform_anchors[3] + [0.0, 0.0, -0.01]
    pose = sl.Pose(inside, np.eye(3))
    points = courses_at(robot, pose, np.full(robot.cable_count, np.nan))[3]
    np.testing.assert_allclose(points[0], robot.frame_anchors[3], atol=1e-12)
    np.testing.assert_allclose(points[-1], pose.transform(robot.platform_anchors)[3], atol=1e-12)
    assert np.isfinite(points).all()
