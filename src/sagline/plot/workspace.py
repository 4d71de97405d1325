"""Plots of a workspace: a slice with boundary, margins and limiting cables, and the hull around the robot."""

from __future__ import annotations

from collections.abc import Sequence
from math import floor, log10
from typing import Any, Final

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import BboxBase
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from scipy.ndimage import distance_transform_edt, label, minimum_filter

from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, Flags, Indices, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.plot.geometry import Find, cut_at_limits, view_axes
from sagline.plot.labels import PLACE, set_heading
from sagline.plot.robot import draw_robot, format_space_axes
from sagline.plot.sheet import GAP_COLOR, axes_or_new, format_axes, sheet
from sagline.plot.style import current
from sagline.robot.pose import Pose
from sagline.robot.reach import is_underconstrained
from sagline.viewer.tension_scale import CABLES, cable_color
from sagline.workspaces.levels import Plane, Slice, slice_of
from sagline.workspaces.region import AXES, flat_axis
from sagline.workspaces.workspace import BY_BOX, Workspace, amount_of, orientations_text

POINTS: Final = 200  # number of grid points along the longer side
LINES: Final = 5  # approximate number of contour lines of the margin
ROOM: Final = 11.0  # smallest half width of a region with a name [pt]
OUTSIDE: Final = to_rgba(GAP_COLOR, 0.35)
BESIDE: Final = 1e-6  # offset of a slice in a plane of symmetry, as a share of the distance to the end of the box
PALE: Final = 0.45  # share of a limit's color in the color of its region, which is mixed with white
Key = tuple[int, int]  # a limit: index of the criterion, and cable
Color = tuple[float, float, float]
HALO: Final = [patheffects.withStroke(linewidth=2.2, foreground="white")]
NEAR_SIDE, FAR_SIDE = 0.5, 0.22  # opacity of the hull in front of and behind the robot
FINEST: Final = 90  # number of cells along the longest side of the drawn hull; more cells would be slow and not visible
HEIGHT = 3.4  # [in]
WHOLE, ROBOT, BARS = (0.0, 0.0, 1.0, 0.94), (-0.02, 0.0, 0.7, 0.96), (0.78, 0.2, 0.19, 0.6)  # places in the sheet
ABOVE, BELOW = (-0.05, 0.42, 1.05, 0.52), (0.2, 0.1, 0.75, 0.3)  # position of the axes in a narrow sheet
MOST_LIMITS: Final = 10  # largest number of limits that have their own bar
REST: Final = "others"


def slice(space: Workspace, normal: str = "z", at: float | None = None, ax: Axes | None = None) -> Axes:
    """A slice through a workspace, perpendicular to a world axis.

    The bold line is the boundary of the workspace, computed from the criteria at the resolution of the slice.
    Inside, thin lines are contours of the margin [N]. Colors show which limit is reached first: the cable that limits
    the margin, or another criterion.

    Args:
        space: The workspace. Its robot, loads, orientations and criteria also apply to the slice.
        normal: Axis perpendicular to the slice: "x", "y" or "z".
        at: Coordinate on this axis [m]; None for the middle of the workspace.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If the slice is outside of the workspace's box. If `normal` is not the normal of a flat box.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> loads = sl.WrenchBox(force=50.0, moment=5.0)
        >>> space = sl.workspace(robot, wrenches=loads, cells=8)
        >>> axes = sl.plot.slice(space, "z", at=2.0)
    """
    plane = _plane(instance(space, Workspace, "space"), normal, at)
    low, high = space.box.low, space.box.high
    first, second = plane.axes
    size = high - low
    longest = max(size[first], size[second])
    shape = tuple(max(2, round(POINTS * float(size[axis] / longest))) for axis in plane.axes)
    # in a plane of symmetry, rounding errors would select one of two cables, so that a parallel plane is drawn
    beside = plane._replace(at=plane.at + BESIDE * float(high[plane.normal] - plane.at))
    cut = slice_of(space.levels().details, beside, low, high, (shape[0], shape[1]))
    ax = axes_or_new(ax, height=0.9 + 5.6 * float(np.clip(size[second] / size[first], 0.3, 1.3)))
    format_axes(ax, PLACE[first], PLACE[second])
    ax.grid(visible=False)
    ax.set_aspect("equal")
    ax.set(xlim=(low[first], high[first]), ylim=(low[second], high[second]))
    if not (cut.level >= 0.0).any():
        ax.set_facecolor(OUTSIDE)
        ax.text(0.5, 0.5, "outside the workspace", transform=ax.transAxes, ha="center", fontsize=current().label)
    else:
        levels = _round_levels(float(cut.margin[(cut.level >= 0.0) & np.isfinite(cut.margin)].max(initial=0.0)))
        _draw_regions(ax, cut, space, levels, _draw_lines(ax, cut, levels))
    place = f"{AXES[plane.normal]} = {n(plane.at, unit='m')}"
    set_heading(ax, f"{space.robot.name}, {place}; {space.wrenches}; {orientations_text(space)}")
    return ax


