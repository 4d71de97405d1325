"""Solid parts of a robot."""

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.viewer import shapes
from tests.tiers import wide


def mesh(solid: shapes.Solid) -> Any:
    import trimesh  # a quarter of a second

    return trimesh.Trimesh(solid.vertices, solid.faces, process=True)


def test_platform_is_a_closed_box_of_its_size() -> None:
    platform = mesh(shapes.Solid.platform(sl.load_robot("article-mixed")))
    assert platform.is_watertight
    assert platform.volume == pytest.approx(0.3 * 0.3 * 0.5)  # positive: the faces look outward


@pytest.mark.parametrize("name", wide(sl.robot_names(), 4))
def test_every_preset_has_its_parts(name: str) -> None:
    robot = sl.load_robot(name)
    low, high = shapes.bounds(robot)
    assert np.all(robot.frame_anchors >= low - 1e-9)
    assert np.all(robot.frame_anchors <= high + 1e-9)
    assert mesh(shapes.Solid.platform(robot)).volume > 0.0
    frame = mesh(shapes.Solid.frame(robot))
    assert frame.volume > 0.0
    assert np.all(np.abs(frame.bounds - [low, high]) < 0.01 * shapes.size_of(robot))


def test_a_tube_has_the_given_length_and_thickness() -> None:
    points = np.linspace([0.0, 0.0, 0.0], [0.0, 3.0, 4.0], 9)
    area = mesh(shapes.Solid.tube(points, 0.1, sides=64)).area
    assert area == pytest.approx(2.0 * np.pi * 0.1 * 5.0, rel=2e-3)


def test_suspended_robot_without_a_frame_stands_on_the_floor() -> None:
    robot = sl.load_robot("cogiro")
    assert robot.frame_size is None
    assert shapes.bounds(robot)[0][2] == 0.0


@pytest.mark.parametrize("name", wide(sl.robot_names(), 4))
def test_assumed_frames_are_dashed(name: str) -> None:
    robot = sl.load_robot(name)
    pieces = mesh(shapes.Solid.frame(robot)).body_count
    assert pieces == 1 if not shapes.is_frame_assumed(robot) else pieces > 60
    given = robot.replace(frame_size=shapes.bounds(robot)[1] - shapes.bounds(robot)[0], assumed={})
    assert mesh(shapes.Solid.frame(given)).body_count == 1


@pytest.mark.parametrize(
    ("length", "rounded"), [(0.099, 0.05), (0.1, 0.1), (1.99, 1.0), (2.0, 2.0), (4.9, 2.0), (7.0, 5.0), (640.0, 500.0)]
)
def test_scale_bars_have_round_lengths(length: float, rounded: float) -> None:
    assert shapes.round_below(length) == pytest.approx(rounded, rel=1e-12)


def test_a_pulley_has_its_radius_about_its_middle() -> None:
    wheel = mesh(shapes.Solid.wheel())
    assert wheel.bounds[0] == pytest.approx([-0.97, -0.1, -0.97], abs=0.01)  # a bit of room for the cable
    assert wheel.bounds[1] == pytest.approx([0.97, 0.1, 0.97], abs=0.01)
    assert wheel.volume > 0.0
    across = np.hypot(wheel.vertices[:, 0], wheel.vertices[:, 2])
    assert across.max() <= 0.97 + 1e-12  # the cable, at 1, lies on it


def test_pulleys_swivel_to_the_platform() -> None:
    robot = sl.load_robot("ipanema-2-pulleys")
    pose = sl.Pose.from_euler([0.5, -0.3, 2.0], 0.1, 0.0, 0.2)
    centers, turns = shapes.wheels(robot, pose)
    turned = Rotation.from_quat(turns, scalar_first=True).apply([1.0, 0.0, 0.0])
    reach = pose.transform(robot.platform_anchors) - robot.frame_anchors
    reach[:, 2] = 0.0
    reach /= np.linalg.norm(reach, axis=1, keepdims=True)
    assert turned == pytest.approx(reach, abs=1e-12)
    assert centers == pytest.approx(robot.frame_anchors + 0.25 * reach, abs=1e-12)


def test_marks_replace_invisible_pulleys_and_drums_are_drawn() -> None:
    robot = sl.load_robot("ipanema-2")
    assert mesh(shapes.Solid.winches(robot)).body_count == 8
    assert mesh(shapes.Solid.winches(robot.replace(winches=sl.Winch(pulley_radius=0.01)))).body_count == 8
    assert len(shapes.Solid.winches(robot.replace(winches=sl.Winch(pulley_radius=0.2))).faces) == 0
    wound = sl.Winch(pulley_radius=0.2, dead_cable=3.0, dead_rise=3.0, drum_radius=0.25, drum_width=0.4)
    drums = mesh(shapes.Solid.winches(robot.replace(winches=wound)))
    assert drums.body_count == 8
    assert drums.volume == pytest.approx(8 * np.pi * 0.25**2 * 0.4, rel=0.03)  # as good as twenty sides are
    assert drums.bounds[:, 2] == pytest.approx(robot.frame_anchors[[5, 3], 2] - 3.0 + [-0.25, 0.25], abs=0.005)


def test_a_tube_omits_repeated_points() -> None:
    points = np.linspace([0.0, 0.0, 0.0], [0.0, 3.0, 4.0], 9)
    twice = np.repeat(points, 2, axis=0)
    assert np.array_equal(shapes.Solid.tube(twice, 0.1).vertices, shapes.Solid.tube(points, 0.1).vertices)
