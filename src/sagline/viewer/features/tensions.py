"""Feasible tensions: their drawing, and the choice of tensions by hand."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import Any, Final

import numpy as np

from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.kinematics.polygon import polygon_at, tension_polygon
from sagline.kinematics.slanted import with_eyelets
from sagline.tension.method import kernel_options
from sagline.tension.methods import MinimumNorm
from sagline.tension.polygon import Side, TensionPolygon
from sagline.viewer import shapes
from sagline.viewer.feature import Feature, View
from sagline.viewer.page import Page
from sagline.viewer.readout import chosen_by, html_block, sentence
from sagline.viewer.server import finite_numbers
from sagline.viewer.snapshot import BY_HAND, METHODS, ByHand, MethodMark, MethodMarks, Snapshot, method_name
from sagline.viewer.tension_scale import ForceUnit, number_text

WIDTH, BORDER = 340, 26  # width of the drawing, and its margin [px]
HEIGHTS: Final = (0, 74, 190)  # height of the drawing by the number of redundant cables [px]
BEYOND: Final = 0.5  # extension of the drawing of an unbounded polygon, relative to the size of its finite part


@dataclass(frozen=True, slots=True, eq=False)
class DotField:
    """Drawing of the feasible tensions."""

    polygon: TensionPolygon
    # corners of the drawing in coordinates of the null space [N], shape (h, r), r = 1 or 2; an unbounded polygon is
    # clipped
    corners: Array
    # limit of each side: side k goes from corner k to corner k + 1; for an interval, side k is corner k
    sides: tuple[Side | None, ...]
    low: Array  # lowest coordinates of the drawing [N], shape (r,)
    high: Array  # highest coordinates of the drawing [N], shape (r,)

    @classmethod
    def of(cls, snapshot: Snapshot, before: DotField | None = None) -> DotField | None:
        """Feasible tensions at the pose of `snapshot`, with the sag forces of the cables; None if there are none."""
        polygon = _polygon(snapshot)
        if polygon is None or not len(polygon.vertices):
            return None
        corners, sides, dot = polygon.vertices, polygon.sides, polygon.coordinates(snapshot.tension)
        low, high = _extent(polygon, dot) if before is None else (before.low, before.high)
        if not polygon.bounded:
            corners, sides = _clipped(corners, sides, low, high)
        return cls(polygon, locked(np.ascontiguousarray(corners)), sides, low, high)

    @property
    def redundant(self) -> int:
        """Number of redundant cables, 1 or 2."""
        return int(self.corners.shape[1])

    @property
    def height(self) -> int:
        """Height of the drawing [px]."""
        return HEIGHTS[self.redundant]

    @property
    def middle(self) -> Array:
        """Coordinates of the middle of the drawing [N], shape (r,)."""
        return np.asarray(0.5 * (self.low + self.high))

    @property
    def scale(self) -> float:
        """Pixels per newton."""
        inside = np.array([WIDTH, self.height])[: self.redundant] - 2.0 * BORDER
        return float(np.min(inside / np.maximum(self.high - self.low, 1e-9)))

    def place(self, at: Array) -> tuple[float, float]:
        """Position of coordinates (r,) in the drawing [px], from its upper left corner."""
        away = self.scale * (at - self.middle)
        return 0.5 * WIDTH + float(away[0]), 0.5 * self.height - float(away[1] if self.redundant > 1 else 0.0)

    def nearest(self, at: Array) -> Array:
        """Nearest feasible point to coordinates (r,)."""
        if self.redundant == 1:
            return np.clip(at, self.corners.min(axis=0), self.corners.max(axis=0))
        starts, ends = self.corners, np.roll(self.corners, -1, axis=0)
        along, away = ends - starts, at - starts
        if np.all(along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0] >= 0.0):  # corners are in counter-clockwise order
            return at
        length = np.maximum((along**2).sum(axis=1), np.finfo(np.float64).tiny)
        share = np.clip((along * away).sum(axis=1) / length, 0.0, 1.0)
        feet = starts + share[:, None] * along
        return np.asarray(feet[int(np.argmin(np.linalg.norm(feet - at, axis=1)))])

    def tension(self, at: Array) -> Array:
        """Chord tensions at coordinates (r,) [N], shape (m,)."""
        return np.maximum(self.polygon.origin + at @ self.polygon.basis, 0.0)


def _extent(polygon: TensionPolygon, dot: Array) -> tuple[Array, Array]:
    """Lowest and highest coordinates to draw (r,)."""
    if polygon.bounded:
        return polygon.vertices.min(axis=0), polygon.vertices.max(axis=0)
    known = np.array([side is not None for side in polygon.sides])
    if polygon.vertices.shape[1] == 2:
        known &= np.roll(known, 1)  # a corner of two limits, not of the box
    dots = [dot] * bool(np.isfinite(dot).all())
    points = np.vstack((polygon.vertices[known], *dots, np.zeros_like(dot)))
    low, high = points.min(axis=0), points.max(axis=0)
    size = float(np.max(high - low)) or float(np.abs(polygon.origin).max()) or 1.0
    return low - BEYOND * size, high + BEYOND * size


def _clipped(
    corners: Array, sides: tuple[Side | None, ...], low: Array, high: Array
) -> tuple[Array, tuple[Side | None, ...]]:
    """Part of a polygon within the box from `low` to `high`. The sides of the box do not count as limits."""
    if corners.shape[1] == 1:
        return np.clip(corners, low, high), sides
    for axis, sign, end in ((0, 1.0, high[0]), (0, -1.0, -low[0]), (1, 1.0, high[1]), (1, -1.0, -low[1])):
        inside = sign * corners[:, axis] <= end
        kept: list[Array] = []
        named: list[Side | None] = []
        for k, corner in enumerate(corners):
            after = (k + 1) % len(corners)
            if inside[k]:
                kept.append(corner)
                named.append(sides[k])
            if inside[k] != inside[after]:
                share = (sign * end - corner[axis]) / (corners[after][axis] - corner[axis])
                kept.append(corner + share * (corners[after] - corner))
                named.append(None if inside[k] else sides[k])
        corners, sides = np.array(kept).reshape(-1, 2), tuple(named)
    return corners, sides


NEAR: Final = 10.0  # closer marks are joined [px]


def grouped(marks: tuple[MethodMark, ...], field: DotField) -> list[tuple[tuple[float, float], list[MethodMark]]]:
    """Groups of `marks` at the same position, and these positions [px]. Only methods with a result have a mark."""
    known = [mark for mark in marks if not mark.missing]
    places = [field.place(field.polygon.coordinates(mark.tension)) for mark in known]
    return [(places[group[0]], [known[k] for k in group]) for group in shapes.grouped(np.array(places), NEAR)]


MOST_REDUNDANT: Final = 2  # largest number of redundant cables for which the feasible tensions are drawn
SHARING: Final = "sharing"  # topic of a chosen tension distribution method


def polygon_figure(
    snapshot: Snapshot, marks: tuple[MethodMark, ...] = (), field: DotField | None = None, back: str = ""
) -> str:
    """HTML: polygon with the chosen tensions; interval for one redundant cable; otherwise a sentence."""
    if remark := _why_not_drawn(snapshot):
        return sentence(remark)
    drawn = DotField.of(snapshot) if field is None else field
    if drawn is None:
        return sentence("No tensions within the limits balance the platform.")
    movable = field is not None
    figure = html_block(_drawing(snapshot, drawn, marks, movable=movable))
    return figure + sentence(_description(snapshot, drawn, movable=movable)) + _key(snapshot, marks, back)


def _why_not_drawn(snapshot: Snapshot) -> str:
    """Reason why the feasible tensions of a robot are not drawn; "" if they are."""
    redundant = snapshot.robot.cable_count - snapshot.robot.degrees_of_freedom
    if redundant > MOST_REDUNDANT:
        return f"{redundant} redundant cables: the feasible tensions cannot be drawn in a plane."
    return "No redundant cable: the force balance determines the tensions." if redundant <= 0 else ""


def _polygon(snapshot: Snapshot) -> TensionPolygon | None:
    plan = snapshot.plan
    if plan is None:
        return None
    robot, state = snapshot.robot, plan.state
    if snapshot.feasible:
        state = with_eyelets(state)  # at constant exit points, as the sag forces are constant
        robot = state.one_robot
        options = kernel_options(robot, state.cables.model, MinimumNorm())
        return polygon_at(robot, snapshot.pose, options, state.wrench, state.chord_tension, state.pull, feasible=True)
    try:
        return tension_polygon(robot, snapshot.pose, state.cables.model, state.wrench)
    except InvalidValueError:  # a pose without force balance
        return None


def _drawing(snapshot: Snapshot, field: DotField, marks: tuple[MethodMark, ...], *, movable: bool) -> str:
    corners, places = field.corners, [field.place(corner) for corner in field.corners]
    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
    if field.redundant == 2:
        area = f'<polygon points="{outline}" class="polygon"/>'
        names = "".join(_side(field, k, places[k], places[(k + 1) % len(corners)]) for k in range(len(corners)))
    else:
        area = f'<polyline points="{outline}" class="interval"/>'
        names = "".join(_end(field, k, places[k], places[1 - k]) for k in range(2))
    where = f' data-scale="{field.scale!r}" data-middle="{" ".join(map(repr, field.middle.tolist()))}"'
    kind = f'class="field" role="group" data-dot=""{where}' if movable else 'role="img"'
    return (
        f'<svg viewBox="0 0 {WIDTH} {field.height}" {kind} aria-label="feasible tensions">{area}{names}'
        f"{_marks(field, marks)}{_dot(snapshot, field, movable=movable)}</svg>"
    )


def _dot(snapshot: Snapshot, field: DotField, *, movable: bool) -> str:
    """The dot of the chosen tensions, clickable in an area as large as a finger; "" without tensions."""
    point = field.polygon.coordinates(snapshot.tension)
    if not np.isfinite(point).all():  # the method has no solution
        return ""
    x, y = field.place(point)
    dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5.5" class="dot"/>'
    if not movable:
        return dot
    text = ForceUnit.of(snapshot.robot).span(snapshot.tension)
    text += "" if snapshot.plan is None else f", {method_name(snapshot.plan.tension)}"
    share = (point[0] - field.low[0]) / max(float(field.high[0] - field.low[0]), 1e-9)
    return (
        '<g class="handle" tabindex="0" role="slider" aria-label="Tensions in the set of feasible ones" '
        f'aria-roledescription="slider of {field.redundant} dimensions" aria-valuemin="0" aria-valuemax="100" '
        f'aria-valuenow="{100.0 * share:.0f}" aria-valuetext="{escape(text)}">'
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="18" class="reach"/>{dot}</g>'
    )


def _marks(field: DotField, marks: tuple[MethodMark, ...]) -> str:
    """A mark with the letter of each tension distribution method; methods with equal results have a common mark."""
    parts = []
    for (x, y), group in grouped(marks, field):
        letters, names = "".join(mark.letter for mark in group), ", ".join(mark.name for mark in group)
        right, above = x < 0.7 * WIDTH, 5.0 if field.redundant == 2 else 10.0
        parts.append(
            f'<g class="way" {chosen_by(SHARING, group[0].name)}><title>{escape(names)}</title>'
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3"/>'
            f'<text x="{x + (6 if right else -6):.1f}" y="{y - above:.1f}" class="letter" '
            f'text-anchor="{"start" if right else "end"}">{letters}</text></g>'
        )
    return "".join(parts)


def _description(snapshot: Snapshot, field: DotField, *, movable: bool) -> str:
    unit = ForceUnit.of(snapshot.robot)
    how = "Drag the dot, or move it with the arrow keys." if movable else "Dot: the chosen tensions."
    if field.redundant == 1:
        ends = field.polygon.vertices[:, 0]
        point = float(field.polygon.coordinates(snapshot.tension)[0])
        span = f"{ends.min():.4g} to {ends.max():.4g} N" if np.isfinite(ends).all() else "unbounded"
        text = f"One redundant cable: λ may be {span}; chosen: {number_text(point, '.4g')} N."
        return f"{text} {how}" if movable else text
    if not field.polygon.bounded:
        return f"{how} Sides: limits of the cables; the set is unbounded at a side without a name."
    width, height = np.ptp(field.corners, axis=0)
    return f"{how} Sides: limits of the cables. Width {unit.written(width)}, height {unit.written(height)}."


def _key(snapshot: Snapshot, marks: tuple[MethodMark, ...], back: str) -> str:
    """The methods by their letters, as buttons; and the choice by hand, with a button to return to a method."""
    if not marks:
        return ""
    by_hand = snapshot.plan is not None and isinstance(snapshot.plan.tension, ByHand)
    parts = []
    for mark in marks:
        name = escape(mark.name)
        if mark.missing:
            parts.append(f'<span class="quiet" title="{escape(mark.missing)}">{mark.letter} {name}: none here</span>')
            continue
        chosen = mark.name == back and not by_hand
        parts.append(
            f'<button {chosen_by(SHARING, mark.name)} aria-pressed="{str(chosen).lower()}">'
            f"<b>{mark.letter}</b> {name}</button>"
        )
    remark = ""
    if by_hand:
        again = f" <button {chosen_by(SHARING, back)}>Back to {escape(back)}</button>" if back else ""
        kept = "at other poses, the feasible tensions that are nearest to these are used"
        remark = f'<div class="hand"><b>{BY_HAND.capitalize()}</b>: {kept}.{again}</div>'
    return html_block(f'{remark}<div class="ways">{"".join(parts)}</div>')


def _side(field: DotField, k: int, start: tuple[float, float], end: tuple[float, float]) -> str:
    """Name of side `k`, drawn outside of the polygon; "" for a short side, and for a side that is not a limit."""
    side = field.sides[k]
    if side is None or np.hypot(end[0] - start[0], end[1] - start[1]) < 22.0:
        return ""
    x, y = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    nx, ny = start[1] - end[1], end[0] - start[0]  # outward direction: corners are counter-clockwise, and y points down
    nx, ny = nx / np.hypot(nx, ny), ny / np.hypot(nx, ny)
    anchor = "start" if nx > 0.35 else "end" if nx < -0.35 else "middle"  # direction of the text away from its side
    x, y = x + 7.0 * nx, y + 9.0 * ny + 3.0
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{side.cable} {side.limit}</text>'


def _end(field: DotField, k: int, at: tuple[float, float], other: tuple[float, float]) -> str:
    """Name of the end `k` of an interval, drawn below the end; an arrow head if the end is unbounded."""
    side, (x, y) = field.sides[k], at
    if side is None:
        back = 8.0 if other[0] > x else -8.0
        return f'<path d="M{x + back:.1f} {y - 5:.1f}L{x:.1f} {y:.1f}L{x + back:.1f} {y + 5:.1f}" class="interval"/>'
    tick = f'<line x1="{x:.1f}" x2="{x:.1f}" y1="{y - 8:.1f}" y2="{y + 8:.1f}" class="interval"/>'
    return f'{tick}<text x="{x:.1f}" y="{y + 22:.1f}" text-anchor="middle">{side.cable} {side.limit}</text>'


DOT: Final = "dot"  # topic of the dot: {"at": coordinates [N]} or {"by": steps as shares of the drawing}
OVER: Final = 2e-3  # step beyond a side, as a share of the drawing
FARTHEST: Final = 1.0  # largest step, as a share of the drawing
FARTHEST_AIM: Final = 1e12  # largest coordinate of a drag [N]


class TensionsFeature(Feature):
    """Drawing of the feasible tensions, with a movable dot for the choice of tensions."""

    def __init__(self, page: Page) -> None:
        """Begin without a drawing."""
        self._panel = page.panel
        self._marks = MethodMarks()
        self._field: DotField | None = None  # drawing in which the dot moves
        self._key: tuple[object, ...] = ()  # key of the pose of the drawing
        self._aim: Array | None = None  # last chosen coordinates, (r,)
        page.channel.on(DOT, self._on_dot)
        page.channel.on(SHARING, self._on_method)

    def follow(self, view: View) -> None:
        """Draw the feasible tensions."""
        snapshot = view.snapshot
        before, self._field = self._field, None
        if not isinstance(snapshot, Snapshot):
            figure = sentence(snapshot.why_no_choice)
        elif view.played is not None or snapshot.plan is None or _why_not_drawn(snapshot):
            figure = polygon_figure(snapshot)
        else:
            state = snapshot.plan.state
            place = (state.pose.position.tobytes(), state.pose.quaternion.tobytes(), state.wrench.tobytes())
            key = (*place, view.settings.changes, type(state.cables.model))
            self._field = DotField.of(snapshot, before if key == self._key else None)
            if key != self._key or not isinstance(snapshot.plan.tension, ByHand):
                self._aim = None
            self._key = key
            if self._field is not None and self._aim is None:
                self._aim = self._field.polygon.coordinates(snapshot.tension)
            marks = self._marks.at(snapshot.plan) if self._field else ()
            figure = polygon_figure(snapshot, marks, self._field, self._panel.method_name)
        self._panel.polygon.content = figure

    def _on_dot(self, value: Any, _: int) -> None:
        """Move the dot by a drag or a step. Invalid and late messages are ignored."""
        field = self._field
        if field is None or not isinstance(value, dict):
            return
        at = finite_numbers(value.get("at"), field.redundant, FARTHEST_AIM)
        by = finite_numbers(value.get("by"), 2, FARTHEST_AIM)  # the page sends steps in both directions
        if at is None:
            if by is None or self._aim is None or not np.isfinite(self._aim).all():
                return
            at = self._aim + np.clip(by[: field.redundant], -FARTHEST, FARTHEST) * float(np.max(field.high - field.low))
        self._aim = field.nearest(at)
        away = at - self._aim
        if (far := float(np.linalg.norm(away))) > 0.0:  # a step outward: other sag forces move the sides slightly
            away *= min(1.0, OVER * float(np.max(field.high - field.low)) / far)
        self._panel.choose_by_hand(ByHand(target=field.tension(self._aim + away)))

    def _on_method(self, value: Any, _: int) -> None:
        if self._field is not None and isinstance(value, str) and value in METHODS:
            self._panel.method.value = value
