"""What other viewers draw of a log: the platform as a frame that moves, and frame, platform and cables as lines."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
    from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

WORLD, PLATFORM = "world", "platform"
FINE, COARSE = 2.0**20, 2.0**10  # 1/m: what is drawn is rounded to such steps, of whose bytes most are zero
POINTS: Final = 7  # of a cable
_THICKNESS: Final = 3.0  # px
_STEEL, _BLUE, _CABLE = (0.47, 0.5, 0.54), (0.23, 0.53, 0.79), (0.55, 0.36, 0.17)  # red, green, blue, 0 to 1


def transform(stamp: int, position: Array, quaternion: Array) -> FrameTransform:
    """Where the platform is, as Foxglove has it.

    Args:
        stamp: When [ns].
        position: Of its origin [m], shape (3,).
        quaternion: Its rotation to the world, scalar last, shape (4,).
    """
    from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform

    found = FrameTransform(parent_frame_id=WORLD, child_frame_id=PLATFORM)
    found.timestamp.FromNanoseconds(stamp)
    for target, values in ((found.translation, position), (found.rotation, quaternion)):
        for name, value in zip("xyzw", np.rint(values * FINE) / FINE, strict=False):
            setattr(target, name, value)
    return found


class Scene:
    """A robot as lines; what does not change is made once."""

    def __init__(self, robot: Robot) -> None:
        """Draw frame and platform."""
        self._robot = robot
        self._frame = _corners(robot.frame_anchors)
        self._body = _corners(robot.platform_anchors)

    def at(self, stamp: int, position: Array, quaternion: Array, tension: Array) -> SceneUpdate:
        """All of it: who looks in later sees all too.

        Args:
            stamp: When [ns].
            position: Of the platform's origin [m], shape (3,).
            quaternion: Its rotation to the world, scalar last, shape (4,).
            tension: At the frame ends [N], shape (m,): how much the cables sag.
        """
        from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

        scene = SceneUpdate()
        _lines(scene.entities.add(), stamp, "frame", WORLD, _STEEL, self._frame)
        _lines(scene.entities.add(), stamp, "platform", PLATFORM, _BLUE, self._body)
        ends = Pose.from_quaternion(position, quaternion).transform(self._robot.platform_anchors)
        _lines(scene.entities.add(), stamp, "cables", WORLD, _CABLE, self._cables(ends, tension))
        return scene

    def _cables(self, ends: Array, tension: Array) -> Array:
        """Points along the cables (m, POINTS, 3): parabolas, which no eye tells from what they are."""
        robot, share = self._robot, np.linspace(0.0, 1.0, POINTS)[:, None]
        start = robot.frame_anchors[:, None]
        run = ends[:, None] - start
        points = np.asarray(start + share * run)
        chord = np.linalg.norm(run[:, 0], axis=1)
        span = np.hypot(run[:, 0, 0], run[:, 0, 1])
        weight = robot.cables.linear_density * robot.gravity  # N/m
        deep = 0.5 * weight * span * chord / np.maximum(tension, weight * chord)  # m, times share (1 - share)
        points[:, :, 2] -= np.where(np.isfinite(deep), deep, 0.0)[:, None] * (share * (1.0 - share))[:, 0]
        return points


def _lines(entity: SceneEntity, stamp: int, name: str, frame: str, color: tuple[float, ...], courses: Array) -> None:
    """Polylines (k, P, 3)."""
    entity.id, entity.frame_id = name, frame
    entity.timestamp.FromNanoseconds(stamp)
    for course in np.rint(courses * COARSE) / COARSE:
        line: Any = entity.lines.add()
        line.thickness, line.scale_invariant = _THICKNESS, True
        line.color.r, line.color.g, line.color.b = color
        line.color.a = line.pose.orientation.w = 1.0
        for x, y, z in course.tolist():
            line.points.add(x=x, y=y, z=z)


def _corners(points: Array) -> Array:
    """Lines from every point to every other that no third is nearer to than both are to one another (e, 2, 3)."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    near = [
        (i, j)
        for i, j in combinations(range(len(points)), 2)
        if (np.maximum(distance[i], distance[j]) >= distance[i, j] * (1.0 - 1e-9)).all()
    ]
    return points[np.array(near, dtype=np.intp).reshape(-1, 2)]
