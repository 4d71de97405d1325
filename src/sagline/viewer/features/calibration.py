"""Calibration: errors of the anchors, and residuals at the poses of the log."""

from __future__ import annotations

from collections.abc import Hashable
from html import escape
from typing import Any, Final

import numpy as np

from sagline.calibration import summary
from sagline.calibration.findings import UNITS, CalibrationStatus, Direction, columns_of
from sagline.calibration.least_squares import exceeded_with
from sagline.calibration.log import count_of_frequencies, reading_deviations
from sagline.calibration.result import Calibration
from sagline.core.arrays import Array, Indices
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.core.numbers import counted, n
from sagline.viewer import shapes
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.readout import chosen_by, color_key, html_block, refused, sentence, table_html, verdict_box
from sagline.viewer.robot_scene import INFEASIBLE, NO_SHADOW, PLATFORM, REST, TRACE_WIDTH, TRUTH, Nodes
from sagline.viewer.server import toggle, typed
from sagline.viewer.shapes import Solid, error_ellipsoids, placed_balls, readable

FIELD: Final = "Row of the log"
LONGEST: Final = 20  # largest number of characters of a requested row
TOPIC: Final = "row"  # topic of the messages with the number of a clicked row
LARGEST: Final = 100.0  # largest factor, relative to the initial one
OPACITY: Final = 0.55
_DOT: Final = 0.0055  # radius of the dot of a pose, as a share of the robot's size
_ABOVE: Final = 0.02  # distance of the label of a pose, as a share of the robot's size
NODES: Final[dict[summary.Anchors, str]] = {"frame_anchors": "", "platform_anchors": "/platform"}
MOST_POSES: Final = 2000  # largest number of drawn poses; of more, a regular selection and all outliers are drawn
MOST_NAMED: Final = 8  # largest number of outliers with labels in the scene
LARGE: Final = 0.04  # initial size of the largest ellipsoid, as a share of the robot's size
QUANTILES: Final = (0.95, 0.999)  # limits of chi squared between the colors
COLORS: Final = np.array([PLATFORM, REST, INFEASIBLE], dtype=np.uint8)
NAMES: Final = ("as expected", "one in 20", "one in 1,000")
MOST_LISTED = 12  # largest number of listed outliers


def degrees_of_freedom(found: Calibration) -> Indices:
    """Degrees of freedom of the residuals of each pose, shape (N,), >= 1."""
    read = np.isfinite(found.residuals).sum(axis=1) - found.robot.cable_count
    return np.asarray(np.maximum(read, 1)).astype(np.int64)


def bands(found: Calibration) -> Indices:
    """Band of each pose, shape (N,): the number of limits that its chi squared exceeds."""
    limits = exceeded_with(1.0 - np.array(QUANTILES)[:, None], degrees_of_freedom(found))
    return np.asarray((found.chi_squared_of_pose > limits).sum(axis=0)).astype(np.int64)


def verdict_text(found: Calibration) -> str:
    """HTML of the status."""
    kind = "good" if found.status is CalibrationStatus.FOUND else "bad"
    heads = {CalibrationStatus.FOUND: "Calibrated", CalibrationStatus.DOUBTFUL: "Doubtful"}
    head = heads.get(found.status, "Not converged")
    text = "" if kind == "good" else f"{escape(found.status.text)}<br>"
    of = f"{len(found.values)} numbers from {counted(len(found.rows), 'pose')}"
    out = (f"<br>{counted(len(rows), 'row')} left out: {escape(why.text)}" for why, rows in found.left_out.items())
    return verdict_box(kind, head, f"{text}{of}; {escape(summary.chi_squared_text(found))}{''.join(out)}")


def parameters_text(found: Calibration) -> str:
    """HTML of each kind of parameter: change, standard error and prior deviation, as root mean squares."""
    parameters, rows = found.parameters, []
    for name, unit in dict.fromkeys(zip(parameters.names, parameters.units, strict=True)):
        mine = (np.array(parameters.names) == name) & (np.array(parameters.units) == unit)
        moved, error = found.values[mine] - parameters.prior[mine], found.standard_error[mine]
        cells = (n(_root_mean_square(each), ".2g", unit) for each in (moved, error, parameters.prior_deviation[mine]))
        rows.append((name.replace("_", " "), *cells))
    items = "".join(f"<li>{_direction_text(one)}</li>" for one in (*found.gauge, *found.cannot_tell_apart))
    remark = f"<b>Not observed, or weakly identifiable</b><ul>{items}</ul>" if items else ""
    return html_block(table_html(("", "change", "error", "error before"), rows) + remark)


