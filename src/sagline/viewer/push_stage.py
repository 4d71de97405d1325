"""A push in the scene: its arrow, the platform where it would go, and how it gives way."""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import viser
from scipy.spatial.transform import Rotation

from sagline.core.arrays import Array
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import solids
from sagline.viewer.ellipsoids import THINNEST, ball

COLOR: Final = (200, 60, 130)  # 3 : 1 on both backgrounds, none of those of platforms
GHOST_OPACITY, BALL_OPACITY = 0.5, 0.3
_SHAFT, _HEAD, _LONG = 0.003, 0.009, 0.025  # of an arrow, of the robot's size
_APART: Final = 0.03  # of the robot's size: what is said of the reserve stands this much below the platform's place


class Drawing(NamedTuple):
    """What is drawn of a push.

    Attributes:
        start: Where the force acts [m], shape (3,).
        end: Tip of its arrow [m], shape (3,).
        ghost: The platform where it would go; None for none.
        axes: Half axes of the ellipsoid as drawn, one a column [m], shape (3, 3); None for none.
        tip: What stands at the arrow.
        below: What stands below the place.
    """

    start: Array
    end: Array
    ghost: Pose | None
    axes: Array | None
    tip: str
    below: str


class PushStage:
    """What is drawn of a push; nothing until there is one."""

    def __init__(self, scene: viser.SceneApi, robot: Robot) -> None:
        """Begin with nothing."""
        self._scene, self._size = scene, solids.size_of(robot)
        self.body = solids.platform(robot)
        self._all: list[Any] = []
        self._ghost: Any = None
        self._arrow: Any = None
        self._ball: Any = None
        self._tip: Any = None
        self._below: Any = None

    def show(self, drawing: Drawing) -> None:
        """Draw a push in place of the one before."""
        if self._arrow is None:
            self._build()
        self._arrow.points = np.stack((drawing.start, drawing.end))[None].astype(np.float32)
        self._tip.position, self._tip.text = drawing.end, drawing.tip
        self._below.position = drawing.start - np.array([0.0, 0.0, _APART * self._size])
        self._below.text = drawing.below
        for each in (self._arrow, self._tip, self._below):
            each.visible = True
        self._ghost.visible = drawing.ghost is not None
        if drawing.ghost is not None:
            self._ghost.position, self._ghost.wxyz = drawing.ghost.position, np.roll(drawing.ghost.quaternion, 1)
        self._ball.visible = drawing.axes is not None
        if drawing.axes is not None:
            self._ball.position = drawing.start
            self._ball.wxyz, self._ball.scale = _placed(drawing.axes)

    def hide(self) -> None:
        """Draw nothing."""
        if self._arrow is not None:
            for each in (self._arrow, self._tip, self._below, self._ghost, self._ball):
                each.visible = False

    def _build(self) -> None:
        size, scene, body, sphere = self._size, self._scene, self.body, ball()
        self._arrow = scene.add_arrows(
            "/push", np.zeros((1, 2, 3), dtype=np.float32), COLOR,
            shaft_radius=_SHAFT * size, head_radius=_HEAD * size, head_length=_LONG * size,
        )  # fmt: skip
        self._tip = scene.add_label("/push_tip", "", anchor="bottom-center", depth_test=False)
        self._below = scene.add_label("/push_below", "", anchor="top-center", depth_test=False, font_screen_scale=0.85)
        self._ghost = scene.add_mesh_simple(
            "/pushed", body.vertices, body.faces, color=COLOR, opacity=GHOST_OPACITY, cast_shadow=False
        )
        self._ball = scene.add_mesh_simple(
            "/gives_way", sphere.vertices, sphere.faces, color=COLOR, opacity=BALL_OPACITY, cast_shadow=False,
            receive_shadow=False,
        )  # fmt: skip


def _placed(axes: Array) -> tuple[Array, tuple[float, float, float]]:
    """How a ball is turned (scalar first) and scaled to have half axes (3, 3); a flat one is still seen."""
    lengths = np.linalg.norm(axes, axis=0)
    directions = axes / np.maximum(lengths, 1e-300)
    if np.linalg.det(directions) < 0.0:
        directions[:, 0] *= -1.0
    scale = np.maximum(lengths, THINNEST * lengths.max())
    turn = Rotation.from_matrix(directions).as_quat()
    return np.roll(turn, 1), (float(scale[0]), float(scale[1]), float(scale[2]))
