"""The panel that cuts a cable: which one, and whether the cables have mass."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from sagline.robot.robot import Robot
from sagline.viewer.readout import refused, sentence

KINDS = {"massless": "none", "with cable mass": "lumped"}
TOP = -10.0  # before all else in the panel
HOW = "Click a cable in the scene, or choose one."


class CutPanel:
    """A choice of cables and buttons; the values are read by whoever simulates."""

    def __init__(
        self,
        gui: viser.GuiApi,
        robot: Robot,
        choose: Callable[[], None],
        cut: Callable[[], None],
        calm: Callable[[], None],
    ) -> None:
        """Build the panel; the callbacks are called, from any thread, when a cable is chosen or a button pressed."""
        with gui.add_folder("Cut a cable", expand_by_default=False):
            self._cable: Any = gui.add_dropdown("Cable to cut", tuple(map(str, range(robot.cable_count))))
            self._mass = gui.add_dropdown(
                "Cables in motion", tuple(KINDS), hint="With mass they swing and take longer to compute."
            )
            self._button = gui.add_button("Cut", icon=viser.Icon.SCISSORS)
            self._told = gui.add_html(sentence(HOW))
        self._calm: Any = gui.add_button(
            "Calm", icon=viser.Icon.ARROW_BACK_UP, visible=False, order=TOP, hint="Put everything back as it was."
        )
        self._cable.on_update(lambda event: choose() if event.client is not None else None)
        self._calm.on_click(lambda _: calm())
        self._button.on_click(lambda _: cut())

    @property
    def cable(self) -> int:
        """Which one."""
        return int(self._cable.value) if self._cable.value in self._cable.options else 0

    @property
    def cable_mass(self) -> str:
        """What `simulate` calls it."""
        return KINDS.get(self._mass.value, "none")

    def mark(self, cable: int) -> None:
        """Choose a cable as if by hand."""
        self._cable.value = str(cable)

    def offer_calm(self, *, offered: bool) -> None:
        """Offer to put everything back."""
        self._calm.visible = offered

    def say(self, html: str) -> None:
        """Say something; "" for how to cut."""
        self._told.content = html or sentence(HOW)

    def refuse(self, message: str) -> None:
        """Say why it cannot be cut."""
        self.say(refused(message))
