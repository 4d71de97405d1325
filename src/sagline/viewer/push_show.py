"""A push: a force that somebody pulls at the platform, and what answers it while it is pulled."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.robot import Robot
from sagline.viewer import push_words, solids
from sagline.viewer.channel import Channel
from sagline.viewer.ellipsoids import readable
from sagline.viewer.eye import Eye, met, place_of
from sagline.viewer.push import Push, Pushed, pushed, radii
from sagline.viewer.push_panel import PushPanel
from sagline.viewer.push_stage import Drawing, PushStage
from sagline.viewer.reading import Reading
from sagline.viewer.readout import sentence
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.tension_scale import TensionScale
from sagline.viewer.view import View

TOPIC: Final = "pull"  # that a page tells where its mouse pulls, by browser/hand.js
FAR: Final = 0.25  # of the robot's size: what is pulled so far is pulled as hard as a middling tension pulls
NEAR: Final = 12.0  # px: a hand this near to the platform has it
LARGE: Final = 0.06  # of the robot's size: the longest half axis of the ellipsoid
LONGEST: Final = 0.6  # of the robot's size: of the arrow of a force that is typed


@dataclass(frozen=True, slots=True, eq=False)
class Hold:
    """What a hand holds.

    Attributes:
        client: Whose it is.
        at: Which place of the platform, in its frame [m], shape (3,).
    """

    client: int
    at: Array


class PushShow:
    """Follows a hand or its panel; all of it belongs to the thread that serves."""

    moving = waiting = False

    def __init__(
        self,
        server: viser.ViserServer,
        robot: Robot,
        channel: Channel,
        wake: Callable[[], None],
        soon: Callable[[Callable[[], None]], None],
        ready: Callable[[Reading], bool],
    ) -> None:
        """Begin with nothing.

        Args:
            server: Where its panel and its arrow are.
            robot: The robot.
            channel: Brings what a hand does.
            wake: Called, from any thread, when everything is to be shown anew.
            soon: Takes what the serving thread is to do, from any thread.
            ready: Whether a reading can be had without waiting.
        """
        self._server, self._ready = server, ready
        self._panel = PushPanel(server.gui, robot, wake, lambda: soon(self.let_go))
        self._stage = PushStage(server.scene, robot)
        self._size = solids.size_of(robot)
        scale = TensionScale.of(robot)
        self._stiffness = float(np.sqrt(scale.low * scale.high)) / (FAR * self._size)  # N/m of the pull
        self._state: Equilibrium | None = None
        self._hold: Hold | None = None
        self.pushed: Pushed | None = None
        channel.on(TOPIC, self._hear)
        server.on_client_disconnect(lambda client: soon(lambda: self._leave(client.client_id)))

    def follow(self, view: View) -> None:
        """Something is shown: answer the push there, if there is one."""
        snapshot = view.snapshot
        held = isinstance(snapshot, Snapshot) and snapshot.plan is not None and snapshot.feasible
        self._state = snapshot.plan.state if held and isinstance(snapshot, Snapshot) and snapshot.plan else None
        try:
            self._answer(view)
        except SaglineError as error:
            self._clear()
            self._panel.refuse(str(error))

    def tick(self) -> None:
        """Nothing comes by itself."""

    def let_go(self) -> None:
        """No force any more."""
        self._hold = None
        self._panel.hold(None)

    def _answer(self, view: View) -> None:
        push = self._panel.push()
        if push is None:
            self._clear()
            return
        if self._state is None or not self._ready(Reading.REST) or not self._ready(Reading.FREQUENCIES):
            self._clear()
            late = "A push is answered as soon as forward kinematics and stiffness are compiled."
            self._panel.say(
                sentence("A push is answered where the platform is held at rest." if self._state is None else late)
            )
            return
        found = pushed(self._state, push, anew=self._ready(Reading.VERDICTS))
        drawn_for = readable(radii(found.compliance)[0], LARGE * self._size) if self._ellipsoid(found) else None
        self._stage.show(self._drawing(found, view.settings.error_scale, drawn_for))
        self._panel.say(push_words.answer(found, drawn_for))
        self.pushed = found

    def _ellipsoid(self, found: Pushed) -> bool:
        return self._panel.ellipsoid and bool(np.isfinite(found.compliance).all())

    def _drawing(self, found: Pushed, error_scale: float, drawn_for: float | None) -> Drawing:
        start, pull = found.state.pose.transform(found.push.at), found.push.force / self._stiffness
        shown = min(1.0, LONGEST * self._size / max(float(np.linalg.norm(pull)), 1e-300))
        axes = None
        if drawn_for is not None:
            lengths, directions = radii(found.compliance)
            axes = drawn_for * lengths * directions
        tip = start + (pull if self._hold is not None else shown * pull)
        return Drawing(start, tip, found.drawn(error_scale), axes, push_words.tip(found), push_words.reserve(found))

    def _clear(self) -> None:
        self._stage.hide()
        self._panel.say("")
        self.pushed = None

    def _leave(self, client: int) -> None:
        """A client has gone; what it held it holds no more."""
        if self._hold is not None and self._hold.client == client:
            self.let_go()

    def _hear(self, value: Any, client: int) -> None:
        """A page tells what its hand does: whatever a client has sent."""
        if not isinstance(value, dict):
            return
        phase, at, eye = value.get("phase"), place_of(value.get("at")), self._eye(client)
        if at is None or eye is None:
            return
        if phase == "start":
            self._grab(eye, at, client)
        elif self._hold is None or self._hold.client != client:
            return
        elif phase in ("move", "end") and self._state is not None:
            self._panel.hold(Push(self._stiffness * self._pulled(eye, at, self._hold.at, self._state), self._hold.at))
        if phase == "cancel" or (phase == "end" and not (self._panel.keeps or value.get("keep") is True)):
            self.let_go()
        elif phase == "end":
            self._hold = None

    def _grab(self, eye: Eye, at: tuple[float, float], client: int) -> None:
        """Take hold of the place of the platform that is seen there, if it is there and held."""
        if self._state is None:
            return
        back = self._state.pose.matrix.T
        start = back @ (eye.place - self._state.pose.position)
        direction = back @ eye.ray(at)
        far = met(self._stage.body, start, direction)
        if far is not None:
            self._hold = Hold(client, start + far * direction)
            return
        points = self._stage.body.vertices[self._stage.body.faces].mean(axis=1)  # a thin one is easily missed
        places, deep = eye.seen(self._state.pose.transform(points))
        away = np.linalg.norm(places - np.asarray(at) * eye.pixels, axis=1)
        away[~(deep > 0.0)] = np.inf  # behind the eye
        if away.min() <= NEAR:
            self._hold = Hold(client, points[away.argmin()])

    def _pulled(self, eye: Eye, at: tuple[float, float], place: Array, state: Equilibrium) -> Array:
        """From a place of the platform to where the hand is, as far away from the eye [m], shape (3,)."""
        there = state.pose.transform(place)
        depth = float((there - eye.place) @ eye.axes[:, 2])
        return np.asarray(eye.place + depth * eye.ray(at) - there)

    def _eye(self, client: int) -> Eye | None:
        found = self._server.get_clients().get(client)
        return None if found is None else Eye.of(found.camera)