def _plane(space: Workspace, normal: str, at: float | None) -> Plane:
    """The plane of a slice. InvalidValueError if the plane is outside the box of the workspace."""
    axis = AXES.index(choice(normal, "normal", AXES))
    low, high = float(space.box.low[axis]), float(space.box.high[axis])
    flat = flat_axis(space.box)
    if flat is not None and flat[0] != axis:
        own = AXES[flat[0]]
        allowed = f"{own!r}, along which the box is flat"
        raise InvalidValueError("normal", repr(normal), allowed, f'Give normal="{own}".')
    if at is None:
        known = space.surface.vertices[:, axis] if len(space.surface.vertices) else np.array([low, high])
        return Plane(axis, float(np.clip(0.5 * (known.min() + known.max()), low, high)))
    place = number(at, "at", "m")
    if not low <= place <= high:
        raise InvalidValueError("at", f"{place:g} m", f"{low:g} to {high:g} m, the box", "Slice the box.")
    return Plane(axis, place)


def _limit_name(key: Key, space: Workspace) -> str:
    """Name of the limit `key`: a criterion, or the limiting cable if the criterion is the margin."""
    which, cable = key
    named = [space.criteria[which].title] if which > 0 or cable < 0 else []
    return ", ".join(named + [f"cable {cable}"] * (cable >= 0))


def _limit_colors(space: Workspace) -> dict[Key, Color]:
    """Colors of all possible limits. A limit has the same color in all figures of a workspace."""
    count = space.robot.cable_count
    colors = {(0, cable): cable_color(cable) for cable in range(-1, count)}
    others = [(which, cable) for which in range(1, len(space.criteria)) for cable in range(-1, count)]
    colors |= {key: CABLES[-1 - k % len(CABLES)] for k, key in enumerate(others)}
    return {key: (red / 255.0, green / 255.0, blue / 255.0) for key, (red, green, blue) in colors.items()}


def _limit_finder(space: Workspace, keys: Sequence[Key]) -> Find:
    """Function of positions (N, 3) [m] that gives the index in `keys` of the limit at each position."""
    details, index = space.levels().details, {key: k for k, key in enumerate(keys)}

    def find(positions: Array) -> Indices:
        found = details(positions)
        return np.array([index[key] for key in zip(found.criterion.tolist(), found.cable.tolist(), strict=True)])

    return find


