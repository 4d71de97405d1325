"""Nodes that a feature draws in the scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.viewer.solids import Solid


class Nodes:
    """Nodes of a scene by name: made when they are first drawn, changed in place afterward.

    Attributes:
        scene: The scene.
    """

    def __init__(self, scene: viser.SceneApi, pixel: float = 0.0) -> None:
        """Draw nothing yet; `pixel` [m] is the width of a line of 1 px, 0 for that of the screen."""
        self.scene, self._pixel = scene, pixel
        self._made: dict[str, Any] = {}

    def draw(self, name: str, make: Callable[..., Any], *, visible: bool = True, **values: Any) -> Any:
        """Show a node with these values; `make`, a method of the scene, adds it where there is none."""
        node = self._made.get(name)
        points = values.get("points")
        if node is not None and points is not None and len(node.points) != len(points):
            node.remove()  # points and colors of another number would not arrive together
            node = None
        if node is None:
            node = self._made[name] = make(name, visible=visible, **values)
            return node
        for key, value in values.items():
            setattr(node, key, value)
        node.visible = visible
        return node

    def lines(self, name: str, segments: Array, color: Any, width: float) -> None:
        """Draw segments (k, 2, 3) so wide [px], in one color or in those of their ends; nothing for none."""
        if not len(segments):
            self.hide(name)
            return
        units, thickness = ("screen", width) if self._pixel == 0.0 else ("world", width * self._pixel)
        self.draw(
            name,
            self.scene.add_line_segments,
            points=segments.astype(np.float32),
            colors=np.asarray(color, dtype=np.uint8),
            thickness=thickness,
            thickness_units=units,
        )

    def arrows(self, name: str, ends: Array, color: Any, shaft: float, head: float, length: float) -> None:
        """Draw arrows (k, 2, 3); radii of shaft and head, and length of the head [m]."""
        self.draw(
            name,
            self.scene.add_arrows,
            points=ends.astype(np.float32),
            colors=np.broadcast_to(np.asarray(color, dtype=np.uint8), (len(ends), 3)),
            shaft_radius=shaft,
            head_radius=head,
            head_length=length,
        )

    def label(self, name: str, text: str, position: Any, anchor: str = "bottom-center", scale: float = 1.0) -> None:
        """Write a text at a position; nothing for none."""
        self.draw(
            name,
            self.scene.add_label,
            visible=bool(text),
            text=text,
            position=position,
            anchor=anchor,
            font_screen_scale=scale,
        )

    def body(self, name: str, solid: Solid, color: Any, opacity: float, pose: Pose, position: Any = None) -> None:
        """Draw a solid at a pose, or with the rotation of the pose at another position."""
        place = pose.position if position is None else position
        self.draw(name, self.scene.add_frame, show_axes=False, position=place, wxyz=np.roll(pose.quaternion, 1))
        self.draw(
            f"{name}/body",
            self.scene.add_mesh_simple,
            vertices=solid.vertices.astype(np.float32),
            faces=solid.faces.astype(np.uint32),
            color=color,
            opacity=opacity,
        )

    def hide(self, *names: str) -> None:
        """Hide nodes; those that were never drawn are passed over."""
        for name in names:
            if name in self._made:
                self._made[name].visible = False

    def keep_first(self, name: str, count: int) -> None:
        """Remove the nodes below a name that are numbered from a count on."""
        while f"{name}/{count}" in self._made:
            self.remove(f"{name}/{count}")
            count += 1

    def remove(self, *names: str) -> None:
        """Remove nodes, and those below them; those that were never drawn are passed over."""
        for name in names:
            for found in [each for each in self._made if each == name or each.startswith(f"{name}/")][::-1]:
                self._made.pop(found).remove()
