"""A robot in space: cables as catenaries, pulleys, drums, frame, platform and ground."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, LogNorm
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from mpl_toolkits.mplot3d.axes3d import Axes3D
from scipy.spatial import ConvexHull

from sagline.core.arguments import instance, optional
from sagline.core.arrays import Array
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.plot.labels import PLACE
from sagline.plot.sheet import VERMILLION, color_bar, sheet
from sagline.plot.style import current
from sagline.robot.batch import on_platform, points_on_pulleys, pulley_radius
from sagline.robot.pose import Pose, PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.viewer import shapes
from sagline.viewer.tension_scale import TensionScale

POINTS = 50  # points around each pulley
FLAT = 1e-6  # the shadow of a platform that is thinner than this share of the robot's size is a line
FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))  # seen from outside
FRAME_COLOR, FLOOR_COLOR, SHADOW_COLOR, WHEEL_COLOR = "0.5", "0.955", "0.82", "0.4"
SAME_PLACE = 0.04  # anchors that are closer than this share of the robot's size have a common label
HALO = [patheffects.withStroke(linewidth=2.0, foreground="white")]
LABEL_DISTANCE = 0.045  # distance of a label outward from its anchor, as a share of the robot's size


def drawn_pose(robot: Robot, pose: PoseLike | None) -> Pose:
    """`pose`, by default the middle of the robot's test box. InvalidValueError for a batch, or if both are missing."""
    if pose is not None:
        return single_pose(pose)
    if robot.test_box is None:
        raise InvalidValueError("pose", "missing", "a single pose, because the robot has no test box", "Give one pose.")
    return Pose(0.5 * (robot.test_box.low + robot.test_box.high))


class Stroke(NamedTuple):
    """A line in a figure of a robot. Visible parts of a line are drawn over lines with a smaller `order`."""

    points: Array  # in the world [m], shape (P, 3)
    color: Any
    width: float  # [pt]
    style: Any
    order: float
    covers: bool = False  # True if it hides lines behind it


def strokes(robot: Robot, pose: Pose, plan: Plan | None) -> tuple[list[Stroke], list[Stroke]]:
    """Lines of cables, pulleys, drums, frame and platform at `pose`. Cables have the colors of their tensions."""
    # A cable without a tension is straight, dashed and gray.
    state = plan.state if plan is not None and plan.feasible else None
    tension = np.full(robot.cable_count, np.nan) if plan is None else plan.chord_tension
    colors = TensionScale.of(robot).colors(tension) / 255.0
    style = (0, (3.0, 2.0)) if state is None else "-"
    courses = shapes.courses(robot, pose, state, 1.0)
    aboard = on_platform(robot)[:, None, None]
    courses = np.where(aboard, courses[:, ::-1], courses)  # from the frame, because numbers of cables are near it
    cables = [Stroke(*each, 1.3, style, 2.0, covers=True) for each in zip(courses, colors, strict=True)]
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)[:, None]
    rims = np.swapaxes(points_on_pulleys(robot, pose, turn, shapes.exits_of(state)), 0, 1)
    circles = list(rims[pulley_radius(robot) > 0.0])
    if robot.winches is not None and robot.winches.drum_radius is not None:
        drums = np.array(list(map(_rims, shapes.drum_axes(robot), robot.winches.drum_radius)))
        circles += list(shapes.in_world(robot, pose, drums))
    others = [Stroke(circle, WHEEL_COLOR, 0.8, "-", 1.9) for circle in circles]
    runs, paths_known = shapes.dead_runs(robot)
    for run, known in zip(shapes.in_world(robot, pose, runs), paths_known, strict=True):
        if (run[0] != run[1]).any():
            others.append(Stroke(run, WHEEL_COLOR, 0.7, "-" if known else ":", 1.8))
    frame, body = _frame_box(robot), platform_box(robot, pose)
    if frame is not None:
        others += [Stroke(frame[[*edge]], FRAME_COLOR, 0.7, "-", 1.7, covers=True) for edge in shapes.BOX_EDGES]
    return cables, others + [Stroke(body[[*edge]], VERMILLION, 1.2, "-", 2.3) for edge in shapes.BOX_EDGES]


