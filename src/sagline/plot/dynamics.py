"""Natural frequencies along a path and over a grid of poses; frequency response; animation of a mode."""

from __future__ import annotations

import os
from collections.abc import Iterable
from io import BytesIO
from itertools import pairwise, zip_longest
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import LogNorm, Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, MaxNLocator, NullFormatter
from mpl_toolkits.mplot3d.axes3d import Axes3D
from numpy.typing import ArrayLike
from PIL import Image

from sagline.core.arguments import callback, choice, file_path, instance, listed, text, whole_number
from sagline.core.arrays import Array, Progress, checked
from sagline.core.errors import FileError, InvalidValueError
from sagline.dynamics.vibration.frequency_map import FrequencyMap
from sagline.dynamics.vibration.response import FrequencyResponse, ResponseCurves
from sagline.dynamics.vibration.vibration import WITH_MASS, ListedMode, Vibration, listed_modes
from sagline.files.writing import atomic_file
from sagline.plot import sheet
from sagline.plot.labels import legend_above, name_lines, set_heading
from sagline.plot.robot import fit_space, platform_box
from sagline.plot.style import current
from sagline.viewer.shapes import BOX_EDGES
from sagline.viewer.swing import PERIOD, Swing

THIN, WIDE = 0.6, 3.6  # line width if only the cables move, and if only the platform moves [pt]
FAINT = 0.4  # opacity of thin lines
SHARES = (1.0, 0.5, 0.0)  # platform shares that the legend shows
PANELS: Final = {6: 3, 4: 2, 3: 3, 2: 2, 1: 1}  # number of heights -> panels per row, without empty panels
HIGHEST, LOWEST = 2e2, 1e-3  # limits of the axis, relative to the static response, because undamped curves are infinite
MARK = 0.035  # length of the longest mark of a mode, as a share of the height of the axes
FAINTEST = 0.15  # opacity of the mark of a mode without platform motion


def frequencies(
    vibrations: Iterable[Vibration], time: ArrayLike | None = None, label: str = "time [s]", ax: Axes | None = None
) -> Axes:
    """Natural frequencies along a path (Campbell diagram): with cable mass, and massless (dashed).

    Width and opacity of a line show the platform's share of the kinetic energy of the mode. If a wide line becomes thin
    while its neighbor becomes wide, the platform's motion passes from one mode to the other.

    Args:
        vibrations: Vibrations of N successive states, from `vibration`.
        time: Times or other abscissae of the states, ascending, shape (N,). `label` gives their unit. None for indices.
        label: Label of the time axis, with its unit.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If there are fewer than two vibrations. If `time` has another number of values.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> path = sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0)
        >>> states = sl.inverse(robot, path).state[::100]
        >>> found = [sl.vibration(state, up_to=8.0) for state in states]
        >>> axes = sl.plot.frequencies(found, path.time[::100])
    """
    states = listed(vibrations, Vibration, "vibrations")
    if len(states) < 2:
        raise InvalidValueError("vibrations", f"{len(states)} of them", "two at least", "Take more states of the path.")
    label = text(label, "label")
    clock = np.arange(len(states), dtype=np.float64)
    if time is not None:
        clock = checked(time, "time", "s", shape=(len(states),))
        if clock.ndim != 1 or not np.all(np.diff(clock) > 0.0):
            raise InvalidValueError("time", "not ascending", "a time a state", "Sort the states by their times.")
    ax = sheet.axes_or_new(ax, height=3.6)
    ax.add_collection(_swinging(states, clock))
    rows = zip_longest(*(each.massless_frequency for each in states), fillvalue=np.nan)  # states have different numbers
    ax.plot(clock, np.array(list(rows)).T, color=sheet.VERMILLION, linewidth=0.9, linestyle=sheet.DASHED, zorder=2.5)
    sheet.format_axes(ax, "state" if time is None else label, "natural frequency [Hz]")
    if time is None:
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlim(clock[0], clock[-1])
    ax.set_ylim(0.0, min(each.up_to for each in states))
    _legend_of_shares(ax)
    return ax


def _swinging(states: tuple[Vibration, ...], clock: Array) -> LineCollection:
    """Segments of lines between neighboring `states`. A segment has the mean platform share of its two ends."""
    pieces, shares = [], []
    for (first, one), (second, other) in pairwise(zip(clock, states, strict=True)):
        count = min(one.frequency.size, other.frequency.size)
        ends = np.stack((one.frequency[:count], other.frequency[:count]), axis=1)
        pieces.append(np.stack((np.broadcast_to((first, second), ends.shape), ends), axis=2))
        shares.append(0.5 * (one.platform_share[:count] + other.platform_share[:count]))
    share = np.concatenate(shares)
    return LineCollection(
        list(np.concatenate(pieces)), colors=_colors(share), linewidths=_widths(share), capstyle="round", zorder=2.0
    )


