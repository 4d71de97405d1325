"""Where a robot can work, as a figure: the hull around the robot, and what limits it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import to_rgb
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

from sagline.core.arguments import instance
from sagline.plot.names import wrapped
from sagline.plot.robot import draw_robot, dress_space
from sagline.plot.sheet import GAP_COLOR, sheet
from sagline.plot.slice import limit_colors, limit_name, slice
from sagline.plot.style import current
from sagline.robot.pose import Pose
from sagline.workspaces.region import AXES, flat_axis
from sagline.workspaces.space import BY_BOX, Workspace, amount_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from mpl_toolkits.mplot3d.axes3d import Axes3D

    from sagline.core.arrays import Array, Indices
    from sagline.plot.slice import Key

NEAR_SIDE, FAR_SIDE = 0.5, 0.22  # opacity of the hull before and behind the robot
FINEST: Final = 90  # cells along the longest side of the hull as it is drawn: more is not seen, and takes long
HEIGHT, ZOOM = 3.4, 1.0  # in; and how large the robot stands in its axes
WHOLE, ROBOT, BARS = (0.0, 0.0, 1.0, 0.94), (-0.02, 0.0, 0.7, 0.96), (0.78, 0.2, 0.19, 0.6)  # of the sheet
ABOVE, BELOW = (-0.05, 0.42, 1.1, 0.52), (0.2, 0.1, 0.75, 0.3)  # the same where nothing fits beside anything
MOST_LIMITS: Final = 10  # that have a bar of their own
REST: Final = "others"


def workspace(space: Workspace) -> Figure:
    """The hull of a workspace around its robot, and what limits it.

    Faces have the color of the limit that is in the way there, of the margin its cable, of other criteria their names;
    they are gray where the box of the workspace cuts it off. The bars beside are shares of the surface. In a plane the
    slice is drawn: it is all there is.

    Args:
        space: The workspace.

    Returns:
        The figure.

    Raises:
        InvalidValueError: If it is no workspace.
    """
    flat = flat_axis(instance(space, Workspace, "space").box)
    if flat is not None:
        return slice(space, AXES[flat[0]]).get_figure(root=True)  # type: ignore[return-value] # a new figure
    limits, narrow = space.limits, current().narrow
    figure = sheet(height=2.3 * HEIGHT if limits and narrow else HEIGHT)
    figure.set_layout_engine("none")  # none knows how much of its axes a robot in space takes
    ax: Any = figure.add_axes((ABOVE if narrow else ROBOT) if limits else WHOLE, projection="3d")
    colors = limit_colors(space)
    _, points = draw_robot(ax, space.robot, _place(space), "0.4")
    _draw_hull(ax, space, colors)
    points = np.concatenate((points, space.surface.vertices))
    dress_space(ax, points, "")
    ax.set_box_aspect([np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim()), np.ptp(ax.get_zlim())], zoom=ZOOM)
    for each in ax.get_children():
        each.set_clip_on(False)
    told = f"{space.robot.name}: {amount_of(space)}; {space.wrenches}; {space.orientations}"
    figure.suptitle(wrapped(told, current().label), fontsize=current().label)
    if limits:
        _draw_bars(figure.add_axes(BELOW if narrow else BARS), space, colors)
    return figure


def _place(space: Workspace) -> Pose:
    """A pose inside: the middle of the robot's test box, or else the point of the grid that is deepest inside."""
    box, turn = space.robot.test_box, space.orientations.quaternion[0]
    if box is not None and space.levels()(0.5 * (box.low + box.high)[None])[0] >= 0.0:
        return Pose.from_quaternion(0.5 * (box.low + box.high), turn)
    deepest = np.unravel_index(int(np.argmax(space.level)), space.level.shape)
    return Pose.from_quaternion([float(axis[k]) for axis, k in zip(space.axes, deepest, strict=True)], turn)


def _draw_hull(ax: Axes3D, space: Workspace, colors: dict[Key, tuple[float, float, float]]) -> None:
    """Its faces, each in the color of the corner that decides."""
    vertices, faces, first = _coarser(space.surface.vertices, space.surface.faces)
    if not len(faces):
        return
    kinds = list(zip(space.limiting[first].tolist(), space.limiting_cable[first].tolist(), strict=True))
    shades = np.array([to_rgb(GAP_COLOR) if kind[0] == BY_BOX else colors[kind] for kind in kinds])
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    turn, up = np.radians([ax.azim, ax.elev])
    toward = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
    for there, opacity, order in ((normals @ toward <= 0.0, FAR_SIDE, 1.6), (normals @ toward > 0.0, NEAR_SIDE, 2.2)):
        shown = Poly3DCollection(corners[there], facecolors=shades[there], alpha=opacity, linewidth=0.0, zorder=order)
        shown.set_rasterized(True)
        ax.add_collection3d(shown)


def _coarser(vertices: Array, faces: Indices) -> tuple[Array, Indices, Indices]:
    """A mesh with as many faces as a sheet shows: corners in one cell of a grid become one.

    Returns:
        Corners (V, 3), faces (F, 3), and of each face a corner of the mesh as it was, shape (F,).
    """
    if not len(faces):
        return vertices, faces, np.empty(0, dtype=np.int64)
    low = vertices.min(axis=0)
    width = float(np.ptp(vertices, axis=0).max()) / FINEST
    cells = np.floor((vertices - low) / width).astype(np.int64)
    _, first, which = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    joined = which.reshape(-1)[faces]
    kept = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return vertices[first], joined[kept], faces[kept, 0]


def _draw_bars(ax: Axes, space: Workspace, colors: dict[Key, tuple[float, float, float]]) -> None:
    """The shares of the surface, the largest at the top."""
    keys = [(limit.number, limit.cable) for limit in space.limits]
    bars = [
        (limit_name(key, space), 100.0 * limit.share, colors[key])
        for key, limit in zip(keys, space.limits, strict=True)
    ]
    if len(bars) > MOST_LIMITS:
        rest = sum(share for _, share, _ in bars[MOST_LIMITS - 1 :])
        bars = [*bars[: MOST_LIMITS - 1], (REST, rest, to_rgb(GAP_COLOR))]
    names, shares, shades = zip(*bars, strict=True)
    drawn = ax.barh(range(len(bars)), shares, color=shades, alpha=0.75, height=0.7)
    ax.bar_label(drawn, fmt="%.0f %%", fontsize=current().tick, padding=2.0)
    ax.set_yticks(range(len(bars)), labels=names, fontsize=current().tick)
    ax.invert_yaxis()
    ax.set_xlabel("share of the boundary [%]", fontsize=current().label)
    ax.set_xlim(0.0, 1.25 * max(shares))
    ax.tick_params(labelsize=current().tick, length=3.0, width=0.6)
    ax.spines[["top", "right"]].set_visible(False)
