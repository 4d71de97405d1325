"""A robot as a line drawing for print: hidden lines removed, cables numbered, axes with a length scale."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection

from sagline.core.arguments import instance
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.plot.geometry import FlatLine, view_axes, visible_parts
from sagline.plot.labels import write_beside
from sagline.plot.robot import FACES, Stroke, drawn_pose, ground, platform_box, strokes, tension_bar
from sagline.plot.sheet import Sheet, axes_or_new
from sagline.plot.style import Style, current
from sagline.robot.pose import Pose, PoseLike
from sagline.robot.robot import Robot
from sagline.viewer.shapes import round_below
from sagline.viewer.tension_scale import TensionScale

AZIMUTH, ELEVATION = np.radians(-60.0), np.radians(24.0)
USUAL: Final = view_axes(float(AZIMUTH), float(ELEVATION))
GROUND, BODY = (0.5, 0.5, 0.5, 0.12), (0.835, 0.369, 0.0, 0.16)
GAP: Final = 1.3  # width of the gap in a line behind another line [pt]
SPECK: Final = 1.5  # a piece of a line between two gaps is omitted if it is shorter than this [pt]
SPARE: Final = 0.05  # margin around the drawing, as a share of the picture
LEAST, MOST = 0.35, 1.1  # smallest and largest ratio of height to width
PLACES: Final = np.linspace(0.12, 0.72, 31)  # possible positions of the number along a cable, 0 at the frame end
BESIDE, ROOM = 0.8, 0.8  # distances of a number from its own cable and from other lines, in units of the text size
CLEAR = 1.15  # distance between other lines and a number that is next to its cable, in units of the text size
FROM_ANCHOR = 1.6  # distance of a number from the frame end, in units of the text size
ARROW: Final = 0.16  # largest length of the drawn world axes, as a share of the picture's width
END_ON: Final = 0.12  # a world axis that appears shorter than this share of its length has no name


def drawing(
    robot: Robot,
    pose: PoseLike | None = None,
    azimuth: float = float(AZIMUTH),
    elevation: float = float(ELEVATION),
    ax: Axes | None = None,
) -> Axes:
    """The robot at rest as a line drawing for print, with hidden lines removed.

    The drawing contains only the visible parts of lines. A cable is interrupted where it passes behind another cable,
    the frame or the platform. Every cable has its number and the color of its chord tension. The projection is
    parallel. The three axes at the ground have equal lengths; their length is written next to the axes.

    Args:
        robot: The robot.
        pose: Pose of the platform; None for the middle of the robot's test box. At an infeasible pose
            the cables are straight, dashed and gray.
        azimuth: Azimuth of the viewer, from the x axis toward the y axis [rad].
        elevation: Elevation of the viewer [rad], 0 to pi / 2.
        ax: Axes to draw on, with their final size; None for a new figure.

    Returns:
        The axes; their coordinates are to the right and up in the picture [m].

    Raises:
        InvalidValueError: If no pose is given and the robot has no test box. If the pose is a batch. If the viewer
            looks up from under the ground.

    Examples:
        >>> import sagline as sl
        >>> with sl.plot.style("ieee"):
        ...     ax = sl.plot.drawing(sl.load_robot("cogiro"))
        >>> [text.get_text() for text in ax.texts[:8]]
        ['0', '1', '2', '3', '4', '5', '6', '7']
    """
    where = drawn_pose(instance(robot, Robot, "robot"), pose)
    turn, above = number(azimuth, "azimuth", "rad"), number(elevation, "elevation", "rad")
    if not 0.0 <= above <= 0.5 * np.pi:
        raise InvalidValueError("elevation", f"{above:g} rad", "0 to pi / 2", "Look down at the robot.")
    return draw_at_rest(robot, where, inverse(robot, where), view_axes(turn, above), ax)


def draw_at_rest(robot: Robot, where: Pose, plan: Plan | None, view: Array = USUAL, ax: Axes | None = None) -> Axes:
    """Draw `robot` at the pose `where`. Cables of a feasible `plan` have the colors of their tensions."""
    held, (cables, others) = plan is not None and bool(plan.feasible), strokes(robot, where, plan)
    body = platform_box(robot, where)
    points = np.concatenate([line.points for line in (*cables, *others)])
    flat = ground(points, body)
    ax = _axes(ax, np.concatenate((points, flat[0])) @ view[:2].T, bar=held)
    if plan is not None and held:
        tension_bar(ax, TensionScale.of(robot), plan.chord_tension, "right")
    elif plan is not None:
        ax.set_title("no tensions within the limits balance the platform at this pose", fontsize=current().label)
    facing = [face for face in body[np.array(FACES)] @ view.T if _seen_from_outside(face)]
    shown = [each @ view[:2].T for each in flat]
    for surface, color in (*((each, GROUND) for each in shown), *((face[:, :2], BODY) for face in facing)):
        ax.add_collection(PolyCollection([surface], facecolors=[color], edgecolors="none", zorder=0.5))
    _draw_lines(ax, cables, others, facing, view, np.concatenate(shown))
    return ax


def _axes(ax: Axes | None, points: Array, *, bar: bool) -> Axes:
    """Axes with equal scales and with limits that fit the `points` (n, 2) of the picture."""
    low, high = points.min(axis=0), points.max(axis=0)
    spare = SPARE * float((high - low).max())
    low, high = low - spare, high + spare
    if ax is None:
        width = current().width
        shape = float(np.clip((high[1] - low[1]) / (high[0] - low[0]), LEAST, MOST))
        tall = min(width * shape * (0.82 if bar else 1.0), current().tallest)
        ax = Sheet(figsize=(width, tall), layout="compressed").add_subplot()
    else:
        ax = axes_or_new(ax)
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.set_axis_off()
    return ax


def _draw_lines(
    ax: Axes, cables: list[Stroke], others: list[Stroke], facing: list[Array], view: Array, flat: Array
) -> None:
    """Draw the visible parts of all lines in front of the faces `facing` (4, 3) and the ground `flat` (n, 2)."""
    # widths and gaps depend on the size on paper
    figure: Any = ax.get_figure(root=True)
    figure.draw_without_rendering()
    point = float(np.ptp(ax.get_xlim())) / (ax.bbox.width / figure.dpi * 72.0)  # [m]
    look, every = current(), [*cables, *others]
    lines = [
        FlatLine(each.points @ view.T, *(each.covers * look.line * point * np.array([0.5 * each.width, GAP])))
        for each in every
    ]
    courses = [line.points[:, :2] for line in lines]
    numbers = _number_positions(courses[: len(cables)], courses, look.tick * point)
    boxes = _label_boxes(numbers, look.tick * point)
    for k, (stroke, parts) in enumerate(zip(every, visible_parts(lines, facing, boxes), strict=True)):
        long = [part[:, :2] for part in parts if _length(part) > SPECK * point]
        shown = LineCollection(
            long, colors=[stroke.color], linewidths=stroke.width, linestyles=[stroke.style],
            capstyle="butt", joinstyle="round", zorder=2.0,
        )  # fmt: skip
        ax.add_collection(shown, autolim=False)
        if k < len(cables) and parts and np.array_equal(parts[0][0], lines[k].points[0]):
            ax.scatter(parts[0][0, 0], parts[0][0, 1], color="black", s=5.0, linewidths=0.0, zorder=3.0)
    for k, place in enumerate(numbers):
        ax.text(place[0], place[1], str(k), fontsize=look.tick, ha="center", va="center", zorder=4.0)
    occupied, limits = np.concatenate((*courses, flat)), np.array([ax.get_xlim(), ax.get_ylim()])
    _draw_axes(ax, *_free_axes(occupied, view, limits, look.tick * point), look)


def _length(part: Array) -> float:
    """Length of a line in the picture [m]."""
    return float(np.linalg.norm(np.diff(part[:, :2], axis=0), axis=1).sum())


def _seen_from_outside(face: Array) -> bool:
    """True if the corners of a face turn counter-clockwise in the picture."""
    one, other = face[1, :2] - face[0, :2], face[2, :2] - face[1, :2]
    return bool(one[0] * other[1] > one[1] * other[0])


def _number_positions(cables: Sequence[Array], courses: Sequence[Array], size: float) -> list[Array]:
    """Positions of the numbers of the cables: on the cable, or next to it if another cable is too close."""
    starts = np.concatenate([course[:-1] for course in courses])
    steps = np.concatenate([course[1:] for course in courses]) - starts
    owners = np.repeat(np.arange(len(courses)), [len(course) - 1 for course in courses])
    chosen: list[Array] = []
    for k, cable in enumerate(cables):
        where = PLACES * (len(cable) - 1)
        on = np.column_stack([np.interp(where, np.arange(len(cable)), cable[:, axis]) for axis in (0, 1)])
        along = np.gradient(on, axis=0)
        across = np.column_stack((-along[:, 1], along[:, 0]))
        across *= BESIDE * size / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9 * size)
        candidates = np.concatenate((on, on + across, on - across))
        other = owners != k
        beside = np.arange(len(candidates)) >= len(on)
        space = np.where(beside, CLEAR, ROOM) * size  # the cable of the number must be the nearest cable
        free = np.minimum(_distances(candidates, starts[other], steps[other]) / space, 1.0)
        free = np.minimum(free, np.linalg.norm(candidates - cable[0], axis=1) / (FROM_ANCHOR * size))
        for place in chosen:
            free += 2.0 * np.minimum(np.linalg.norm(candidates - place, axis=1) / (1.6 * size), 1.0) - 2.0
        worth = free - 0.2 * np.tile(PLACES, 3) - 0.15 * beside
        chosen.append(candidates[int(np.argmax(worth))])
    return chosen


def _distances(points: Array, starts: Array, steps: Array) -> Array:
    """Distances (n,) of `points` (n, 2) from the nearest of S segments. `starts`, `steps`: the segments, (S, 2)."""
    square = np.einsum("sc,sc->s", steps, steps)
    away = points[:, None] - starts
    share = np.einsum("nsc,sc->ns", away, steps) / np.where(square > 0.0, square, 1.0)
    nearest = away - np.clip(share, 0.0, 1.0)[..., None] * steps
    return np.asarray(np.linalg.norm(nearest, axis=2).min(axis=1))


def _label_boxes(places: Sequence[Array], size: float) -> list[Array]:
    """Corners (4, 2), in order, of a box around each number; no line is drawn in a box."""
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return [place + corners * (0.35 * size * len(str(k)) + 0.1 * size, 0.55 * size) for k, place in enumerate(places)]


def _free_axes(occupied: Array, view: Array, limits: Array, size: float) -> tuple[Array, Array, str]:
    """Draw the directions of the world axes in the emptiest corner of the picture."""
    length = round_below(ARROW * float(np.ptp(limits[0])))
    ends = length * view[:2].T
    low, high = np.minimum(ends.min(axis=0), 0.0) - 1.4 * size, np.maximum(ends.max(axis=0), 0.0) + 1.4 * size
    corners = [np.array([x, y]) for y in (limits[1, 0] - low[1], limits[1, 1] - high[1])
               for x in (limits[0, 0] - low[0], limits[0, 1] - high[0])]  # fmt: skip
    middle = 0.5 * (low + high)
    start = max(corners, key=lambda corner: float(np.linalg.norm(occupied - corner - middle, axis=1).min()))
    return start, start + ends, n(length, unit="m")


def _draw_axes(ax: Axes, start: Array, ends: Array, length: str, look: Style) -> None:
    """Draw three arrows with their names, and write their length."""
    longest = float(np.linalg.norm(ends - start, axis=1).max())
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 5.0 * look.line, "linewidth": 0.6 * look.line}
    arrow |= {"color": "black", "shrinkA": 0.0, "shrinkB": 0.0}
    for name, end in zip("xyz", ends, strict=True):
        away = float(np.linalg.norm(end - start))
        if away < END_ON * longest:
            continue
        ax.annotate("", (end[0], end[1]), (start[0], start[1]), arrowprops=arrow, annotation_clip=False)
        write_beside(ax, f"${name}$", end, 0.7 * look.tick * (end - start) / away)
    write_beside(ax, length, start, (0.0, -0.4 * look.tick), va="top")
