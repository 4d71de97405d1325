"""The scene as sent to clients."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import shapes
from sagline.viewer.page import home_pose
from sagline.viewer.robot_scene import RobotScene
from sagline.viewer.server import PageServer, start_server, stop_server
from sagline.viewer.snapshot import Settings, snapshot_at
from sagline.viewer.tension_scale import TensionScale
from tests.tiers import wide


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    one = start_server(port=0)
    yield one
    stop_server(one)


def node(server: PageServer, name: str) -> Any:
    return server.scene.get_handle_by_name(name)


@pytest.mark.parametrize("name", wide(sl.robot_names(), 3))
def test_the_gizmo_is_smaller_than_the_robot(server: PageServer, name: str) -> None:
    robot = sl.load_robot(name)
    RobotScene(server.scene, robot, home_pose(robot))
    size = shapes.size_of(robot)
    gizmo = node(server, "/platform")
    assert 0.05 * size < gizmo.scale < 0.2 * size
    assert gizmo.depth_test  # what is behind the platform does not hide it


@pytest.mark.parametrize("name", wide(sl.robot_names(), 3))
def test_every_robot_has_a_floor_and_a_scale(server: PageServer, name: str) -> None:
    robot = sl.load_robot(name)
    RobotScene(server.scene, robot, home_pose(robot))
    low, high = shapes.bounds(robot)
    floor = node(server, "/floor")
    assert floor.width > high[0] - low[0]
    assert floor.position[2] == pytest.approx(low[2], abs=0.01 * shapes.size_of(robot))
    assert floor.fade_distance > 5.0 * shapes.size_of(robot)
    assert 5.0 < np.hypot(floor.width, floor.height) / floor.cell_size < 60.0
    arms = np.asarray(node(server, "/axes").points)
    lengths = np.linalg.norm(arms[:, 1] - arms[:, 0], axis=1)
    assert node(server, "/axes/length").text == f"{lengths[0]:g} m"
    assert lengths == pytest.approx(lengths[0])
    assert (arms[:, 1] - arms[:, 0]) / lengths[0] == pytest.approx(np.eye(3), abs=1e-6)


def test_pulleys_and_exit_points_follow_the_platform(server: PageServer) -> None:
    robot = sl.load_robot("ipanema-2-pulleys")
    stage = RobotScene(server.scene, robot, home_pose(robot))
    wheels = node(server, "/pulleys")
    assert np.asarray(wheels.batched_scales) == pytest.approx(0.25)
    seen = []
    for position in ([0.0, 0.0, 2.0], [1.0, 0.5, 2.5]):
        snapshot = snapshot_at(robot, sl.Pose(position, np.eye(3)), Settings(mass=robot.mass), None)
        stage.show(snapshot, TensionScale.of(robot), 1.0, 1.0, ghost=True)
        centers, turns = snapshot.wheels()
        assert np.asarray(wheels.batched_positions) == pytest.approx(centers, abs=1e-6)
        assert np.asarray(wheels.batched_wxyzs) == pytest.approx(turns, abs=1e-6)
        points = np.asarray(node(server, "/cables").points).reshape(8, -1, 2, 3)
        assert points[:, 0, 0] == pytest.approx(robot.frame_anchors, abs=1e-6)
        exits = sl.inverse(robot, snapshot.pose).exit_point
        assert np.linalg.norm(points[:, :, 0] - exits[:, None], axis=2).min(axis=1) == pytest.approx(0.0, abs=1e-5)
        seen.append(exits)
    assert np.linalg.norm(seen[1] - seen[0], axis=1).min() > 0.005


def test_a_dead_length_of_unknown_direction_is_dashed(server: PageServer) -> None:
    base = sl.load_robot("article-suspended")
    rise = np.array([2.0, 2.0, 2.0, 2.0, 1.0, 1.0, 0.0, 0.0])
    winch = sl.Winch(pulley_radius=0.2, dead_cable=2.0, dead_rise=rise, drum_radius=0.2)
    robot = base.replace(winches=winch)
    stage = RobotScene(server.scene, robot, home_pose(robot))
    for name, runs in (("/dead", 4 * 2.0), ("/dead_assumed", 2 * 0.5 * 1.0)):
        points = np.asarray(node(server, name).points)
        assert np.linalg.norm(points[:, 1] - points[:, 0], axis=1).sum() == pytest.approx(runs, rel=1e-5)
    low, high = stage.extent(home_pose(robot))
    drums = shapes.Solid.winches(robot).vertices
    assert np.all(drums > low)
    assert np.all(drums <= high)