def _outliers_text(found: Calibration, chosen: int | None) -> str:
    if not found.outliers:
        return sentence("No outliers.")
    rows = "".join(
        f'<tr {chosen_by("row", one.row)} class="{"chosen" if one.row == chosen else ""}"><td>'
        f"<button {chosen_by('row', one.row)}>{escape(summary.outlier_text(one))}</button></td></tr>"
        for one in found.outliers[:MOST_LISTED]
    )
    rest = len(found.outliers) - MOST_LISTED
    more = f'<div class="quiet">and {rest:,} more</div>' if rest > 0 else ""
    return html_block(f'<b>Outliers</b><div class="rows"><table>{rows}</table></div>{more}')


def pose_residuals(found: Calibration, number: int) -> str:
    """HTML of the residuals at the pose `number`, beside the standard deviations of the sensors."""
    m, row = found.robot.cable_count, found.residuals[number]
    modes = count_of_frequencies(found.sensors, m, len(row))
    spread = reading_deviations(found.sensors, m, modes)
    lines = "".join(
        f"<tr><td>{k}</td>{_cell(row[k], spread[k], 'm')}{_cell(row[m + k], spread[m + k], 'N')}</tr>" for k in range(m)
    )
    cables = f"<table><tr><th>cable</th><th>length</th><th></th><th>load cell</th><th></th></tr>{lines}</table>"
    axes = {"position": tuple("xyz"), "rotation": ("about x", "about y", "about z")}
    places = "".join(
        f"<tr><td>{axes[quantity][k] if quantity in axes else f'{quantity} {k}'}</td>"
        f"{_cell(residual, deviation, UNITS[quantity])}</tr>"
        for quantity, part in list(columns_of(m, modes, len(row)).items())[2:]
        for k, (residual, deviation) in enumerate(zip(row[part], spread[part], strict=True))
        if np.isfinite(residual)
    )
    measured = f"<table><tr><th>position</th><th>residual</th><th></th></tr>{places}</table>" if places else ""
    weight = f", counts {n(found.weights[number], '.2g')}" if found.weights[number] < 1.0 else ""
    expected = degrees_of_freedom(found)[number]
    fit = f"chi squared {n(found.chi_squared_of_pose[number], '.3g')}, expected {expected}{weight}"
    return html_block(f"<b>Row {found.rows[number]}</b>: {fit}{cables}{measured}")


def _cell(residual: float, deviation: float, unit: str) -> str:
    """Table cells of a residual, in its unit and in standard deviations."""
    if not np.isfinite(residual):
        return "<td>–</td><td></td>"
    times = residual / deviation
    wrong = ' style="color:var(--sagline-bad)"' if abs(times) > 3.0 else ""
    return f"<td>{n(residual, '.2g', unit)}</td><td{wrong}>{n(times, '.1f')} σ</td>"


def _direction_text(one: Direction) -> str:
    """A direction, and the part of its prior error that remains after the calibration."""
    left = f", {100.0 * one.known:.0f} % of the error before" if one.known < 0.995 else ""
    return f"{escape(one.name.replace('_', ' '))}{left}"


