"""Cut: the simulation of a robot after one of its cables is cut."""

from __future__ import annotations

from collections.abc import Hashable, Iterator
from typing import Any, Final, TypeAlias

import numpy as np
import viser

from sagline.core.numbers import n
from sagline.dynamics.simulation.initial_conditions import initial_conditions
from sagline.dynamics.simulation.results import Break, Simulation
from sagline.dynamics.simulation.simulate import losses_after_break, started_run
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.viewer import shapes
from sagline.viewer.camera import OUTSIDE, Camera
from sagline.viewer.feature import BackgroundTask, Feature, View
from sagline.viewer.features.state import FIRST
from sagline.viewer.page import Page
from sagline.viewer.playback import PlayedSimulation
from sagline.viewer.player import PlayerState
from sagline.viewer.readout import definitions, refused, sentence, verdict_box
from sagline.viewer.robot_scene import MARK, Nodes
from sagline.viewer.server import finite_numbers
from sagline.viewer.tension_scale import ForceUnit, cables_text

PARTS: Final = (0.03, 0.1, 0.3, 0.7, 1.5, 2.8, 4.2)  # ends of the parts [s]; the first part is short and shown soon
DURATION: Final = PARTS[-1]
ELEMENTS: Final = 10  # elements of a cable with mass; twice as many take four times as long
CABLE_MASS = {"massless": "none", "with cable mass": "lumped"}
TOP = -10.0  # order value, above all other controls
HELP: Final = sentence("Click a cable in the scene, or choose one.")
_WIDTH: Final = 7.0  # width of the mark [px]
_PLACE: Final = 0.4  # position of the name along the cable, from the frame end
TOPIC: Final = "pick"  # topics of the messages of browser/hand.js
Before: TypeAlias = tuple[Pose, PlayerState]
NEAR: Final = 14.0  # largest distance of a click, or of a finger, from a cable [px]


def simulate_cut(state: Equilibrium, cable: int, cable_mass: str) -> Iterator[Simulation]:
    """Simulation of the break of `cable`; the other lengths are constant. Each part continues the previous part."""
    given = initial_conditions(state, None, None, DURATION)
    elements = ELEMENTS if cable_mass == "lumped" else 0
    losses = losses_after_break(given, elements)
    run = started_run(given, elements, events=(Break(cable=cable, time=0.0),), damping=losses)
    for part in PARTS:
        yield run.until(part)


def peak_of(simulation: Simulation, cut: int) -> tuple[int, float, float]:
    """Highest tension of the other cables: its cable, its value at the frame end [N] and its time after the cut [s]."""
    highest = simulation.tensions.max(axis=0) if simulation.largest_tension is None else simulation.largest_tension
    cable = int(np.argmax(np.where(np.arange(len(highest)) == cut, -np.inf, highest)))
    time = float(simulation.time[np.argmax(simulation.tensions[:, cable])] - simulation.time[0])
    return cable, float(highest[cable]), time


def _outcome_text(simulation: Simulation, cut: int, *, whole: bool) -> str:
    """HTML: largest displacement of the platform and highest tension after a cut; `whole`: a complete simulation."""
    unit, (cable, tension, time) = ForceUnit.of(simulation.robot), peak_of(simulation, cut)
    limit = float(simulation.robot.tension_max[cable])  # infinite without a limit
    away = np.linalg.norm(simulation.pose.position - simulation.pose.position[0], axis=1)
    far = int(np.argmax(away))
    times = f", {tension / limit:.2f} times its limit" if np.isfinite(limit) else ""
    rows = [
        ("Largest displacement", f"{n(away[far], '.3g', 'm')} at {simulation.time[far] - simulation.time[0]:.2f} s"),
        ("Highest tension", f"{unit.written(tension)} in cable {cable} at {time:.2f} s{times}"),
    ]
    slack = sorted({event.cable for event in simulation.events if event.kind == "slack" and event.cable is not None})
    if slack:
        rows.append(("Slack", cables_text(slack)))
    rows.append(("Damping", f"loss time {n(simulation.damping.loss_time, '.2g', 's')} of the cables, assumed"))
    if not whole:
        rows.append(("Simulated", f"{simulation.time[-1] - simulation.time[0]:.2f} s so far"))
    return verdict_box("bad" if tension > limit else "quiet", f"Cable {cut} is cut", definitions(rows))


