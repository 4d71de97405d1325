"""A calibration in the scene: ellipsoids of its anchors' errors, and the poses of its log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.viewer.ellipsoids import Ellipsoids, ball
from sagline.viewer.stage import TRACE_WIDTH, TRUTH
from sagline.viewer.tension_scale import Colors

OPACITY: Final = 0.55
_DOT: Final = 0.0055  # radius of a pose, of the robot's size
_ABOVE: Final = 0.02  # of the robot's size: the name of a pose over it


class CalibrationStage:
    """What is drawn of a calibration."""

    def __init__(self, scene: viser.SceneApi, size: float, picked: Callable[[int], None]) -> None:
        """Begin with nothing.

        Args:
            scene: Where.
            size: Of the robot [m].
            picked: Given the number of a pose that is clicked, among those drawn; from any thread.
        """
        self._scene, self._size, self._picked = scene, size, picked
        self._ball = ball()
        self._ellipsoids: dict[str, list[Any]] = {}
        self._dots: Any = None
        self._names: list[Any] = []
        self._chosen: Any = None

    def show_ellipsoids(self, where: str, some: Ellipsoids, moved_from: Array, factor: float) -> None:
        """Draw ellipsoids in place of those before, with lines from where the points were.

        Args:
            where: Node they hang on: "" for the world, "/platform" for the platform.
            some: The ellipsoids; without any nothing is drawn.
            moved_from: Where their points were [m], shape (k, 3).
            factor: How many times as large errors and moves are drawn.
        """
        self.hide_ellipsoids(where)
        if not len(some.which):
            return
        ends = np.stack((some.middle + factor * (moved_from - some.middle), some.middle), axis=1)
        self._ellipsoids[where] = [
            self._scene.add_batched_meshes_simple(
                f"{where}/errors", self._ball.vertices.astype(np.float32), self._ball.faces.astype(np.uint32),
                some.turn.astype(np.float32), some.middle.astype(np.float32),
                batched_scales=some.drawn(factor).astype(np.float32), batched_colors=TRUTH, opacity=OPACITY,
                lod="off", cast_shadow=False, receive_shadow=False,
            ),
            self._scene.add_line_segments(
                f"{where}/moves", ends.astype(np.float32), TRUTH, thickness=TRACE_WIDTH, thickness_units="screen"
            ),
        ]  # fmt: skip

    def hide_ellipsoids(self, where: str) -> None:
        """Draw none there."""
        for handle in self._ellipsoids.pop(where, []):
            handle.remove()

    def show_poses(self, places: Array, colors: Colors, names: dict[int, str]) -> None:
        """Draw poses as dots to be clicked, some of them with a name.

        Args:
            places: Where [m], shape (k, 3).
            colors: Of each, shape (k, 3).
            names: Of those that have one, by their numbers.
        """
        self.hide_poses()
        if not len(places):
            return
        upright = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(places), 1))
        self._dots = self._scene.add_batched_meshes_simple(
            "/log", self._ball.vertices.astype(np.float32), self._ball.faces.astype(np.uint32), upright,
            places.astype(np.float32), batched_scales=np.full(len(places), _DOT * self._size, dtype=np.float32),
            batched_colors=colors, lod="off", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._dots.on_click(lambda event: self._picked(int(event.instance_index)))
        over = np.array([0.0, 0.0, _ABOVE * self._size])
        self._names = [
            self._scene.add_label(f"/log/{k}", name, position=places[k] + over, font_screen_scale=0.8)
            for k, name in names.items()
        ]

    def hide_poses(self) -> None:
        """Draw none."""
        while self._names:
            self._names.pop().remove()
        if self._dots is not None:
            self._dots.remove()
            self._dots = None

    def choose(self, place: Array | None, name: str) -> None:
        """Name a pose; None for none."""
        if self._chosen is not None:
            self._chosen.remove()
            self._chosen = None
        if place is not None:
            under = place - np.array([0.0, 0.0, _ABOVE * self._size])
            self._chosen = self._scene.add_label("/chosen", name, position=under, anchor="top-center")
