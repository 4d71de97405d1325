"""The panels in the browser: on the left what can be changed, on the right what comes of it."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor, log10
from typing import Any

import viser

from sagline.errors import InvalidValueError
from sagline.robot.robot import Robot
from sagline.viewer import readout
from sagline.viewer.settings import METHODS, MODELS, Settings
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.wording import remembers

LEFT_WIDTH, RIGHT_WIDTH = 310, 380  # px
_LIGHTEST, _HEAVIEST = 0.1, 4.0  # of the robot's own mass


class Panel:
    """Sliders, choices and readings. Reading a value twice is free; nothing here calls back but `changed`."""

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        scale: TensionScale,
        changed: Callable[[], None],
        forget: Callable[[], None],
    ) -> None:
        """Build the panels; `changed` is called, from any thread, when a value changes, `forget` to forget the way."""
        self._gui = server.gui
        self._changed = changed
        self._forget = forget
        self._gui.main_panel.dock_left()
        self._gui.main_panel.set_width(LEFT_WIDTH)
        self._build_what_if(robot)
        self._build_drawing()
        readings = self.readings = self._gui.add_panel()
        with readings.add_tab("Readings"):
            self._verdict = self._gui.add_html(readout.waiting())
            self._gui.add_html(readout.legend(scale, robot))
            self._numbers = self._gui.add_html("")
            with self._gui.add_folder("Feasible tensions"):
                self._polygon = self._gui.add_html("")
        readings.dock_right()
        readings.set_width(RIGHT_WIDTH)
        readings.expand()  # in the bottom sheet of a small screen it would start closed

    @property
    def ghost(self) -> bool:
        """Whether straight cables are drawn beside the real ones."""
        return bool(self._ghost.value)

    def settings(self) -> Settings:
        """What is set.

        Raises:
            InvalidValueError: If a client sent what no slider gives.
        """
        return Settings(
            mass=_slid(self._mass),
            density=_slid(self._density),
            stiffness=_slid(self._stiffness),
            model=MODELS.get(self._model.value, next(iter(MODELS.values()))),
            tension=METHODS.get(self._method.value, next(iter(METHODS.values()))),
            sag_scale=_slid(self._sag_scale),
            error_scale=_slid(self._error_scale),
        )

    def show_what_if(self, still: str) -> None:
        """Show what would change the robot, or in its place why it cannot be changed."""
        shown = not still
        for handle in (self._mass, self._density, self._stiffness, self._model, self._method):
            handle.visible = shown
        self._of_run.visible = not shown
        self._of_run.content = readout.block(f'<div class="quiet">{still}</div>')
        self._forgetting.visible = shown and remembers(self.settings().tension)

    def read_out(self, verdict: str, numbers: str, polygon: str) -> None:
        """Show the readings."""
        self._verdict.content = verdict
        self._numbers.content = numbers
        self._polygon.content = polygon

    def wait(self, what: str) -> None:
        """Say what the numbers wait for."""
        self._verdict.content = readout.waiting(what)

    def refuse(self, message: str) -> None:
        """Say why a setting cannot be had."""
        self._verdict.content = readout.refused(message)

    def watched(self, handle: Any) -> Any:
        """A handle whose changes are told."""
        handle.on_update(lambda _: self._changed())
        return handle

    def _build_what_if(self, robot: Robot) -> None:
        gui = self._gui
        with gui.add_folder("What if"):
            self._of_run = gui.add_html("", visible=False)
            lightest, heaviest, step = mass_range(robot.mass)
            self._mass = self.watched(
                gui.add_slider(
                    "Platform + load [kg]", lightest, heaviest, step, robot.mass,
                    hint="Mass of the platform with its load; the inertia grows with it.",
                )
            )  # fmt: skip
            self._density = self.watched(
                gui.add_slider("Cable density ×", 0.1, 10.0, 0.1, 1.0, hint="Factor on the cables' mass per length.")
            )
            self._stiffness = self.watched(
                gui.add_slider("Cable stiffness ×", 0.1, 10.0, 0.1, 1.0, hint="Factor on the cables' EA.")
            )
            self._model = self.watched(
                gui.add_dropdown(
                    "Cable model",
                    tuple(MODELS),
                    hint="With an approximate model, orange shows where the platform rests.",
                )
            )
            self._method = self.watched(
                gui.add_dropdown("Tensions", tuple(METHODS), hint="How redundant cables share the load.")
            )
            self._forgetting = gui.add_button(
                "Forget the way here",
                icon=viser.Icon.ERASER,
                visible=False,
                hint="The tensions depend on the poses before this one; begin again from this pose alone.",
            )
            self._forgetting.on_click(lambda _: self._forget())

    def _build_drawing(self) -> None:
        gui = self._gui
        with gui.add_folder("Drawing"):
            self._sag_scale = self.watched(gui.add_slider("Sag drawn ×", 0.0, 20.0, 0.5, 1.0))
            self._error_scale = self.watched(
                gui.add_slider("Error drawn ×", 1.0, 200.0, 1.0, 1.0, hint="Position error of the orange platform.")
            )
            self._ghost = self.watched(
                gui.add_checkbox(
                    "Straight cables beside", False, hint="Drawn where a cable hangs visibly apart from it."
                )
            )


def _slid(slider: Any) -> float:
    """The value of a slider.

    Raises:
        InvalidValueError: If a client sent one that the slider does not reach.
    """
    value, low, high = float(slider.value), float(slider.min), float(slider.max)
    if not low <= value <= high:
        raise InvalidValueError(slider.label, value, f"{low:g} to {high:g}", "Move the slider.")
    return value


def mass_range(mass: float) -> tuple[float, float, float]:
    """Lowest and highest mass of the slider and its step [kg], all round numbers."""
    step = 10.0 ** (floor(log10(mass)) - 2)
    rounding = 10.0 * step
    return max(round(_LIGHTEST * mass / step) * step, step), ceil(_HEAVIEST * mass / rounding) * rounding, step