def _widths(share: Array) -> Array:
    return np.asarray(THIN + (WIDE - THIN) * share)


def _colors(share: Array) -> list[tuple[float, float, float]]:
    """Colors for platform shares, mixed with white: transparent lines would be darker where their ends overlap."""
    dense = FAINT + (1.0 - FAINT) * share
    red, green, blue = (1.0 - dense * (1.0 - part) for part in to_rgb(sheet.BLUE))
    return list(zip(red.tolist(), green.tolist(), blue.tolist(), strict=True))


def _legend_of_shares(ax: Axes) -> None:
    handles = []
    for share in SHARES:
        look: dict[str, Any] = {"color": _colors(np.array([share]))[0], "linewidth": float(_widths(np.array(share)))}
        handles.append(Line2D([], [], label=f"with cable mass, platform share {100.0 * share:.0f} %", **look))
    handles.append(Line2D([], [], color=sheet.VERMILLION, linewidth=0.9, linestyle=sheet.DASHED, label="massless"))
    ax.legend(handles=handles, **legend_above(ax, [str(handle.get_label()) for handle in handles]))


MAP_QUANTITIES: Final = {  # attribute of a map -> label; the scale of "peak" is logarithmic
    "frequency": "lowest frequency with cable mass [Hz]",
    "massless_frequency": "lowest frequency, massless [Hz]",
    "platform_share": "platform's share of the lowest mode with cable mass",
    "peak": "largest response with cable mass [m/N]",
    "peak_frequency": "frequency of the largest response, with cable mass [Hz]",
}


def frequency_map(found: FrequencyMap, quantity: str = "frequency") -> Figure:
    """One quantity of a frequency map over a grid of poses, with one panel for each of several heights.

    Args:
        found: Map from `frequency_map`, of poses on a grid along x, y and z.
        quantity: "frequency", "massless_frequency", "platform_share", "peak" or "peak_frequency".

    Returns:
        The figure; cells without a solution are hatched.

    Raises:
        InvalidValueError: If `quantity` does not exist. If the poses are not on a grid.

    Examples:
        >>> import sagline as sl
        >>> import numpy as np
        >>> robot = sl.load_robot("cogiro")
        >>> grid = np.meshgrid([-1, 1], [-1, 1], [1, 2], indexing="ij")
        >>> poses = sl.Pose(np.stack(grid, axis=-1).reshape(-1, 3), np.eye(3))
        >>> found = sl.frequency_map(robot, poses, up_to=8.0)
        >>> figure = sl.plot.frequency_map(found)
    """
    label = MAP_QUANTITIES[choice(quantity, "quantity", MAP_QUANTITIES)]
    x, y, z, values = _gridded(instance(found, FrequencyMap, "found"), getattr(found, quantity))
    shown = max(count for count in PANELS if count <= z.size)
    rows = np.linspace(0, z.size - 1, shown).astype(np.intp)  # lowest, highest and some heights between
    known = values[:, :, rows][np.isfinite(values[:, :, rows])]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.5, 1.0)
    scale = LogNorm(low, max(high, 1.01 * low)) if quantity == "peak" and low > 0.0 else Normalize(low, high)
    columns = PANELS[shown]
    count, each = shown // columns, current().width / columns
    tall = np.clip(np.ptp(y) / max(float(np.ptp(x)), 1e-9), 0.4, 1.4) * each
    figure = sheet.sheet(1.4 + count * (0.85 * float(tall) + 0.5))
    figure.set_layout_engine("compressed")  # the panels have equal scales
    panels = figure.subplots(count, columns, sharex=True, sharey=True, squeeze=False)
    for ax, row in zip(panels.flat, rows, strict=True):
        sheet.draw_map(ax, x, y, values[:, :, row], scale, f"$z$ = {z[row]:.3g} m")
    drawn = ScalarMappable(scale, sheet.MAP_COLORS)
    sheet.color_bar(drawn, list(panels.flat), label, shrink=0.8, location="bottom", aspect=30)
    set_heading(figure, found.robot.name)
    return figure


