"""Chapter about the boundary of the workspace with and without sag, a topic that the article leaves to future work."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

import sagline as sl
from sagline.article.drawing import Drawing, axes, chapter, finding
from sagline.article.simulation import ROBOTS
from sagline.plot.labels import PLACE
from sagline.plot.sheet import BLUE, VERMILLION
from sagline.present.page import Chapter, Finding, table_of
from sagline.workspaces.levels import Plane, slice_of

CELLS = 24  # number of cells of the grid along the longest edge of the frame
HEIGHT = 3.0  # half the height of the frame [m]
POINTS = 121  # number of points along each side of a slice


Pair: TypeAlias = tuple[sl.Workspace, sl.Workspace]  # workspaces with exact catenaries, and with weightless cables


def workspace_chapter() -> Chapter:
    """Chapter about the volumes and boundaries of the workspaces of both simulated robots."""
    pairs = {name: _pair(name) for name in ROBOTS}
    return chapter("workspace", (_volumes(pairs), _boundaries(pairs)))


def _pair(name: str) -> Pair:
    robot = sl.load_robot(name)
    exact, straight = (sl.workspace(robot, model=model, cells=CELLS) for model in (sl.Catenary(), sl.Straight()))
    return exact, straight


def _volumes(pairs: dict[str, Pair]) -> Finding:
    change = {name: exact.volume / straight.volume - 1.0 for name, (exact, straight) in pairs.items()}
    shown = table_of(
        "Volumes of the workspaces within the frame.",
        ("robot", pairs, ""),
        ("with sag [m³]", [exact.volume for exact, _ in pairs.values()], ".1f"),
        ("error [m³]", [exact.volume_error for exact, _ in pairs.values()], ".1f"),
        ("straight [m³]", [straight.volume for _, straight in pairs.values()], ".1f"),
        ("change [%]", [100.0 * each for each in change.values()], "+.2f"),
    )
    return finding(
        "volume",
        numbers={
            name: {
                "volume_m3": exact.volume,
                "volume_error_m3": exact.volume_error,
                "straight_volume_m3": straight.volume,
                "straight_volume_error_m3": straight.volume_error,
                "change_percent": 100.0 * change[name],
            }
            for name, (exact, straight) in pairs.items()
        },
        data=(shown,),
    )


def _boundaries(pairs: dict[str, Pair]) -> Finding:
    apart = {name: _farthest(pair) for name, pair in pairs.items()}
    panels = tuple(
        _panel(pair, normal, at)
        for pair in pairs.values()
        for normal, at in ((2, HEIGHT), (1, 0.0))
    )  # fmt: skip
    return finding("boundary", numbers={"height_m": HEIGHT, "farthest_apart_m": apart}, panels=panels)


def _panel(pair: Pair, normal: int, at: float) -> Drawing:
    """Drawing of the boundaries of both workspaces of `pair` in the plane `normal` = `at` [m]."""
    exact, straight = pair
    plane, box = Plane(normal, at), exact.box
    first, second = plane.axes
    figure, ax = axes(PLACE[first], PLACE[second])
    for space, color, label in ((exact, BLUE, "with sag"), (straight, VERMILLION, "straight")):
        cut = slice_of(space.levels().details, plane, box.low, box.high, (POINTS, POINTS))
        style = "-" if space is exact else "--"
        ax.contour(cut.across, cut.up, cut.level, levels=[0.0], colors=color, linestyles=style, linewidths=1.3)
        ax.plot([], [], color=color, linestyle=style, label=label)
    ax.set(xlim=(box.low[first], box.high[first]), ylim=(box.low[second], box.high[second]))
    return figure, f"{exact.robot.name}: boundaries in the plane {plane}; the frame is the border."


def _farthest(pair: Pair) -> float:
    """Largest distance [m] between the boundaries of both workspaces, along rays from the middle of the frame."""
    middle = np.array([0.0, 0.0, HEIGHT])
    ways = np.vstack((np.eye(3), -np.eye(3)))
    box = pair[0].box
    reach = np.linspace(0.0, float(np.max(box.high - box.low)), 2001)
    places = middle + reach[:, None, None] * ways
    ends = []
    for space in pair:
        level = space.levels()(places.reshape(-1, 3)).reshape(reach.size, len(ways))
        first = (level < 0.0).argmax(axis=0)  # index of the first position outside the workspace on each ray
        row = np.arange(len(ways))
        inner, outer = level[first - 1, row], level[first, row]
        end = reach[first - 1] + (reach[first] - reach[first - 1]) * inner / (inner - outer)
        within = (middle + end[:, None] * ways >= space.box.low) & (middle + end[:, None] * ways <= space.box.high)
        ends.append(np.where((first > 0) & within.all(axis=1), end, np.nan))
    return float(np.nanmax(np.abs(ends[0] - ends[1])))
