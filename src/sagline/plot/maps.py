"""Maps over a grid of poses: lowest frequencies and strongest answers, height by height."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm, Normalize

from sagline.core.arguments import choice, instance
from sagline.core.errors import InvalidValueError
from sagline.dynamics.vibration.frequency_map import FrequencyMap
from sagline.plot.sheet import GAP_COLOR, WIDTH, sheet
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from sagline.core.arrays import Array

PANELS: Final = {6: 3, 4: 2, 3: 3, 2: 2, 1: 1}  # heights that are drawn -> panels beside each other; none stays empty
COLORS: Final = "cividis"  # the same to all eyes


class Quantity(NamedTuple):
    """What can be drawn: where it is, what it is called, and whether decades apart."""

    place: str
    label: str
    logarithmic: bool


QUANTITIES: Final = {
    "frequency": Quantity("frequency", "lowest frequency with cable mass [Hz]", False),
    "massless_frequency": Quantity("massless_frequency", "lowest frequency, massless [Hz]", False),
    "platform_share": Quantity("platform_share", "platform's share of the lowest mode with cable mass", False),
    "peak": Quantity("peak", "strongest answer with cable mass [m/N]", True),
    "peak_frequency": Quantity("peak_frequency", "frequency of the strongest answer, with cable mass [Hz]", False),
}


def frequency_map(found: FrequencyMap, quantity: str = "frequency") -> Figure:
    """One quantity of a map over a grid of poses, a panel for each of some heights.

    Args:
        found: From `frequency_map`, of poses that are a grid along x, y and z.
        quantity: "frequency", "massless_frequency", "platform_share", "peak" or "peak_frequency".

    Returns:
        The figure; gray where there is no answer.

    Raises:
        InvalidValueError: If there is no such quantity, or the poses are no grid.
    """
    name, label, logarithmic = QUANTITIES[choice(quantity, "quantity", QUANTITIES)]
    x, y, z, values = _gridded(instance(found, FrequencyMap, "found"), getattr(found, name))
    shown = max(count for count in PANELS if count <= z.size)
    rows = np.linspace(0, z.size - 1, shown).astype(np.intp)  # the lowest, the highest, and some between
    known = values[:, :, rows][np.isfinite(values[:, :, rows])]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.5, 1.0)
    scale = LogNorm(low, max(high, 1.01 * low)) if logarithmic and low > 0.0 else Normalize(low, high)
    columns = PANELS[shown]
    count, each = shown // columns, WIDTH / columns
    tall = np.clip(np.ptp(y) / max(float(np.ptp(x)), 1e-9), 0.4, 1.4) * each
    figure = sheet(0.5 + count * (0.85 * float(tall) + 0.3))
    panels = figure.subplots(count, columns, sharex=True, sharey=True, squeeze=False)
    for ax, row in zip(panels.flat, rows, strict=True):
        ax.set_facecolor(GAP_COLOR)
        ax.pcolormesh(_edges(x), _edges(y), values[:, :, row].T, norm=scale, cmap=COLORS, rasterized=True)
        ax.set_title(f"$z$ = {z[row]:.3g} m", fontsize=current().tick)
        ax.set_aspect("equal")
        ax.tick_params(labelsize=current().tick, length=3.0, width=0.6)
        ax.set_xlabel("$x$ [m]", fontsize=current().label)
        ax.set_ylabel("$y$ [m]", fontsize=current().label)
        ax.label_outer()
    bar = figure.colorbar(ScalarMappable(scale, COLORS), ax=list(panels.flat), shrink=0.8, pad=0.02)
    bar.set_label(label, fontsize=current().label)
    bar.ax.tick_params(labelsize=current().tick)
    figure.suptitle(found.robot.name, fontsize=current().label)
    return figure


def _gridded(found: FrequencyMap, values: Array) -> tuple[Array, Array, Array, Array]:
    """The grid's coordinates, and values at its points, (nx, ny, nz)."""
    axes = [np.unique(column) for column in found.pose.position.T]
    shape = tuple(axis.size for axis in axes)
    places = tuple(np.searchsorted(axis, column) for axis, column in zip(axes, found.pose.position.T, strict=True))
    if values.size != np.prod(shape) or np.unique(np.ravel_multi_index(places, shape)).size != values.size:
        step = "Make the poses with numpy.meshgrid, all with one orientation."
        raise InvalidValueError("found", f"{values.size} poses that fill no grid", "every point of a grid, once", step)
    grid = np.empty(shape)
    grid[places] = values
    return axes[0], axes[1], axes[2], grid


def _edges(middles: Array) -> Array:
    """Edges of the cells around points of a grid."""
    if middles.size == 1:
        return np.asarray(middles[0] + np.array([-0.5, 0.5]))
    between = 0.5 * (middles[1:] + middles[:-1])
    return np.concatenate(([2.0 * middles[0] - between[0]], between, [2.0 * middles[-1] - between[-1]]))