def _gridded(found: FrequencyMap, values: Array) -> tuple[Array, Array, Array, Array]:
    """The coordinates of the grid, and the values at its points, (nx, ny, nz)."""
    axes = [np.unique(column) for column in found.pose.position.T]
    shape = tuple(axis.size for axis in axes)
    places = tuple(np.searchsorted(axis, column) for axis, column in zip(axes, found.pose.position.T, strict=True))
    if values.size != np.prod(shape) or np.unique(np.ravel_multi_index(places, shape)).size != values.size:
        step = "Make the poses with numpy.meshgrid, all with one orientation."
        raise InvalidValueError("found", f"{values.size} poses that fill no grid", "every point of a grid, once", step)
    grid = np.empty(shape)
    grid[places] = values
    return axes[0], axes[1], axes[2], grid


def response(
    vibration: Vibration | FrequencyResponse, force: str = "x", motion: str | None = None, ax: Axes | None = None
) -> Axes:
    """Amplitude of the platform's motion per force over frequency, with cable mass and with massless cables.

    Marks at the bottom are the modes with cable mass; a darker mark means a larger platform share.

    Args:
        vibration: Vibration of a stable state, from `vibration`; both curves have its damping. A result of
            `frequency_response` is drawn at its own frequencies, without marks of modes.
        force: "x", "y" or "z" for a force along this axis [N]; "about x", "about y" or "about z" for a moment [N m].
        motion: Motion to draw, with one of the names for `force`. None: along the force or about the moment.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes, both logarithmic.

    Raises:
        InvalidValueError: If the vibration has no modes. If the response has no frequencies. If `motion` does not
            exist.

    Examples:
        >>> import sagline as sl
        >>> found = sl.vibration(sl.load_robot("cogiro"), (1.0, 0.5, 2.0), up_to=20.0)
        >>> axes = sl.plot.response(found)
    """
    if isinstance(vibration, FrequencyResponse):
        curves, modes = ResponseCurves(vibration, force, motion), []
    else:
        curves = ResponseCurves.of_vibration(vibration, force, motion)
        modes = list(zip(vibration.frequency, vibration.platform_share, strict=True))
    ax = sheet.axes_or_new(ax)
    ax.loglog(curves.frequency, curves.with_mass, color=sheet.BLUE, linewidth=1.2, label="with cable mass", zorder=2.2)
    ax.loglog(
        curves.frequency, curves.massless, color=sheet.VERMILLION, linewidth=1.1, linestyle=sheet.DASHED,
        label="massless", zorder=2.1,
    )  # fmt: skip
    motion, cause = _described(motion or force, "rotation", "motion"), _described(force, "moment", "force")
    sheet.format_axes(ax, "frequency [Hz]", f"{motion} for a {cause} [{curves.unit}]")
    ax.set_xlim(curves.frequency[0], curves.frequency[-1])
    drawn = np.concatenate((curves.with_mass, curves.massless))
    low, high = max(float(drawn.min()), LOWEST * curves.static), min(float(drawn.max()), HIGHEST * curves.static)
    ax.set_ylim(0.7 * low, 1.4 * high)
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(which="minor", length=1.5, width=0.4)
    for frequency, share in modes:
        shade = FAINTEST + (1.0 - FAINTEST) * float(share)
        ax.axvline(frequency, ymax=MARK, color=sheet.BLUE, alpha=shade, linewidth=0.9, zorder=1.9)
    ax.set_title(_damping(vibration), fontsize=current().tick, loc="right")
    name_lines(ax)
    return ax


def _described(direction: str, about: str, along: str) -> str:
    return f"{about} {direction}" if direction.startswith("about") else f"{along} along {direction}"


def _damping(vibration: Vibration | FrequencyResponse) -> str:
    damping = vibration.damping
    parts = [
        f"modal damping {100.0 * damping.modal_damping:g} %" if damping.modal_damping else "",
        f"loss time {damping.loss_time:g} s" if damping.loss_time else "",
        f"air damping {damping.air_damping:g} N s/m²" if damping.air_damping else "",
    ]
    return ", ".join(filter(None, parts)) or "undamped: peaks are infinite"


SECONDS = 10.0  # duration of the animation [s]; the animation has whole periods, so that it repeats without a jump
PICTURES = 25  # pictures per period
HEIGHT, DOTS = 3.8, 140  # height of a picture [in], and dots per inch
COLORS = 48
LEAST_SHARE = 0.01  # a cable with a smaller share of the energy is not named


