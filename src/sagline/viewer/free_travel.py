"""Free travel from a pose, and the panel of the region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import viser

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import InvalidValueError
from sagline.robot.robot import Robot
from sagline.viewer.readout import block, refused, sentence
from sagline.viewer.slices import MarginScale
from sagline.viewer.wording import ForceUnit
from sagline.workspaces.region import Find

_STEPS: Final = 20  # along each way at first: a gap that is narrower than a step may be passed over
_HALVINGS: Final = 14  # then: a way is known to some 1e-4 of its step
WAYS: Final = np.vstack((np.eye(3), -np.eye(3)))  # +x, +y, +z, -x, -y, -z
NAMES: Final = ("+x", "+y", "+z", "−x", "−y", "−z")


@dataclass(frozen=True, slots=True, eq=False)
class WhereTo:
    """Straight ways from a pose, the platform turned as it is.

    Attributes:
        start: Where they begin [m], shape (3,).
        inside: Whether the platform is within the workspace there.
        margin: There [N].
        which: Ways that a platform of this robot can go, indices of `WAYS`, shape (K,).
        distance: Along each to the boundary, or to the end of the box [m], shape (K,).
        crossed: Whether it ends at the boundary, shape (K,).
        cable: The cable that limits there, -1 where none does, shape (K,).
    """

    start: Array
    inside: bool
    margin: float
    which: Indices
    distance: Array
    crossed: Flags
    cable: Indices

    @property
    def ends(self) -> Array:
        """Where the ways end [m], shape (K, 3)."""
        return np.asarray(self.start + self.distance[:, None] * WAYS[self.which])


def free_ways(robot: Robot, flat: int | None) -> Indices:
    """Ways along axes of the world that the platform may move along.

    Returns:
        Indices of `WAYS`, shape (K,).
    """
    free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
    if flat is not None:
        free[flat] = False
    return np.flatnonzero(np.abs(WAYS) @ free > 0.5)


def where_to(find: Find, start: Array, which: Indices, low: Array, high: Array) -> WhereTo:
    """Follow straight ways to the boundary.

    Returns:
        How far each goes until the margin changes its sign: for a platform inside to where it has to stop, for one
        outside to where it would be held.
    """
    ways = WAYS[which]
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(ways > 0.0, (high - start) / ways, np.where(ways < 0.0, (low - start) / ways, np.inf))
    farthest = np.maximum(room.min(axis=1), 0.0)
    at = farthest[:, None] * np.linspace(0.0, 1.0, _STEPS + 1)
    first = find(start[None])
    value, cable = _found(find, start + at[..., None] * ways[:, None])
    inside = bool(first.level[0] >= 0.0)
    other = (value >= 0.0) != inside
    crossed = other.any(axis=1)
    last = np.where(crossed, other.argmax(axis=1), _STEPS)
    row = np.arange(len(which))
    near, far, limiting = at[row, np.maximum(last - 1, 0)], at[row, last], cable[row, last]
    for _ in range(_HALVINGS):
        middle = 0.5 * (near + far)
        value_there, cable_there = _found(find, (start + middle[:, None] * ways)[:, None])
        beyond = ((value_there[:, 0] >= 0.0) != inside) & crossed
        far, limiting = np.where(beyond, middle, far), np.where(beyond, cable_there[:, 0], limiting)
        near = np.where(beyond, near, middle)
    distance, limiting = np.where(crossed, far, farthest), np.where(crossed, limiting, -1)
    margin = float(first.margin[0])
    return WhereTo(start, inside, margin, which, locked(distance), locked(crossed), locked(limiting))


def _found(find: Find, places: Array) -> tuple[Array, Indices]:
    """Levels and limiting cables at places (K, S, 3)."""
    found = find(places.reshape(-1, 3))
    return found.level.reshape(places.shape[:2]), found.cable.reshape(places.shape[:2])


BY_CABLE, BY_MARGIN = "limiting cable", "margin"
PLANES: Final = {"level": 2, "upright, along x": 1, "upright, along y": 0}  # -> the axis at right angles
_NOTHING: Final = sentence("Nothing is computed until something is asked for.")


class SpacePanel:
    """A tab: what is drawn, the loads, and readings."""

    def __init__(self, gui: viser.GuiApi, readings: Any, planes: tuple[int, ...], changed: Callable[[], None]) -> None:
        """Build the tab."""
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
        """Force [N] and moment [N m] that are to be borne besides, along and about each axis."""
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
    """The number of a field."""
    value = float(field.value)
    if not 0.0 <= value < 1e12:
        raise InvalidValueError(field.label, value, f"0 {unit} or more", "Type a load, 0 for none.")
    return value
