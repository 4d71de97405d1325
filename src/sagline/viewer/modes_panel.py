"""The panel of the modes: a list in which one is chosen to move, and what a force does over frequency."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any, Final

import numpy as np
import viser

from sagline.dynamics.mode_list import MASSLESS, ListedMode, listed_modes
from sagline.dynamics.response_curves import MOTIONS, ResponseCurves
from sagline.dynamics.vibration import Vibration
from sagline.dynamics.vibration_status import VibrationStatus
from sagline.viewer.channel import Channel, chosen_by
from sagline.viewer.readout import block, refused, sentence, waiting
from sagline.viewer.response_figure import response_figure
from sagline.viewer.swing import Swing
from sagline.viewer.wording import number

UP_TO = 20.0  # Hz, at first
HIGHEST = 200.0  # Hz
FIELD = "Mode"
TOPIC: Final = "mode"  # that a page tells the name of a mode under that is clicked


class ModesPanel:
    """A tab: which mode moves, up to which frequency, the list and the response."""

    def __init__(
        self, gui: viser.GuiApi, readings: Any, changed: Callable[[], None], channel: Channel, mode: str = ""
    ) -> None:
        """Build the tab; `changed` is called, from any thread, when something is chosen."""
        self._vibration: Vibration | None = None
        self._shown: tuple[object, ...] = ()
        with readings.add_tab("Modes"):
            self._mode: Any = gui.add_text(
                FIELD, mode, hint="Number of the mode that moves, from the list; massless 1 and so on; empty: none."
            )
            self._told = gui.add_html("")
            self._up_to: Any = gui.add_slider("Modes up to [Hz]", 1.0, HIGHEST, 1.0, UP_TO)
            self._list = gui.add_html(waiting("The modes are worked out when the platform rests."))
            self._force: Any = gui.add_dropdown("Force", MOTIONS, hint="Along an axis, or a moment about one.")
            self._response = gui.add_html("")
        for handle in (self._mode, self._up_to, self._force):
            handle.on_update(lambda _: changed())
        channel.on(TOPIC, lambda name, _: self._toggle(name))

    @property
    def chosen(self) -> str:
        """Name of the mode that is to move; "" for none."""
        return " ".join(str(self._mode.value).split())[:40]

    @property
    def up_to(self) -> float:
        """Highest frequency of the list [Hz]."""
        value = float(self._up_to.value)
        return value if 1.0 <= value <= HIGHEST else UP_TO  # NaN neither

    @property
    def force(self) -> str:
        """Whose response is drawn: one of `MOTIONS`."""
        return self._force.value if self._force.value in MOTIONS else MOTIONS[0]

    def _toggle(self, name: Any) -> None:
        """A page tells a mode: it moves, or no more if it did."""
        self._mode.value = "" if str(name) == self.chosen else str(name)

    def wait(self, seconds: float) -> None:
        """Say for how long the modes have been worked out."""
        self._told.content = sentence(f"Working out the modes: {seconds:.0f} s so far")

    def refuse(self, message: str) -> None:
        """Say why there are no modes."""
        self._vibration, self._shown = None, ()
        self._told.content = self._response.content = ""
        self._list.content = refused(message)

    def forget(self) -> None:
        """Say that the modes are those of a rest that is to come."""
        self._told.content = sentence("The modes come when the platform rests.")

    def show(self, vibration: Vibration, swing: Swing | None, curves: ResponseCurves | None) -> None:
        """Show the list, what moves, and the response to the force, None as long as it is worked out."""
        name = "" if swing is None else swing.mode.name
        self._told.content = _told(vibration, swing, self.chosen)
        if self._shown == (vibration, curves, name):
            return
        self._shown = (vibration, curves, name)
        modes = listed_modes(vibration)
        self._list.content = _listed(vibration, modes, name)
        if vibration.status is not VibrationStatus.SOLVED or not vibration.frequency.size:
            self._response.content = sentence("No response: there are no modes.")
            return
        if curves is None:
            self._response.content = waiting("The response is worked out.")
            return
        force = self.force
        words = f"{'rotation' if force.startswith('about') else 'motion along'} {force} for 1 {_unit(force)}"
        swinging = [mode for mode in modes if mode.kind != MASSLESS]
        self._response.content = response_figure(curves, swinging, f"{words} [{curves.unit}]", name)


def _unit(force: str) -> str:
    return "N m" if force.startswith("about") else "N"


def _told(vibration: Vibration, swing: Swing | None, chosen: str) -> str:
    if swing is not None:
        mode = swing.mode
        return block(f"<b>{mode.frequency:.3f} Hz, {mode.kind}</b>: {swing.told}")
    if chosen:
        counts = vibration.frequency.size, int(np.isfinite(vibration.massless_frequency).sum())
        there = [f"{word}1 to {count}" for word, count in zip(("", "massless "), counts, strict=True) if count]
        return sentence(f"There is no mode {escape(chosen)}: the list has {' and '.join(there) or 'none'}.")
    return sentence("Click a frequency, and it moves.")


def _listed(vibration: Vibration, modes: list[ListedMode], chosen: str) -> str:
    head = "<tr><th>mode</th><th>Hz</th><th></th><th>platform</th><th>most in</th><th>damping</th></tr>"
    rows = "".join(_row(mode, chosen) for mode in sorted(modes, key=lambda mode: mode.frequency))
    table = block(f'<div class="modes"><table>{head}{rows}</table></div>')
    if vibration.status is not VibrationStatus.SOLVED:
        return block(escape(vibration.status.text)) + table
    count = "all of them" if vibration.complete else "not complete"
    ratio = 100.0 * vibration.damping.modal_damping
    text = f"{vibration.frequency.size} modes with cable mass below {vibration.up_to:g} Hz: {count}."
    return block(f'{text} <span class="quiet">A damping of {ratio:g} % is assumed.</span>') + table


def _row(mode: ListedMode, chosen: str) -> str:
    looks = " ".join(["chosen"] * (mode.name == chosen) + ["light"] * (mode.kind == MASSLESS))
    return (
        f'<tr {chosen_by(TOPIC, mode.name)} class="{looks}"><td>'
        f"<button {chosen_by(TOPIC, mode.name)}>{mode.number}</button></td>"
        f"<td>{mode.frequency:.3f}</td><td>{mode.kind}</td><td>{100.0 * mode.platform_share:.0f} %</td>"
        f"<td>{mode.swings}</td><td>{number(100.0 * mode.loss, '.2g')} %</td></tr>"
    )
