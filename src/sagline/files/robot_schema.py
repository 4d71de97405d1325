"""Keys and units of robot files. Ranges and shapes are checked by the constructor of the robot."""

from __future__ import annotations

import reprlib
from typing import TYPE_CHECKING, Annotated, Any, Final, TypeAlias

import numpy as np
from attrs import NOTHING, fields
from pydantic import Field, model_validator

from sagline.cables.cable import Cable
from sagline.core.arguments import label
from sagline.core.arrays import Array, checked, exactly, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import units
from sagline.files.quantity import plain_number
from sagline.files.yaml_text import YamlEntry, schema_of
from sagline.robot.pose import Pose, PoseBox
from sagline.robot.robot import Robot, box_inertia, cylinder_inertia
from sagline.robot.tolerances import UNCERTAIN, Provenance, of_share, value_of
from sagline.robot.winch import Winch

if TYPE_CHECKING:
    from sagline.interference.obstacles import Box, Capsule, Sphere

_KINDS: Final = {  # kinds of obstacles, and the additional keys that each kind allows
    "box": ("center", "turned"),
    "capsule": ("radius",),
    "sphere": ("radius",),
    "mesh": ("unit", "position", "turned"),
}
_EITHER: Final = "one of box, capsule, sphere, mesh"
_ERROR: Final = "calibration.standard_error."  # prefix of the keys of standard errors
Meters: TypeAlias = Annotated[Any, "m"]
Newtons: TypeAlias = Annotated[Any, "N"]
Moment: TypeAlias = Annotated[Any, "kg*m^2"]  # moment or product of inertia
SWIVEL_AXES: Final = {"up": [0.0, 0.0, 1.0], "down": [0.0, 0.0, -1.0]}  # words for vertical directions


class _ObstacleEntry(YamlEntry):
    """Obstacle around the robot; `_KINDS` lists the allowed combinations of keys."""

    name: str
    box: Meters = None  # edges of a box
    center: Meters = None  # center of a box
    capsule: Meters = None  # end points of the axis of a capsule
    sphere: Meters = None  # center of a sphere
    radius: Meters = None  # radius of a capsule or sphere
    mesh: str | None = None  # file in the folder of the robot file
    unit: str = "m"  # unit of the coordinates of a mesh
    position: Meters = None  # position of the origin of a mesh
    turned: Annotated[Any, "rad"] = 0.0  # angle of a box or mesh about z

    def _kind(self, item: str) -> str:
        """Kind of the obstacle; raise InvalidValueError for a combination of keys that is not allowed."""
        label(self.name, f"{item}.name")
        given = self.model_fields_set - {"name"}
        found = [kind for kind in _KINDS if kind in given]
        if len(found) != 1:
            value = " and ".join(found) or "none of them"
            raise InvalidValueError(item, value, _EITHER, "Give exactly one of these keys.")
        kind = found[0]
        if foreign := sorted(given - {kind, *_KINDS[kind]}):
            allowed = ", ".join(_KINDS[kind])
            raise InvalidValueError(f"{item}.{foreign[0]}", f"given for a {kind}", allowed, "Leave it out.")
        if "radius" in _KINDS[kind] and "radius" not in given:
            raise InvalidValueError(f"{item}.radius", "missing", "a length", f"Give the {kind}'s radius.")
        return kind

    def solid(self, item: str) -> Box | Capsule | Sphere | None:
        """Box, capsule or sphere of the entry. None for a mesh: its values are checked, but its file is not read."""
        from sagline.files.mesh_file import meters  # imported here because most robot files have no scene
        from sagline.interference.obstacles import Box, Capsule, Sphere

        kind = self._kind(item)
        if kind == "mesh":
            self.pose(item)
            meters(self.unit, f"{item}.unit")
            return None
        if kind == "box":
            size = exactly(self.si("box", f"{item}."), f"{item}.box", "m", (3,), above=0.0)
            return Box(size, self._point(item, "center"), self.pose(item).matrix, self.name)
        radius = number(self.si("radius", f"{item}."), f"{item}.radius", "m", low=0.0)
        if kind == "sphere":
            return Sphere(self._point(item, "sphere"), radius, self.name)
        ends = exactly(self.si("capsule", f"{item}."), f"{item}.capsule", "m", (2, 3))
        return Capsule(ends[0], ends[1], radius, self.name)

    def pose(self, item: str) -> Pose:
        """Pose of the obstacle's frame: the position of a mesh, and the rotation about z."""
        angle = number(self.si("turned", f"{item}."), f"{item}.turned", "rad")
        return Pose.from_euler(self._point(item, "position"), angle, 0.0, 0.0)

    def _point(self, item: str, key: str) -> Any:
        if getattr(self, key) is None:
            return np.zeros(3)
        return exactly(self.si(key, f"{item}."), f"{item}.{key}", "m", (3,))


