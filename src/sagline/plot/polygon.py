"""The polygon of feasible tensions, with the tensions of distribution methods as marks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any, TypeAlias, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.textpath import TextPath
from numpy.typing import ArrayLike

from sagline.core.arguments import instance
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.plot.labels import name_lines, write_beside
from sagline.plot.sheet import COLORS, GAP_COLOR, axes_or_new, format_axes, sheet
from sagline.plot.style import current
from sagline.tension.polygon import TensionPolygon
from sagline.viewer.shapes import grouped

MARKERS = "osD^v<>phXP*"
LARGEST, LEAST = 11.0, 4.0  # sizes of the first and of the last mark at a place [pt]
SAME = 1e-6  # marks closer than this share of the polygon's extent count as equal
CLOSE = 0.06  # marks closer than this share of the extent are also drawn in a second, enlarged panel
AROUND = 1.6  # width of the enlarged part, relative to the extent of its marks
SIZE, ENLARGED = 5.8, 2.6  # heights of the panels [in]
LONGEST = 48  # largest number of letters per line for the names of equal marks
POINT = 1.0 / 72.0  # [in]
TRIES, SPARE = 5, 0.03  # largest number of iterations that enlarge the axes, and relative enlargement per iteration
SHORT = 1e-9  # a side that is shorter than this share of the longest side has no direction of its own
GAP = 4.0  # distance between a side and its name [pt]


def polygon(shape: TensionPolygon, points: Mapping[str, ArrayLike] | None = None, ax: Axes | None = None) -> Axes:
    """The feasible polygon in coordinates of the null space, with the name of the limit at each side.

    Args:
        shape: The polygon from `tension_polygon`, for two redundant cables.
        points: Chord tensions (m,) by name. Each becomes a mark in the polygon, except tensions with NaN. Equal
            tensions have a common mark with all their names. None: no marks.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If the polygon `shape` is empty. If `points` are not tensions of its cables.

    Examples:
        >>> import sagline as sl
        >>> polygon = sl.tension_polygon(sl.load_robot("cogiro"), (1.0, 0.5, 2.0))
        >>> axes = sl.plot.polygon(polygon)
    """
    if instance(shape, TensionPolygon, "shape").vertices.shape[1] != 2 or len(shape.vertices) == 0:
        value = f"{len(shape.vertices)} points with {shape.vertices.shape[1]} coordinates"
        step = "Choose a feasible pose of a robot with n + 2 cables."
        raise InvalidValueError("polygon", value, "a polygon of two redundant cables", step)
    points = instance({} if points is None else points, Mapping, "points")  # type: ignore[type-abstract]
    places = {str(name): shape.coordinates(tensions) for name, tensions in points.items()}
    if wrong := [name for name, place in places.items() if place.ndim != 1]:
        item, allowed = f"points[{wrong[0]!r}]", "the tensions of one pose"
        raise InvalidValueError(item, "a batch of tensions", allowed, "Give each pose a name.")
    corners = np.asarray(shape.vertices)
    extent = float(np.ptp(corners, axis=0).max())
    groups = _equal_places(places, SAME * extent)
    panels = _panels([place for place, _ in groups], CLOSE * extent) if ax is None else [axes_or_new(ax)]
    for panel in panels:
        panel.fill(*corners.T, facecolor=GAP_COLOR, alpha=0.25, edgecolor="none")
        for k, side in enumerate(shape.sides):
            ends = corners[[k, (k + 1) % len(corners)]]
            panel.plot(*ends.T, color="0.3", linewidth=1.0, linestyle="-" if side else ":")
        _draw_places(panel, groups)
        format_axes(panel, r"$\lambda_1$ [N]", r"$\lambda_2$ [N]")
        panel.set_aspect("equal")
    panels[0].margins(x=0.33, y=0.16)  # space for the names
    if groups:
        name_lines(panels[0])
    _name_sides(panels[0], shape, corners)
    return panels[0]


def _panels(places: Sequence[Array], near: float) -> list[Axes]:
    """Axes of a new figure: one for the polygon, and one for the enlarged part if marks are close together."""
    near_each = [[other for other in places if np.linalg.norm(other - place) < near] for place in places]
    cluster = max(near_each, key=len, default=[])
    several = len(cluster) > 1
    figure = sheet(SIZE + ENLARGED * several)
    if not several:
        figure.set_layout_engine("compressed")  # axes with equal scales need this setting
        return [figure.add_subplot()]
    panels: list[Axes] = list(figure.subplots(2, 1, height_ratios=(SIZE, ENLARGED)))
    low, high = (end(cluster, axis=0) for end in (np.min, np.max))
    half = 0.5 * float((high - low).max()) * AROUND
    for axis, middle in zip("xy", 0.5 * (low + high), strict=True):
        panels[1].set(**{f"{axis}lim": (middle - half, middle + half)})
    panels[1].set_title("enlarged", fontsize=current().tick)
    return panels


def _draw_places(ax: Axes, groups: Sequence[tuple[Array, list[str]]]) -> None:
    """Draw empty marks of decreasing size, so that marks at the same place are one inside the other."""
    for k, (place, names) in enumerate(groups):
        color, marker = COLORS[k % len(COLORS)], MARKERS[k % len(MARKERS)]
        size = LARGEST - (LARGEST - LEAST) * k / max(len(groups) - 1, 1)
        look: dict[str, Any] = {"markersize": size, "markerfacecolor": "none", "markeredgewidth": 1.3}
        ax.plot(*place, marker, color=color, linestyle="none", label=fill(", ".join(names), LONGEST), **look)


def _equal_places(places: Mapping[str, Array], least: float) -> list[tuple[Array, list[str]]]:
    """Places that are farther apart than `least`. Each has the names of all `places` that are closer to it."""
    names = [name for name, place in places.items() if np.isfinite(place).all()]
    known = np.array([places[name] for name in names])
    return [(known[group[0]], [names[k] for k in group]) for group in grouped(known, least)]


# name of a side: text, middle of the side [N], offset and half size of the name [pt], True if moved outward
_Name: TypeAlias = "tuple[str, Array, Array, Array, bool]"


def _name_sides(ax: Axes, shape: TensionPolygon, corners: Array) -> None:
    """Write the names of the sides, and enlarge the axes until all names are inside."""
    figure = cast(Figure, ax.get_figure(root=True))
    for _ in range(TRIES):
        figure.draw_without_rendering()  # the layout determines the size of the polygon on the sheet
        scale = ax.bbox.width / (figure.dpi * POINT) / float(np.ptp(ax.get_xlim()))  # points per newton
        names = _names(shape, corners, scale)
        reach = [middle + (away + sign * half) / scale for _, middle, away, half, _ in names for sign in (-1, 1)]
        seen = np.array([ax.get_xlim(), ax.get_ylim()]).T
        wanted = np.array([np.min([seen[0], *reach], axis=0), np.max([seen[1], *reach], axis=0)])
        if np.array_equal(wanted, seen):
            break
        wanted += (wanted != seen) * np.array([[-SPARE], [SPARE]]) * np.ptp(wanted, axis=0)
        ax.set(xlim=wanted[:, 0], ylim=wanted[:, 1])
    line = {"arrowstyle": "-", "color": "0.75", "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 2.0}
    for text, middle, away, _, moved in names:
        write_beside(ax, text, middle, away, color="0.3", arrowprops=line if moved else None)


def _names(shape: TensionPolygon, corners: Array, scale: float) -> list[_Name]:
    """Place each name outside of its side, where a convex polygon has no lines. Overlapping names are moved outward."""
    names: list[_Name] = []
    size = current().tick
    normals = _normals(corners)
    for k, side in enumerate(shape.sides):
        if side is None:
            continue
        text, middle = f"cable {side.cable} {side.limit}", 0.5 * (corners[k] + corners[(k + 1) % len(corners)])
        out = normals[k]
        half = 0.5 * np.array([TextPath((0.0, 0.0), text, size=size).get_extents().width + 4.0, 1.3 * size])
        away = least = GAP + half @ np.abs(out)  # at this distance, the whole box of the name is outside of the line
        while any(
            np.all(np.abs(scale * (middle - other) + away * out - place) < half + size_of_other + 1.0)
            for _, other, place, size_of_other, _ in names
        ):
            away += 0.5 * size
        names.append((text, middle, away * out, half, bool(away > least)))
    return names


def _normals(corners: Array) -> Array:
    """Outward directions (h, 2) of the sides. A side of zero length has the mean direction of its neighbors."""
    along = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(along, axis=1)
    long = np.flatnonzero(lengths > SHORT * lengths.max())
    if long.size == 0:
        return np.tile((0.0, 1.0), (len(corners), 1))
    normals = np.zeros_like(along)
    normals[long] = np.column_stack((along[long, 1], -along[long, 0])) / lengths[long, None]  # counter-clockwise
    for k in set(range(len(corners))) - set(long.tolist()):
        place = int(np.searchsorted(long, k))
        between = normals[long[place - 1]] + normals[long[place % long.size]]
        tip = along[long[place - 1]] / lengths[long[place - 1]]
        normals[k] = between / size if (size := np.linalg.norm(between)) > SHORT else tip
    return normals
