"""What is written into a drawing of a robot: the numbers of its cables, and how large and which way it is."""

from __future__ import annotations

from math import floor, log10
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.core.numbers import n

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from sagline.core.arrays import Array
    from sagline.plot.style import Style

PLACES: Final = np.linspace(0.12, 0.72, 31)  # along a cable from the frame, where its number may stand
BESIDE, ROOM = 0.8, 0.8  # of the size of the text: from a cable to its number, and from a number to other lines
CLEAR = 1.15  # the same where it stands beside its cable
FROM_ANCHOR = 1.6  # of the size of the text, from the end of a cable at the frame, which is to be seen
ARROW: Final = 0.16  # of the picture's width: at most the length of the axes
END_ON: Final = 0.12  # of its length: an axis seen so short has no name


def places_of_numbers(cables: Sequence[Array], courses: Sequence[Array], size: float) -> list[Array]:
    """Where the number of each cable stands: on it, or close beside it where another cable is too near.

    Args:
        cables: Points along each cable in the picture, shape (P, 2).
        courses: The same of everything that is drawn, cables first.
        size: Of the text [m].

    Returns:
        Middles of the numbers, each of shape (2,).
    """
    starts = np.concatenate([course[:-1] for course in courses])
    steps = np.concatenate([course[1:] for course in courses]) - starts
    owners = np.repeat(np.arange(len(courses)), [len(course) - 1 for course in courses])
    chosen: list[Array] = []
    for number, cable in enumerate(cables):
        where = PLACES * (len(cable) - 1)
        on = np.column_stack([np.interp(where, np.arange(len(cable)), cable[:, axis]) for axis in (0, 1)])
        along = np.gradient(on, axis=0)
        across = np.column_stack((-along[:, 1], along[:, 0]))
        across *= BESIDE * size / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9 * size)
        candidates = np.concatenate((on, on + across, on - across))
        other = owners != number
        beside = np.arange(len(candidates)) >= len(on)
        room = np.where(beside, CLEAR, ROOM) * size  # so that it is nearer to its own cable than to any other
        free = np.minimum(_distances(candidates, starts[other], steps[other]) / room, 1.0)
        free = np.minimum(free, np.linalg.norm(candidates - cable[0], axis=1) / (FROM_ANCHOR * size))
        for place in chosen:
            free += 2.0 * np.minimum(np.linalg.norm(candidates - place, axis=1) / (1.6 * size), 1.0) - 2.0
        worth = free - 0.2 * np.tile(PLACES, 3) - 0.15 * beside
        chosen.append(candidates[int(np.argmax(worth))])
    return chosen


def _distances(points: Array, starts: Array, steps: Array) -> Array:
    """From points (n, 2) to the nearest of segments (S, 2), shape (n,)."""
    square = np.einsum("sc,sc->s", steps, steps)
    away = points[:, None] - starts
    share = np.einsum("nsc,sc->ns", away, steps) / np.where(square > 0.0, square, 1.0)
    nearest = away - np.clip(share, 0.0, 1.0)[..., None] * steps
    return np.asarray(np.linalg.norm(nearest, axis=2).min(axis=1))


def label_boxes(places: Sequence[Array], size: float) -> list[Array]:
    """Boxes that lines leave free around numbers, corners (4, 2) in order.

    Args:
        places: Middles of the numbers.
        size: Of the text [m].
    """
    corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    return [place + corners * (0.35 * size * len(str(k)) + 0.1 * size, 0.55 * size) for k, place in enumerate(places)]


def free_axes(taken: Array, view: Array, limits: Array, size: float) -> tuple[Array, Array, str]:
    """The world's axes in the corner of the picture that is farthest from everything; their place means nothing.

    Args:
        taken: Points of what is drawn, in the picture, shape (n, 2).
        view: To the right, up and toward the viewer, as rows, shape (3, 3).
        limits: Of the picture, lowest and highest across, then up [m], shape (2, 2).
        size: Of the text [m].

    Returns:
        Where they begin and where each ends, in the picture, shapes (2,) and (3, 2); and how long they are.
    """
    width = float(np.ptp(limits[0]))
    decade = 10.0 ** floor(log10(ARROW * width))
    length = max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= ARROW * width)
    ends = length * view[:2].T
    low, high = np.minimum(ends.min(axis=0), 0.0) - 1.4 * size, np.maximum(ends.max(axis=0), 0.0) + 1.4 * size
    corners = [np.array([x, y]) for y in (limits[1, 0] - low[1], limits[1, 1] - high[1])
               for x in (limits[0, 0] - low[0], limits[0, 1] - high[0])]  # fmt: skip
    middle = 0.5 * (low + high)
    start = max(corners, key=lambda corner: float(np.linalg.norm(taken - corner - middle, axis=1).min()))
    return start, start + ends, n(length, unit="m")


def draw_axes(ax: Axes, start: Array, ends: Array, length: str, look: Style) -> None:
    """Three arrows with their names, and how long they are.

    Args:
        ax: Where they are drawn.
        start: Where they begin.
        ends: Where they end, shape (3, 2).
        length: How long they are, in words.
        look: The style of the drawing.
    """
    longest = float(np.linalg.norm(ends - start, axis=1).max())
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "mutation_scale": 5.0 * look.line, "linewidth": 0.6 * look.line}
    arrow |= {"color": "black", "shrinkA": 0.0, "shrinkB": 0.0}
    for name, end in zip("xyz", ends, strict=True):
        away = float(np.linalg.norm(end - start))
        if away < END_ON * longest:
            continue
        ax.annotate("", (end[0], end[1]), (start[0], start[1]), arrowprops=arrow, annotation_clip=False)
        out = 0.7 * look.tick * (end - start) / away
        ax.annotate(
            f"${name}$", (end[0], end[1]), xytext=(out[0], out[1]), textcoords="offset points", fontsize=look.tick,
            ha="center", va="center", annotation_clip=False,
        )  # fmt: skip
    ax.annotate(
        length, (start[0], start[1]), xytext=(0.0, -0.4 * look.tick), textcoords="offset points", fontsize=look.tick,
        ha="center", va="top", annotation_clip=False,
    )  # fmt: skip
