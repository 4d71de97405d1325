"""The proof, seen: the forces on the platform in a tab of their own, and as arrows in the scene."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.force_polygon import pulls_of
from sagline.viewer.force_polygon_figure import force_polygon_figure
from sagline.viewer.missing import Missing
from sagline.viewer.readout import sentence
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.view import View

LONG: Final = 0.22  # of the robot's size: the longest arrow in the scene
HEAD, HEAD_RADIUS, SHAFT_RADIUS = 0.03, 0.011, 0.0045
NOT_AT_REST: Final = "In motion, and in a log, forces do not add up to nothing: the proof is one of a pose at rest."
UNKNOWN: Final = "There are no tensions here, and no force is known that would do: nothing to add up."


class ForcePolygonShow:
    """Follows what is shown; all of it belongs to the thread that serves."""

    moving = False
    waiting = False

    def __init__(
        self,
        server: viser.ViserServer,
        readings: Any,
        size: float,
        changed: Callable[[], None],
        missing: Callable[[], Missing | None],
    ) -> None:
        """Build the tab.

        Args:
            server: The page.
            readings: The panel that gets the tab.
            size: The robot's [m].
            changed: Called, from any thread, when the arrows are wanted or not.
            missing: What is missing at the pose that is shown; None for nothing.
        """
        self._scene, self._size, self._missing = server.scene, size, missing
        self._arrows: Any = None
        with readings.add_tab("Proof"):
            self._wanted: Any = server.gui.add_checkbox(
                "Forces in the scene", False, hint="As arrows at the platform, the longest always of the same length."
            )
            self._told = server.gui.add_html("")
        self._wanted.on_update(lambda _: changed())

    def follow(self, view: View) -> None:
        """Add up the forces of what is shown."""
        state, lacking = self._balance(view)
        if state is None:
            self._told.content = sentence(NOT_AT_REST if not isinstance(view.snapshot, Snapshot) else UNKNOWN)
        else:
            self._told.content = force_polygon_figure(state, lacking)
        self._draw(state if self._wanted.value else None, lacking)

    def tick(self) -> None:
        """Nothing comes of time."""

    def _balance(self, view: View) -> tuple[Equilibrium | None, Array | None]:
        """What is in balance, and the wrench that nobody gives."""
        snapshot = view.snapshot
        if not isinstance(snapshot, Snapshot):
            return None, None
        if snapshot.plan is not None and snapshot.feasible:
            return snapshot.plan.state, None
        missing = self._missing()
        return (None, None) if missing is None else (missing.state, missing.wrench)

    def _draw(self, state: Equilibrium | None, lacking: Array | None) -> None:
        """Arrows from where the forces act; those toward the platform's middle, its weight too, from there."""
        if state is None:
            if self._arrows is not None:
                self._arrows.visible = False
            return
        pulls = pulls_of(state, lacking)
        longest = max(float(np.linalg.norm(each.force)) for each in pulls)
        scale = LONG * self._size / longest
        ends = np.array([[each.at, each.at + scale * each.force] for each in pulls], dtype=np.float32)
        colors = np.array([each.color for each in pulls], dtype=np.uint8)
        if self._arrows is None or len(self._arrows.points) != len(ends):
            if self._arrows is not None:
                self._arrows.remove()
            self._arrows = self._scene.add_arrows(
                "/forces", ends, colors, shaft_radius=SHAFT_RADIUS * self._size, head_radius=HEAD_RADIUS * self._size,
                head_length=HEAD * self._size,
            )  # fmt: skip
        self._arrows.points, self._arrows.colors, self._arrows.visible = ends, colors, True
