"""The drawing of the feasible tensions, and the dot that is dragged in it: what it chooses, the view follows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array
from sagline.viewer import moment_words, session_words
from sagline.viewer.by_hand import ByHand
from sagline.viewer.channel import Channel
from sagline.viewer.dot_field import DotField
from sagline.viewer.dot_marks import Marks
from sagline.viewer.panel import Panel
from sagline.viewer.polygon_figure import SHARING, field_of, polygon_figure, polygon_later, why_none
from sagline.viewer.reading import Reading
from sagline.viewer.session import SessionMoment
from sagline.viewer.settings import METHODS
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.view import View

DOT: Final = "dot"  # topic of the dot: {"at": coordinates [N]}, or {"by": steps, in shares of the drawing}
OVER: Final = 2e-3  # of the drawing: sides are aimed at from so far beyond
FARTHEST: Final = 1.0  # share of the drawing that a step may be


class DotShow:
    """Draws the field and moves the dot; all of it belongs to the thread that serves."""

    moving = False
    waiting = False

    def __init__(self, panel: Panel, channel: Channel, ready: Callable[[Reading], bool]) -> None:
        """Begin with nothing.

        Args:
            panel: Where the drawing is, and which way of sharing is chosen.
            channel: What brings the dot from the page.
            ready: Whether a reading can be had without waiting.
        """
        self._panel, self._ready = panel, ready
        self._marks = Marks()
        self._field: DotField | None = None  # where the dot can go
        self._key: tuple[object, ...] = ()  # of the pose that the field is of
        self._aim: Array | None = None  # coordinates that were chosen last, (r,)
        channel.on(DOT, self._hear_dot)
        channel.on(SHARING, self._hear_sharing)

    def follow(self, view: View) -> None:
        """Draw what there is to choose from."""
        snapshot = view.snapshot
        before, self._field = self._field, None
        if not isinstance(snapshot, Snapshot):
            recorded = isinstance(snapshot, SessionMoment)
            self._panel.show_polygon(session_words.polygon() if recorded else moment_words.polygon())
        elif not self._ready(Reading.POLYGON):
            self._panel.show_polygon(polygon_later())
        elif view.played is not None or snapshot.plan is None or why_none(snapshot):
            self._panel.show_polygon(polygon_figure(snapshot))
        else:
            state = snapshot.plan.state
            place = (state.pose.position.tobytes(), state.pose.quaternion.tobytes(), state.wrench.tobytes())
            key = (*place, view.settings.changes, type(state.cables.model))
            self._field = field_of(snapshot, before if key == self._key else None)
            if key != self._key or not isinstance(snapshot.plan.tension, ByHand):
                self._aim = None
            self._key = key
            if self._field is not None and self._aim is None:
                self._aim = self._field.polygon.coordinates(snapshot.tension)
            further, verdicts = self._ready(Reading.SHARING), self._ready(Reading.VERDICTS)
            marks = self._marks.at(snapshot.plan, further=further, verdicts=verdicts) if self._field else ()
            self._panel.show_polygon(polygon_figure(snapshot, marks, self._field, self._panel.way))

    def tick(self) -> None:
        """Nothing comes by itself."""

    def _hear_dot(self, value: Any, _: int) -> None:
        """The dot has been dragged, or stepped; what is no such thing, or comes too late, is not heard."""
        field = self._field
        if field is None or not isinstance(value, dict):
            return
        at, by = (_numbers(value.get(name), field.redundant) for name in ("at", "by"))
        if at is None:
            if by is None or self._aim is None or not np.isfinite(self._aim).all():
                return
            at = self._aim + np.clip(by, -FARTHEST, FARTHEST) * float(np.max(field.high - field.low))
        self._aim = field.nearest(at)
        self._panel.choose_by_hand(ByHand(target=field.tension(self._aim + self._beyond(field, at - self._aim))))

    @staticmethod
    def _beyond(field: DotField, away: Array) -> Array:
        """A little of the way out of the field: with other pulls its sides are a little farther."""
        far = float(np.linalg.norm(away))
        return away * min(1.0, OVER * float(np.max(field.high - field.low)) / far) if far > 0.0 else away

    def _hear_sharing(self, value: Any, _: int) -> None:
        """A way of sharing has been chosen by its mark."""
        if self._field is not None and isinstance(value, str) and value in METHODS:
            self._panel.choose_way(value)


def _numbers(value: Any, count: int) -> Array | None:
    """So many finite numbers, or None for anything else."""
    if not isinstance(value, list) or len(value) < count:
        return None
    if not all(type(part) in (int, float) and abs(part) < 1e12 for part in value):
        return None
    return np.array(value[:count], dtype=np.float64)
