"""Small figures for notebooks. Drawing takes at most a second for results of any size."""

from __future__ import annotations

import re
from base64 import b64encode
from dataclasses import replace
from functools import singledispatch
from hashlib import sha1
from html import escape
from io import BytesIO
from typing import TYPE_CHECKING, Final

import numpy as np
from matplotlib.figure import Figure

from sagline.calibration.result import Calibration
from sagline.core.arguments import true_runs
from sagline.dynamics.simulation.results import Simulation
from sagline.kinematics.confirm import Confirmation
from sagline.kinematics.plan import Plan
from sagline.motion.path import Path
from sagline.plot import sheet as sheets
from sagline.plot.calibration import calibration
from sagline.plot.drawing import draw_at_rest
from sagline.plot.labels import PLACE, TENSIONS, TIME, name_lines
from sagline.plot.plan import abscissa
from sagline.plot.robot import drawn_pose
from sagline.plot.style import PLAIN, Using
from sagline.present.summaries import middle_plan
from sagline.robot.robot import Robot
from sagline.workspaces.workspace import Workspace

if TYPE_CHECKING:
    from sagline.core.arrays import Array, Flags, Indices

STYLE: Final = replace(PLAIN, name="notebook")
MOST_SAMPLES: Final = 300  # largest number of points of a line
MOST_CABLES: Final = 16
LEVELS: Final = 4  # number of drawn slices of a workspace

LARGEST: Final = 200_000  # largest size of a figure [bytes]
MOST_MARKS: Final = 1500  # largest number of points in a vector drawing; more points are drawn as a bitmap
DOTS: Final = 110  # dots per inch of the bitmap
FONT: Final = "'DejaVu Sans', Verdana, sans-serif"
_remarks = re.compile(r"<metadata>.*?</metadata>|<!--.*?-->|<defs>\s*<style.*?</style>\s*</defs>", flags=re.DOTALL)
_gray = re.compile(r"\b(fill|stroke): #([0-9a-f]{2})\2\2(?![0-9a-f])")
_family = re.compile(r"font-family: 'DejaVu Sans'(?:, 'DejaVu Sans')?;? ?")


def drawing_of(thing: object, description: str) -> str:
    """HTML of the figure of `thing`, in the style and colors of the notebook; "" for an object without a figure."""
    with Using(STYLE):
        figure = figure_of(thing)
        return "" if figure is None else _html(figure, description)


@singledispatch
def figure_of(thing: object) -> Figure | None:
    """Small figure of `thing`; None for an object without a figure."""
    return None


@figure_of.register
def _(robot: Robot) -> Figure | None:
    if robot.test_box is None:
        return None
    return draw_at_rest(robot, drawn_pose(robot, None), middle_plan(robot)).get_figure(root=True)


@figure_of.register
def _(plan: Plan) -> Figure | None:
    state = plan.state
    if not state.pose.shape:
        return draw_at_rest(state.one_robot, state.pose, plan).get_figure(root=True)
    return _time_lines(*abscissa(plan), plan.chord_tension, TENSIONS["chord_tension"][0], ~plan.feasible)


@figure_of.register
def _(proof: Confirmation) -> Figure | None:
    plan = proof.plan
    if not plan.state.pose.shape:
        return None
    error = 1e3 * proof.position_error
    return _time_lines(*abscissa(plan), error, "position error [mm]", ~proof.held, ("$x$", "$y$", "$z$"))


@figure_of.register
def _(run: Simulation) -> Figure | None:
    return _time_lines(run.time, TIME, run.tensions, "tension at the frame [N]", np.zeros(run.time.size, dtype=bool))


@figure_of.register
def _(path: Path) -> Figure | None:
    ax = sheets.axes_or_new(None, height=3.4)
    x, y, _ = path.pose.position[_chosen(path.pose.position)].T
    ax.plot(x, y, color=sheets.BLUE, linewidth=1.3)
    ax.plot(x[:1], y[:1], "o", color=sheets.BLUE, markersize=5.0)
    sheets.format_axes(ax, *PLACE[:2])
    ax.set_aspect("equal", adjustable="datalim")
    return ax.get_figure(root=True)


