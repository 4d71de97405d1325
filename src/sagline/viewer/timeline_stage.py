"""What the timeline draws into the scene: the cable that is pointed at, and the second of two runs."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import viser

from sagline.robot.robot import Robot
from sagline.viewer import lines, solids
from sagline.viewer.drawn import Drawn
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.stage import GHOST, GHOST_WIDTH, NEAR
from sagline.viewer.tension_scale import linear
from sagline.viewer.timeline_track import COLORS

_WIDTH: Final = 8.0  # px
_COLORS: Final = linear(np.array([[int(color[i : i + 2], 16) for i in (1, 3, 5)] for color in COLORS], dtype=np.uint8))


class TimelineStage:
    """Nodes of the scene that are made when they are first needed."""

    def __init__(self, scene: viser.SceneApi, robot: Robot, name: str = "") -> None:
        """Draw nothing yet; `name` is that of the second run."""
        self._scene, self._robot, self._name = scene, robot, name
        self._pointed: Any = None
        self._beside: tuple[Any, Any] | None = None  # platform and cables

    def emphasize(self, snapshot: Snapshot | Drawn, cable: int | None, sag_scale: float) -> None:
        """Draw a cable bold in the color of its line, or none."""
        shown = cable is not None and cable < self._robot.cable_count
        if self._pointed is not None:
            self._pointed.visible = shown
        if not shown or cable is None:
            return
        points = lines.segments(snapshot.courses(sag_scale)[[cable]], dashed=False).astype(np.float32)
        if self._pointed is None:
            self._pointed = self._scene.add_line_segments(
                "/pointed", points, GHOST, thickness=_WIDTH, thickness_units="screen"
            )
        self._pointed.points = points
        self._pointed.colors = np.broadcast_to(_COLORS[cable % len(_COLORS)], points.shape)

    def show_beside(self, other: Snapshot | Drawn | None, sag_scale: float) -> None:
        """Draw the second run as a ghost, or nothing."""
        if self._beside is not None:
            for node in self._beside:
                node.visible = other is not None
        if other is None:
            return
        points = other.cable_segments(sag_scale).astype(np.float32)
        if self._beside is None:
            self._beside = self._made(points)
        platform, cables = self._beside
        platform.position, platform.wxyz = other.pose.position, np.roll(other.pose.quaternion, 1)
        cables.points = points

    def _made(self, points: Any) -> tuple[Any, Any]:
        body = solids.platform(self._robot)
        frame = self._scene.add_frame("/beside", show_axes=False)
        self._scene.add_mesh_simple("/beside/body", body.vertices, body.faces, color=GHOST, opacity=0.5)
        above = float(body.vertices[:, 2].max()) + NEAR * solids.size_of(self._robot)
        self._scene.add_label("/beside/name", self._name, position=(0.0, 0.0, above), anchor="bottom-center")
        cables = self._scene.add_line_segments(
            "/beside_cables", points, GHOST, thickness=GHOST_WIDTH, thickness_units="screen"
        )
        return frame, cables
