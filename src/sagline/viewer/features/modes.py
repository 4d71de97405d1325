"""Modes with cable mass: the list, the frequency response, and the mode that moves."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from html import escape
from math import ceil, floor, log10
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.dynamics.vibration.mode_list import MASSLESS, ListedMode, listed_modes
from sagline.dynamics.vibration.response import MOTIONS, ResponseCurves, response_curves
from sagline.dynamics.vibration.vibration import Vibration, VibrationStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.channel import Channel, chosen_by
from sagline.viewer.drawn import Drawn
from sagline.viewer.feature import Aside, Feature, Reading, View
from sagline.viewer.page import Page
from sagline.viewer.readout import block, refused, sentence, waiting
from sagline.viewer.swing import PERIOD, Swing, mode_of, vibrating
from sagline.viewer.wording import number

Place = Callable[[Array], Array]

WIDTH, HEIGHT = 340, 210  # px
LEFT, RIGHT, TOP, BOTTOM = 36, 10, 28, 36  # px around the axes
TOP_OF_AXIS, LOWEST = 2e2, 1e-3  # over the answer at rest: undamped peaks have no top, and zeros no bottom
MARK = 12  # px, of a mode's mark


def response_figure(curves: ResponseCurves, modes: list[ListedMode], words: str, chosen: str) -> str:
    """HTML: both curves on logarithmic axes, a mark for every mode with cable mass, which can be clicked."""
    low = max(min(curves.with_mass.min(), curves.massless.min()), LOWEST * curves.static)
    high = min(max(curves.with_mass.max(), curves.massless.max()), TOP_OF_AXIS * curves.static)
    decades = 10.0 ** floor(log10(low)), 10.0 ** ceil(log10(high))
    first, last = float(curves.frequency[0]), float(curves.frequency[-1])

    def across(frequency: Array) -> Array:
        return np.asarray(LEFT + (WIDTH - LEFT - RIGHT) * np.log(frequency / first) / np.log(last / first))

    def up(value: Array) -> Array:
        share = np.log(np.clip(value, *decades) / decades[0]) / np.log(decades[1] / decades[0])
        return np.asarray(HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share)

    lines = "".join(
        f'<polyline class="{name}" points="{_points(across(curves.frequency), up(values))}"/>'
        for name, values in (("massless", curves.massless), ("massive", curves.with_mass))
    )
    foot = HEIGHT - BOTTOM
    marks = "".join(
        f'<g class="mark{" chosen" if mode.name == chosen else ""}" {chosen_by("mode", mode.name)}>'
        f'<rect x="{x - 3.0:.1f}" y="{foot - MARK}" width="6" height="{MARK + 2}"/>'
        f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{foot}" y2="{foot - 2 - (MARK - 2) * mode.platform_share:.1f}"/></g>'
        for mode, x in zip(modes, across(np.array([each.frequency for each in modes])), strict=True)
    )
    axes = _axes(words, across, up, decades, first, last)
    key = (
        '<span class="key"><span class="stroke massive"></span> with cable mass</span>'
        '<span class="key"><span class="stroke massless"></span> massless</span>'
    )
    return block(f'<svg class="response" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">{axes}{lines}{marks}</svg>{key}')


def _points(x: Array, y: Array) -> str:
    """Points of a line, those that a screen shows as one left out."""
    cells = np.round(np.stack((2.0 * x, 2.0 * y)))
    kept = np.concatenate(([True], np.any(np.diff(cells, axis=1) != 0.0, axis=0)))
    return " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x[kept], y[kept], strict=True))


def _axes(words: str, across: Place, up: Place, decades: tuple[float, float], first: float, last: float) -> str:
    marks = [f'<text x="4" y="12" font-weight="600">{words}</text>']
    for power in range(round(log10(decades[0])), round(log10(decades[1])) + 1):
        y = float(up(np.array(10.0**power)))
        marks.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        marks.append(
            f'<text class="quiet" x="{LEFT - 4}" y="{y + 3.5:.1f}" text-anchor="end">10'
            f'<tspan dy="-4" font-size="8">{str(power).replace("-", "−")}</tspan></text>'
        )
    ticks = [k * 10.0**p for p in range(floor(log10(first)), ceil(log10(last)) + 1) for k in (1, 2, 5)]
    ticks = [tick for tick in ticks if first <= tick <= last * (1.0 + 1e-9)]
    for tick in ticks:
        x = float(across(np.array(tick)))
        marks.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
        marks.append(f'<text class="quiet" x="{x:.1f}" y="{HEIGHT - BOTTOM + 13}" text-anchor="middle">{tick:g}</text>')
    middle = 0.5 * (LEFT + WIDTH - RIGHT)
    marks.append(f'<text class="quiet" x="{middle}" y="{HEIGHT - 8}" text-anchor="middle">frequency [Hz]</text>')
    return "".join(marks)


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


Vibrate = Callable[[Equilibrium, float], Vibration]

RESTED = 0.25  # s without a change: what is dragged is not worked out on its way


class ModesFeature(Feature):
    """Follows what is shown; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Build the tab."""
        self._panel = ModesPanel(page.server.gui, page.panel.readings, page.refresh, page.channel, page.mode)
        self._stage, self._aside, self._ready = page.stage, Aside(page.later), page.ready
        self._key: Hashable = None
        self._state: Equilibrium | None = None
        self._due: float | None = None
        self._vibration: Vibration | None = None
        self._answers: dict[str, ResponseCurves] = {}  # of the vibration, by force
        self.swing: Swing | None = None

    @property
    def moving(self) -> bool:
        """Whether a mode moves."""
        return self.swing is not None

    @property
    def waiting(self) -> bool:
        """Whether something is to come without anybody's doing."""
        return self._due is not None or self._aside.busy

    def follow(self, view: View) -> None:
        """Something is shown; what hangs at rest can vibrate."""
        state, key = self._at_rest(view)
        key = (key, self._panel.up_to)
        if state is None or key != self._key:
            self._still()
            self._key, self._state, self._vibration = key, state, None
            self._due = None if state is None else time.monotonic() + RESTED
            self._panel.forget()
        elif self._vibration is not None:
            self._choose(self._vibration)

    def tick(self) -> None:
        """Draw the next picture, if something moves; see whether something is due."""
        now = time.monotonic()
        if self._due is not None and now >= self._due and self._state is not None:
            self._due = None
            state, up_to = self._state, self._panel.up_to
            self._aside.ask(lambda: vibrating(state, up_to), self._found, self._panel.refuse)
        if self._aside.waited:
            self._panel.wait(self._aside.waited)
        if self.swing is not None:
            phase = 2.0 * np.pi * now / PERIOD
            self._stage.swing(self.swing.state.pose, self.swing.pose(phase), self.swing.courses(phase))

    def _at_rest(self, view: View) -> tuple[Equilibrium | None, Hashable]:
        """The state whose modes are asked for, if there is one, and what tells it from others."""
        snapshot, settings = view.snapshot, view.settings
        if isinstance(snapshot, Drawn) or snapshot.plan is None or not snapshot.feasible:
            return None, None
        if view.playing or not self._ready(Reading.MODES):
            return None, None
        place = snapshot.pose.position.tobytes() + snapshot.pose.quaternion.tobytes()
        return snapshot.plan.state, (
            place,
            settings.mass,
            settings.density,
            settings.stiffness,
            settings.model,
            settings.tension,
            id(view.played),
        )

    def _found(self, vibration: Vibration) -> None:
        if vibration.state is self._state:
            self._vibration, self._answers = vibration, {}
            self._choose(vibration)

    def _answer(self, vibration: Vibration) -> ResponseCurves | None:
        """The response to the force that is chosen, if it is known; else it is worked out."""
        force = self._panel.force
        some = vibration.status is VibrationStatus.SOLVED and vibration.frequency.size > 0
        if some and force not in self._answers and not self._aside.busy:

            def answered(curves: ResponseCurves) -> None:
                if vibration is self._vibration:
                    self._answers[force] = curves
                    self._choose(vibration)

            self._aside.ask(lambda: response_curves(vibration, force), answered, self._panel.refuse)
        return self._answers.get(force)

    def _choose(self, vibration: Vibration) -> None:
        mode = mode_of(vibration, self._panel.chosen)
        if mode is None:
            self._still()
        elif self.swing is None or self.swing.mode != mode or self.swing.state is not vibration.state:
            self.swing = Swing.of(vibration, mode)
        self._panel.show(vibration, self.swing, self._answer(vibration))

    def _still(self) -> None:
        if self.swing is not None:
            self._stage.swing(self.swing.state.pose, self.swing.state.pose, self.swing.rest)
            self.swing = None