def _draw_regions(ax: Axes, cut: Slice, space: Workspace, levels: Array, numbers: Sequence[Text]) -> None:
    """Fill the region of each limit with a pale color, and write its name, but not over `numbers`. Outside is gray."""
    ax.set_facecolor(OUTSIDE)
    inside = ax.contourf(cut.across, cut.up, cut.level, levels=[0.0, np.inf], colors=["white"], zorder=0.8)
    shades, codes = _limit_colors(space), np.stack((cut.criterion, cut.cable), axis=-1)
    keys = list(shades)
    region = np.array([keys.index((int(which), int(cable))) for which, cable in codes.reshape(-1, 2)])
    colors = PALE * np.array(list(shades.values())) + 1.0 - PALE
    region = region.reshape(cut.level.shape)
    image = ax.pcolormesh(cut.across, cut.up, colors[region], shading="nearest", rasterized=True, zorder=0.9)
    corners, own = _triangles_at_borders(cut, region, _limit_finder(space, keys))
    borders = PolyCollection(
        list(corners), facecolors=colors[own], edgecolors="none", antialiased=False, rasterized=True, zorder=0.91
    )
    ax.add_collection(borders, autolim=False)
    for drawn in (image, borders):
        drawn.set_clip_path(inside.get_paths()[0], ax.transData)
    figure: Any = ax.get_figure(root=True)
    figure.draw_without_rendering()  # the layout determines the size of the slice on the sheet
    boxes: list[BboxBase] = [number.get_window_extent() for number in numbers]
    free = (cut.level >= 0.0) & ~_on_lines(cut.margin, levels)
    for k in np.unique(region):
        name = _limit_name(keys[k], space)
        boxes += _name_region(ax, cut, (region == k) & (cut.level >= 0.0), free, name, boxes)


def _triangles_at_borders(cut: Slice, region: Indices, find: Find) -> tuple[Array, Indices]:
    """Triangles (U, 3, 2) of cells with several limits, divided where the limit changes, and their limits (U,)."""
    rows, columns = region.shape
    place = np.arange(region.size).reshape(rows, columns)
    cells = np.stack((place[:-1, :-1], place[:-1, 1:], place[1:, 1:], place[1:, :-1]), axis=-1).reshape(-1, 4)
    limits = region.ravel()[cells]
    cells = cells[(limits != limits[:, :1]).any(axis=1)]
    triangles = np.concatenate((cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]))

    def find_in_plane(points: Array) -> Indices:
        positions = np.full((len(points), 3), cut.plane.at)
        positions[:, cut.plane.axes] = points
        return find(positions)

    points = np.stack(np.meshgrid(cut.across, cut.up), axis=-1).reshape(-1, 2)
    return cut_at_limits(points, triangles, region.ravel(), find_in_plane)


def _on_lines(margin: Array, levels: Array) -> Flags:
    """Grid points next to a contour line of the margin."""
    band = np.searchsorted(levels, margin)
    passed = np.zeros(margin.shape, dtype=bool)
    passed[:, 1:] |= band[:, 1:] != band[:, :-1]
    passed[1:] |= band[1:] != band[:-1]
    return passed


def _name_region(
    ax: Axes, cut: Slice, within: Flags, free: Flags, name: str, boxes: Sequence[BboxBase]
) -> list[BboxBase]:
    """Write `name` in the middle of each large part of a region, without overlap. Returns the boxes of the names."""
    parts, count = label(within)
    figure: Any = ax.get_figure(root=True)
    points = ax.bbox.width * 72.0 / figure.dpi / cut.across.size
    look: dict[str, Any] = {"ha": "center", "va": "center", "path_effects": HALO, "zorder": 3.0}
    written = ax.text(0.0, 0.0, name, fontsize=current().tick, **look)
    toward = ax.transData.inverted()
    half = 0.5 * np.ptp(written.get_window_extent().transformed(toward).get_points(), axis=0)
    written.remove()
    clear = np.ones(within.shape, dtype=bool)
    for box in boxes:
        low, high = box.transformed(toward).get_points() + np.outer((-1.0, 1.0), half)
        across = (low[0] < cut.across) & (cut.across < high[0])
        clear &= ~np.outer((low[1] < cut.up) & (cut.up < high[1]), across)
    names: list[BboxBase] = []
    box = 2 * np.ceil(half[::-1] / (cut.up[1] - cut.up[0], cut.across[1] - cut.across[0])).astype(int) + 1
    for part in range(1, count + 1):
        within = parts == part
        fits = minimum_filter(within, tuple(box), mode="constant")
        for area, room in ((fits & free & clear, 0.0), (fits & clear, 0.0), (within & free & clear, ROOM)):
            depth = distance_transform_edt(np.pad(area, 1))[1:-1, 1:-1]
            row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
            if points * depth[row, column] > room:
                place = cut.across[column], cut.up[row]
                names.append(ax.text(*place, name, fontsize=current().tick, **look).get_window_extent())
                break
    return names