def _only_way(item: str, keys: set[str], ways: tuple[tuple[str, ...], ...]) -> tuple[str, ...]:
    """The one of `ways` with the same keys as `keys`. Raise an error if there is none."""
    for way in ways:
        if keys == set(way):
            return way
    given, allowed = " and ".join(sorted(keys)) or "nothing", "; or ".join(" and ".join(way) for way in ways)
    raise InvalidValueError(item, f"given by {given}", allowed, "Give exactly one of these.")


class _Cables(YamlEntry):
    """Schema of the cables. Each value is one number for all cables, or a list."""

    linear_density: Annotated[Any, "kg/m"]
    axial_stiffness: Newtons = None
    youngs_modulus: Annotated[Any, "Pa"] = None
    section_area: Annotated[Any, "m^2"] = None
    radius: Meters = None
    diameter: Meters = None
    expansion: Annotated[Any, "1/K"] = None

    def cable(self) -> Cable:
        """Create the cables. The stiffness follows from the given keys, and a missing section from the diameter."""
        ways = (("axial_stiffness",), *(("youngs_modulus", key) for key in ("section_area", "radius", "diameter")))
        keys = self.model_fields_set - {"linear_density", "expansion"}
        if keys & {"axial_stiffness", "section_area"}:
            keys.discard("diameter")
        *_, section = _only_way("cables: stiffness", keys, ways)
        density = self.si("linear_density", "cables.")
        width = self.si(section, "cables.")
        known = {key: self.si(key, "cables.") for key in ("diameter", "expansion") if key in self.model_fields_set}
        if section == "axial_stiffness":
            return Cable(density, width, **known)
        if section != "section_area":
            radius = checked(width, f"cables.{section}", "m", above=0.0) * (0.5 if section == "diameter" else 1.0)
            known.setdefault("diameter", 2.0 * radius)
            width = np.pi * radius**2
        return Cable.from_material(density, self.si("youngs_modulus", "cables."), width, **known)


class _Winches(schema_of(units(Winch))):  # type: ignore[misc]
    """Schema of the winches and pulleys. Each value is one number for all cables, or a list."""

    swivel_axis: Annotated[Any, ""] = None  # a vector or a word
    on_platform: Annotated[Any, ""] = None  # true or false

    def winches(self) -> Winch:
        """Create the winches. Missing values are the defaults of `Winch`."""
        if "swivel_axis" in self.model_fields_set:
            self.swivel_axis = _vectors(self.swivel_axis)
        if "on_platform" in self.model_fields_set:
            self.on_platform = _flags(self.on_platform)
        return Winch(**self.given("winches."))


def _flags(value: object) -> object:
    """1 for true and 0 for false, for all cables or in a list."""
    if isinstance(value, list):
        return [_flags(entry) for entry in value]
    if not isinstance(value, bool):
        allowed, step = "true or false, or a list of them", "Say where the winch is."
        raise InvalidValueError("winches.on_platform", reprlib.repr(value), allowed, step)
    return float(value)


def _vectors(value: object) -> object:
    """Swivel axis for all cables, or a list of axes; words are replaced by vectors."""
    if isinstance(value, list):
        return [_vectors(entry) for entry in value]
    if not isinstance(value, str) or plain_number(value) is not None:
        return value
    if value not in SWIVEL_AXES:
        allowed = f"{', '.join(SWIVEL_AXES)}, or a vector of three numbers"
        step = "Give the direction in which the cable enters the pulley."
        raise InvalidValueError("winches.swivel_axis", reprlib.repr(value), allowed, step)
    return SWIVEL_AXES[value]


class _Inertia(YamlEntry):
    """Schema of the inertia about the center of mass: a matrix, its diagonal or elements, or a solid body."""

    matrix: Moment = None
    diagonal: Moment = None
    Ixx: Moment = None
    Iyy: Moment = None
    Izz: Moment = None
    Ixy: Moment = 0.0  # this key and the next two are elements of the matrix: negative products of inertia
    Ixz: Moment = 0.0
    Iyz: Moment = 0.0
    box: Meters = None
    cylinder_radius: Meters = None
    cylinder_height: Meters = None

    @model_validator(mode="before")
    @classmethod
    def _accept_list(cls, data: object) -> object:
        """Read the matrix from a list of lists, or its diagonal from a list of numbers."""
        if not isinstance(data, list):
            return data
        return {"matrix" if any(isinstance(row, list) for row in data) else "diagonal": data}

    def about_center(self, mass: float) -> Array:
        """Inertia matrix for a platform of this mass [kg], shape (3, 3)."""
        ways = (("matrix",), ("diagonal",), ("Ixx", "Iyy", "Izz"), ("box",), ("cylinder_radius", "cylinder_height"))
        keys = self.model_fields_set
        way = _only_way("inertia", keys - {"Ixy", "Ixz", "Iyz"} if "Ixx" in keys else keys, ways)
        values = [self.si(key, "inertia.") for key in way]
        match way[0]:
            case "matrix":
                return exactly(values[0], "inertia", "kg m^2", (3, 3))
            case "diagonal":
                return np.diag(exactly(values[0], "inertia", "kg m^2", (3,)))
            case "box":
                return box_inertia(mass, *exactly(values[0], "inertia.box", "m", (3,), above=0.0))
            case "cylinder_radius":
                sizes = zip(values, way, strict=True)
                return cylinder_inertia(mass, *(number(v, f"inertia.{key}", "m", above=0.0) for v, key in sizes))
        xx, yy, zz = values
        xy, xz, yz = (self.si(key, "inertia.") for key in ("Ixy", "Ixz", "Iyz"))
        return exactly([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], "inertia", "kg m^2", (3, 3))


