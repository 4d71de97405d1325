"""Calibration: errors of the anchors, and residuals at the poses of the log."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Final

import numpy as np
import viser

from sagline.calibration.result import Calibration
from sagline.calibration.summary import Anchors, anchor_covariance, relative_covariance, without_motion
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.viewer import calibration_words, solids
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.readout import refused, sentence
from sagline.viewer.solids import Ellipsoids, ball, readable
from sagline.viewer.stage import TRACE_WIDTH, TRUTH
from sagline.viewer.tension_scale import Colors

FIELD: Final = "Row of the log"
TOPIC: Final = "row"  # that a page tells the number of a row under that is clicked
MOST: Final = 100.0  # times the factor at first


class CalibrationPanel:
    """A tab."""

    def __init__(self, gui: viser.GuiApi, readings: Any, factor: float, changed: Callable[[], None]) -> None:
        """Build the tab."""
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
    def values(self) -> tuple[Hashable, ...]:
        """All that is chosen."""
        return self.ellipsoids, self.relative, self._factor.value, self.poses, self.row

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
        """How many times as large errors are drawn."""
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


OPACITY: Final = 0.55
_DOT: Final = 0.0055  # radius of a pose, of the robot's size
_ABOVE: Final = 0.02  # of the robot's size: the name of a pose over it


class CalibrationStage:
    """What is drawn of a calibration."""

    def __init__(self, scene: viser.SceneApi, size: float, picked: Callable[[int], None]) -> None:
        """Begin with nothing."""
        self._scene, self._size, self._picked = scene, size, picked
        self._ball = ball()
        self._ellipsoids: dict[str, list[Any]] = {}
        self._dots: Any = None
        self._names: list[Any] = []
        self._chosen: Any = None

    def show_ellipsoids(self, where: str, some: Ellipsoids, moved_from: Array, factor: float) -> None:
        """Draw ellipsoids in place of those before, with lines from where the points were."""
        self.hide_ellipsoids(where)
        if not len(some.which):
            return
        ends = np.stack((some.middle + factor * (moved_from - some.middle), some.middle), axis=1)
        self._ellipsoids[where] = [
            self._scene.add_batched_meshes_simple(
                f"{where}/errors", self._ball.vertices.astype(np.float32), self._ball.faces.astype(np.uint32),
                some.turn.astype(np.float32), some.middle.astype(np.float32),
                batched_scales=some.drawn(factor).astype(np.float32), batched_colors=TRUTH, opacity=OPACITY,
                lod="off", cast_shadow=False, receive_shadow=False,
            ),
            self._scene.add_line_segments(
                f"{where}/moves", ends.astype(np.float32), TRUTH, thickness=TRACE_WIDTH, thickness_units="screen"
            ),
        ]  # fmt: skip

    def hide_ellipsoids(self, where: str) -> None:
        """Draw none there."""
        for handle in self._ellipsoids.pop(where, []):
            handle.remove()

    def show_poses(self, places: Array, colors: Colors, names: dict[int, str]) -> None:
        """Draw poses as dots to be clicked, some of them with a name."""
        self.hide_poses()
        if not len(places):
            return
        upright = np.tile(np.array([1.0, 0.0, 0.0, 0.0], dtype=np.float32), (len(places), 1))
        self._dots = self._scene.add_batched_meshes_simple(
            "/log", self._ball.vertices.astype(np.float32), self._ball.faces.astype(np.uint32), upright,
            places.astype(np.float32), batched_scales=np.full(len(places), _DOT * self._size, dtype=np.float32),
            batched_colors=colors, lod="off", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
        self._dots.on_click(lambda event: self._picked(int(event.instance_index)))
        over = np.array([0.0, 0.0, _ABOVE * self._size])
        self._names = [
            self._scene.add_label(f"/log/{k}", name, position=places[k] + over, font_screen_scale=0.8)
            for k, name in names.items()
        ]

    def hide_poses(self) -> None:
        """Draw none."""
        while self._names:
            self._names.pop().remove()
        if self._dots is not None:
            self._dots.remove()
            self._dots = None

    def choose(self, place: Array | None, name: str) -> None:
        """Name a pose; None for none."""
        if self._chosen is not None:
            self._chosen.remove()
            self._chosen = None
        if place is not None:
            under = place - np.array([0.0, 0.0, _ABOVE * self._size])
            self._chosen = self._scene.add_label("/chosen", name, position=under, anchor="top-center")


NODES: Final[dict[Anchors, str]] = {"frame_anchors": "", "platform_anchors": "/platform"}
MOST_POSES: Final = 2000  # that are drawn; of more every so-manieth, and all that do not fit
MOST_NAMED: Final = 8  # outliers that have their names in the scene
LARGE: Final = 0.04  # of the robot's size: the largest ellipsoid at first


class CalibrationFeature(Feature):
    """Follows what its panel says; all of it belongs to the thread that serves."""

    def __init__(self, page: Page, found: Calibration) -> None:
        """Build tab and scene of a calibration."""
        server = page.server
        self._found, self._go = found, page.go
        size = solids.size_of(found.robot)
        self._panel = CalibrationPanel(
            server.gui,
            page.panel.readings,
            readable(self._anchors("frame_anchors", relative=False).radius, LARGE * size),
            page.refresh,
        )
        self._stage = CalibrationStage(server.scene, size, lambda k: page.later(lambda: self._pick(k)))
        page.channel.on(TOPIC, lambda row, _: self._panel.toggle(row))
        bands = calibration_words.bands(found)
        self._panel.tell(
            calibration_words.verdict(found),
            calibration_words.kinds(found),
            calibration_words.key(np.bincount(bands, minlength=len(calibration_words.COLORS)).astype(np.int64)),
        )
        held = np.flatnonzero(np.isin(found.rows, [one.row for one in found.outliers]) | (bands == bands.max()))
        some = np.arange(0, len(found.rows), -(-len(found.rows) // MOST_POSES))
        self._drawn = np.union1d(some, held[:MOST_POSES])
        self._ellipsoids: Hashable = ()  # of what they are drawn: nothing yet
        self._poses: bool | None = None
        self._row: str | None = None

    def depends(self, view: View) -> Hashable:
        """The panel alone."""
        return self._panel.values

    def follow(self, view: View) -> None:
        """Draw and say what the panel asks for, whatever else is shown."""
        try:
            self._follow_ellipsoids()
        except SaglineError as error:
            self._ellipsoids = ()
            self._panel.explain(refused(str(error)))
        if self._panel.poses != self._poses:
            self._poses = self._panel.poses
            self._follow_poses()
        if self._panel.row != self._row:
            self._row = self._panel.row
            self._follow_row(self._row)

    def _anchors(self, which: Anchors, *, relative: bool) -> Ellipsoids:
        """Ellipsoids of the anchors of frame or platform; none where nobody asked for them."""
        points = getattr(self._found.robot, which)
        covariance = anchor_covariance(self._found.parameters, self._found.covariance, which)
        if covariance is None:
            return Ellipsoids.of(points, np.zeros((len(points), 3, 3)))
        if relative:
            covariance = relative_covariance(points, covariance, which)
        return Ellipsoids.of(points, np.einsum("kikj->kij", covariance))

    def _moved(self, which: Anchors, *, relative: bool) -> Array:
        """By how much the anchors have moved [m], shape (m, 3)."""
        points = getattr(self._found.robot, which)
        moved = points - getattr(self._found.before, which)
        if relative:
            moved = (without_motion(points, which) @ moved.reshape(-1)).reshape(-1, 3)
        return np.asarray(moved)

    def _follow_ellipsoids(self) -> None:
        panel = self._panel
        wanted = (panel.relative, panel.factor) if panel.ellipsoids else None
        if wanted == self._ellipsoids:
            return
        self._ellipsoids = wanted
        if wanted is None:
            for where in NODES.values():
                self._stage.hide_ellipsoids(where)
            panel.explain("")
            return
        relative, factor = wanted
        for which, where in NODES.items():
            some, moved = self._anchors(which, relative=relative), self._moved(which, relative=relative)
            self._stage.show_ellipsoids(where, some, some.middle - moved[some.which], factor)
        panel.explain(calibration_words.magnified(factor, relative=relative))

    def _follow_poses(self) -> None:
        if not self._poses:
            self._stage.hide_poses()
            return
        rows = self._found.rows[self._drawn]
        names: dict[int, str] = {}
        for one in self._found.outliers:
            for k in np.flatnonzero(rows == one.row)[: MOST_NAMED - len(names)]:
                cable = "" if one.cable is None else f", cable {one.cable}"
                names.setdefault(int(k), f"row {one.row}{cable}")
        colors = calibration_words.colors(self._found)[self._drawn]
        self._stage.show_poses(self._found.poses.position[self._drawn], colors, names)

    def _follow_row(self, typed: str) -> None:
        """Go to the pose of a row, and say what was read there."""
        found = self._found
        k = self._place_of(typed)
        self._panel.tell_pose(
            calibration_words.outliers(found, None if k is None else int(found.rows[k])),
            calibration_words.pose(found, k) if k is not None else self._why_not(typed),
        )
        self._stage.choose(None if k is None else found.poses.position[k], "" if k is None else f"row {found.rows[k]}")
        if k is not None:
            self._go(found.poses[k])

    def _place_of(self, typed: str) -> int | None:
        """The pose of a row; None if there is none."""
        there = np.flatnonzero(self._found.rows == int(typed)) if typed.isdecimal() else np.empty(0)
        return int(there[0]) if len(there) else None

    def _why_not(self, typed: str) -> str:
        if not typed:
            return ""
        for reason, rows in self._found.left_out.items():
            if typed.isdecimal() and int(typed) in rows:
                return sentence(f"Row {int(typed)} was left out: {reason.text}.")
        return sentence("The log has no such row.")

    def _pick(self, k: int) -> None:
        if 0 <= k < len(self._drawn):
            self._panel.choose(int(self._found.rows[self._drawn[k]]))
