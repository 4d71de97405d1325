"""What is missing where the platform cannot be held, in the scene: an arrow, marked cables, and a ghost elsewhere."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import viser

from sagline.robot.robot import Robot
from sagline.viewer import lines, solids
from sagline.viewer.missing import Missing
from sagline.viewer.missing_nearest import NearestHeld
from sagline.viewer.missing_words import distance_of, missing_label
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import INFEASIBLE
from sagline.viewer.tension_scale import TensionScale, force_unit

HELD: Final = (28, 140, 92)  # the platform where it would be held
WIDTH, WAY_WIDTH = 5.0, 2.0  # px
SMALL: Final = 0.8  # of the size of other names
LONG: Final = 0.2  # of the robot's size: the arrow, its head and its thickness
HEAD, HEAD_RADIUS, SHAFT_RADIUS = 0.04, 0.014, 0.006
ALONG: Final = (0.32, 0.44, 0.56)  # of a cable from its anchor, where names stand: neighbors do not meet


class MissingStage:
    """Draws it; nothing is there before it is needed."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, scale: TensionScale) -> None:
        """Draw nothing yet."""
        self._scene, self._scale = scene, scale
        self._size, self._body = solids.size_of(robot), solids.platform(robot)
        self._arrow: tuple[Any, ...] = ()
        self._marks: Any = None
        self._names: dict[int, Any] = {}
        self._ghost: list[Any] = []

    def show(self, snapshot: Snapshot, missing: Missing | None) -> None:
        """Draw the missing force at the center of mass, and cables at limits, in the colors of these tensions."""
        self._show_force(snapshot, missing)
        limits = () if missing is None else missing.limits
        for cable, name in self._names.items():
            name.visible = any(each.cable == cable for each in limits)
        if self._marks is not None:
            self._marks.visible = bool(limits)
        if not limits:
            return
        courses = snapshot.courses(1.0)[[each.cable for each in limits]]
        ends = np.array([self._scale.low if each.lower else self._scale.high for each in limits])
        pieces = lines.segments(courses, dashed=False).astype(np.float32)
        colors = np.repeat(self._scale.linear_colors(ends), 2 * (courses.shape[1] - 1), axis=0).reshape(-1, 2, 3)
        if self._marks is None or len(self._marks.points) != len(pieces):
            if self._marks is not None:
                self._marks.remove()
            self._marks = self._scene.add_line_segments(
                "/limits", pieces, colors, thickness=WIDTH, thickness_units="screen"
            )
        self._marks.points, self._marks.colors, self._marks.visible = pieces, colors, True
        for each, course in zip(limits, courses, strict=True):
            self._name(each.cable, each.name, course)

    def show_nearest(self, snapshot: Snapshot, nearest: NearestHeld | None) -> None:
        """Draw the platform where it would be held, and the way there."""
        if nearest is not None and not self._ghost:
            frame = self._scene.add_frame("/nearest", show_axes=False)
            body = self._scene.add_mesh_simple(
                "/nearest/body", self._body.vertices, self._body.faces, color=HELD, opacity=0.5
            )
            name = self._scene.add_label("/nearest/name", "", anchor="top-center", font_screen_scale=SMALL)
            way = self._scene.add_line_segments(
                "/nearest_way", np.zeros((lines.POINTS - 1, 2, 3), dtype=np.float32), HELD,
                thickness=WAY_WIDTH, thickness_units="screen",
            )  # fmt: skip
            self._ghost = [frame, way, name, body]
        for handle in self._ghost[:2]:
            handle.visible = nearest is not None
        if nearest is None:
            return
        frame, way, name, _ = self._ghost
        pose = nearest.pose
        frame.position, frame.wxyz = pose.position, np.roll(pose.quaternion, 1)
        name.text = f"held here, {distance_of(nearest)} away"
        ends = np.stack((snapshot.pose.position, pose.position))[None]
        way.points = lines.segments(lines.straight(ends), dashed=True).astype(np.float32)

    def clear(self) -> None:
        """Draw nothing."""
        for handle in (*self._names.values(), *self._ghost[:2], *self._arrow):
            handle.visible = False
        if self._marks is not None:
            self._marks.visible = False

    def _show_force(self, snapshot: Snapshot, missing: Missing | None) -> None:
        size = 0.0 if missing is None else float(np.linalg.norm(missing.force))
        for handle in self._arrow:
            handle.visible = size > 0.0
        if missing is None or size == 0.0:
            return
        start = snapshot.pose.transform(snapshot.robot.center_of_mass)
        tip = start + LONG * self._size / size * missing.force
        ends = np.stack((start, tip))[None].astype(np.float32)
        if not self._arrow:
            self._arrow = (
                self._scene.add_arrows(
                    "/missing", ends, INFEASIBLE, shaft_radius=SHAFT_RADIUS * self._size,
                    head_radius=HEAD_RADIUS * self._size, head_length=HEAD * self._size,
                ),
                self._scene.add_label("/missing_name", "", anchor="bottom-center"),
            )  # fmt: skip
        arrow, name = self._arrow
        arrow.points = ends
        name.text, name.position = missing_label(missing, force_unit(snapshot.robot)), tip

    def _name(self, cable: int, text: str, course: np.ndarray) -> None:
        share = ALONG[cable % len(ALONG)]
        place = course[round(share * (len(course) - 1))]
        if cable not in self._names:
            self._names[cable] = self._scene.add_label(f"/limits_names/{cable}", "", font_screen_scale=SMALL)
        name = self._names[cable]
        name.text, name.position, name.visible = text, place, True
