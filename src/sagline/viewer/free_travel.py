"""Free travel from a pose along the axes of the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.robot.robot import Robot
from sagline.viewer.readout import block
from sagline.viewer.tension_scale import ForceUnit
from sagline.workspaces.region import Find

_STEPS: Final = 20  # along each direction at first: a gap narrower than a step may be missed
_BISECTIONS: Final = 14  # then: accurate to some 1e-4 of a step
DIRECTIONS: Final = np.vstack((np.eye(3), -np.eye(3)))  # +x, +y, +z, -x, -y, -z
NAMES: Final = ("+x", "+y", "+z", "−x", "−y", "−z")


@dataclass(frozen=True, slots=True, eq=False)
class FreeTravel:
    """Free travel from a position in directions of the axes, at one orientation."""

    start: Array  # the position [m], shape (3,)
    inside: bool  # whether it is within the workspace
    margin: float  # capacity margin there [N]
    which: Indices  # directions in which this robot can move, indices of `DIRECTIONS`, shape (K,)
    distance: Array  # distance to the boundary, or to the end of the box [m], shape (K,)
    crossed: Flags  # whether the boundary is reached, shape (K,)
    cable: Indices  # the cable that limits there, -1 where none does, shape (K,)

    @property
    def ends(self) -> Array:
        """End points [m], shape (K, 3)."""
        return np.asarray(self.start + self.distance[:, None] * DIRECTIONS[self.which])


def free_directions(robot: Robot, flat: int | None) -> Indices:
    """Indices of the `DIRECTIONS` of free motion, shape (K,); `flat` is the normal of a planar region."""
    free = np.abs(robot.freedom[:, :3]).max(axis=0) > 0.5
    if flat is not None:
        free[flat] = False
    return np.flatnonzero(np.abs(DIRECTIONS) @ free > 0.5)


def free_travel(find: Find, start: Array, which: Indices, low: Array, high: Array) -> FreeTravel:
    """Distances along directions to the sign change of the margin, by a scan and bisection."""
    ways = DIRECTIONS[which]
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(ways > 0.0, (high - start) / ways, np.where(ways < 0.0, (low - start) / ways, np.inf))
    farthest = np.maximum(room.min(axis=1), 0.0)
    at = farthest[:, None] * np.linspace(0.0, 1.0, _STEPS + 1)
    first = find(start[None])
    value, cable = _levels_at(find, start + at[..., None] * ways[:, None])
    inside = bool(first.level[0] >= 0.0)
    other = (value >= 0.0) != inside
    crossed = other.any(axis=1)
    last = np.where(crossed, other.argmax(axis=1), _STEPS)
    row = np.arange(len(which))
    near, far, limiting = at[row, np.maximum(last - 1, 0)], at[row, last], cable[row, last]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (near + far)
        value_there, cable_there = _levels_at(find, (start + middle[:, None] * ways)[:, None])
        beyond = ((value_there[:, 0] >= 0.0) != inside) & crossed
        far, limiting = np.where(beyond, middle, far), np.where(beyond, cable_there[:, 0], limiting)
        near = np.where(beyond, near, middle)
    distance, limiting = np.where(crossed, far, farthest), np.where(crossed, limiting, -1)
    margin = float(first.margin[0])
    return FreeTravel(start, inside, margin, which, locked(distance), locked(crossed), locked(limiting))


def _levels_at(find: Find, places: Array) -> tuple[Array, Indices]:
    """Levels and limiting cables at places (K, S, 3)."""
    found = find(places.reshape(-1, 3))
    return found.level.reshape(places.shape[:2]), found.cable.reshape(places.shape[:2])


def travel_text(found: FreeTravel, unit: ForceUnit) -> str:
    """HTML: the margin, the nearest boundary and what limits there, and all directions in a table."""
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
