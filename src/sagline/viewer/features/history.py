"""Undo and redo of changes of the page, and its reset."""

from __future__ import annotations

import time
from collections import deque
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.kinematics.plan import Plan
from sagline.robot.pose import Pose
from sagline.viewer.feature import Feature, View
from sagline.viewer.features.cut import Before, CutFeature
from sagline.viewer.features.push import PushFeature
from sagline.viewer.features.state import FIRST, StateFeature
from sagline.viewer.page import Page
from sagline.viewer.player import PlayerState
from sagline.viewer.readout import chosen_by, html_block
from sagline.viewer.snapshot import ByHand

PAUSE: Final = 0.4  # time without a change after which the inputs are recorded [s], so that a drag is one step
MOST: Final = 200  # largest number of steps
NEAR: Final = 1e-9  # smaller differences of poses are rounding errors [m], or of a quaternion
TOPIC: Final = "history"
BUTTONS: Final = (
    ("undo", "Undo", "Undo the last change (Ctrl+Z)"),
    ("redo", "Redo", "Redo the change that was undone last (Ctrl+Y or Ctrl+Shift+Z)"),
    ("reset", "Reset all", "Restore pose and controls of the start; this can be undone"),
)
_CONTENT: Final = html_block(
    '<div class="copies">'
    + "".join(
        f'<button type="button" title="{hint}" {chosen_by(TOPIC, name)}>{label}</button>'
        for name, label, hint in BUTTONS
    )
    + "</div>"
)


class Inputs(NamedTuple):
    """Everything of a page that its users can change, except cameras."""

    values: dict[str, Any]  # values of the controls
    hand: ByHand | None  # tensions chosen by hand, if they apply
    wrench: Array | None
    pose: Pose
    previous: Plan | None  # plan for a tension distribution method that depends on history
    player: PlayerState
    number: int  # number of the played motion
    cuts: tuple[Before, ...]

    def same(self, other: Inputs) -> bool:
        """True if there is no step between two inputs; the clock of a played motion makes no step."""
        played = self.number, self.player.following, len(self.cuts)
        if played != (other.number, other.player.following, len(other.cuts)):
            return False
        if self.values != other.values or self.hand is not other.hand or self.wrench is not other.wrench:
            return False
        one, two = (np.concatenate((each.pose.position, each.pose.quaternion)) for each in (self, other))
        return self.player.following or bool(np.all(np.abs(one - two) < NEAR))


class HistoryFeature(Feature):
    """Buttons and keys that restore earlier inputs."""

    def __init__(self, page: Page) -> None:
        """Add the buttons below the field of the pose."""
        page.server.gui.add_html(_CONTENT, order=FIRST + 0.01)
        self._page = page
        self._past: deque[Inputs] = deque(maxlen=MOST)
        self._future: list[Inputs] = []
        self._first: Inputs | None = None
        self._present: Inputs | None = None
        self._changed = 0.0  # time of the last change that is not recorded yet [s]; 0 if there is none
        page.channel.on(TOPIC, lambda value, _: self.go(value))

    def follow(self, view: View) -> None:
        """Note the time of a change; the clock of a played motion is not a change."""
        if self._present is None:
            self._first = self._present = self._taken()
        elif view.playing and self._present.number == self._page.player.number:
            self._present = self._present._replace(player=self._page.player.save())
        else:
            self._changed = time.monotonic()

    def tick(self) -> None:
        """Record inputs that no longer change."""
        dragged = self._page.dragging or self._page.feature(PushFeature).hold
        if self._changed and not dragged and time.monotonic() - self._changed > PAUSE:
            self._record()

    def go(self, way: Any) -> None:
        """Undo, redo or reset; `way` is unchecked data of a client."""
        self._record()
        present, past, future = self._present, self._past, self._future
        if present is None or self._first is None:
            return
        if way == "undo" and past:
            future.append(present)
            self._restore(past.pop())
        elif way == "redo" and future:
            past.append(present)
            self._restore(future.pop())
        elif way == "reset" and not present.same(self._first):
            past.append(present)
            future.clear()
            self._restore(self._first)

    def _record(self) -> None:
        try:
            taken = self._taken()
        except SaglineError:
            return  # a browser has sent an invalid pose, which is not shown either
        self._changed = 0.0
        if self._present is not None and not taken.same(self._present):
            self._past.append(self._present)
            self._future.clear()
        self._present = taken

    def _taken(self) -> Inputs:
        page = self._page
        values, tension = page.feature(StateFeature).controls.values(), page.panel.settings().tension
        return Inputs(
            values, tension if isinstance(tension, ByHand) else None, page.wrench, page.scene.dragged_pose(),
            page.previous, page.player.save(), page.player.number, page.feature(CutFeature).before,
        )  # fmt: skip

    def _restore(self, inputs: Inputs) -> None:
        page = self._page
        page.feature(CutFeature).put(inputs.cuts)
        if inputs.number != page.player.number or inputs.player.following:
            page.player.restore(inputs.player)
        page.feature(StateFeature).controls.put(inputs.values)
        if inputs.hand is not None:
            page.panel.choose_by_hand(inputs.hand)
        page.wrench, page.previous = inputs.wrench, inputs.previous
        if not inputs.player.following:
            page.go(inputs.pose)
        page.refresh()
        self._present = self._taken()
