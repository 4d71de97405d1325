"""A cable that is cut: what follows is simulated beside the page, and played as it comes; calm puts all back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, NamedTuple

import viser

from sagline.dynamics.simulation import Simulation
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.viewer import cut_words, dynamics
from sagline.viewer.aside import Aside
from sagline.viewer.channel import Channel
from sagline.viewer.cut_panel import CutPanel
from sagline.viewer.cut_stage import CutStage
from sagline.viewer.eye import Eye, chosen_line, place_of
from sagline.viewer.playback import Playback
from sagline.viewer.player import Kept, Player
from sagline.viewer.reading import Reading
from sagline.viewer.readout import sentence
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.view import View

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


class CutShow:
    """Cuts what is shown; all of it belongs to the thread that serves."""

    moving = False

    def __init__(
        self,
        server: viser.ViserServer,
        channel: Channel,
        panel: CutPanel,
        player: Player,
        soon: Callable[[Callable[[], None]], None],
        go: Callable[[Pose], None],
        ready: Callable[[Reading], bool],
    ) -> None:
        """Begin with nothing.

        Args:
            server: Where its mark is.
            channel: Brings clicks on the scene.
            panel: Which cable; its buttons are to call `choose`, `cut` and `calm`.
            player: What plays what follows.
            soon: Takes what the serving thread is to do, from any thread.
            go: Puts the platform somewhere.
            ready: Whether a reading can be had without waiting.
        """
        self._server, self._player, self._soon, self._go, self._ready = server, player, soon, go, ready
        self._panel = panel
        self._stage = CutStage(server, lambda: soon(self.cut))
        self._aside = Aside(soon)
        self._view: View | None = None
        self._chosen = False  # whether a cable is marked
        self._asked = self._playing = 0  # numbers of the cut that was asked for last, and of that which is played
        self._number = 0  # of what is played of it, by the player
        self._before: list[Before] = []  # a cut, and one that followed it, and so on
        channel.on(TOPIC, self._pick)

    @property
    def waiting(self) -> bool:
        """Whether something is simulated."""
        return self._aside.busy

    def follow(self, view: View) -> None:
        """This is what would be cut."""
        self._view = view
        state = self._state()
        if self._chosen and state is not None:
            course = view.snapshot.courses(view.settings.sag_scale)[self._panel.cable]
            self._stage.show(course, cut_words.chosen(state, self._panel.cable), self._panel.cable)
        else:
            self._stage.hide()

    def tick(self) -> None:
        """Say how long it takes until there is something to see."""
        if self._aside.waited and self._player.played is None:
            self._panel.say(sentence(f"Simulating: {self._aside.waited:.0f} s so far"))

    def cut(self) -> None:
        """Simulate what comes when a cable of the robot that is shown breaks, and play it as it comes."""
        state, panel, view = self._state(), self._panel, self._view
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
            for simulation in dynamics.cut(state, cable, cable_mass):
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
        whole = float(simulation.time[-1] - simulation.time[0]) >= dynamics.LASTS - simulation.step
        self._panel.say(cut_words.told(simulation, cable, whole=whole))

    def _state(self) -> Equilibrium | None:
        """The rest that is shown, if one is."""
        snapshot = None if self._view is None else self._view.snapshot
        if not isinstance(snapshot, Snapshot) or snapshot.plan is None or not snapshot.feasible:
            return None
        return snapshot.plan.state

    def choose(self) -> None:
        """A cable is chosen in the panel: mark it."""
        self._chosen = True

    def _pick(self, value: Any, client: int) -> None:
        """A page tells where its scene is clicked: whatever a client has sent."""
        at, found = place_of(value), self._server.get_clients().get(client)
        eye = None if found is None else Eye.of(found.camera)
        if at is None or eye is None or self._view is None or self._state() is None:
            return
        courses = self._view.snapshot.courses(self._view.settings.sag_scale)
        cable = chosen_line(eye, at, courses, NEAR)
        self._chosen = cable is not None
        if cable is not None:
            self._panel.mark(cable)