def _draw_lines(ax: Axes, cut: Slice, levels: Array) -> Sequence[Text]:
    """Draw the boundary, and inside it contour lines of the margin. Returns the numbers at the contour lines."""
    numbers: Sequence[Text] = ()
    if levels.size:
        margin = np.ma.masked_where((cut.level < 0.0) | ~np.isfinite(cut.margin), cut.margin)
        drawn = ax.contour(cut.across, cut.up, margin, levels=levels, colors="0.25", linewidths=0.7, zorder=2.0)
        numbers = ax.clabel(drawn, fmt=lambda value: n(value, unit="N"), fontsize=current().tick, inline_spacing=3)
        for number in numbers:
            number.set_path_effects([*HALO])
    ax.contour(cut.across, cut.up, cut.level, levels=[0.0], colors="black", linewidths=2.2, zorder=2.5)
    return numbers


def _round_levels(largest: float) -> Array:
    """About `LINES` round values of the margin, above 0 and up to the largest margin."""
    if not np.isfinite(largest) or largest <= 0.0:
        return np.empty(0)
    coarse = largest / LINES
    power = 10.0 ** floor(log10(coarse))
    step = min(times * power for times in (1.0, 2.0, 5.0, 10.0) if times * power >= coarse * (1.0 - 1e-9))
    return np.arange(step, largest * (1.0 + 1e-9), step)


def workspace(space: Workspace) -> Figure:
    """The hull of a workspace around its robot, and its limits.

    The color of a face shows its limit: the cable that limits the margin, or another criterion. Faces on the box of the
    workspace are gray. Bars show the share of each limit. A plane workspace is drawn as a slice.

    Args:
        space: The workspace.

    Returns:
        The figure.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> loads = sl.WrenchBox(force=50.0, moment=5.0)
        >>> space = sl.workspace(robot, wrenches=loads, cells=8)
        >>> figure = sl.plot.workspace(space)
    """
    flat = flat_axis(instance(space, Workspace, "space").box)
    if flat is not None:
        return slice(space, AXES[flat[0]]).get_figure(root=True)  # type: ignore[return-value] # a new figure
    limits, narrow = space.limits, current().narrow
    figure = sheet(height=2.3 * HEIGHT if limits and narrow else HEIGHT)
    figure.set_layout_engine("none")  # the layout of Matplotlib does not include the extent of 3D axes
    ax: Any = figure.add_axes((ABOVE if narrow else ROBOT) if limits else WHOLE, projection="3d")
    colors = _limit_colors(space)
    _, points = draw_robot(ax, space.robot, _place(space), "0.4")
    _draw_hull(ax, space, colors)
    points = np.concatenate((points, space.surface.vertices))
    format_space_axes(ax, points, "")
    sides = [np.ptp(ends) for ends in (ax.get_xlim(), ax.get_ylim(), ax.get_zlim())]
    ax.set_box_aspect(sides, zoom=0.78 if narrow else 1.0)
    for each in ax.get_children():
        each.set_clip_on(False)
    set_heading(figure, f"{space.robot.name}: {amount_of(space)}; {space.wrenches}; {orientations_text(space)}")
    if limits:
        _draw_bars(figure.add_axes(BELOW if narrow else BARS), space, colors)
    return figure