def _root_mean_square(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if np.isfinite(values).all() else float("nan")


class CalibrationFeature(Feature):
    """A tab with a calibration, ellipsoids of the errors of the anchors, and clickable poses of the log."""

    def __init__(self, page: Page, found: Calibration) -> None:
        """Build tab and scene of a calibration."""
        self._found, self._go, self._size = found, page.go, shapes.size_of(found.robot)
        self._nodes, self._ball, self._later = Nodes(page.server.scene), Solid.ball(), page.later
        self._bands = bands(found)
        _, errors, _ = self._anchors("frame_anchors", relative=False)
        factor = readable(errors, LARGE * self._size)
        self._largest = LARGEST * factor
        self._build_tab(page, factor)
        page.channel.on(TOPIC, lambda row, _: toggle(self._field, row))
        outliers = np.isin(found.rows, [one.row for one in found.outliers]) | (self._bands == self._bands.max())
        some = np.arange(0, len(found.rows), -(-len(found.rows) // MOST_POSES))
        self._drawn = np.union1d(some, np.flatnonzero(outliers)[:MOST_POSES])
        self._ellipsoids: Hashable = ()  # settings of the present drawing
        self._poses: bool | None = None
        self._row: str | None = None

    @classmethod
    def of_page(cls, page: Page) -> CalibrationFeature | None:
        """The feature of a page with a calibration; None for other pages."""
        return None if page.found is None else cls(page, page.found)

    def _build_tab(self, page: Page, factor: float) -> None:
        gui, found = page.server.gui, self._found
        with page.panel.readings.add_tab("Calibration"):
            gui.add_html(verdict_text(found))
            self._wanted: Any = gui.add_checkbox("Errors of the anchors", True)
            hint = "Without a common displacement and rotation, which readings may not determine."
            self._relative: Any = gui.add_checkbox("Relative to one another", False, hint=hint)
            hint = "Scale of the drawn errors."
            self._factor: Any = gui.add_number("Drawn ×", factor, min=1.0, hint=hint)
            self._ellipsoids_html = gui.add_html("")
            hint = "Click one to move the platform there."
            self._poses_wanted: Any = gui.add_checkbox("Poses of the log", True, hint=hint)
            rows = zip(COLORS, NAMES, np.bincount(self._bands, minlength=len(COLORS)), strict=True)
            key = color_key((color, f"{name}: {count}") for color, name, count in rows)
            gui.add_html(html_block(f"<b>Chi squared of the poses</b><br>{key}"))
            self._field: Any = gui.add_text(FIELD, "", hint="Number of a row; empty for none.")
            self._outliers_html = gui.add_html("")
            self._pose_html = gui.add_html("")
            gui.add_html(parameters_text(found))
        self._controls = self._wanted, self._relative, self._factor, self._poses_wanted, self._field
        page.refresh_on(*self._controls)

    def depends(self, view: View) -> Hashable:
        """Key of the controls, without the view."""
        return tuple(each.value for each in self._controls)

    def follow(self, view: View) -> None:
        """Update drawing and text for the values of the controls."""
        try:
            self._follow_ellipsoids()
        except SaglineError as error:
            self._ellipsoids = ()
            self._ellipsoids_html.content = refused(str(error))
        if bool(self._poses_wanted.value) != self._poses:
            self._poses = bool(self._poses_wanted.value)
            self._draw_poses()
        if (row := typed(self._field, LONGEST)) != self._row:
            self._row = row
            self._follow_row(row)

    def _anchors(self, which: summary.Anchors, *, relative: bool) -> tuple[Indices, Array, Array]:
        """`error_ellipsoids` of the anchors `which`, of frame or platform; none if they were not calibrated."""
        covariance = summary.anchor_covariance(self._found.parameters, self._found.covariance, which)
        if covariance is None:
            return error_ellipsoids(np.zeros((0, 3, 3)))
        if relative:
            covariance = summary.relative_covariance(getattr(self._found.robot, which), covariance, which)
        return error_ellipsoids(np.einsum("kikj->kij", covariance))

    def _follow_ellipsoids(self) -> None:
        relative, factor = bool(self._relative.value), float(self._factor.value)
        if self._wanted.value and not 1.0 <= factor <= self._largest:
            raise InvalidValueError("Drawn ×", factor, f"1 to {self._largest:g}", "Type a factor.")
        wanted = (relative, factor) if self._wanted.value else None
        if wanted == self._ellipsoids:
            return
        self._ellipsoids = wanted
        for parent in NODES.values():
            self._nodes.remove(f"{parent}/errors", f"{parent}/moves")
        if wanted is None:
            self._ellipsoids_html.content = ""
            return
        for which, parent in NODES.items():
            self._draw_ellipsoids(which, parent, factor, relative=relative)
        but = ", without the common motion of all anchors" if relative else ""
        text = f"Ellipsoids: one standard error{but}, enlarged {factor:g} times; lines: change of the position."
        self._ellipsoids_html.content = sentence(text)

    def _draw_ellipsoids(self, which: summary.Anchors, parent: str, factor: float, *, relative: bool) -> None:
        """Draw the ellipsoids of the anchors `which`, with lines from the points before the calibration."""
        known, errors, axes = self._anchors(which, relative=relative)
        if not len(known):
            return
        points = getattr(self._found.robot, which)
        moved = points - getattr(self._found.before, which)
        if relative:
            moved = (summary.without_motion(points, which) @ moved.reshape(-1)).reshape(-1, 3)
        ends = np.stack((points[known] - factor * moved[known], points[known]), axis=1)
        turns, radii = placed_balls(factor * errors, axes)
        self._draw_balls(f"{parent}/errors", points[known], turns, radii, TRUTH, opacity=OPACITY)
        self._nodes.lines(f"{parent}/moves", ends, TRUTH, TRACE_WIDTH)

    def _draw_balls(self, name: str, places: Array, turns: Array, scales: Array, colors: Any, **looks: Any) -> Any:
        """Draw balls at `places` (k, 3), with quaternions `turns` (k, 4) and `scales` (k,) or (k, 3)."""
        return self._nodes.draw(
            name,
            self._nodes.scene.add_batched_meshes_simple,
            vertices=self._ball.vertices.astype(np.float32),
            faces=self._ball.faces.astype(np.uint32),
            batched_wxyzs=turns.astype(np.float32),
            batched_positions=places.astype(np.float32),
            batched_scales=scales.astype(np.float32),
            batched_colors=np.asarray(colors, dtype=np.uint8),
            lod="off",
            **NO_SHADOW,
            **looks,
        )

    def _draw_poses(self) -> None:
        """Draw the poses of the log as clickable dots, some outliers with labels."""
        self._nodes.remove("/log")
        if not self._poses:
            return
        found, rows, places = self._found, self._found.rows[self._drawn], self._found.poses.position[self._drawn]
        names: dict[int, str] = {}
        for one in found.outliers:
            for k in np.flatnonzero(rows == one.row)[: MOST_NAMED - len(names)]:
                cable = "" if one.cable is None else f", cable {one.cable}"
                names.setdefault(int(k), f"row {one.row}{cable}")
        upright, scales = np.tile([1.0, 0.0, 0.0, 0.0], (len(places), 1)), np.full(len(places), _DOT * self._size)
        dots = self._draw_balls("/log", places, upright, scales, COLORS[self._bands[self._drawn]])
        dots.on_click(lambda event: self._later(lambda: self._pick(int(event.instance_index))))
        for k, name in names.items():
            self._nodes.label(f"/log/{k}", name, places[k] + [0.0, 0.0, _ABOVE * self._size], "top-left", 0.8)

    def _follow_row(self, typed: str) -> None:
        """Go to the pose of a row, and write its residuals."""
        found = self._found
        there = np.flatnonzero(found.rows == int(typed)) if typed.isdecimal() else np.empty(0)
        k = int(there[0]) if len(there) else None
        self._outliers_html.content = _outliers_text(found, None if k is None else int(found.rows[k]))
        self._pose_html.content = self._why_no_row(typed) if k is None else pose_residuals(found, k)
        self._nodes.remove("/chosen")
        if k is not None:
            below = found.poses.position[k] - [0.0, 0.0, _ABOVE * self._size]
            self._nodes.label("/chosen", f"row {found.rows[k]}", below, "top-center")
            self._go(found.poses[k])

    def _why_no_row(self, typed: str) -> str:
        if not typed:
            return ""
        for reason, rows in self._found.left_out.items():
            if typed.isdecimal() and int(typed) in rows:
                return sentence(f"Row {int(typed)} was left out: {reason.text}.")
        return sentence("The log has no such row.")

    def _pick(self, k: int) -> None:
        if 0 <= k < len(self._drawn):
            self._field.value = str(int(self._found.rows[self._drawn[k]]))
