"""Exported scenes."""

from io import BytesIO
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.viewer.snapshot import Settings, snapshot_at
from sagline.viewer.tension_scale import TensionScale

ROBOT = sl.load_robot("article-suspended")


def exported(robot: sl.Robot, pose: sl.Pose) -> Any:
    """The scene of a GLB file, read again by trimesh."""
    import trimesh  # a quarter of a second; the exporter imports it too

    from sagline.viewer.features.export import scene_as_glb

    glb = scene_as_glb(snapshot_at(robot, pose, Settings(mass=50.0), None), TensionScale.of(robot))
    scene = trimesh.load(BytesIO(glb), file_type="glb")
    assert isinstance(scene, trimesh.Scene)
    return scene


def corners_of(scene: Any, name: str) -> np.ndarray:
    """Corners of a part where the scene puts it [m], shape (V, 3)."""
    place, geometry = scene.graph[name]
    return np.asarray(scene.geometry[geometry].vertices @ place[:3, :3].T + place[:3, 3])


def test_glb_contains_the_scene_in_meters_with_y_up() -> None:
    pose = sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    scene = exported(ROBOT, pose)
    assert set(scene.geometry) == {"frame", "winches", "platform", *(f"cable {i}" for i in range(8))}
    assert scene.bounds[0] == pytest.approx([-7.5, 0.0, -5.5], abs=0.3)
    assert scene.bounds[1] == pytest.approx([7.5, 6.0, 5.5], abs=0.3)
    corners = corners_of(scene, "platform")
    assert corners.mean(axis=0) == pytest.approx([1.0, 2.0, -0.5], abs=1e-5)
    for i, (x, y, z) in enumerate(ROBOT.frame_anchors):
        away = np.linalg.norm(corners_of(scene, f"cable {i}") - [x, z, -y], axis=1)
        assert away.min() < 0.05


def test_glb_contains_rotated_pulleys_and_the_routing() -> None:
    winch = sl.Winch(pulley_radius=[0.0] + [0.3] * 7, dead_cable=2.0, dead_rise=[2.0] * 4 + [1.0] * 4, drum_radius=0.2)
    robot, pose = ROBOT.replace(winches=winch), sl.Pose([1.0, 0.5, 2.0], np.eye(3))
    scene = exported(robot, pose)
    behind = {f"dead length {i}" for i in range(4)} | {f"dead length {i}, path not known" for i in range(4, 8)}
    assert set(scene.geometry) == {
        "frame",
        "winches",
        "platform",
        *behind,
        *(f"pulley {i}" for i in range(1, 8)),
        *(f"cable {i}" for i in range(8)),
    }
    for i in range(1, 8):
        corners = corners_of(scene, f"pulley {i}")
        middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
        reach = (pose.transform(robot.platform_anchors) - robot.frame_anchors)[i] * [1.0, 1.0, 0.0]
        x, y, z = robot.frame_anchors[i] + 0.3 * reach / np.linalg.norm(reach)
        assert middle == pytest.approx([x, z, -y], abs=1e-5)
