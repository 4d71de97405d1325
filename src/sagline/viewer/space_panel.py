"""The panel of the workspace: what of it is drawn, for which loads, and what it says in numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import viser

from sagline.core.errors import InvalidValueError
from sagline.viewer.margin_scale import MarginScale
from sagline.viewer.readout import block, refused, sentence
from sagline.viewer.where_to import NAMES, WhereTo
from sagline.viewer.wording import ForceUnit

BY_CABLE, BY_MARGIN = "limiting cable", "margin"
PLANES: Final = {"level": 2, "upright, along x": 1, "upright, along y": 0}  # -> the axis at right angles
_NOTHING: Final = sentence("Nothing is computed until something is asked for.")


class SpacePanel:
    """A tab: what is drawn, the loads, and readings."""

    def __init__(self, gui: viser.GuiApi, readings: Any, planes: tuple[int, ...], changed: Callable[[], None]) -> None:
        """Build the tab.

        Args:
            gui: Where.
            readings: The tabs that it is one of.
            planes: Axes at right angles to which the robot can be sliced.
            changed: Called, from any thread, when something is chosen.
        """
        with readings.add_tab("Workspace"):
            self._force = gui.add_number(
                "Force ± [N]", 0.0, min=0.0, hint="Further load that is to be borne, of this size along each axis."
            )
            self._moment = gui.add_number(
                "Moment ± [N m]", 0.0, min=0.0, hint="The same about each axis, about the center of mass."
            )
            self._hull: Any = gui.add_checkbox(
                "Region", False, hint="Where the platform may go, turned as it is now, with these loads."
            )
            self._by: Any = gui.add_dropdown("Region colored by", (BY_CABLE, BY_MARGIN), visible=False)
            self._told = gui.add_html("")
            self._left = gui.add_html("")
            self._slice: Any = gui.add_checkbox("Slice", False, hint="Margins on a plane through the platform.")
            names = tuple(name for name, normal in PLANES.items() if normal in planes)
            self._plane: Any = gui.add_dropdown("Plane", names, visible=False)
            self._key = gui.add_html("")
            self._ways: Any = gui.add_checkbox(
                "Where can I go", False, hint="How far along each axis, the platform turned as it is."
            )
            self._where = gui.add_html(_NOTHING)
        for handle in (self._force, self._moment, self._hull, self._by, self._slice, self._plane, self._ways):
            handle.on_update(lambda _: changed())

    @property
    def loads(self) -> tuple[float, float]:
        """Force [N] and moment [N m] that are to be borne besides, along and about each axis.

        Raises:
            InvalidValueError: If a client sent what is none.
        """
        return _checked(self._force, "N"), _checked(self._moment, "N m")

    @property
    def hull(self) -> bool:
        """Whether the hull is wanted."""
        return bool(self._hull.value)

    @property
    def by_cable(self) -> bool:
        """Whether the hull shows which cable limits; else the margin."""
        return bool(self._by.value != BY_MARGIN)

    @property
    def slice(self) -> bool:
        """Whether a slice is wanted."""
        return bool(self._slice.value)

    @property
    def normal(self) -> int:
        """The axis at right angles to the slice."""
        return PLANES.get(self._plane.value, PLANES[self._plane.options[0]])

    @property
    def ways(self) -> bool:
        """Whether the ways out of here are wanted."""
        return bool(self._ways.value)

    @property
    def anything(self) -> bool:
        """Whether anything is wanted."""
        return self.hull or self.slice or self.ways

    def arrange(self) -> None:
        """Show the choices of what is wanted, and forget what is not."""
        self._by.visible, self._plane.visible = self.hull, self.slice
        if not self.hull:
            self._told.content = self._left.content = ""
        if not self.slice and not (self.hull and not self.by_cable):
            self._key.content = ""
        if not self.ways:
            self._where.content = "" if self.anything else _NOTHING

    def say(self, text: str) -> None:
        """A remark on the hull."""
        self._told.content = sentence(text)

    def tell_hull(self, html: str) -> None:
        """What the hull is, in HTML."""
        self._told.content = block(html)

    def tell_left(self, text: str) -> None:
        """How much is left where the platform is."""
        self._left.content = block(f"<b>Here</b> {text}")

    def refuse(self, message: str) -> None:
        """Say why there is nothing to see."""
        self._told.content, self._left.content = refused(message), ""

    def explain(self, scale: MarginScale, unit: ForceUnit) -> None:
        """Say which color is which margin."""
        self._key.content = scale.key(unit)

    def tell_ways(self, found: WhereTo, unit: ForceUnit) -> None:
        """How far it is along each way, the nearest end first said."""
        self._where.content = ways_told(found, unit)


def ways_told(found: WhereTo, unit: ForceUnit) -> str:
    """HTML: the margin, the nearest end and what limits there, and all ways in a table."""
    head = f"<b>Margin</b> {unit.written(found.margin)}<br>"
    crossed = [k for k in range(len(found.which)) if found.crossed[k]]
    if crossed:
        nearest = min(crossed, key=lambda k: float(found.distance[k]))
        length, way = f"{found.distance[nearest]:.3f} m", NAMES[found.which[nearest]]
        head += f"<b>Boundary</b> {length} along {way}" if found.inside else f"<b>Way back</b> {length} along {way}"
        head += _limited(int(found.cable[nearest]))
    else:
        head += "Along no axis is there a boundary in the robot's box."
    rows = "".join(
        f"<tr><td>{NAMES[which]}</td><td>{distance:.3f} m</td>"
        f"<td>{_end(bool(crossed), int(cable), found.inside)}</td></tr>"
        for which, distance, crossed, cable in zip(found.which, found.distance, found.crossed, found.cable, strict=True)
    )
    return block(f"{head}<table><tr><th>way</th><th>length</th><th>ends at</th></tr>{rows}</table>")


def _limited(cable: int) -> str:
    return f", cable {cable} limits" if cable >= 0 else ""


def _end(crossed: bool, cable: int, inside: bool) -> str:
    if not crossed:
        return "the box"
    return f"{'the boundary' if inside else 'the workspace'}{f', cable {cable}' if cable >= 0 else ''}"


def _checked(field: Any, unit: str) -> float:
    """The number of a field.

    Raises:
        InvalidValueError: If a client sent one that is none, or negative.
    """
    value = float(field.value)
    if not 0.0 <= value < 1e12:
        raise InvalidValueError(field.label, value, f"0 {unit} or more", "Type a load, 0 for none.")
    return value
