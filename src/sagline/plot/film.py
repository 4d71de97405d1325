"""Animation of a mode, with an exaggerated motion of platform and cables."""

from __future__ import annotations

import os
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from mpl_toolkits.mplot3d.axes3d import Axes3D
from PIL import Image

from sagline.core.arguments import callback, file_path, instance, whole_number
from sagline.core.arrays import Progress
from sagline.core.errors import FileError, InvalidValueError
from sagline.dynamics.vibration.vibration import WITH_MASS, ListedMode, Vibration, listed_modes
from sagline.files.writing import atomic_file
from sagline.plot.robot import fit_space, platform_box
from sagline.plot.sheet import BLUE, GAP_COLOR, LABEL, TICK, VERMILLION, sheet
from sagline.viewer.shapes import BOX_EDGES
from sagline.viewer.swing import PERIOD, Swing

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
    figure = sheet(HEIGHT)
    canvas: Any = FigureCanvasAgg(figure)
    figure.set_layout_engine("none")
    ax = figure.add_axes((0.0, 0.05, 1.0, 0.9), projection="3d")
    assert isinstance(ax, Axes3D)
    for course in swing.rest:
        ax.plot(*course.T, color=GAP_COLOR, linewidth=0.8)
    cables = [ax.plot(*course.T, color=BLUE, linewidth=1.3)[0] for course in swing.rest]
    edges = [ax.plot([0.0], [0.0], [0.0], color=VERMILLION, linewidth=1.6)[0] for _ in BOX_EDGES]
    ax.scatter(*robot.frame_anchors.T, color="black", s=7.0, depthshade=False)
    for artist in ax.get_children():
        artist.set_clip_on(False)  # the axes are square, but the picture is wider than high
    points = swing.rest.reshape(-1, 3)
    ax.set_box_aspect(fit_space(ax, points.min(axis=0), points.max(axis=0)), zoom=1.5)
    ax.set_axis_off()
    ax.view_init(elev=18.0, azim=-62.0)
    ax.set_title(f"{robot.name}, mode {mode.number}: {mode.frequency:.3f} Hz {mode.kind}", fontsize=LABEL, y=0.97)
    figure.text(0.5, 0.02, f"{_energy_shares(mode)}; {swing.text}", fontsize=TICK, ha="center")
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