def _rims(ends: Array, radius: float) -> Array:
    """Both rims of a horizontal drum as one line. `ends` (2, 3): end points of the drum's axis."""
    axis = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])  # in the axes of the winch
    turn = np.linspace(0.0, 2.0 * np.pi, POINTS)[:, None]
    rim = radius * (np.cos(turn) * np.cross(axis, [0.0, 0.0, 1.0]) + np.sin(turn) * [0.0, 0.0, 1.0])
    return np.concatenate((ends[0] + rim, ends[1] + rim))


def _frame_box(robot: Robot) -> Array | None:
    """Corners of the frame, shape (8, 3). The top of the frame is at the height of the highest anchor."""
    if robot.frame_size is None:
        return None
    top = robot.frame_anchors.max(axis=0)
    middle = 0.5 * (top + robot.frame_anchors.min(axis=0))
    middle[2] = top[2] - 0.5 * robot.frame_size[2]
    return shapes.box_corners(middle - 0.5 * robot.frame_size, middle + 0.5 * robot.frame_size)


def platform_box(robot: Robot, pose: Pose) -> Array:
    """Corners of the platform in the world, shape (8, 3): the box of its size, or the box around its anchors."""
    low, high = robot.platform_anchors.min(axis=0), robot.platform_anchors.max(axis=0)
    if robot.platform_size is not None:
        middle = 0.5 * (low + high)
        low, high = middle - 0.5 * robot.platform_size, middle + 0.5 * robot.platform_size
    return np.asarray(pose.transform(shapes.box_corners(low, high)))


def ground(points: Array, platform: Array) -> tuple[Array, Array]:
    """Corners (k, 3) of the ground (at z = 0 or below the lowest point), and of the platform's shadow on it."""
    low, high = points.min(axis=0), points.max(axis=0)
    height = min(0.0, float(low[2]))
    outline = shapes.box_corners(low, high)[[0, 2, 6, 4], :2]
    shadow = platform[:, :2]
    if np.linalg.matrix_rank(shadow - shadow[0], tol=FLAT * float(np.ptp(points))) == 2:
        shadow = shadow[ConvexHull(shadow).vertices]
    flat = [np.column_stack((place, np.full(len(place), height))) for place in (outline, shadow)]
    return flat[0], flat[1]


def robot(robot: Robot, pose: PoseLike | None = None, ax: Axes3D | None = None) -> Axes3D:
    """The robot in space at rest: frame, platform, and its cables as exact catenaries.

    Cables have the color of their chord tension, on the scale of the robot's limits as in `sagline view`, and their
    numbers at the frame. Pulleys are turned into the planes of their cables. Between drum and pulley, a cable is drawn
    along the swivel axis; if this axis is vertical, from one height to the other. The line is dotted if the true length
    or rise differs. The ground with the platform's shadow is at z = 0 or lower.

    Args:
        robot: The robot.
        pose: Pose of the platform; None for the middle of the robot's test box. At an infeasible pose
            the cables are straight, dashed and without color.
        ax: Axes to draw on, made with `projection="3d"`; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If no pose is given and the robot has no test box. If the pose is a batch.

    Examples:
        >>> import sagline as sl
        >>> axes = sl.plot.robot(sl.load_robot("cogiro"))
    """
    where = drawn_pose(instance(robot, Robot, "robot"), pose)
    optional(ax, Axes3D, "ax")
    if ax is None:
        ax = sheet(height=4.0).add_subplot(projection="3d")
    plan, points = draw_robot(ax, robot, where)
    remark = "" if plan.feasible else ": no tensions within the limits balance this pose"
    format_space_axes(ax, points, robot.name + remark)
    if plan.feasible:
        tension_bar(ax, TensionScale.of(robot), plan.chord_tension, "left")
    return ax


