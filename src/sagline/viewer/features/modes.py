"""Modes with cable mass: list, frequency response, and animation of a mode."""

from __future__ import annotations

import time
from collections.abc import Callable, Hashable
from html import escape
from math import ceil, floor, log10
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.dynamics.vibration.dynamic_stiffness import Damping
from sagline.dynamics.vibration.response import MOTIONS, ResponseCurves
from sagline.dynamics.vibration.vibration import (
    MASSLESS,
    ListedMode,
    Vibration,
    VibrationStatus,
    listed_modes,
    vibration,
)
from sagline.robot.equilibrium import Equilibrium
from sagline.viewer.feature import BackgroundTask, Feature, View
from sagline.viewer.page import Page
from sagline.viewer.readout import chosen_by, html_block, refused, sentence
from sagline.viewer.server import toggle, typed
from sagline.viewer.swing import PERIOD, Swing, mode_of
from sagline.viewer.tension_scale import number_text

Place = Callable[[Array], Array]

WIDTH, HEIGHT = 340, 210  # size of the figure [px]
LEFT, RIGHT, TOP, BOTTOM = 36, 10, 28, 36  # margins around the axes [px]
HIGHEST_RESPONSE, LOWEST_RESPONSE = 2e2, 1e-3  # limits for undamped peaks and zeros, relative to the static response
MARK = 12  # radius of a mode's mark [px]


def _response_figure(curves: ResponseCurves, modes: list[ListedMode], words: str, chosen: str) -> str:
    """HTML: both curves on logarithmic axes, and a clickable mark for every mode with cable mass."""
    low = max(min(curves.with_mass.min(), curves.massless.min()), LOWEST_RESPONSE * curves.static)
    high = min(max(curves.with_mass.max(), curves.massless.max()), HIGHEST_RESPONSE * curves.static)
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
    return html_block(
        f'<svg class="response" viewBox="0 0 {WIDTH} {HEIGHT}" role="img">{axes}{lines}{marks}</svg>{key}'
    )


def _points(x: Array, y: Array) -> str:
    """Points of a polyline, at most one per half pixel."""
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


UP_TO = 20.0  # initial highest frequency [Hz]
HIGHEST = 200.0  # largest value of the highest frequency [Hz]
ROWS: Final = 200  # longest list; each row has a button, and the keyboard reaches what follows only after all buttons
FIELD = "Mode"
TOPIC: Final = "mode"  # topic of the messages with the name of a clicked mode


def range_of_modes(vibration: Vibration) -> str:
    """First and last mode of each kind in the list, "1 to 4 and massless 1 to 6"; "none" if the list is empty."""
    counts = vibration.frequency.size, int(np.isfinite(vibration.massless_frequency).sum())
    there = [f"{word}1 to {count}" for word, count in zip(("", "massless "), counts, strict=True) if count]
    return " and ".join(there) or "none"


def _swing_text(vibration: Vibration, swing: Swing | None, chosen: str) -> str:
    if swing is not None:
        mode = swing.mode
        return html_block(f"<b>{mode.frequency:.3f} Hz, {mode.kind}</b>: {swing.text}")
    if chosen:
        return sentence(f"There is no mode {escape(chosen)}: the list has {range_of_modes(vibration)}.")
    return sentence("Click a frequency to see its mode move.")


def _list_text(vibration: Vibration, modes: list[ListedMode], chosen: str) -> str:
    head = "<tr><th>mode</th><th>Hz</th><th></th><th>platform</th><th>location</th><th>damping</th></tr>"
    ordered = sorted(modes, key=lambda mode: mode.frequency)
    shown = [mode for k, mode in enumerate(ordered) if k < ROWS or mode.name == chosen]
    rows = "".join(_row(mode, chosen) for mode in shown)
    table = html_block(f'<div class="modes"><table>{head}{rows}</table></div>')
    if vibration.status is not VibrationStatus.SOLVED:
        return html_block(escape(vibration.status.text)) + table
    count = "complete" if vibration.complete else "not complete"
    ratio = 100.0 * vibration.damping.modal_damping
    text = f"{vibration.frequency.size} modes with cable mass below {vibration.up_to:g} Hz: {count}."
    if len(shown) < len(modes):
        text += f" The list has the lowest {ROWS} modes; enter another name in the field above."
    return html_block(f'{text} <span class="quiet">A damping of {ratio:g} % is assumed.</span>') + table


def _row(mode: ListedMode, chosen: str) -> str:
    looks = " ".join(["chosen"] * (mode.name == chosen) + ["light"] * (mode.kind == MASSLESS))
    return (
        f'<tr {chosen_by(TOPIC, mode.name)} class="{looks}"><td>'
        f"<button {chosen_by(TOPIC, mode.name)}>{mode.number}</button></td>"
        f"<td>{mode.frequency:.3f}</td><td>{mode.kind}</td><td>{100.0 * mode.platform_share:.0f} %</td>"
        f"<td>{mode.swings}</td><td>{number_text(100.0 * mode.loss, '.2g')} %</td></tr>"
    )


RESTED: Final = 0.25  # delay of the computation after a change [s]
DAMPING: Final = Damping(modal_damping=0.01)


