"""The panel of a calibration: its verdict, how its errors are drawn, and what was read at a pose of its log."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import viser

from sagline.core.errors import InvalidValueError

FIELD: Final = "Row of the log"
TOPIC: Final = "row"  # that a page tells the number of a row under that is clicked
MOST: Final = 100.0  # times the factor at first


class CalibrationPanel:
    """A tab."""

    def __init__(self, gui: viser.GuiApi, readings: Any, factor: float, changed: Callable[[], None]) -> None:
        """Build the tab.

        Args:
            gui: Where.
            readings: The tabs that it is one of.
            factor: How many times as large errors are drawn at first.
            changed: Called, from any thread, when something is chosen.
        """
        with readings.add_tab("Calibration"):
            self._verdict = gui.add_html("")
            self._ellipsoids: Any = gui.add_checkbox("Errors of the anchors", True)
            self._relative: Any = gui.add_checkbox(
                "Relative to one another",
                False,
                hint="Without what only shifts all of them or turns them together, which readings may leave open.",
            )
            self._factor: Any = gui.add_number(
                "Drawn ×", factor, min=1.0, hint="How many times as large the errors are drawn."
            )
            self._magnified = gui.add_html("")
            self._poses: Any = gui.add_checkbox(
                "Poses of the log", True, hint="Click one, and the platform goes there."
            )
            self._key = gui.add_html("")
            self._row: Any = gui.add_text(FIELD, "", hint="Number of a row; empty for none.")
            self._outliers = gui.add_html("")
            self._pose = gui.add_html("")
            self._kinds = gui.add_html("")
        self._largest = MOST * factor
        for handle in (self._ellipsoids, self._relative, self._factor, self._poses, self._row):
            handle.on_update(lambda _: changed())

    @property
    def ellipsoids(self) -> bool:
        """Whether the errors of the anchors are wanted."""
        return bool(self._ellipsoids.value)

    @property
    def relative(self) -> bool:
        """Whether without what moves all anchors together."""
        return bool(self._relative.value)

    @property
    def factor(self) -> float:
        """How many times as large errors are drawn.

        Raises:
            InvalidValueError: If a client sent what is none.
        """
        value = float(self._factor.value)
        if not 1.0 <= value <= self._largest:
            raise InvalidValueError("Drawn ×", value, f"1 to {self._largest:g}", "Type a factor.")
        return value

    @property
    def poses(self) -> bool:
        """Whether the poses of the log are wanted."""
        return bool(self._poses.value)

    @property
    def row(self) -> str:
        """The row that is asked for, as it was typed; "" for none."""
        return " ".join(str(self._row.value).split())[:20]

    def choose(self, row: int) -> None:
        """Ask for a row."""
        self._row.value = str(row)

    def toggle(self, row: Any) -> None:
        """Ask for a row that a page tells, or no more if it was asked for before."""
        self._row.value = "" if str(row) == self.row else str(row)

    def tell(self, verdict: str, kinds: str, key: str) -> None:
        """What does not change: verdict, kinds of numbers, and which color is which fit."""
        self._verdict.content, self._kinds.content, self._key.content = verdict, kinds, key

    def explain(self, magnified: str) -> None:
        """What the ellipsoids are."""
        self._magnified.content = magnified

    def tell_pose(self, outliers: str, pose: str) -> None:
        """What does not fit, and what was read at the pose that is asked for."""
        self._outliers.content, self._pose.content = outliers, pose
