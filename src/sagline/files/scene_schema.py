"""What stands around a robot, as its file says it: boxes, capsules, spheres, and meshes from files beside it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline.core.arguments import label
from sagline.core.arrays import exactly, number
from sagline.core.errors import InvalidValueError
from sagline.files.mesh_file import meters
from sagline.files.quantity import in_si
from sagline.files.schema import Entry
from sagline.interference.obstacles import Box, Capsule, Sphere
from sagline.robot.pose import Pose

_KINDS: Final = {  # and the keys that may stand beside each
    "box": ("center", "turned"),
    "capsule": ("radius",),
    "sphere": ("radius",),
    "mesh": ("unit", "position", "turned"),
}
_EITHER: Final = "one of box, capsule, sphere, mesh"


class Place(Entry):
    """One thing that stands around.

    Attributes:
        name: What it is called.
        box: Its edges.
        center: The box's middle.
        capsule: Both ends of its middle line.
        sphere: Its middle.
        radius: Of a capsule or sphere.
        mesh: The mesh's file, beside the robot's file.
        unit: Unit of the mesh's coordinates.
        position: Where the mesh's origin goes.
        turned: How a box or mesh is turned about z.
    """

    name: str
    box: Any = None
    center: Any = None
    capsule: Any = None
    sphere: Any = None
    radius: Any = None
    mesh: str | None = None
    unit: str = "m"
    position: Any = None
    turned: Any = 0.0

    def kind(self, item: str) -> str:
        """Which of the four it is, every other key fitting it.

        Raises:
            InvalidValueError: If it is none or several, or a key is missing or belongs to another.
        """
        label(self.name, f"{item}.name")
        given = self.model_fields_set - {"name"}
        found = [kind for kind in _KINDS if kind in given]
        if len(found) != 1:
            value = " and ".join(found) or "none of them"
            raise InvalidValueError(item, value, _EITHER, "Say what it is, once.")
        kind = found[0]
        if foreign := sorted(given - {kind, *_KINDS[kind]}):
            allowed = ", ".join(_KINDS[kind])
            raise InvalidValueError(f"{item}.{foreign[0]}", f"given for a {kind}", allowed, "Leave it out.")
        if "radius" in _KINDS[kind] and "radius" not in given:
            raise InvalidValueError(f"{item}.radius", "missing", "a length", f"Give the {kind}'s radius.")
        return kind

    def solid(self, item: str, kind: str) -> Box | Capsule | Sphere:
        """The thing, where it is none from a file."""
        if kind == "box":
            size = exactly(in_si(self.box, "m", f"{item}.box"), f"{item}.box", "m", (3,), above=0.0)
            return Box(size, self._point(item, "center"), self.pose(item).matrix, self.name)
        radius = number(in_si(self.radius, "m", f"{item}.radius"), f"{item}.radius", "m", low=0.0)
        if kind == "sphere":
            return Sphere(self._point(item, "sphere"), radius, self.name)
        ends = exactly(in_si(self.capsule, "m", f"{item}.capsule"), f"{item}.capsule", "m", (2, 3))
        return Capsule(ends[0], ends[1], radius, self.name)

    def pose(self, item: str) -> Pose:
        """Where its own frame is: the position of a mesh, and the turn about z."""
        angle = number(in_si(self.turned, "rad", f"{item}.turned"), f"{item}.turned", "rad")
        return Pose.from_euler(self._point(item, "position"), angle, 0.0, 0.0)

    def mesh_file(self, beside: Path) -> Path:
        """The mesh's file, found from the robot's."""
        return beside.parent / str(self.mesh)

    def _point(self, item: str, key: str) -> Any:
        value = getattr(self, key)
        place = f"{item}.{key}"
        return np.zeros(3) if value is None else exactly(in_si(value, "m", place), place, "m", (3,))


def check_scene(places: list[Place]) -> None:
    """Refuse what is wrong with a scene's values; meshes are not looked for.

    Raises:
        InvalidValueError: If a value has a wrong unit or shape, or is out of range.
    """
    for k, place in enumerate(places):
        item = f"scene[{k}]"
        kind = place.kind(item)
        if kind == "mesh":
            place.pose(item)
            meters(place.unit, f"{item}.unit")
        else:
            place.solid(item, kind)
