"""Cut: the simulation of a robot after one of its cables is cut."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Final, NamedTuple

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.dynamics.simulation.results import Simulation
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer import lines, swing
from sagline.viewer.camera import Eye, chosen_line, place_of
from sagline.viewer.feature import Aside, Feature, Reading, View
from sagline.viewer.page import Page
from sagline.viewer.playback import Playback
from sagline.viewer.player import Kept
from sagline.viewer.readout import box, refused, sentence
from sagline.viewer.tension_scale import force_unit


class Peak(NamedTuple):
    """The highest tension after a cut.

    Attributes:
        cable: Whose.
        tension: How high, at the frame end [N].
        time: When, to a sample [s] after the cut.
        limit: Its highest allowed tension [N]; infinite where there is none.
    """

    cable: int
    tension: float
    time: float
    limit: float


def peak_of(simulation: Simulation, cut: int) -> Peak:
    """The highest tension of the cables that are left, at any step."""
    highest = simulation.tensions.max(axis=0) if simulation.largest_tension is None else simulation.largest_tension
    left = np.where(np.arange(len(highest)) == cut, -np.inf, highest)
    cable = int(np.argmax(left))
    when = float(simulation.time[np.argmax(simulation.tensions[:, cable])] - simulation.time[0])
    return Peak(cable, float(highest[cable]), when, float(simulation.robot.tension_max[cable]))


def before_text(state: Equilibrium, cable: int) -> str:
    """What stands at a cable that is chosen."""
    unit = force_unit(state.one_robot)
    return f"cable {cable}: {unit.written(float(state.chord_tension[cable]))}"


def outcome_text(simulation: Simulation, cut: int, *, whole: bool) -> str:
    """What follows, as HTML: how far the platform swings, and which tension peaks."""
    unit, peak = force_unit(simulation.robot), peak_of(simulation, cut)
    away = np.linalg.norm(simulation.pose.position - simulation.pose.position[0], axis=1)
    far = int(np.argmax(away))
    highest = f"{unit.written(peak.tension)} in cable {peak.cable} at {peak.time:.2f} s"
    rows = [("Farthest", f"{n(away[far], '.3g', 'm')} away at {simulation.time[far] - simulation.time[0]:.2f} s")]
    over = False
    if np.isfinite(peak.limit):
        over = peak.tension > peak.limit
        highest += f", {peak.tension / peak.limit:.2f} times its limit"
    rows.append(("Highest tension", highest))
    slack = sorted({event.cable for event in simulation.events if event.kind == "slack" and event.cable is not None})
    if slack:
        rows.append(("Slack", f"cable{'s' * (len(slack) > 1)} {', '.join(map(str, slack))}"))
    rows.append(("Losses", f"{n(simulation.damping.loss_time, '.2g', 's')} of the cables' stretch, assumed"))
    if not whole:
        rows.append(("So far", f"{simulation.time[-1] - simulation.time[0]:.2f} s; the rest is being simulated"))
    text = "".join(f"<dt>{name}</dt><dd>{what}</dd>" for name, what in rows)
    return box("bad" if over else "quiet", f"Cable {cut} is cut", f"<dl>{text}</dl>")


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


TOPIC: Final = "pick"  # that a page tells where the scene is clicked, by browser/hand.js
NEAR: Final = 14.0  # px: as far as a click may be from a cable, as a finger's may


class Before(NamedTuple):
    """How it was before a cut.

    Attributes:
        pose: Where the platform was.
        kept: What was played.
    """

    pose: Pose
    kept: Kept


class CutFeature(Feature):
    """Cuts what is shown; all of it belongs to the thread that serves."""

    def __init__(self, page: Page) -> None:
        """Build panel and mark."""
        server, soon = page.server, page.later
        self._page, self._server, self._player, self._soon = page, server, page.player, soon
        self._go, self._ready = page.go, page.ready
        self._panel = CutPanel(
            server.gui, page.robot, lambda: soon(self.choose), lambda: soon(self.cut), lambda: soon(self.calm)
        )
        self._stage = CutStage(server, lambda: soon(self.cut))
        self._aside = Aside(soon)
        self._chosen = False  # whether a cable is marked
        self._asked = self._playing = 0  # numbers of the cut that was asked for last, and of that which is played
        self._number = 0  # of what is played of it, by the player
        self._before: list[Before] = []  # a cut, and one that followed it, and so on
        page.channel.on(TOPIC, self._pick)

    @property
    def waiting(self) -> bool:
        """Whether something is simulated."""
        return self._aside.busy

    def depends(self, view: View) -> Hashable:
        """Nothing while no cable is marked."""
        return view if self._chosen else None

    def follow(self, view: View) -> None:
        """This is what would be cut."""
        state = self._page.state
        if self._chosen and state is not None:
            course = view.snapshot.courses(view.settings.sag_scale)[self._panel.cable]
            self._stage.show(course, before_text(state, self._panel.cable), self._panel.cable)
        else:
            self._stage.hide()

    def tick(self) -> None:
        """Say how long it takes until there is something to see."""
        if self._aside.waited and self._player.played is None:
            self._panel.say(sentence(f"Simulating: {self._aside.waited:.0f} s so far"))

    def cut(self) -> None:
        """Simulate what comes when a cable of the robot that is shown breaks, and play it as it comes."""
        state, panel, view = self._page.state, self._panel, self._page.view
        if state is None or view is None:
            panel.say(sentence("A cable is cut at rest, where the platform is held: drag it there first."))
            return
        if not self._ready(Reading.SIMULATION):
            panel.say(sentence("The simulation is still being compiled."))
            return
        cable, cable_mass = panel.cable, panel.cable_mass
        self._asked += 1
        mine, before = self._asked, Before(view.snapshot.pose, self._player.kept())

        def work() -> None:
            for simulation in swing.cut(state, cable, cable_mass):
                if self._asked != mine:
                    return
                self._soon(lambda part=simulation: self._play(mine, part, cable, before))  # type: ignore[misc]

        panel.say(sentence("Simulating …"))
        self._aside.ask(work, lambda _: None, panel.refuse)

    def calm(self) -> None:
        """Put everything back as it was before the last cut."""
        self._asked += 1  # what is still simulated is looked at no more
        if not self._before:
            return
        before = self._before.pop()
        self._player.put_back(before.kept)
        if not before.kept.following:
            self._go(before.pose)
        self._panel.offer_calm(offered=bool(self._before))
        self._panel.say("")

    def _play(self, asked: int, simulation: Simulation, cable: int, before: Before) -> None:
        """Play a part, which begins as those before."""
        if asked != self._asked:
            return
        if self._playing == asked:
            if self._player.number != self._number:
                return  # something else has been put on meanwhile
            self._player.grow(Playback(simulation))
        else:
            self._playing, self._chosen = asked, False
            self._before.append(before)
            self._player.play(Playback(simulation), at_once=True)
            self._number = self._player.number
            self._panel.offer_calm(offered=True)
        whole = float(simulation.time[-1] - simulation.time[0]) >= swing.LASTS - simulation.step
        self._panel.say(outcome_text(simulation, cable, whole=whole))

    def choose(self) -> None:
        """A cable is chosen in the panel: mark it."""
        self._chosen = True

    def _pick(self, value: Any, client: int) -> None:
        """A page tells where its scene is clicked: whatever a client has sent."""
        at, found = place_of(value), self._server.get_clients().get(client)
        eye = None if found is None else Eye.of(found.camera)
        if at is None or eye is None or self._page.view is None or self._page.state is None:
            return
        courses = self._page.view.snapshot.courses(self._page.view.settings.sag_scale)
        cable = chosen_line(eye, at, courses, NEAR)
        self._chosen = cable is not None
        if cable is not None:
            self._panel.mark(cable)
