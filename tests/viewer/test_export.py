"""What one takes away."""

from io import BytesIO

import numpy as np
import pytest
import trimesh

import sagline as sl
from sagline.viewer.export import scene_as_glb
from sagline.viewer.settings import Settings
from sagline.viewer.snapshot import taken_at
from sagline.viewer.tension_scale import TensionScale

ROBOT = sl.load_robot("article-suspended")


def test_glb_holds_the_scene_in_meters_with_y_up() -> None:
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    scale = TensionScale.of(ROBOT)
    glb = scene_as_glb(taken_at(ROBOT, pose, Settings(mass=50.0), None), scale)
    scene = trimesh.load(BytesIO(glb), file_type="glb")
    assert isinstance(scene, trimesh.Scene)
    assert set(scene.geometry) == {"frame", "winches", "platform", *(f"cable {i}" for i in range(8))}
    assert scene.bounds[0] == pytest.approx([-7.5, 0.0, -5.5], abs=0.3)
    assert scene.bounds[1] == pytest.approx([7.5, 6.0, 5.5], abs=0.3)
    place, _ = scene.graph["platform"]
    corners = trimesh.transform_points(scene.geometry["platform"].vertices, place)
    assert corners.mean(axis=0) == pytest.approx([1.0, 2.0, -0.5], abs=1e-5)


def test_glb_holds_pulleys_as_they_have_turned_and_what_is_behind() -> None:
    winch = sl.Winch(pulley_radius=[0.0] + [0.3] * 7, dead_cable=2.0, dead_rise=[2.0] * 4 + [1.0] * 4, drum_radius=0.2)
    robot, pose = ROBOT.replace(winches=winch), sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    snapshot = taken_at(robot, pose, Settings(mass=50.0), None)
    scene = trimesh.load(BytesIO(scene_as_glb(snapshot, TensionScale.of(robot))), file_type="glb")
    assert isinstance(scene, trimesh.Scene)
    behind = {f"dead cable {i}" for i in range(4)} | {f"dead cable {i}, its way not known" for i in range(4, 8)}
    assert set(scene.geometry) == {
        "frame",
        "winches",
        "platform",
        *behind,
        *(f"pulley {i}" for i in range(1, 8)),
        *(f"cable {i}" for i in range(8)),
    }
    for i in range(1, 8):
        place, geometry = scene.graph[f"pulley {i}"]
        middle = trimesh.transform_points(scene.geometry[geometry].bounds, place).mean(axis=0)
        reach = (pose.transform(robot.platform_anchors) - robot.frame_anchors)[i] * [1.0, 1.0, 0.0]
        x, y, z = robot.frame_anchors[i] + 0.3 * reach / np.linalg.norm(reach)
        assert middle == pytest.approx([x, z, -y], abs=1e-5)
