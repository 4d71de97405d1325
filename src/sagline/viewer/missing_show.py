"""A pose that is not feasible explains itself: what is missing at once, the nearest that is held soon after."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sagline.robot.pose import Pose
from sagline.viewer.aside import Aside
from sagline.viewer.channel import Channel
from sagline.viewer.missing import Missing, missing_of
from sagline.viewer.missing_nearest import NearestHeld, nearest_held
from sagline.viewer.missing_stage import MissingStage
from sagline.viewer.missing_words import GO, explanation
from sagline.viewer.panel import Panel
from sagline.viewer.reading import Reading
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.view import View

Key = tuple[object, ...]


class MissingShow:
    """Explains what is shown; all of it belongs to the thread that serves."""

    moving = False

    def __init__(
        self,
        panel: Panel,
        stage: MissingStage,
        aside: Aside,
        channel: Channel,
        go: Callable[[Pose], None],
        ready: Callable[[Reading], bool],
    ) -> None:
        """Begin with nothing.

        Args:
            panel: Where it is told.
            stage: Where it is drawn.
            aside: What looks for the nearest pose.
            channel: What brings the wish to go there.
            go: Puts the platform to a pose.
            ready: Whether a reading can be had without waiting.
        """
        self._panel, self._stage, self._aside, self._go, self._ready = panel, stage, aside, go, ready
        self.missing: Missing | None = None  # at the pose that is shown
        self._key: Key = ()  # of the pose that is shown; () while it is feasible
        self._found: tuple[Key, NearestHeld | None] = ((), None)
        self._told: Callable[[], None] = _nothing
        self._look: Callable[[], None] = _nothing
        channel.on(GO, self._hear)

    @property
    def waiting(self) -> bool:
        """Whether the nearest pose is still to come."""
        return self._aside.busy

    def follow(self, view: View) -> None:
        """Explain a pose, or say nothing of one that is feasible."""
        snapshot = view.snapshot
        if not isinstance(snapshot, Snapshot) or snapshot.feasible:
            self.missing = None
            if self._key:
                self._clear()
            return
        missing = self.missing = missing_of(snapshot)
        self._stage.show(snapshot, missing)
        robot, pose, plan = snapshot.robot, snapshot.pose, snapshot.plan
        model = view.settings.model if plan is None else plan.state.cables.model
        wrench = view.wrench if plan is None else plan.state.wrench
        load = b"" if wrench is None else wrench.tobytes()
        self._key = (id(robot), type(model), pose.position.tobytes(), pose.quaternion.tobytes(), load)
        key = self._key

        def tell() -> None:
            known = self._found[1] if self._found[0] else None  # of a pose before, until this one's is there
            looking = self._found[0] != key  # or will be, as soon as it can
            self._panel.explain(explanation(snapshot, missing, known, looking=looking))
            self._stage.show_nearest(snapshot, known)

        def look() -> None:
            self._aside.ask(lambda: nearest_held(robot, pose, model, wrench), done, lambda _: done(None))

        def done(found: NearestHeld | None) -> None:
            if self._key:
                self._found = (key, found)
                self._told()
                if self._key != key:
                    self._look()

        self._told, self._look = tell, look
        if self._ready(Reading.WORKSPACE) and not self._aside.busy and self._found[0] != key:
            look()
        tell()

    def tick(self) -> None:
        """Nothing comes of time."""

    def _clear(self) -> None:
        self._key, self._found = (), ((), None)
        self._panel.explain("")
        self._stage.clear()

    def _hear(self, _value: Any, _client: int) -> None:
        """Somebody wants to go there."""
        key, nearest = self._found
        if key and key == self._key and nearest is not None:
            self._go(nearest.pose)


def _nothing() -> None:
    """Before there is anything to tell."""
