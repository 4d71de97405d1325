"""Residuals, correlations and expected position errors of a calibration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from sagline.calibration.findings import UNITS, columns_of
from sagline.calibration.log import count_of_frequencies, reading_deviations
from sagline.calibration.result import Calibration
from sagline.calibration.summary import chi_squared_text
from sagline.core.arguments import choice, instance
from sagline.core.arrays import Array, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import n
from sagline.plot.labels import figure_legend, set_heading, spread_heights, write_beside
from sagline.plot.sheet import COLORS, GAP_COLOR, MAP_COLORS, VERMILLION, color_bar, draw_map, format_axes, sheet
from sagline.plot.style import current
from sagline.robot.pose import Pose

PARTS: Final = ("all", "residuals", "correlation", "errors")
BANDS: Final = ((2.0, 0.35), (1.0, 0.55))  # for each band, its half width in standard deviations and its opacity
REACH: Final = 5.0  # largest residual on the axis [standard deviations]; larger ones are drawn at the edge
MOST_POSES: Final = 1500  # largest number of drawn poses; of a longer log, an even selection and all outliers are drawn
MOST_NAMED: Final = 8  # largest number of outliers whose name is written
POINTS: Final = 25  # number of points along each side of a map
MARKS: Final = ("o", "s", "^", "D")
PANEL, MATRIX, BESIDE, MAP = 1.3, 3.8, 1.2, 2.7  # heights of panel and matrix; extra height and width of a map [in]
LINE: Final = 1.3 / 72.0  # height of a name in a font of 1 pt [in], which is scaled with the font size
LEADER: Final[dict[str, Any]] = {"arrowstyle": "-", "linewidth": 0.5, "relpos": (1.0, 0.5), "shrinkB": 0.0}
SHRUNK: Final = 1.5  # a figure may be higher than a slide if otherwise its parts would become smaller than this factor
ROUND: Final = FuncFormatter(lambda value, _: f"{value:g}")
PER_METER: Final = 1e3  # [mm]


# residuals of one kind: axis label, values (N, c) in standard deviations, names of the columns, word for the outliers
_Kind: TypeAlias = "tuple[str, Array, tuple[str, ...], str]"


def calibration(found: Calibration, part: str = "all", *, height: float | None = None) -> Figure:
    """Residuals, correlations and expected errors of a calibration.

    The unit of a residual is the standard deviation of its sensor. Residuals are in the order of the rows of the log.
    The bands are one and two standard deviations wide. Outliers have a ring, and values off the scale are triangles at
    the edge. The correlation matrix has all estimated parameters, grouped by kind. The maps show the expected position
    error on a level slice, before (from the priors) and after the calibration. The maps do not include translations and
    rotations of the world that the readings do not observe.

    Args:
        found: Result of `calibrate`.
        part: "residuals", "correlation" or "errors"; "all" for these three parts.
        height: Height of the slice [m]; None for the middle of the calibration's poses.

    Returns:
        The figure.

    Raises:
        InvalidValueError: If `part` does not exist.

    Examples:
        >>> import sagline as sl
        >>> found = sl.load_calibration("calibration.nc")  # doctest: +SKIP
        >>> figure = sl.plot.calibration(found)  # doctest: +SKIP
    """
    instance(found, Calibration, "found")
    choice(part, "part", PARTS)
    place = None if height is None else number(height, "height", "m")
    drawn: dict[str, tuple[float, Callable[[Any], None]]] = {
        "residuals": (0.5 + PANEL * (len(_kinds(found)) + 1), lambda own: _residuals(own, found)),
        "correlation": (MATRIX, lambda own: _correlation(own, found)),
        "errors": (_height_of_maps(found), lambda own: _errors(own, found, place)),
    }
    heights, draw = zip(*(drawn.values() if part == "all" else [drawn[part]]), strict=True)
    look = current()
    figure = sheet(sum(heights))
    if look.height * sum(heights) > SHRUNK * look.tallest:
        figure.set_figheight(look.height * sum(heights))
    own = figure.subfigures(len(heights), 1, height_ratios=heights, squeeze=False)[:, 0]
    for make, where in zip(draw, own, strict=True):
        make(where)
    return figure


def _kinds(found: Calibration) -> list[_Kind]:
    """Residuals of the calibration, one entry per kind of reading."""
    m, residuals = found.robot.cable_count, found.residuals
    width = residuals.shape[1]
    modes = count_of_frequencies(found.sensors, m, width)
    stated = reading_deviations(found.sensors, m, modes)  # infinite without a sensor
    cables, axes = tuple(f"cable {k}" for k in range(m)), ("$x$", "$y$", "$z$")
    names = cables, cables, axes, axes, cables, tuple(f"mode {k + 1}" for k in range(modes))
    labels = "lengths", "load cells", "positions", "rotations", "swivel angles", "frequencies"
    return [
        (label, residuals[:, part] / stated[part], own, quantity)
        for (quantity, part), label, own in zip(columns_of(m, modes, width).items(), labels, names, strict=True)
        if np.isfinite(stated[part]).any() and np.isfinite(residuals[:, part]).any()
    ]


def _residuals(figure: SubFigure, found: Calibration) -> None:
    """Draw a panel for each kind of reading."""
    kinds = _kinds(found)
    panels = figure.subplots(len(kinds), 1, sharex=True, squeeze=False)[:, 0]
    held = np.isin(found.rows, [outlier.row for outlier in found.outliers])
    some = np.arange(len(found.rows))[:: -(-len(found.rows) // MOST_POSES)]
    shown = np.union1d(some, np.flatnonzero(held))
    for ax, (label, values, names, quantity) in zip(panels, kinds, strict=True):
        for size, density in BANDS:
            ax.axhspan(-size, size, color=GAP_COLOR, alpha=density, linewidth=0.0, zorder=0.4)
        far = bool((np.abs(values[shown]) > REACH).any())
        for k, (name, column) in enumerate(zip(names, values[shown].T, strict=True)):
            within, color = np.where(np.abs(column) <= REACH, column, np.nan), COLORS[k % len(COLORS)]
            look = {"color": color, "linewidth": 0.0, "zorder": 2.0}
            ax.plot(found.rows[shown], within, MARKS[k // len(COLORS) % len(MARKS)], markersize=2.6, label=name, **look)
            for side, arrow in ((1.0, "^"), (-1.0, "v")):
                beyond = side * column > REACH
                ax.plot(found.rows[shown][beyond], np.full(beyond.sum(), side * REACH), arrow, markersize=4.0, **look)
        _mark_outliers(ax, found, quantity)
        format_axes(ax, "", f"{label} [$\\sigma$]")
        ax.grid(visible=False)
        top = 1.12 * REACH if far else max(2.5, 1.1 * float(np.nanmax(np.abs(values[shown]))))
        ax.set_ylim(-top, top)
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    every = f", every {-(-len(found.rows) // MOST_POSES)}th is drawn" if len(shown) < len(found.rows) else ""
    panels[-1].set_xlabel(f"row of the log{every}", fontsize=current().label)
    figure_legend(figure, panels, "outside lower center")
    figure.align_ylabels(panels)
    set_heading(figure, f"{found.robot.name}: {chi_squared_text(found)}")


def _mark_outliers(ax: Axes, found: Calibration, quantity: str) -> None:
    """Mark each outlier by a ring, and write its cable and its size."""
    named = 0
    for outlier in found.outliers:
        if outlier.quantity != quantity:
            continue
        place = float(np.clip(outlier.deviations * np.sign(outlier.size), -REACH, REACH))
        ax.plot(outlier.row, place, "o", markersize=8.0, markerfacecolor="none", markeredgecolor=VERMILLION, zorder=3.0)
        if named < MOST_NAMED:
            cable = "" if outlier.cable is None else f"cable {outlier.cable}, "
            left = outlier.row > found.rows[0] + 0.7 * (found.rows[-1] - found.rows[0])
            side, away = ("right", -7.0) if left else ("left", 7.0)
            size = f"{cable}{n(outlier.size, '.2g', UNITS[quantity])}"
            write_beside(ax, size, (outlier.row, place), (away, 0.0), ha=side, zorder=4.0, annotation_clip=None)
            named += 1


def _correlation(figure: SubFigure, found: Calibration) -> None:
    """Draw the correlation matrix. Lines separate the kinds of parameters, whose names are written."""
    ax = figure.subplots()
    ax.set_facecolor(GAP_COLOR)
    image = ax.imshow(found.correlation, vmin=-1.0, vmax=1.0, cmap="PuOr_r", interpolation="nearest", rasterized=True)
    names = found.parameters.names
    starts = [k for k in range(len(names)) if k == 0 or names[k] != names[k - 1]]
    ends = [*starts[1:], len(names)]
    for edge in starts[1:]:
        ax.axhline(edge - 0.5, color="0.3", linewidth=0.6)
        ax.axvline(edge - 0.5, color="0.3", linewidth=0.6)
    ax.set_xticks([])
    ax.set_yticks([])
    side = min(0.9 * figure.bbox.height, 0.5 * figure.bbox.width) / figure.dpi  # least side of the matrix [in]
    middles = np.array([0.5 * (start + end - 1) for start, end in zip(starts, ends, strict=True)])
    places = len(names) * spread_heights((middles + 0.5) / len(names), LINE * current().tick / side) - 0.5
    for start, middle, place in zip(starts, middles, places, strict=True):
        ax.annotate(
            names[start].replace("_", " "), (-0.5, middle), xytext=(-0.5 - 0.05 * len(names), place),
            fontsize=current().tick, ha="right", va="center", annotation_clip=False, arrowprops=LEADER,
        )  # fmt: skip
    color_bar(image, ax, "correlation", shrink=0.8, pad=0.02)


def _errors(figure: SubFigure, found: Calibration, at: float | None) -> None:
    """Draw maps of the expected errors before and after the calibration."""
    x, y, z = _slice(found, at)
    poses = Pose(np.stack(np.meshgrid(x, y, [z], indexing="ij"), axis=-1).reshape(-1, 3), np.eye(3))
    own = any("world" in direction.name for direction in found.gauge)
    maps = []
    for each in (_before(found), found):
        error = each.pose_error(poses)
        maps.append(PER_METER * (error.own_position if own else error.position).reshape(len(x), len(y)))
    known = np.concatenate([values[np.isfinite(values) & (values > 0.0)] for values in maps])
    low, high = (float(known.min()), float(known.max())) if known.size else (1.0, 10.0)
    scale = LogNorm(low, max(high, 1.01 * low))
    panels = figure.subplots(*((2, 1) if current().narrow else (1, 2)), sharex=True, sharey=True)
    for ax, values, name in zip(panels, maps, ("before: from the priors", "after"), strict=True):
        is_known = bool(np.isfinite(values).any())
        median = f"median {n(float(np.nanmedian(values)), '.2g', 'mm')}" if is_known else "not observed"
        draw_map(ax, x, y, values, scale, f"{name}, {median}")
    across, up, _ = found.poses.position[:: -(-len(found.rows) // MOST_POSES)].T
    panels[1].plot(across, up, ".", color="white", markeredgecolor="0.2", markeredgewidth=0.4, markersize=4.0)
    shown, label = ScalarMappable(scale, MAP_COLORS), "expected position error [mm]"
    bar = color_bar(shown, list(panels), label, shrink=0.85, pad=0.02, format=ROUND)
    bar.ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    bar.ax.yaxis.set_minor_locator(NullLocator())
    without = ", without translation and rotation of the world" if own else ""
    set_heading(figure, f"at z = {n(z, '.3g', 'm')}{without}; dots: poses of the log")


def _height_of_maps(found: Calibration) -> float:
    """Height of a figure of two maps side by side [in]."""
    x, y, _ = _slice(found, None)
    high = BESIDE + MAP * float(np.clip(np.ptp(y) / max(float(np.ptp(x)), 1e-9), 0.3, 1.3))
    return 2.0 * high if current().narrow else high


def _before(found: Calibration) -> Calibration:
    """Calibration object for the state before: uncalibrated robot, prior values and prior deviations."""
    covariance = locked(np.diag(found.parameters.prior_deviation**2))
    return replace(found, robot=found.before, values=found.parameters.prior, covariance=covariance)


def _slice(found: Calibration, at: float | None) -> tuple[Array, Array, float]:
    """Coordinates of a level grid at the height `at` that covers the robot's test box or the poses of the log."""
    low, high = found.poses.position.min(axis=0), found.poses.position.max(axis=0)
    box = found.robot.test_box
    if box is not None:
        low, high = np.minimum(low, box.low), np.maximum(high, box.high)
    z = 0.5 * float(found.poses.position[:, 2].min() + found.poses.position[:, 2].max()) if at is None else at
    if not low[2] <= z <= high[2]:
        allowed = f"{low[2]:g} to {high[2]:g} m, the range of its poses"
        raise InvalidValueError("height", f"{z:g} m", allowed, "Give another.")
    return np.linspace(low[0], high[0], POINTS), np.linspace(low[1], high[1], POINTS), z
