"""A cable that is chosen to be cut: marked and named in the scene, with a button at the top of the panel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.viewer import lines
from sagline.viewer.cut_panel import TOP

MARK: Final = (200, 60, 130)  # 3 : 1 on both backgrounds
_WIDTH: Final = 7.0  # px
_PLACE: Final = 0.4  # where on the cable its name is, from the frame on


class CutStage:
    """What is drawn of the choice; nothing until there is one."""

    def __init__(self, server: viser.ViserServer, cut: Callable[[], None]) -> None:
        """Begin with nothing; `cut` is called, from any thread, when the button is pressed."""
        self._scene = server.scene
        self._line: Any = None
        self._label: Any = None
        self._button: Any = server.gui.add_button("Cut", icon=viser.Icon.SCISSORS, visible=False, order=TOP)
        self._button.on_click(lambda _: cut())

    def show(self, course: Array, name: str, cable: int) -> None:
        """Mark a cable along its points (P, 3), with a name and a button."""
        points = lines.segments(course[None], dashed=False).astype(np.float32)
        if self._line is None:
            self._build(points)
        place = course[int(_PLACE * (len(course) - 1))]
        self._line.points, self._line.visible = points, True
        self._label.position, self._label.text, self._label.visible = place, name, True
        self._button.label, self._button.visible = f"Cut cable {cable}", True

    def hide(self) -> None:
        """Mark nothing."""
        if self._line is not None:
            self._line.visible = self._label.visible = self._button.visible = False

    def _build(self, points: Any) -> None:
        scene = self._scene
        self._line = scene.add_line_segments("/chosen", points, MARK, thickness=_WIDTH, thickness_units="screen")
        self._label = scene.add_label("/chosen_name", "", anchor="bottom-center", depth_test=False)
