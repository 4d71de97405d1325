"""Pose field, and the state as code or as a link."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, Final

import viser

from sagline.core.errors import InvalidValueError, SaglineError
from sagline.files.pose_text import pose_of
from sagline.robot.pose import Pose
from sagline.viewer.feature import Feature, View
from sagline.viewer.link import LinkedControls, Linking
from sagline.viewer.page import Page
from sagline.viewer.readout import block
from sagline.viewer.state_code import code_of
from sagline.viewer.tension_scale import number

FIRST: Final = -0.9  # among the controls: above all but what is played
EXAMPLE: Final = "1, 0, 1.5 or 1, 0, 1.5, 10, 0, 0"
STEP: Final = f"Give meters, and degrees about z, y and x: {EXAMPLE}."
HINT: Final = "Position in meters, and if need be angles about z, y and x in degrees. Enter goes there."
_CONTENT: Final = block(
    '<div class="state"><label for="sagline-pose">x, y, z [m], α, β, γ [°]</label>'
    f'<input id="sagline-pose" type="text" autocomplete="off" spellcheck="false" title="{HINT}"'
    ' aria-describedby="sagline-pose-told">'
    '<div id="sagline-pose-told" class="bad" role="alert"></div>'
    '<div class="copies"><button type="button" data-copy="code" title="Lines of Python for what is shown">'
    "Copy as code</button>"
    '<button type="button" data-copy="link" title="A link that brings another page to the same">Copy link</button>'
    '<button type="button" data-keys class="small" aria-label="Keys" title="What keys do">?</button></div></div>'
)


def add_state_panel(gui: viser.GuiApi) -> None:
    """Build it."""
    gui.add_html(_CONTENT, order=FIRST)


def pose_text(pose: Pose) -> str:
    """A pose as the field takes it, to a tenth of a millimeter and a hundredth of a degree; no angles where level."""
    place = [_short(value, ".4f") for value in pose.position]
    angles = [_short(value, ".2f") for value in pose.rotation.as_euler("ZYX", degrees=True)]
    return ", ".join(place if angles == ["0"] * 3 else place + angles)


def _short(value: float, form: str) -> str:
    return number(value, form).rstrip("0").rstrip(".")


LONGEST_NAME = 40  # characters of what a page calls its question


class StateFeature(Feature):
    """Field of the pose, and the state as code or as a link."""

    def __init__(self, page: Page) -> None:
        """Build the panel; last of all, as it knows the controls that there are."""
        channel = page.channel
        add_state_panel(page.server.gui)
        self.linking = Linking(page, LinkedControls(page.server.gui))
        self._channel, self._player, self._robot, self._source = channel, page.player, page.robot, page.source
        self._go = page.go_near
        self._view: View | None = None
        self._time = 0.0
        self._asked: deque[tuple[Any, int]] = deque()  # what is to be given as text, and to whom
        channel.on("pose", self._on_pose)
        channel.on("copy", self._on_copy)
        channel.on("link", self._on_link)

    def follow(self, view: View) -> None:
        """Send the pose."""
        self._view, self._time = view, self._player.clock.time
        self._channel.send("pose", pose_text(view.snapshot.pose))

    def tick(self) -> None:
        """Send the texts that were asked for, after the messages before them are shown."""
        while self._asked:
            self._send_text(*self._asked.popleft())

    def _on_pose(self, value: Any, client: int) -> None:
        """Go to a pose that was typed."""

        def go(text: str) -> dict[str, str]:
            self._go(pose_of(text, "the pose", STEP))
            return {}

        self._answer(client, "pose-told", value, go)

    def _on_copy(self, value: Any, client: int) -> None:
        """Queue a text that is asked for."""
        self._asked.append((value, client))

    def _send_text(self, value: Any, client: int) -> None:
        """Send a text that was asked for."""
        self._answer(client, "copy-told", value, lambda what: self._copy(what, client))

    def _on_link(self, value: Any, client: int) -> None:
        """Follow a link."""

        def follow(text: str) -> dict[str, str]:
            self.linking.follow(text, client)
            return {}

        self._answer(client, "link-told", value, follow)

    def _copy(self, what: str, client: int) -> dict[str, str]:
        if self._view is None:
            raise InvalidValueError("the view", "not there yet", "something on the screen", "Wait until it stands.")
        if what == "link":
            return {"text": self.linking.link_to(self._view, client)}
        if what != "code":
            raise InvalidValueError("what to copy", repr(what), "code or link", "Press one of the buttons.")
        if self._view.played is not None and not (self._player.given and self._source.played):
            step = "Copy the pose that it begins with, and simulate from there."
            raise InvalidValueError(f"the {self._view.played.name}", "in no file", "what lines can load", step)
        return {"text": code_of(self._view, self._robot, self._source, self._time)}

    def _answer(self, client: int, topic: str, value: Any, done: Callable[[str], dict[str, str]]) -> None:
        """Handle a request [name, text] of a page, and send the answer {"to": name, ...} to it alone."""
        if not isinstance(value, list) or len(value) != 2 or not all(isinstance(each, str) for each in value):
            return
        name, text = value
        if len(name) > LONGEST_NAME:
            return
        try:
            answer = done(text)
        except SaglineError as error:
            answer = {"refused": str(error)}
        self._channel.send_to(client, topic, {"to": name, **answer})
