"""A calibration beside the robot it has found: how well its anchors are known, and how well its poses fit."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import Any, Final

import numpy as np
import viser

from sagline.calibration.relative import Anchors, anchor_covariance, relative_covariance, without_motion
from sagline.calibration.result import Calibration
from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.robot.pose import Pose
from sagline.viewer import calibration_words, fit_scale, solids
from sagline.viewer.calibration_panel import TOPIC, CalibrationPanel
from sagline.viewer.calibration_stage import CalibrationStage
from sagline.viewer.channel import Channel
from sagline.viewer.ellipsoids import Ellipsoids, readable
from sagline.viewer.readout import refused, sentence
from sagline.viewer.view import View

NODES: Final[dict[Anchors, str]] = {"frame_anchors": "", "platform_anchors": "/platform"}
MOST_POSES: Final = 2000  # that are drawn; of more every so-manieth, and all that do not fit
MOST_NAMED: Final = 8  # outliers that have their names in the scene
LARGE: Final = 0.04  # of the robot's size: the largest ellipsoid at first


class CalibrationShow:
    """Follows what its panel says; all of it belongs to the thread that serves."""

    moving = waiting = False

    def __init__(
        self,
        server: viser.ViserServer,
        readings: Any,
        found: Calibration,
        changed: Callable[[], None],
        soon: Callable[[Callable[[], None]], None],
        go: Callable[[Pose], None],
        channel: Channel,
    ) -> None:
        """Build tab and scene.

        Args:
            server: Where.
            readings: The tabs that it is one of.
            found: The calibration.
            changed: Called, from any thread, when something is chosen.
            soon: Takes what the serving thread is to do, from any thread.
            go: Puts the platform somewhere.
            channel: Tells which row of a list is clicked.
        """
        self._found, self._go = found, go
        size = solids.size_of(found.robot)
        self._panel = CalibrationPanel(
            server.gui, readings, readable(self._anchors("frame_anchors", relative=False).radius, LARGE * size), changed
        )
        self._stage = CalibrationStage(server.scene, size, lambda k: soon(lambda: self._pick(k)))
        channel.on(TOPIC, lambda row, _: self._panel.toggle(row))
        bands = fit_scale.bands(found)
        self._panel.tell(
            calibration_words.verdict(found),
            calibration_words.kinds(found),
            fit_scale.key(np.bincount(bands, minlength=len(fit_scale.COLORS)).astype(np.int64)),
        )
        held = np.flatnonzero(np.isin(found.rows, [one.row for one in found.outliers]) | (bands == bands.max()))
        some = np.arange(0, len(found.rows), -(-len(found.rows) // MOST_POSES))
        self._drawn = np.union1d(some, held[:MOST_POSES])
        self._ellipsoids: Hashable = ()  # of what they are drawn: nothing yet
        self._poses: bool | None = None
        self._row: str | None = None

    def tick(self) -> None:
        """Nothing comes by itself."""

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
        colors = fit_scale.colors(self._found)[self._drawn]
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