class CutFeature(Feature):
    """A folder to choose a cable and cut it, and buttons to cut the marked one and to undo a cut."""

    live = True

    def __init__(self, page: Page) -> None:
        """Build folder and buttons."""
        self._page, self._player, self._nodes = page, page.player, Nodes(page.server.scene)
        self._task: BackgroundTask = BackgroundTask(page.later)
        self._is_marked = False  # True if a cable is marked in the scene
        self._requested = self._playing = 0  # numbers of the last requested cut and of the played cut
        self._number = 0  # of the player, for the played cut
        self.before: tuple[Before, ...] = ()  # states of the page before each of the successive cuts
        gui = page.server.gui
        with gui.add_folder("Cut a cable", expand_by_default=False, order=FIRST + 0.03):
            self._cable: Any = gui.add_dropdown("Cable to cut", tuple(map(str, range(page.robot.cable_count))))
            hint = "Cables with mass vibrate and take longer to compute."
            self._mass = gui.add_dropdown("Cables in motion", tuple(CABLE_MASS), hint=hint)
            button = gui.add_button("Cut", icon=viser.Icon.SCISSORS)
            self._text = gui.add_html(HELP)
        hidden: dict[str, Any] = {"visible": False, "order": TOP}
        hint = "Restore the state before the cut."
        self._undo: Any = gui.add_button("Undo cut", icon=viser.Icon.ARROW_BACK_UP, hint=hint, **hidden)
        self._button: Any = gui.add_button("Cut", icon=viser.Icon.SCISSORS, **hidden)
        self._cable.on_update(lambda event: page.later(self._mark) if event.client is not None else None)
        self._undo.on_click(lambda _: page.later(self.undo))
        for each in (button, self._button):
            each.on_click(lambda _: page.later(self.cut))
        page.channel.on(TOPIC, self._pick)

    def depends(self, view: View) -> Hashable:
        """The view while a cable is marked."""
        return view if self._is_marked else None

    def follow(self, view: View) -> None:
        """Mark the chosen cable, and show its tension and a button to cut it."""
        state, nodes, cable = view.state, self._nodes, self._chosen
        self._button.visible = shown = self._is_marked and state is not None
        if not shown or state is None:
            nodes.hide("/chosen", "/chosen_name")
            return
        points = view.snapshot.courses(view.settings.sag_scale)[cable]
        tension = ForceUnit.of(state.one_robot).written(float(state.chord_tension[cable]))
        nodes.lines("/chosen", shapes.segments(points[None], dashed=False), MARK, _WIDTH)
        nodes.label("/chosen_name", f"cable {cable}: {tension}", points[int(_PLACE * (len(points) - 1))])
        self._button.label = f"Cut cable {cable}"

    def tick(self) -> None:
        """Write the elapsed time until the first part is played."""
        if self._task.elapsed and self._player.played is None:
            self._text.content = sentence(f"Simulating: {self._task.elapsed:.0f} s so far")

    def cut(self) -> None:
        """Simulate the break of the chosen cable from the equilibrium that is shown, and play its parts."""
        state, view = self._page.state, self._page.view
        if state is None or view is None:
            self._text.content = sentence("A cable can be cut at a feasible pose at rest. Drag the platform to one.")
            return
        cable, cable_mass = self._chosen, CABLE_MASS.get(self._mass.value, "none")
        self._requested += 1
        number, before = self._requested, (view.snapshot.pose, self._player.save())

        def simulate() -> None:
            for simulation in simulate_cut(state, cable, cable_mass):
                if self._requested != number:
                    return
                self._page.later(lambda part=simulation: self._play(number, part, cable, before))  # type: ignore[misc]

        self._text.content = sentence("Simulating …")
        self._task.start(simulate, lambda _: None, self._refuse)

    def undo(self) -> None:
        """Restore the page as it was before the last cut."""
        if not self.before:
            self.put(())
            return
        pose, state = self.before[-1]
        self.put(self.before[:-1])
        self._player.restore(state)
        if not state.following:
            self._page.go(pose)

    def put(self, before: tuple[Before, ...]) -> None:
        """Set the states before the cuts. The results of a simulation that is still running are ignored."""
        self._requested += 1
        self.before, self._undo.visible, self._text.content = before, bool(before), HELP

    @property
    def _chosen(self) -> int:
        return int(self._cable.value) if self._cable.value in self._cable.options else 0

    def _refuse(self, message: str) -> None:
        self._text.content = refused(message)

    def _play(self, number: int, simulation: Simulation, cable: int, before: Before) -> None:
        """Play a simulation from its start to the end of its newest part."""
        if number != self._requested:
            return
        if self._playing == number:
            if self._player.number != self._number:
                return  # another motion is played now
            self._player.grow(PlayedSimulation(simulation))
        else:
            self._playing, self._is_marked = number, False
            self.before += (before,)
            self._player.play(PlayedSimulation(simulation), at_once=True)
            self._number = self._player.number
            self._undo.visible = True
        whole = float(simulation.time[-1] - simulation.time[0]) >= DURATION - simulation.step
        self._text.content = _outcome_text(simulation, cable, whole=whole)

    def _mark(self) -> None:
        self._is_marked = True

    def _pick(self, value: Any, client: int) -> None:
        """Mark the cable at a point of the picture; `value` is unchecked data of a client."""
        at, view = finite_numbers(value, 2, OUTSIDE), self._page.view
        camera = Camera.of_client(self._page.server, client)
        if at is None or camera is None or view is None or self._page.state is None:
            return
        cable = camera.nearest_line(at, view.snapshot.courses(view.settings.sag_scale), NEAR)
        self._is_marked = cable is not None
        if cable is not None:
            self._cable.value = str(cable)