def _place(space: Workspace) -> Pose:
    """A pose in the workspace: the middle of the robot's test box, or the grid point with the largest margin."""
    box, turn = space.robot.test_box, space.orientations.quaternion[0]
    if box is not None and space.levels()(0.5 * (box.low + box.high)[None])[0] >= 0.0:
        return Pose.from_quaternion(0.5 * (box.low + box.high), turn)
    deepest = np.unravel_index(int(np.argmax(space.level)), space.level.shape)
    pose = Pose.from_quaternion([float(axis[k]) for axis, k in zip(space.axes, deepest, strict=True)], turn)
    if not is_underconstrained(space.robot):
        return pose
    return inverse(space.robot, pose, given=space.given).state.pose


def _draw_hull(ax: Axes3D, space: Workspace, colors: dict[Key, Color]) -> None:
    """Draw the faces of the hull in the colors of their limits, divided where the limit changes."""
    chosen, faces = _coarser(space.surface.vertices, space.surface.faces)
    if not len(faces):
        return
    vertices, keys, find = space.surface.vertices[chosen], list(colors), _limit_finder(space, list(colors))
    known = space.limiting[chosen] != BY_BOX
    free = faces[known[faces].any(axis=1)]
    limit = np.zeros(len(vertices), dtype=np.int64)
    used = np.unique(free)
    limit[used] = find(vertices[used])
    corners, codes = cut_at_limits(vertices, free, limit, find)
    shades = np.array([colors[key] for key in keys])[codes]
    walls = vertices[faces[~known[faces].any(axis=1)]]
    corners = np.concatenate((corners, walls))
    shades = np.concatenate((shades, np.tile(to_rgb(GAP_COLOR), (len(walls), 1))))
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    toward = view_axes(*np.radians([ax.azim, ax.elev]))[2]
    for there, opacity, order in ((normals @ toward <= 0.0, FAR_SIDE, 1.6), (normals @ toward > 0.0, NEAR_SIDE, 2.2)):
        shown = Poly3DCollection(corners[there], facecolors=shades[there], alpha=opacity, linewidth=0.0, zorder=order)
        shown.set_rasterized(True)
        ax.add_collection3d(shown)


def _coarser(vertices: Array, faces: Indices) -> tuple[Indices, Indices]:
    """A simplified mesh for print with one corner per cell of a grid: indices of the kept corners, and new faces."""
    if not len(faces):
        return np.empty(0, dtype=np.int64), faces
    low = vertices.min(axis=0)
    width = float(np.ptp(vertices, axis=0).max()) / FINEST
    cells = np.floor((vertices - low) / width).astype(np.int64)
    _, first, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    joined = which.reshape(-1)[faces]
    return first, joined[(joined != np.roll(joined, 1, axis=1)).all(axis=1)]


def _draw_bars(ax: Axes, space: Workspace, colors: dict[Key, Color]) -> None:
    """Draw the shares of the limits in the surface as bars. The largest share is at the top."""
    shown = {(limit.number, limit.cable): 100.0 * limit.share for limit in space.limits}
    bars = [(_limit_name(key, space), share, colors[key]) for key, share in shown.items()]
    if len(bars) > MOST_LIMITS:
        rest = sum(share for _, share, _ in bars[MOST_LIMITS - 1 :])
        bars = [*bars[: MOST_LIMITS - 1], (REST, rest, to_rgb(GAP_COLOR))]
    names, shares, shades = zip(*bars, strict=True)
    drawn = ax.barh(range(len(bars)), shares, color=shades, alpha=0.75, height=0.7)
    ax.bar_label(drawn, fmt="%.0f %%", fontsize=current().tick, padding=2.0)
    ax.set_yticks(range(len(bars)), labels=names, fontsize=current().tick)
    ax.invert_yaxis()
    ax.set_xlabel("share of the boundary [%]", fontsize=current().label, x=1.0, ha="right")
    ax.set_xlim(0.0, 1.25 * max(shares))
    ax.tick_params(labelsize=current().tick, length=3.0, width=0.6)
    ax.spines[["top", "right"]].set_visible(False)
