"""The solid parts of a robot."""

import numpy as np
import pytest
import trimesh

import sagline as sl
from sagline.viewer import solids


def mesh(solid: solids.Solid) -> trimesh.Trimesh:
    return trimesh.Trimesh(solid.vertices, solid.faces, process=True)


def test_platform_is_a_closed_box_of_its_size() -> None:
    platform = mesh(solids.platform(sl.load_robot("article-mixed")))
    assert platform.is_watertight
    assert platform.volume == pytest.approx(0.3 * 0.3 * 0.5)  # positive: the faces look outward


@pytest.mark.parametrize("name", sl.robot_names())
def test_every_preset_has_its_parts(name: str) -> None:
    robot = sl.load_robot(name)
    low, high = solids.bounds(robot)
    assert np.all(robot.frame_anchors >= low - 1e-9)
    assert np.all(robot.frame_anchors <= high + 1e-9)
    assert mesh(solids.platform(robot)).volume > 0.0
    frame = mesh(solids.frame(robot))
    assert frame.volume > 0.0
    assert np.all(np.abs(frame.bounds - [low, high]) < 0.01 * solids.size_of(robot))


def test_tube_is_as_long_and_thick_as_asked() -> None:
    points = np.linspace([0.0, 0.0, 0.0], [0.0, 3.0, 4.0], 9)
    area = mesh(solids.tube(points, 0.1, sides=64)).area
    assert area == pytest.approx(2.0 * np.pi * 0.1 * 5.0, rel=2e-3)


def test_suspended_robot_without_a_frame_stands_on_the_floor() -> None:
    robot = sl.load_robot("cogiro")
    assert robot.frame_size is None
    assert solids.bounds(robot)[0][2] == 0.0


@pytest.mark.parametrize("name", sl.robot_names())
def test_frames_that_nobody_gave_are_dashed(name: str) -> None:
    robot = sl.load_robot(name)
    pieces = mesh(solids.frame(robot)).body_count
    assert pieces == 1 if not solids.is_frame_assumed(robot) else pieces > 60
    given = robot.replace(frame_size=solids.bounds(robot)[1] - solids.bounds(robot)[0], assumed={})
    assert mesh(solids.frame(given)).body_count == 1


@pytest.mark.parametrize(
    ("length", "rounded"), [(0.099, 0.05), (0.1, 0.1), (1.99, 1.0), (2.0, 2.0), (4.9, 2.0), (7.0, 5.0), (640.0, 500.0)]
)
def test_lengths_to_measure_by_are_round(length: float, rounded: float) -> None:
    assert solids.round_below(length) == pytest.approx(rounded, rel=1e-12)