class _TestBox(schema_of(units(PoseBox) | {"tilt": "rad"}, ("low", "high"))):  # type: ignore[misc]
    """Schema of the test box: poses for tests of the robot."""


class _Deviations(schema_of({name: what.unit for name, what in UNCERTAIN.items()})):  # type: ignore[misc]
    """Schema of the standard deviations of a robot's values: one number per field, per axis or per value."""

    def of(self, robot: Robot, within: str) -> dict[str, Any]:
        """Standard deviations in SI. A percentage refers to the robot's value."""
        found = {}
        for key in (key for key in _Deviations.model_fields if key in self.model_fields_set):
            item, value = within + key, getattr(self, key)
            if UNCERTAIN[key].share and _in_percent(value):
                found[key] = of_share(_share(value, item), value_of(robot, key), item.replace(".", ": "))
            else:
                found[key] = self.si(key, within)
        return found


def _in_percent(value: object) -> bool:
    """True if `value` is a text in percent, or a list that begins with such a text."""
    if isinstance(value, list):
        return bool(value) and _in_percent(value[0])
    return isinstance(value, str) and value.rstrip().endswith("%")


def _share(value: Any, item: str) -> Any:
    """Convert percentages to fractions."""
    if isinstance(value, list):
        return [_share(element, f"{item}[{i}]") for i, element in enumerate(value)]
    number = plain_number(value.strip().removesuffix("%")) if _in_percent(value) else None
    if number is None:
        raise InvalidValueError(item, reprlib.repr(value), 'a share, such as "5 %"', "Give all of them in percent.")
    return number / 100.0


class _Calibration(YamlEntry):
    """Schema of the calibration that has determined some of the values."""

    log: str
    date: str
    note: str = ""
    standard_error: _Deviations = Field(default_factory=_Deviations)

    def provenance(self, robot: Robot) -> Provenance:
        """Create the record of the origin of the robot's values."""
        return Provenance(self.log, self.date, self.standard_error.of(robot, _ERROR), self.note)


# the fields of Robot, in their order: quantities by their units, texts, and parts with a schema of their own
_PARTS: Final = {
    **{"cables": _Cables, "winches": _Winches | None, "inertia": _Inertia | None, "test_box": _TestBox | None},
    **{"assumed": dict[str, str], "tolerances": _Deviations | None, "calibration": _Calibration | None},
}
_KEYS: Final = {field.name: field.metadata.get("unit", str) for field in fields(Robot)} | _PARTS
_REQUIRED: Final = [field.name for field in fields(Robot) if field.default is NOTHING]


class RobotEntry(schema_of(_KEYS, _REQUIRED)):  # type: ignore[misc]
    """Schema of a whole robot file. Keys and units are those of the fields of `Robot`."""

    scene: list[_ObstacleEntry] = Field(default_factory=list)  # not a field of Robot; see sagline.files.robot_file

    def robot(self) -> Robot:
        """Create the robot that the file describes."""
        keys = self.model_fields_set - {"scene", "tolerances", "calibration"}
        fields = {key: getattr(self, key) for key in keys} | self.given()
        for k, place in enumerate(self.scene):
            place.solid(f"scene[{k}]")
        fields["cables"] = self.cables.cable()
        if self.winches is not None:
            fields["winches"] = self.winches.winches()
        if self.inertia is not None:
            mass = number(fields["mass"], "mass", "kg", above=0.0)
            fields["inertia"] = self.inertia.about_center(mass)
        if self.test_box is not None:
            fields["test_box"] = PoseBox(**self.test_box.given("test_box."))
        robot = Robot(**fields)
        about: dict[str, Any] = {}  # tolerances may be in percent of the robot's values
        if self.tolerances is not None:
            about["tolerances"] = self.tolerances.of(robot, "tolerances.")
        if self.calibration is not None:
            about["calibration"] = self.calibration.provenance(robot)
        return robot.replace(**about) if about else robot