def draw_robot(ax: Axes3D, robot: Robot, where: Pose, color: str | None = None) -> tuple[Plan, Array]:
    """Draw frame, platform, cables and ground on axes that have no labels yet."""
    ax.computed_zorder = False  # matplotlib sorts objects by their centers, and would draw the floor over objects on it
    plan = inverse(robot, where)
    cables, others = strokes(robot, where, plan)
    if color is not None:
        cables = [line._replace(color=color) for line in cables]
    for line in (*cables, *others):
        ax.plot(*line.points.T, color=line.color, linewidth=line.width, linestyle=line.style, zorder=line.order)
    ax.scatter(*robot.frame_anchors.T, color="black", s=8.0, depthshade=False, zorder=4.0)
    points = np.concatenate([line.points for line in (*cables, *others)])
    for flat, shade in zip(ground(points, platform_box(robot, where)), (FLOOR_COLOR, SHADOW_COLOR), strict=True):
        ax.add_collection3d(Poly3DCollection([flat], facecolor=shade, edgecolor="none", zorder=0.5))
    _number_cables(ax, robot.frame_anchors, points)
    return plan, points


def _number_cables(ax: Axes3D, anchors: Array, points: Array) -> None:
    """Write each cable's number above and outside its anchor. Anchors that are close have a common label."""
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    for together in shapes.grouped(anchors, SAME_PLACE * size):
        place = anchors[together].mean(axis=0)
        out = (place - points.mean(axis=0)) * (1.0, 1.0, 0.0)
        out = 0.5 * out / (np.linalg.norm(out) or 1.0) + (0.0, 0.0, 0.85)  # upward: the axes have numbers below
        place = place + LABEL_DISTANCE * size * out
        text = ", ".join(map(str, together))
        ax.text(*place, text, fontsize=current().tick, ha="center", va="center", path_effects=HALO, zorder=5.0)


def tension_bar(ax: Axes, scale: TensionScale, tension: Array, place: Literal["left", "right"]) -> None:
    """Draw the color bar of the cable tensions."""
    steps = np.geomspace(scale.low, scale.high, 128)
    shown = ScalarMappable(LogNorm(scale.low, scale.high), ListedColormap(scale.colors(steps) / 255.0))
    below, above = tension.min() < scale.low * (1.0 - 1e-6), tension.max() > scale.high * (1.0 + 1e-6)
    extend = {(False, False): "neither", (True, False): "min", (False, True): "max", (True, True): "both"}
    look = {"location": place, "shrink": 0.6, "pad": 0.0, "aspect": 24, "extend": extend[bool(below), bool(above)]}
    bar = color_bar(shown, ax, r"chord tension $\tau$ [N]", **look)
    if bar.solids is not None:
        bar.solids.set_rasterized(False)
        bar.solids.set_edgecolor("face")  # this avoids white lines between the colors
    bar.set_ticks(list(scale.ticks()), labels=[n(tick, ",.4g") for tick in scale.ticks()])
    bar.ax.minorticks_off()


def fit_space(ax: Axes3D, low: Array, high: Array) -> Array:
    """Limit `ax` to a box with sides of at least a tenth of the longest side. Returns the lengths of the sides."""
    size: Array = np.maximum(high - low, 0.1 * np.max(high - low))
    sides = zip("xyz", 0.5 * (low + high), size, strict=True)
    ax.set(**{f"{name}lim": (middle - 0.5 * side, middle + 0.5 * side) for name, middle, side in sides})
    return size


def format_space_axes(ax: Axes3D, points: Array, title: str) -> None:
    """Write labels, and set ticks so that their numbers do not overlap. The points where two axes meet have no tick."""
    ax.set_title(title, fontsize=current().label, y=0.97)
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = min(0.0, low[2])
    size = fit_space(ax, low, high)
    outward, beside = (17.0, 6.0) if current().narrow else (7.0, -2.0)  # [pt]; the numbers of z are beside their axis
    for name, axis, share in zip(PLACE, (ax.xaxis, ax.yaxis, ax.zaxis), size / size.max(), strict=True):
        axis.set_label_text(name, fontsize=current().label)
        axis.labelpad = beside if axis is ax.zaxis else outward
        axis.set_tick_params(labelsize=current().tick, pad=3.0 if axis is ax.zaxis else 0.0)
        axis.set_major_locator(MaxNLocator(max(1, round(4.5 * share)), steps=[1, 2, 5, 10], prune="both"))
        axis.set_pane_color((1.0, 1.0, 1.0, 0.0))
    ax.grid(visible=False)
    # tall robots and narrow figures need space for their labels
    zoom = (0.84 - 0.1 * float(size[2] / size.max())) * (0.78 if current().narrow else 1.0)
    ax.set_box_aspect(size, zoom=zoom)
