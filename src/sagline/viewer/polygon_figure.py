"""The feasible tensions of one pose as a small drawing (SVG) in the null space of two redundant cables."""

from __future__ import annotations

import numpy as np

from sagline.arrays import Array
from sagline.errors import InvalidValueError
from sagline.kinematics.polygon import tension_polygon
from sagline.tension.polygon import TensionPolygon
from sagline.viewer.readout import LATER, block, force_unit, sentence
from sagline.viewer.snapshot import Snapshot
from sagline.viewer.wording import ForceUnit, number

MOST_REDUNDANT = 2  # dimensions of a drawing
WIDTH, HEIGHT, BORDER = 340, 190, 26  # px


def polygon_figure(snapshot: Snapshot) -> str:
    """HTML: the polygon with the chosen tensions in it; for one redundant cable the interval; else a sentence."""
    redundant = snapshot.robot.cable_count - snapshot.robot.degrees_of_freedom
    if redundant > MOST_REDUNDANT:
        return sentence(f"{redundant} redundant cables: their feasible tensions have no picture in a plane.")
    if redundant == 0:
        return sentence("As many cables as freedoms: the balance leaves nothing to choose.")
    polygon = _polygon(snapshot)
    if polygon is None or not len(polygon.vertices):
        return sentence("No tensions within the limits balance the platform: there is nothing to choose from.")
    point = polygon.coordinates(snapshot.tension)
    unit = force_unit(snapshot.robot)
    if redundant == 1:
        return _interval(polygon.vertices[:, 0], float(point[0]))
    return _drawing(polygon, point, unit)


def polygon_later() -> str:
    """HTML: that the polygon is not there yet."""
    return sentence(LATER.capitalize())


def _polygon(snapshot: Snapshot) -> TensionPolygon | None:
    if snapshot.plan is None:
        return None
    state = snapshot.plan.state
    try:
        return tension_polygon(snapshot.robot, snapshot.pose, state.cables.model, state.wrench)
    except InvalidValueError:  # a pose without a balance
        return None


def _drawing(polygon: TensionPolygon, point: Array, unit: ForceUnit) -> str:
    corners = polygon.vertices
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = float(np.min((np.array([WIDTH, HEIGHT]) - 2 * BORDER) / np.maximum(high - low, 1e-9)))
    middle = 0.5 * (low + high)

    def place(at: Array) -> tuple[float, float]:
        x, y = scale * (at - middle)
        return 0.5 * WIDTH + float(x), 0.5 * HEIGHT - float(y)

    outline = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(place, corners))
    sides = "".join(
        _side(polygon, k, place(corners[k]), place(corners[(k + 1) % len(corners)])) for k in range(len(corners))
    )
    dot = ""
    if np.isfinite(point).all():  # no tensions were chosen where the way of sharing found none
        x, y = place(point)
        dot = f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" class="dot"/>'
    drawing = (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="polygon of feasible tensions">'
        f'<polygon points="{outline}" class="polygon"/>{sides}{dot}</svg>'
    )
    extent = f"Width {unit.written(high[0] - low[0])}, height {unit.written(high[1] - low[1])}."
    return block(drawing) + sentence(f"Dot: the chosen tensions. Sides: the limit that each is. {extent}")


def _side(polygon: TensionPolygon, k: int, start: tuple[float, float], end: tuple[float, float]) -> str:
    """The name of a side, outside of it; none for a side that is too short to name, or no limit."""
    side = polygon.sides[k]
    if side is None or np.hypot(end[0] - start[0], end[1] - start[1]) < 22.0:
        return ""
    x, y = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    nx, ny = start[1] - end[1], end[0] - start[0]  # outward: corners go around counter-clockwise, and y points down
    nx, ny = nx / np.hypot(nx, ny), ny / np.hypot(nx, ny)
    anchor = "start" if nx > 0.35 else "end" if nx < -0.35 else "middle"  # the text leaves its side, not along it
    x, y = x + 7.0 * nx, y + 9.0 * ny + 3.0
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{side.cable} {side.limit}</text>'


def _interval(ends: Array, point: float) -> str:
    low, high = float(ends.min()), float(ends.max())
    return sentence(f"One redundant cable: λ may be {low:.4g} to {high:.4g} N; chosen: {number(point, '.4g')} N.")