@figure_of.register
def _(space: Workspace) -> Figure | None:
    """Draw the boundary of a workspace at some heights, seen from above. A flat workspace is drawn in its own plane."""
    sides = [k for k, axis in enumerate(space.axes) if axis.size > 1]
    if space.volume <= 0.0 or len(sides) < 2:
        return None
    first, second = sides[:2]
    (third,) = set(range(3)) - {first, second}
    level = np.moveaxis(space.level, third, 2)
    inside = np.flatnonzero((level >= 0.0).any(axis=(0, 1)))
    shown = np.unique(inside[np.linspace(0, inside.size - 1, LEVELS + 2).astype(np.intp)[1:-1]])
    ax = sheets.axes_or_new(None, height=4.0)
    for k, row in enumerate(shown):
        color = sheets.COLORS[k % len(sheets.COLORS)]
        ax.contour(space.axes[first], space.axes[second], level[:, :, row].T, levels=[0.0], colors=[color])
        ax.plot([], [], color=color, label=f"${'xyz'[third]}$ = {space.axes[third][row]:.3g} m")
    sheets.format_axes(ax, PLACE[first], PLACE[second])
    ax.set_aspect("equal")
    name_lines(ax)
    return ax.get_figure(root=True)


@figure_of.register
def _(found: Calibration) -> Figure | None:
    return calibration(found, "residuals")


def _time_lines(
    clock: Array, axis: str, values: Array, label: str, gaps: Flags, names: tuple[str, ...] | None = None
) -> Figure:
    """Lines of the columns of `values` over `clock`, with at most about `MOST_SAMPLES` samples."""
    figure = sheets.sheet(3.2)
    ax = figure.add_subplot()
    chosen = _chosen(values)
    for i, line in enumerate(values[chosen].T[:MOST_CABLES]):
        look = sheets.cable_look(i) | {"label": f"cable {i}"}
        if names:
            look = {"color": sheets.COLORS[i], "label": names[i]}
        sheets.draw_series(ax, clock[chosen], line, **look, linewidth=1.2)
    sheets.shade_spans(ax, clock, true_runs(gaps)[:MOST_SAMPLES], "not feasible")
    sheets.format_clock(ax, clock, label, axis)
    name_lines(ax)
    return figure


def _chosen(values: Array) -> Indices:
    """Indices of equally spaced rows of `values` (N, c), and of the rows with the extreme values of each column."""
    count = len(values)
    if count <= MOST_SAMPLES:
        return np.arange(count, dtype=np.int64)
    even = np.linspace(0, count - 1, MOST_SAMPLES).astype(np.intp)
    known = np.where(np.isfinite(values), values, np.nan)
    columns = known[:, np.isfinite(known).any(axis=0)]
    ends = [end(columns, axis=0) for end in (np.nanargmax, np.nanargmin)] if columns.size else []
    return np.unique(np.concatenate((even, *ends))).astype(np.int64)


def _html(figure: Figure, description: str) -> str:
    """The figure as SVG, as PNG if the SVG is too large, or "" if both are too large."""
    lines = [line for ax in figure.findobj(lambda each: hasattr(each, "get_lines")) for line in ax.get_lines()]  # type: ignore[attr-defined]
    if sum(len(line.get_xdata()) for line in lines if line.get_marker() not in ("None", None)) > MOST_MARKS:
        for line in lines:
            line.set_rasterized(True)
    drawing = _themed(sheets.svg_text(figure, DOTS), description)
    if len(drawing.encode()) <= LARGEST:
        return drawing
    written = BytesIO()
    figure.savefig(written, format="png", dpi=DOTS, facecolor="white")
    picture = b64encode(written.getvalue()).decode()
    if len(picture) > LARGEST:
        return ""
    return f'<img style="max-width:100%" alt="{escape(description)}" src="data:image/png;base64,{picture}">'


def _ink(gray: re.Match[str]) -> str:
    return f"{gray[1]}: currentColor; {gray[1]}-opacity: {1.0 - int(gray[2], 16) / 255.0:.2f}"


def _themed(svg: str, description: str) -> str:
    """Convert a drawing to the colors of the page: black becomes the text color, gray a transparent text color."""
    # the identifiers are made unique, so that one page can contain several drawings
    svg = _family.sub("", _remarks.sub("", svg)).strip()
    svg = _gray.sub(_ink, svg)
    svg = sheets.unique_names(svg, f"s{sha1(svg.encode()).hexdigest()[:8]}-")
    look = f"max-width:100%;height:auto;color:inherit;fill:currentColor;stroke-linejoin:round;font-family:{FONT}"
    return svg.replace("<svg ", f'<svg role="img" aria-label="{escape(description)}" style="{look}" ', 1)
