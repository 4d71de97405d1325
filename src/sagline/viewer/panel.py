"""Panels in the browser: controls on the left, displayed values on the right."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil, floor, log10
from typing import Any

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.inverse_rows import Given
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.statics.stiffness import modes
from sagline.statics.tables import has_pulley_model
from sagline.tension.method import TensionMethod
from sagline.viewer import readout
from sagline.viewer.feature import View
from sagline.viewer.player import InMotion
from sagline.viewer.snapshot import BY_HAND, METHODS, MODELS, ByHand, Settings, depends_on_history
from sagline.viewer.tension_scale import TensionScale

LEFT_WIDTH, RIGHT_WIDTH = 310, 380  # width of the panel [px]
BY_LIMITS, BY_POSE = "tension limits", "this pose"
_ENDS_OF_POSE = "ends: lowest and highest tension of this pose"
_LIGHTEST, _HEAVIEST = 0.1, 4.0  # limits relative to the robot's mass


class ControlPanel:
    """Sliders, choices and displayed values."""

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        scale: TensionScale,
        changed: Callable[[], None],
        forget: Callable[[], None],
        given: tuple[Given, ...] | None = None,
    ) -> None:
        """Build the panels. Any thread calls `changed` after a change of a value, and `forget` to reset the history."""
        self._gui, self._robot, self._limits, self._given = server.gui, robot, scale, given
        self._changed, self._forget = changed, forget
        self.method_name = next(iter(METHODS))  # name of the last chosen method, except for tensions by hand
        self._by_hand: ByHand | None = None
        self._shown_scale = scale  # scale of the legend
        self._sliders: dict[str, viser.GuiHtmlHandle] = {}  # sliders of the factors by their labels
        self._gui.main_panel.dock_left()
        self._gui.main_panel.set_width(LEFT_WIDTH)
        self._build_what_if(robot)
        self._build_drawing()
        readings = self.readings = self._gui.add_panel()
        with readings.add_tab("Readings"):
            self.verdict = self._gui.add_html("")  # verdict on the pose, or the reason why a setting is invalid
            self._explained = self._gui.add_html("", visible=False)
            self._legend = self._gui.add_html(readout.legend(scale, robot))
            self.numbers = self._gui.add_html("")  # numbers of the pose and of the cables
            with self._gui.add_folder("Feasible tensions"):
                self.polygon = self._gui.add_html("")
        with readings.add_tab("Control"):  # for small screens; see browser/control.js
            self._gui.add_html(readout.sentence("Pose, push, cut and all other controls are below."))
        readings.dock_right()
        readings.set_width(RIGHT_WIDTH)
        readings.expand()  # closed at first in the bottom sheet of a small screen

    def color_scale(self, tension: Array) -> TensionScale:
        """The scale of colors for the tensions of a pose."""
        return TensionScale.of_pose(tension, self._limits) if self._colors.value == BY_POSE else self._limits

    def show(self, view: View, visible: float) -> None:
        """Write the readings of a view; a smaller sag than `visible` [m] cannot be seen."""
        snapshot, scale, state = view.snapshot, view.scale, view.state
        if scale != self._shown_scale:
            ends = "" if scale is self._limits else _ENDS_OF_POSE
            self._shown_scale, self._legend.content = scale, readout.legend(scale, self._robot, ends)
        if isinstance(snapshot, InMotion):
            self.verdict.content, self.numbers.content = snapshot.verdict, snapshot.numbers(scale)
        else:
            frequencies = None if state is None else modes(state).frequency
            compromise = None if view.missing is None else view.missing.state
            self.verdict.content = readout.verdict(snapshot)
            self.numbers.content = readout.numbers_html(snapshot, scale, frequencies, compromise)
        self.show_what_if("" if view.played is None else view.played.unchanged)
        sag = 0.0 if state is None else float(np.max(state.cables.sag))
        self._sag_hint.visible = 0.0 < sag * view.settings.sag_scale < visible
        if self._sag_hint.visible:
            text = f"The sag is {n(1e3 * sag, '.2g', 'mm')} or less, too small to be seen here. Draw it larger."
            self._sag_hint.content = readout.sentence(text)

    def settings(self) -> Settings:
        """The settings."""
        mass = _slid(self._mass)
        return Settings(
            mass=self._own_mass if mass == written_mass(self._own_mass) else mass,
            density=_slid(self._density),
            stiffness=_slid(self._stiffness),
            model=MODELS.get(self._model.value, next(iter(MODELS.values()))),
            tension=self._tension(),
            sag_scale=_slid(self._sag_scale),
            error_scale=_slid(self._error_scale),
            given=self._given,
        )

    def _tension(self) -> TensionMethod:
        chosen = self.method.value
        if chosen == BY_HAND and self._by_hand is not None:
            return self._by_hand
        self.method_name = chosen if chosen in METHODS else next(iter(METHODS))
        return METHODS[self.method_name]

    def show_what_if(self, reason: str) -> None:
        """Show the controls that change the robot, or the reason why a played motion does not allow changes."""
        shown = not reason
        factors = (self._sliders[each.label] for each in (self._density, self._stiffness))
        for handle in (self._mass, *factors, self._model):
            handle.visible = shown
        self.method.visible = shown and not is_underconstrained(self._robot)
        self._of_run.visible = not shown
        self._of_run.content = readout.html_block(f'<div class="quiet">{reason}</div>')
        self._forgetting.visible = shown and depends_on_history(self._tension())

    def explain(self, text: str) -> None:
        """Write the reason why a pose is not feasible, and a remedy; "" for no text."""
        self._explained.content, self._explained.visible = text, bool(text)

    def choose_by_hand(self, method: ByHand) -> None:
        """Choose tensions by hand, and add this choice to the list of methods."""
        self._by_hand = method
        if BY_HAND not in self.method.options:
            self.method.options = (*METHODS, BY_HAND)
        self.method.value = BY_HAND
        self._changed()

    def _build_what_if(self, robot: Robot) -> None:
        gui = self._gui
        with gui.add_folder("What if"):
            self._of_run = gui.add_html("", visible=False)
            lightest, heaviest, step = mass_range(robot.mass)
            self._own_mass = robot.mass
            mass = written_mass(robot.mass)
            hint = "Mass of the platform with its load; the inertia scales with it."
            self._mass: Any = gui.add_slider("Platform + load [kg]", lightest, heaviest, step, mass, hint=hint)
            self._density = self._add_factor("Cable density ×", 0.1, 10.0, "Factor on the cables' mass per length.")
            self._stiffness = self._add_factor("Cable stiffness ×", 0.1, 10.0, "Factor on the cables' EA.")
            hint = "With an approximate model, the orange platform shows the pose of equilibrium."
            models = [name for name, model in MODELS.items() if has_pulley_model(robot, model)]
            self._model = gui.add_dropdown("Cable model", models, hint=hint)
            self.method: Any = gui.add_dropdown("Tensions", tuple(METHODS), hint="Tension distribution method.")
            hint = "The tensions depend on earlier poses; start again from this pose."
            self._forgetting = gui.add_button("Reset history", icon=viser.Icon.ERASER, visible=False, hint=hint)
            self._forgetting.on_click(lambda _: self._forget())
        self._watch(self._mass, self._model, self.method)

    def _add_factor(self, label: str, low: float, high: float, hint: str, least: float | None = None) -> Any:
        """Add a factor, initially 1, with a logarithmic slider; its left end is `least` (possibly 0), not `low`."""
        # the slider is HTML that browser/factors.js connects with the hidden number: sliders of viser are linear
        least = low if least is None else least
        self._sliders[label] = self._gui.add_html(readout.factor_slider(label, low, high, least, hint))
        number = self._gui.add_number(label, 1.0, min=least, max=high, step=0.1, visible=False)
        self._watch(number)
        return number

    def _watch(self, *handles: Any) -> None:
        """Connect the controls: each change of a control calls `changed`."""
        for handle in handles:
            handle.on_update(lambda _: self._changed())

    def _build_drawing(self) -> None:
        gui = self._gui
        with gui.add_folder("Drawing"):
            hint = "Range of the colors: the tension limits, or the tensions of the pose, so that they differ."
            self._colors = gui.add_dropdown("Colors by", (BY_LIMITS, BY_POSE), hint=hint)
            hint = "Factor on the drawn sag; 0, at the left end, draws straight cables."
            self._sag_scale = self._add_factor("Sag drawn ×", 0.05, 20.0, hint, 0.0)
            self._sag_hint = gui.add_html("", visible=False)
            hint = "Factor on the drawn position error of the orange platform."
            self._error_scale = self._add_factor("Error drawn ×", 1.0, 200.0, hint)
            hint = "Drawn if the sag of a cable is visible."
            self.ghost: Any = gui.add_checkbox("Straight cables beside", False, hint=hint)
        self._watch(self._colors, self.ghost)


def _slid(slider: Any) -> float:
    value, low, high = float(slider.value), float(slider.min), float(slider.max)
    if not low <= value <= high:
        raise InvalidValueError(slider.label, value, f"{low:g} to {high:g}", "Move the slider.")
    return value


def written_mass(mass: float) -> float:
    """A mass [kg] rounded to the digits of its field; a calibrated mass has more digits."""
    return float(f"{mass:.5g}")


def mass_range(mass: float) -> tuple[float, float, float]:
    """Lowest and highest mass of the slider and its step [kg], all round numbers."""
    step = 10.0 ** (floor(log10(mass)) - 2)
    rounding = 10.0 * step
    return max(round(_LIGHTEST * mass / step) * step, step), ceil(_HEAVIEST * mass / rounding) * rounding, step