class ModesFeature(Feature):
    """A tab with the list of modes and a frequency response; the scene animates the chosen mode."""

    def __init__(self, page: Page) -> None:
        """Build the tab."""
        self._scene = page.scene
        self._task: BackgroundTask = BackgroundTask(page.later)
        self._key: Hashable = None
        self._state: Equilibrium | None = None
        self._due: float | None = None  # time at which the computation of modes starts [s]
        self._vibration: Vibration | None = None
        self._curves: dict[str, ResponseCurves] = {}  # responses of the vibration, by force
        self._listed: tuple[object, ...] = ()  # key of the list and the figure
        self.swing: Swing | None = None
        gui = page.server.gui
        with page.panel.readings.add_tab("Modes"):
            hint = "Name of the mode that moves, from the list, such as 2 or massless 1; empty for none."
            self._mode: Any = gui.add_text(FIELD, page.mode, hint=hint)
            self._text = gui.add_html("")
            self._up_to: Any = gui.add_slider("Modes up to [Hz]", 1.0, HIGHEST, 1.0, UP_TO)
            self._list = gui.add_html("")
            self._force: Any = gui.add_dropdown("Force", MOTIONS, hint="Along an axis, or a moment about one.")
            self._figure = gui.add_html("")
        page.refresh_on(self._mode, self._up_to, self._force)
        page.channel.on(TOPIC, lambda name, _: toggle(self._mode, name))

    @property
    def moving(self) -> bool:
        """True if a mode is animated."""
        return self.swing is not None

    @property
    def waiting(self) -> bool:
        """True while modes or a response are being computed."""
        return self._due is not None or self._task.busy

    def follow(self, view: View) -> None:
        """Start the computation of the shown equilibrium's modes, or show the chosen mode."""
        state, key = self._at_rest(view)
        key = (key, self._highest)
        if state is None or key != self._key:
            self._stop_swing()
            self._key, self._state, self._vibration = key, state, None
            self._due = None if state is None else time.monotonic() + RESTED
            self._text.content = sentence("The modes are computed when the platform is at rest.")
        elif self._vibration is not None:
            self._choose(self._vibration)

    def tick(self) -> None:
        """Start a due calculation, write its elapsed time, and draw the next picture of the animated mode."""
        now = time.monotonic()
        if self._due is not None and now >= self._due and self._state is not None:
            self._due = None
            state, up_to = self._state, self._highest
            self._task.start(lambda: vibration(state, up_to=up_to, damping=DAMPING), self._receive, self._refuse)
        if self._task.elapsed:
            self._text.content = sentence(f"Computing the modes: {self._task.elapsed:.0f} s so far")
        if self.swing is not None:
            phase = 2.0 * np.pi * now / PERIOD
            self._scene.swing(self.swing.state.pose, self.swing.pose(phase), self.swing.courses(phase))

    @property
    def _highest(self) -> float:
        """Highest frequency of the list [Hz]."""
        value = float(self._up_to.value)
        return value if 1.0 <= value <= HIGHEST else UP_TO  # also excludes NaN

    @property
    def _axis(self) -> str:
        """Axis of the force of the response, one of `MOTIONS`."""
        return self._force.value if self._force.value in MOTIONS else MOTIONS[0]

    def _refuse(self, message: str) -> None:
        self._vibration, self._listed = None, ()
        self._text.content = self._figure.content = ""
        self._list.content = refused(message)

    def _at_rest(self, view: View) -> tuple[Equilibrium | None, Hashable]:
        """The equilibrium of the modes, and a key of it."""
        state, pose, settings = view.state, view.snapshot.pose, view.settings
        if view.playing or state is None:
            return None, None
        place = pose.position.tobytes() + pose.quaternion.tobytes()
        return state, (place, settings.changes, settings.model, settings.tension, id(view.played))

    def _receive(self, vibration: Vibration) -> None:
        if vibration.state is self._state:
            self._vibration, self._curves = vibration, {}
            self._choose(vibration)

    def _response(self, vibration: Vibration) -> ResponseCurves | None:
        """The response to the chosen force; None while it is being computed."""
        force = self._axis
        if _has_modes(vibration) and force not in self._curves and not self._task.busy:

            def receive(curves: ResponseCurves) -> None:
                if vibration is self._vibration:
                    self._curves[force] = curves
                    self._choose(vibration)

            self._task.start(lambda: ResponseCurves.of_vibration(vibration, force), receive, self._refuse)
        return self._curves.get(force)

    def _choose(self, vibration: Vibration) -> None:
        """Animate the chosen mode, and write list and response."""
        chosen = typed(self._mode)
        mode = mode_of(vibration, chosen)
        if mode is None:
            self._stop_swing()
        elif self.swing is None or self.swing.mode != mode or self.swing.state is not vibration.state:
            self.swing = Swing.of(vibration, mode)
        curves = self._response(vibration)
        name = "" if self.swing is None else self.swing.mode.name
        self._text.content = _swing_text(vibration, self.swing, chosen)
        if self._listed != (vibration, curves, name):
            self._listed = (vibration, curves, name)
            modes = listed_modes(vibration)
            self._list.content = _list_text(vibration, modes, name)
            self._figure.content = self._figure_text(vibration, curves, modes, name)

    def _figure_text(
        self, vibration: Vibration, curves: ResponseCurves | None, modes: list[ListedMode], name: str
    ) -> str:
        if not _has_modes(vibration):
            return sentence("No response: there are no modes.")
        if curves is None:
            return sentence("The response is being computed.")
        axis = self._axis
        motion, unit = ("rotation", "N m") if axis.startswith("about") else ("motion along", "N")
        with_mass = [mode for mode in modes if mode.kind != MASSLESS]
        return _response_figure(curves, with_mass, f"{motion} {axis} for 1 {unit} [{curves.unit}]", name)

    def _stop_swing(self) -> None:
        if self.swing is not None:
            self._scene.swing(self.swing.state.pose, self.swing.state.pose, self.swing.rest)
            self.swing = None


def _has_modes(vibration: Vibration) -> bool:
    return vibration.status is VibrationStatus.SOLVED and vibration.frequency.size > 0