def film(vibration: Vibration, number: int, file: os.PathLike[str] | str, *, progress: Progress | None = None) -> None:
    """Write an animation of a mode with cable mass as a GIF. The animation has ten seconds and repeats.

    Args:
        vibration: Vibration, from `vibration`.
        number: Number of the mode, 1 for the lowest.
        file: The file, "mode.gif" for instance; an existing file is replaced.
        progress: Function that is called with the number of finished pictures and the total number.

    Raises:
        InvalidValueError: If the mode does not exist.
        FileError: If the file cannot be written. If its suffix is not .gif.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")  # doctest: +SKIP
        >>> found = sl.vibration(robot, (1.0, 0.5, 2.0), up_to=20.0)  # doctest: +SKIP
        >>> sl.plot.film(found, 1, "mode.gif")  # doctest: +SKIP
    """
    path = file_path(file)
    if path.suffix.lower() != ".gif":
        raise FileError(path, f"the suffix is {path.suffix or 'missing'}", "Name it .gif.")
    modes = [mode for mode in listed_modes(instance(vibration, Vibration, "vibration")) if mode.kind == WITH_MASS]
    if not 1 <= whole_number(number, "number", 1) <= len(modes):
        step = "Raise up_to to find more modes."
        raise InvalidValueError("number", number, f"1 to {len(modes)}, modes with cable mass", step)
    pictures = _pictures(Swing.of(vibration, modes[number - 1]), callback(progress, "progress"))
    rounds = round(SECONDS / PERIOD)
    buffer = BytesIO()
    pictures[0].save(
        buffer, "GIF", save_all=True, append_images=(pictures * rounds)[1:], duration=round(1e3 * PERIOD / PICTURES),
        loop=0,
    )  # fmt: skip
    with atomic_file(path) as partial:
        partial.write_bytes(buffer.getbuffer())


def _pictures(swing: Swing, progress: Progress | None) -> list[Image.Image]:
    """Pictures of one period, which all have the same color table."""
    robot, mode = swing.state.one_robot, swing.mode
    figure = sheet.sheet(HEIGHT)
    canvas: Any = FigureCanvasAgg(figure)
    figure.set_layout_engine("none")
    ax = figure.add_axes((0.0, 0.05, 1.0, 0.9), projection="3d")
    assert isinstance(ax, Axes3D)
    for course in swing.rest:
        ax.plot(*course.T, color=sheet.GAP_COLOR, linewidth=0.8)
    cables = [ax.plot(*course.T, color=sheet.BLUE, linewidth=1.3)[0] for course in swing.rest]
    edges = [ax.plot([0.0], [0.0], [0.0], color=sheet.VERMILLION, linewidth=1.6)[0] for _ in BOX_EDGES]
    ax.scatter(*robot.frame_anchors.T, color="black", s=7.0, depthshade=False)
    for artist in ax.get_children():
        artist.set_clip_on(False)  # the axes are square, but the picture is wider than high
    points = swing.rest.reshape(-1, 3)
    ax.set_box_aspect(fit_space(ax, points.min(axis=0), points.max(axis=0)), zoom=1.5)
    ax.set_axis_off()
    ax.view_init(elev=18.0, azim=-62.0)
    ax.set_title(f"{robot.name}, mode {mode.number}: {mode.frequency:.3f} Hz {mode.kind}", fontsize=sheet.LABEL, y=0.97)
    figure.text(0.5, 0.02, f"{_energy_shares(mode)}; {swing.text}", fontsize=sheet.TICK, ha="center")
    drawn = []
    for k in range(PICTURES):
        phase = 2.0 * np.pi * k / PICTURES
        for line, course in zip(cables, swing.courses(phase), strict=True):
            line.set_data_3d(*course.T)
        corners = platform_box(robot, swing.pose(phase))
        for line, (a, b) in zip(edges, BOX_EDGES, strict=True):
            line.set_data_3d(*corners[[a, b]].T)
        figure.set_dpi(DOTS)
        canvas.draw()
        drawn.append(Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB"))
        if progress is not None:
            progress(k + 1, PICTURES)
    palette = drawn[0].quantize(COLORS)
    return [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in drawn]


def _energy_shares(mode: ListedMode) -> str:
    words = f"kinetic energy: platform {100.0 * mode.platform_share:.0f} %"
    if mode.cable is None or mode.cable_share < LEAST_SHARE:
        return f"{words}, each cable less than {100.0 * LEAST_SHARE:g} %"
    return f"{words}, cable {mode.cable} {100.0 * mode.cable_share:.0f} %"
