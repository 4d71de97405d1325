"""The state that is typed, and taken away: pages ask, and are answered each for itself."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

from sagline.core.errors import InvalidValueError, SaglineError
from sagline.files.typed import pose_of
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.viewer.channel import Channel
from sagline.viewer.linking import Linking
from sagline.viewer.player import Player
from sagline.viewer.source import Source
from sagline.viewer.state_code import code_of
from sagline.viewer.state_panel import STEP, pose_text
from sagline.viewer.view import View

LONGEST_NAME = 40  # characters of what a page calls its question


class StateShow:
    """Tells pages where the platform is, and hears where it shall go; all of it belongs to the thread that serves."""

    moving = False
    waiting = False

    def __init__(
        self,
        channel: Channel,
        player: Player,
        robot: Robot,
        source: Source,
        go: Callable[[Pose], None],
        linking: Linking,
    ) -> None:
        """Begin with nothing.

        Args:
            channel: To the pages.
            player: What is played.
            robot: The robot that the page was opened with.
            source: Where that came from.
            go: Puts the platform to a pose, or refuses by a `SaglineError`.
            linking: Makes links and follows them.
        """
        self._linking = linking
        self._channel, self._player, self._robot, self._source, self._go = channel, player, robot, source, go
        self._view: View | None = None
        self._time = 0.0
        self._asked: deque[tuple[Any, int]] = deque()  # what is to be given as text, and to whom
        channel.on("pose", self._hear_pose)
        channel.on("copy", self._hear_copy)
        channel.on("link", self._hear_link)

    def follow(self, view: View) -> None:
        """Tell the pose."""
        self._view, self._time = view, self._player.clock.time
        self._channel.tell("pose", pose_text(view.snapshot.pose))

    def tick(self) -> None:
        """Give what was asked for, now that all that was said before is shown."""
        while self._asked:
            self._give(*self._asked.popleft())

    def _hear_pose(self, value: Any, client: int) -> None:
        """Go to a pose that was typed."""

        def go(text: str) -> dict[str, str]:
            self._go(pose_of(text, "the pose", STEP))
            return {}

        self._answer(client, "pose-told", value, go)

    def _hear_copy(self, value: Any, client: int) -> None:
        """Note what is asked for as text."""
        self._asked.append((value, client))

    def _give(self, value: Any, client: int) -> None:
        """Give what was asked for as text."""
        self._answer(client, "copy-told", value, lambda what: self._copy(what, client))

    def _hear_link(self, value: Any, client: int) -> None:
        """Follow a link."""

        def follow(text: str) -> dict[str, str]:
            self._linking.follow(text, client)
            return {}

        self._answer(client, "link-told", value, follow)

    def _copy(self, what: str, client: int) -> dict[str, str]:
        if self._view is None:
            raise InvalidValueError("the view", "not there yet", "something on the screen", "Wait until it stands.")
        if what == "link":
            return {"text": self._linking.told(self._view, client)}
        if what != "code":
            raise InvalidValueError("what to copy", repr(what), "code or link", "Press one of the buttons.")
        if self._view.played is not None and not (self._player.given and self._source.played):
            step = "Copy the pose that it begins with, and simulate from there."
            raise InvalidValueError(f"the {self._view.played.name}", "in no file", "what lines can load", step)
        return {"text": code_of(self._view, self._robot, self._source, self._time)}

    def _answer(self, client: int, topic: str, value: Any, done: Callable[[str], dict[str, str]]) -> None:
        """Do what a page asks, [name of the question, text], and answer it alone: {"to": name, ...}, refused or not."""
        if not isinstance(value, list) or len(value) != 2 or not all(isinstance(each, str) for each in value):
            return
        name, text = value
        if len(name) > LONGEST_NAME:
            return
        try:
            answer = done(text)
        except SaglineError as error:
            answer = {"refused": str(error)}
        self._channel.answer(client, topic, {"to": name, **answer})
