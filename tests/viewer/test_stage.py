"""The scene, as it is sent to clients."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer import solids
from sagline.viewer.server import Server, started, stop
from sagline.viewer.stage import Stage
from sagline.viewer.viewer import home_pose


@pytest.fixture(scope="module")
def server() -> Iterator[Server]:
    one = started(port=0)
    yield one
    stop(one)


def node(server: Server, name: str) -> Any:
    return server.scene._handle_from_node_name[name]


@pytest.mark.parametrize("name", sl.robot_names())
def test_the_gizmo_is_smaller_than_the_robot_and_no_larger_than_it_must(server: Server, name: str) -> None:
    robot = sl.load_robot(name)
    Stage(server.scene, robot, home_pose(robot))
    size = solids.size_of(robot)
    gizmo = node(server, "/platform")
    assert 0.05 * size < gizmo.scale < 0.2 * size
    assert gizmo.depth_test  # what is behind the platform does not hide it


@pytest.mark.parametrize("name", sl.robot_names())
def test_every_robot_has_a_floor_and_a_scale(server: Server, name: str) -> None:
    robot = sl.load_robot(name)
    Stage(server.scene, robot, home_pose(robot))
    low, high = solids.bounds(robot)
    floor = node(server, "/floor")
    assert floor.width > high[0] - low[0]
    assert floor.position[2] == pytest.approx(low[2], abs=0.01 * solids.size_of(robot))
    assert floor.fade_distance > 5.0 * solids.size_of(robot)
    assert 5.0 < np.hypot(floor.width, floor.height) / floor.cell_size < 60.0
    arms = np.asarray(node(server, "/axes").points)
    lengths = np.linalg.norm(arms[:, 1] - arms[:, 0], axis=1)
    assert node(server, "/axes/length").text == f"{lengths[0]:g} m"
    assert lengths == pytest.approx(lengths[0])
    assert (arms[:, 1] - arms[:, 0]) / lengths[0] == pytest.approx(np.eye(3), abs=1e-6)
