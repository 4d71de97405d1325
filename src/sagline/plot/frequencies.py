"""Natural frequencies along a path or over states: whose they are is their width."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from sagline.core.arguments import instance
from sagline.core.arrays import checked
from sagline.core.errors import InvalidValueError
from sagline.dynamics.vibration.vibration import Vibration
from sagline.plot.names import above
from sagline.plot.sheet import BLUE, TICK, VERMILLION, axes_or_new, dressed
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from sagline.core.arrays import Array

THIN, WIDE = 0.6, 3.6  # pt: a mode in which only cables swing, one in which only the platform does
FAINT = 0.4  # how dense the thin ones are
SHARES = (1.0, 0.5, 0.0)  # in the legend


def frequencies(
    vibrations: Iterable[Vibration], time: ArrayLike | None = None, label: str = "time [s]", ax: Axes | None = None
) -> Axes:
    """Natural frequencies along a path, as in a diagram of Campbell: with cable mass, and massless (dashed).

    A line is as wide and as dense as the platform's share of the mode's kinetic energy: where a wide line fades and
    its neighbor grows, platform and cable pass the motion on to each other.

    Args:
        vibrations: Of N states in a row, from `vibration`.
        time: Where the states are on the horizontal axis, ascending, shape (N,), times of a path [s] for instance;
            None for their numbers.
        label: Of that axis, with its unit.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes.

    Raises:
        InvalidValueError: If there are less than two, or the times do not fit them.
    """
    states = tuple(instance(each, Vibration, f"vibrations[{k}]") for k, each in enumerate(vibrations))
    if len(states) < 2:
        raise InvalidValueError("vibrations", f"{len(states)} of them", "two at least", "Take more states of the path.")
    clock = np.arange(len(states), dtype=np.float64)
    if time is not None:
        clock = checked(time, "time", "s", shape=(len(states),))
        if clock.ndim != 1 or not np.all(np.diff(clock) > 0.0):
            raise InvalidValueError("time", "not ascending", "a time a state", "Sort the states by their times.")
    ax = axes_or_new(ax, height=3.6)
    ax.add_collection(_swinging(states, clock))
    massless = _filled([each.massless_frequency for each in states])
    ax.plot(clock, massless, color=VERMILLION, linewidth=0.9, linestyle=(0, (4.0, 1.6)), zorder=2.5)
    dressed(ax, "state" if time is None else label, "natural frequency [Hz]")
    if time is None:
        ax.xaxis.set_major_locator(MaxNLocator(integer=True))
    ax.set_xlim(clock[0], clock[-1])
    ax.set_ylim(0.0, min(each.up_to for each in states))
    _legend(ax)
    return ax


def _swinging(states: tuple[Vibration, ...], clock: Array) -> LineCollection:
    """A segment between every two neighbors, of the mean of both shares."""
    pieces, shares = [], []
    for (first, one), (second, other) in pairwise(zip(clock, states, strict=True)):
        count = min(one.frequency.size, other.frequency.size)
        ends = np.stack((one.frequency[:count], other.frequency[:count]), axis=1)
        places = np.broadcast_to((first, second), ends.shape)
        pieces.append(np.stack((places, ends), axis=2))
        shares.append(0.5 * (one.platform_share[:count] + other.platform_share[:count]))
    share = np.concatenate(shares)
    return LineCollection(
        list(np.concatenate(pieces)), colors=_colors(share), linewidths=_widths(share), capstyle="round", zorder=2.0
    )


def _widths(share: Array) -> Array:
    return np.asarray(THIN + (WIDE - THIN) * share)


def _colors(share: Array) -> list[tuple[float, float, float]]:
    """On white; not by opacity, in which round ends would show."""
    dense = FAINT + (1.0 - FAINT) * share
    red, green, blue = (1.0 - dense * (1.0 - part) for part in to_rgb(BLUE))
    return list(zip(red.tolist(), green.tolist(), blue.tolist(), strict=True))


def _filled(rows: list[Array]) -> Array:
    """Rows of different lengths as one table, NaN where there is none."""
    table = np.full((len(rows), max(row.size for row in rows)), np.nan)
    for k, row in enumerate(rows):
        table[k, : row.size] = row
    return table


def _legend(ax: Axes) -> None:
    handles = [
        Line2D([], [], color=_colors(np.array([share]))[0], linewidth=float(_widths(np.array(share))),
               label=f"with cable mass, platform share {100.0 * share:.0f} %")
        for share in SHARES
    ]  # fmt: skip
    handles.append(Line2D([], [], color=VERMILLION, linewidth=0.9, linestyle=(0, (4.0, 1.6)), label="massless"))
    labels = [str(handle.get_label()) for handle in handles]
    place = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 2, "fontsize": TICK, "frameon": False}
    ax.legend(handles=handles, **(above(ax, labels) if current().direct else place))
