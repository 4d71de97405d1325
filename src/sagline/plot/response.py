"""How strongly the platform answers a force, over frequency: what cables with mass do, and what massless ones would."""

from __future__ import annotations

from typing import TYPE_CHECKING

from matplotlib.ticker import LogLocator, NullFormatter

from sagline.dynamics.vibration.response import FrequencyResponse, drawn_curves, response_curves
from sagline.plot.names import name_lines
from sagline.plot.sheet import BLUE, VERMILLION, axes_or_new, dressed
from sagline.plot.style import current

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from sagline.core.arrays import Array
    from sagline.dynamics.vibration.vibration import Vibration

HIGHEST, LOWEST = 2e2, 1e-3  # over the answer at rest: undamped peaks have no top, and zeros no bottom
MARK = 0.035  # longest mark of a mode, of the axes' height
FAINTEST = 0.15  # mark of a mode in which the platform stands still


def response(
    vibration: Vibration | FrequencyResponse, force: str = "x", motion: str | None = None, ax: Axes | None = None
) -> Axes:
    """How far the platform swings for a force of 1 N, over frequency: with cable mass, and massless.

    Marks at the foot are the modes with cable mass, the darker the more the platform takes part.

    Args:
        vibration: Of a stable state, from `vibration`; its damping is that of both curves. Or what `frequency_response`
            found, which is drawn at its own frequencies and marks no modes.
        force: "x", "y", "z": a force along it; "about x", ...: a moment [N m].
        motion: In the same words, what is drawn; None for the motion of the force.
        ax: Axes to draw on; None for a new figure.

    Returns:
        The axes, both logarithmic.

    Raises:
        InvalidValueError: If the vibration has no modes or the response no frequencies, or there is no such motion.
    """
    if isinstance(vibration, FrequencyResponse):
        curves, modes = drawn_curves(vibration, force, motion), []
    else:
        curves = response_curves(vibration, force, motion)
        modes = list(zip(vibration.frequency, vibration.platform_share, strict=True))
    ax = axes_or_new(ax)
    ax.loglog(curves.frequency, curves.with_mass, color=BLUE, linewidth=1.2, label="with cable mass", zorder=2.2)
    ax.loglog(
        curves.frequency, curves.massless, color=VERMILLION, linewidth=1.1, linestyle=(0, (4.0, 1.6)),
        label="massless", zorder=2.1,
    )  # fmt: skip
    dressed(ax, "frequency [Hz]", f"{_name(motion or force)} for a {_cause(force)} [{curves.unit}]")
    ax.set_xlim(curves.frequency[0], curves.frequency[-1])
    ax.set_ylim(*_range(curves.with_mass, curves.massless, curves.static))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.tick_params(which="minor", length=1.5, width=0.4)
    for frequency, share in modes:
        shade = FAINTEST + (1.0 - FAINTEST) * float(share)
        ax.axvline(frequency, ymax=MARK, color=BLUE, alpha=shade, linewidth=0.9, zorder=1.9)
    ax.set_title(_damping(vibration), fontsize=current().tick, loc="right")
    name_lines(ax)
    return ax


def _range(with_mass: Array, massless: Array, static: float) -> tuple[float, float]:
    low = min(with_mass.min(), massless.min())
    high = max(with_mass.max(), massless.max())
    return 0.7 * max(float(low), LOWEST * static), 1.4 * min(float(high), HIGHEST * static)


def _name(motion: str) -> str:
    return f"rotation {motion}" if motion.startswith("about") else f"motion along {motion}"


def _cause(force: str) -> str:
    return f"moment {force}" if force.startswith("about") else f"force along {force}"


def _damping(vibration: Vibration | FrequencyResponse) -> str:
    """What both curves are damped by, in words."""
    damping = vibration.damping
    parts = [
        f"modal damping {100.0 * damping.modal_damping:g} %" if damping.modal_damping else "",
        f"loss time {damping.loss_time:g} s" if damping.loss_time else "",
        f"air damping {damping.air_damping:g} N s/m²" if damping.air_damping else "",
    ]
    return ", ".join(filter(None, parts)) or "undamped: peaks have no top"
