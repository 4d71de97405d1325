"""The panel that cuts a cable: which one, and whether the cables have mass."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import viser

from sagline.robot.robot import Robot
from sagline.viewer.readout import refused, sentence

KINDS = {"massless": "none", "with cable mass": "lumped"}


class CutPanel:
    """A choice of cables and a button; the values are read by whoever simulates."""

    def __init__(self, gui: viser.GuiApi, robot: Robot, cut: Callable[[], None], back: Callable[[], None]) -> None:
        """Build the panel; `cut` and `back` are called, from any thread, when their buttons are pressed."""
        with gui.add_folder("Cut a cable", expand_by_default=False):
            self._cable = gui.add_dropdown("Cable to cut", tuple(map(str, range(robot.cable_count))))
            self._mass = gui.add_dropdown(
                "Cables in motion", tuple(KINDS), hint="With mass they swing and take longer to compute."
            )
            self._button = gui.add_button("Cut", icon=viser.Icon.SCISSORS)
            self._told = gui.add_html("")
            self._back: Any = gui.add_button("Back", icon=viser.Icon.ARROW_BACK_UP, visible=False)
        self._back.on_click(lambda _: back())
        self._button.on_click(lambda _: cut())

    @property
    def cable(self) -> int:
        """Which one."""
        return int(self._cable.value) if self._cable.value in self._cable.options else 0

    @property
    def cable_mass(self) -> str:
        """What `simulate` calls it."""
        return KINDS.get(self._mass.value, "none")

    def offer_back(self, to: str) -> None:
        """Offer to go back to what was played before; "" for nothing."""
        self._back.visible = bool(to)
        self._back.label = f"Back to the {to}"

    def say(self, text: str) -> None:
        """A remark, or none."""
        self._told.content = sentence(text) if text else ""

    def refuse(self, message: str) -> None:
        """Say why it cannot be cut."""
        self._told.content = refused(message)
