"""A mode as drawn: rest position, cable ends, size and texts."""

import numpy as np
import pytest

import sagline as sl
from sagline import vibration
from sagline.viewer import shapes
from sagline.viewer.snapshot import Settings, snapshot_at
from sagline.viewer.swing import Swing, mode_of
from tests.tiers import wide


def swings(name: str, up_to: float = 8.0) -> list[Swing]:
    robot = sl.load_robot(name)
    assert robot.test_box is not None
    pose = sl.Pose.from_euler(0.4 * robot.test_box.low + 0.6 * robot.test_box.high, 0.0, 0.0, 0.0)
    found = vibration(sl.inverse(robot, pose, tension=sl.MinimumNorm()).state, up_to=up_to)
    names = [str(k + 1) for k in range(found.frequency.size)]
    names += [f"massless {k + 1}" for k in range(np.count_nonzero(np.isfinite(found.massless_frequency)))]
    return [Swing.of(found, mode) for name in names if (mode := mode_of(found, name)) is not None]


@pytest.mark.parametrize("name", wide(["cogiro", "ipanema-2-pulleys"]))
def test_the_rest_position_is_that_of_the_page(name: str) -> None:
    for swing in swings(name):
        robot, pose = swing.state.one_robot, swing.state.pose
        seen = snapshot_at(robot, pose, Settings(robot.mass), None)
        np.testing.assert_allclose(swing.courses(0.0), seen.courses(1.0), atol=1e-9)
        np.testing.assert_allclose(swing.pose(0.0).matrix, pose.matrix, atol=1e-12)
        break


@pytest.mark.parametrize("name", wide(["cogiro", "falcon-7", "ipanema-2-pulleys"], 2))
def test_cables_stay_on_the_platform_and_at_the_frame(name: str) -> None:
    for swing in swings(name):
        robot = swing.state.one_robot
        size = shapes.size_of(robot)
        for phase in (0.7, 0.5 * np.pi, 4.0):
            courses, pose = swing.courses(phase), swing.pose(phase)
            np.testing.assert_allclose(courses[:, -1], pose.transform(robot.platform_anchors), atol=1e-9)
            np.testing.assert_allclose(courses[:, 0], robot.frame_anchors, atol=1e-9)
            np.testing.assert_allclose(courses[:, : -shapes.POINTS], swing.rest[:, : -shapes.POINTS], atol=1e-9)
            away = np.linalg.norm(courses - swing.rest, axis=-1).max()
            assert away < 0.1 * size
        farthest = np.linalg.norm(swing.moved, axis=-1).max()
        assert 0.003 * size < max(farthest, np.linalg.norm(swing.motion[:3])) <= 0.0351 * size


def test_the_magnification_relative_to_a_joule_is_stated() -> None:
    """The energy of the drawn motion is that of a joule, times the square of the factor."""
    for swing in swings("cogiro", up_to=5.0):
        if swing.mode.kind != "massless":
            continue
        robot, omega = swing.state.one_robot, 2.0 * np.pi * swing.mode.frequency
        turn = swing.state.pose.matrix
        inertia = turn @ robot.inertia @ turn.T
        kinetic = (
            0.5
            * omega**2
            * (robot.mass * swing.motion[:3] @ swing.motion[:3] + swing.motion[3:] @ inertia @ swing.motion[3:])
        )
        assert kinetic == pytest.approx(swing.factor**2, rel=1e-9)
        assert f"{swing.factor:.2g} times as" in swing.text
        assert f"{2.0 * swing.mode.frequency:.3g} times slower" in swing.text


def test_modes_are_requested_by_name() -> None:
    robot = sl.load_robot("article-suspended")
    found = vibration(sl.inverse(robot, sl.Pose([0, 0, 1.5], np.eye(3))).state, up_to=3.0)
    second, light = mode_of(found, " 2 "), mode_of(found, "massless  3")
    assert second is not None
    assert light is not None
    assert second.frequency == found.frequency[1]
    assert light.frequency == found.massless_frequency[2]
    assert mode_of(found, "99") is None
    assert mode_of(found, "") is None
