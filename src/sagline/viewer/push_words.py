"""What is said of a push."""

from __future__ import annotations

import numpy as np

from sagline.core.numbers import n
from sagline.viewer.push import Pushed, Reserve, radii
from sagline.viewer.readout import LATER, box
from sagline.viewer.tension_scale import force_unit
from sagline.viewer.wording import ForceUnit


def answer(pushed: Pushed, drawn_for: float | None) -> str:
    """All of it, as HTML.

    Args:
        pushed: The push and its answer.
        drawn_for: Force that the ellipsoid is drawn for [N]; None where none is drawn.
    """
    unit = force_unit(pushed.state.one_robot)
    shared = LATER if pushed.shared is None else f"{left(pushed, pushed.shared, unit)}, the platform kept where it is"
    rows = [
        ("Force", unit.written(pushed.force)),
        ("It moves", moved(pushed)),
        ("Tensions", _tensions(pushed, unit)),
        ("Lengths held", left(pushed, pushed.held, unit)),
        ("Shared anew", shared),
        ("Gives way", _gives_way(pushed, drawn_for)),
    ]
    held = pushed.pushed is not None and pushed.held.force >= pushed.force
    head = "Pushed" if held else "Pushed beyond a limit"
    return box(
        "quiet" if held else "bad", head, "<dl>" + "".join(f"<dt>{a}</dt><dd>{b}</dd>" for a, b in rows) + "</dl>"
    )


def moved(pushed: Pushed) -> str:
    """How far it goes, in millimeters and degrees."""
    if pushed.pushed is None:
        return "no rest was found with this force"
    return f"{n(1e3 * np.linalg.norm(pushed.moved), '.3g', 'mm')}, {turned(pushed)}"


def turned(pushed: Pushed) -> str:
    """How far it turns."""
    return f"{n(np.degrees(np.linalg.norm(pushed.turned)), '.2g', '°')}"


def tip(pushed: Pushed) -> str:
    """What stands at the arrow."""
    return f"{force_unit(pushed.state.one_robot).written(pushed.force)}: moves {moved(pushed)}"


def reserve(pushed: Pushed) -> str:
    """What stands at the platform."""
    return left(pushed, pushed.held, force_unit(pushed.state.one_robot))


def left(pushed: Pushed, reserve: Reserve, unit: ForceUnit) -> str:
    """How much more force until a limit is reached, or how much too much it is."""
    if not np.isfinite(reserve.force):
        return "no limit found"
    more = reserve.force - pushed.force
    which = "" if reserve.cable is None else f" (cable {reserve.cable}, {'upper' if reserve.upper else 'lower'} limit)"
    if more >= 0.0:
        return f"{unit.written(more)} more{which}"
    return f"{unit.written(-more)} too much{which}"


def _tensions(pushed: Pushed, unit: ForceUnit) -> str:
    if pushed.pushed is None:
        return "–"
    tension = pushed.pushed.limited_tension
    return f"{unit.bare(tension.min())} to {unit.written(tension.max())}"


def _gives_way(pushed: Pushed, drawn_for: float | None) -> str:
    if not np.isfinite(pushed.compliance).all():
        return "freely: nothing holds it in some direction"
    least, middle, most = (n(1e3 * r, ".2g", "mm/N") for r in radii(pushed.compliance)[0])
    drawn = "" if drawn_for is None else f"; drawn as for {n(drawn_for, '.3g', 'N')}"
    return f"{least}, {middle} and {most}{drawn}"
