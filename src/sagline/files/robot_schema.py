"""What a robot file may contain: its keys and their units. Ranges and shapes are the robot's own to check."""

from __future__ import annotations

import reprlib
from typing import Any, Final

import numpy as np
from pydantic import Field, model_validator

from sagline.cables.cable import Cable
from sagline.core.arrays import Array, checked, exactly, number
from sagline.core.errors import InvalidValueError
from sagline.files.quantity import in_si, plain_number
from sagline.files.scene_schema import Place, check_scene
from sagline.files.schema import Entry
from sagline.robot.inertia import box_inertia, cylinder_inertia
from sagline.robot.pose_box import PoseBox
from sagline.robot.provenance import Provenance
from sagline.robot.robot import Robot
from sagline.robot.tolerances import UNCERTAIN, of_share, value_of
from sagline.robot.winch import RULES, Winch

_ERROR: Final = "calibration.standard_error."  # where those of a robot's numbers are
_UNITS: Final = {
    "frame_anchors": "m",
    "platform_anchors": "m",
    "mass": "kg",
    "center_of_mass": "m",
    "gravity": "m/s^2",
    "plane_normal": "",
    "tension_min": "N",
    "tension_max": "N",
    "platform_size": "m",
    "frame_size": "m",
    "cables.linear_density": "kg/m",
    "cables.axial_stiffness": "N",
    "cables.youngs_modulus": "Pa",
    "cables.section_area": "m^2",
    "cables.radius": "m",
    "cables.diameter": "m",
    "cables.expansion": "1/K",
    "inertia.box": "m",
    "inertia.cylinder_radius": "m",
    "inertia.cylinder_height": "m",
    **{f"tolerances.{name}": what.unit for name, what in UNCERTAIN.items()},
    **{f"{_ERROR}{name}": what.unit for name, what in UNCERTAIN.items()},
    "test_box.low": "m",
    "test_box.high": "m",
    "test_box.tilt": "rad",
    "winches.swivel_axis": "",
    "winches.guides": "m",
    **{f"winches.{name}": rule.unit for name, rule in RULES.items()},
}  # every other key of inertia is in kg m^2
SWIVEL_AXES: Final = {"up": [0.0, 0.0, 1.0], "down": [0.0, 0.0, -1.0]}  # the words for the axes that there are


class _RobotPart(Entry):
    """A mapping in a robot file."""

    def given(self, key: str, within: str = "") -> Any:
        """A key's quantity in SI."""
        item = within + key
        return in_si(getattr(self, key), _UNITS.get(item, "kg*m^2"), item)

    def only_way(self, item: str, ways: tuple[tuple[str, ...], ...], beside: tuple[str, ...]) -> tuple[str, ...]:
        """The one of several sets of keys that is there, whole and alone but for the keys `beside` them."""
        found = self.model_fields_set.difference(beside)
        for way in ways:
            if found == set(way):
                return way
        raise InvalidValueError(
            item,
            "given by " + (" and ".join(sorted(found)) or "nothing"),
            "; or ".join(" and ".join(way) for way in ways),
            "Give exactly one of these.",
        )


class _Cables(_RobotPart):
    """Material of the cables; each value one number for all of them, or a list."""

    linear_density: Any
    axial_stiffness: Any = None
    youngs_modulus: Any = None
    section_area: Any = None
    radius: Any = None
    diameter: Any = None
    expansion: Any = None

    def cable(self) -> Cable:
        """The cables, from whichever way their stiffness is given; a diameter gives it where nothing else does."""
        ways = (("axial_stiffness",), *(("youngs_modulus", key) for key in ("section_area", "radius", "diameter")))
        beside = ["linear_density", "expansion"]
        if self.model_fields_set & {"axial_stiffness", "section_area"}:
            beside.append("diameter")
        *_, section = self.only_way("cables: stiffness", ways, beside=tuple(beside))
        density = self.given("linear_density", "cables.")
        width = self.given(section, "cables.")
        known = {key: self.given(key, "cables.") for key in ("diameter", "expansion") if key in self.model_fields_set}
        if section == "axial_stiffness":
            return Cable(density, width, **known)
        if section != "section_area":
            radius = checked(width, f"cables.{section}", "m", above=0.0) * (0.5 if section == "diameter" else 1.0)
            known.setdefault("diameter", 2.0 * radius)
            width = np.pi * radius**2
        return Cable.from_material(density, self.given("youngs_modulus", "cables."), width, **known)


class _Winches(_RobotPart):
    """The machine behind the frame anchors; each value one number for all cables, or a list."""

    pulley_radius: Any = None
    swivel_axis: Any = None
    pulley_friction: Any = None
    rolling_friction: Any = None
    dead_cable: Any = None
    dead_rise: Any = None
    guides: Any = None
    drum_radius: Any = None
    drum_width: Any = None
    groove_pitch: Any = None
    layers: Any = None
    drum_distance: Any = None
    drum_offset: Any = None
    gear: Any = None
    counts_per_turn: Any = None
    count_zero: Any = None
    length_zero: Any = None
    cable_length: Any = None
    winding_tension: Any = None
    inertia: Any = None
    torque_limit: Any = None
    speed_limit: Any = None
    friction: Any = None
    position_gain: Any = None
    speed_gain: Any = None
    integral_gain: Any = None
    load_cell_range: Any = None
    load_cell_deviation: Any = None
    load_cell_bias: Any = None
    load_cell_gain: Any = None

    def winches(self) -> Winch:
        """The winches; what is left out takes the winch's own default."""
        if "swivel_axis" in self.model_fields_set:
            self.swivel_axis = _vectors(self.swivel_axis)
        keys = [key for key in _Winches.model_fields if key in self.model_fields_set]
        return Winch(**{key: self.given(key, "winches.") for key in keys})


def _vectors(value: object) -> object:
    """Swivel axes whose words, for all cables or in a list, have become vectors."""
    if isinstance(value, list):
        return [_vectors(entry) for entry in value]
    if not isinstance(value, str) or plain_number(value) is not None:
        return value
    if value not in SWIVEL_AXES:
        allowed = f"{', '.join(SWIVEL_AXES)}, or a vector of three numbers"
        raise InvalidValueError("winches.swivel_axis", reprlib.repr(value), allowed, "Say which way the cable enters.")
    return SWIVEL_AXES[value]


class _Inertia(_RobotPart):
    """Inertia about the center of mass: a matrix, its diagonal, its elements, or a solid body of the robot's mass."""

    matrix: Any = None
    diagonal: Any = None
    Ixx: Any = None
    Iyy: Any = None
    Izz: Any = None
    Ixy: Any = 0.0  # an element of the matrix, not the product of inertia with its sign turned; so are the next two
    Ixz: Any = 0.0
    Iyz: Any = 0.0
    box: Any = None
    cylinder_radius: Any = None
    cylinder_height: Any = None

    @model_validator(mode="before")
    @classmethod
    def _accept_list(cls, data: object) -> object:
        """A list of lists is the matrix, a list of numbers its diagonal."""
        if not isinstance(data, list):
            return data
        return {"matrix" if any(isinstance(row, list) for row in data) else "diagonal": data}

    def about_center(self, mass: float) -> Array:
        """The matrix for a platform of this mass [kg], shape (3, 3)."""
        ways = (("matrix",), ("diagonal",), ("Ixx", "Iyy", "Izz"), ("box",), ("cylinder_radius", "cylinder_height"))
        mixed = ("Ixy", "Ixz", "Iyz") if "Ixx" in self.model_fields_set else ()
        way = self.only_way("inertia", ways, beside=mixed)
        values = [self.given(key, "inertia.") for key in way]
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
        xy, xz, yz = (self.given(key, "inertia.") for key in ("Ixy", "Ixz", "Iyz"))
        return exactly([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], "inertia", "kg m^2", (3, 3))


class _TestBox(_RobotPart):
    """The box of poses in which the robot can work."""

    low: Any
    high: Any
    tilt: Any = 0.0


class _Deviations(_RobotPart):
    """Standard deviations of a robot's numbers; each one number for the field, one along each axis, or all of it."""

    frame_anchors: Any = None
    platform_anchors: Any = None
    length_zero: Any = None
    drum_radius: Any = None
    linear_density: Any = None
    axial_stiffness: Any = None
    pulley_radius: Any = None
    dead_cable: Any = None
    load_cell_gain: Any = None
    load_cell_bias: Any = None
    mass: Any = None
    center_of_mass: Any = None

    def of(self, robot: Robot, within: str) -> dict[str, Any]:
        """Those that are given, in SI; percents are of the robot's own numbers."""
        found = {}
        for key in (key for key in _Deviations.model_fields if key in self.model_fields_set):
            item, value = within + key, getattr(self, key)
            if UNCERTAIN[key].share and _in_percent(value):
                found[key] = of_share(_share(value, item), value_of(robot, key), item.replace(".", ": "))
            else:
                found[key] = self.given(key, within)
        return found


def _in_percent(value: object) -> bool:
    """Whether a text, or the first of a list, is a share in percent."""
    if isinstance(value, list):
        return bool(value) and _in_percent(value[0])
    return isinstance(value, str) and value.rstrip().endswith("%")


def _share(value: Any, item: str) -> Any:
    """Shares in percent as numbers."""
    if isinstance(value, list):
        return [_share(element, f"{item}[{i}]") for i, element in enumerate(value)]
    number = plain_number(value.strip().removesuffix("%")) if _in_percent(value) else None
    if number is None:
        raise InvalidValueError(item, reprlib.repr(value), 'a share, such as "5 %"', "Give all of them in percent.")
    return number / 100.0


class _Calibration(_RobotPart):
    """The calibration that found some of the numbers."""

    log: str
    date: str
    note: str = ""
    standard_error: _Deviations = Field(default_factory=_Deviations)

    def provenance(self, robot: Robot) -> Provenance:
        """Where the robot's numbers come from."""
        return Provenance(self.log, self.date, self.standard_error.of(robot, _ERROR), self.note)


class RobotEntry(_RobotPart):
    """A whole robot file. Keys are the robot's fields; what is left out takes the robot's own default."""

    name: str
    frame_anchors: Any
    platform_anchors: Any
    cables: _Cables
    winches: _Winches | None = None
    mass: Any
    inertia: _Inertia | None = None
    center_of_mass: Any = None
    gravity: Any = None
    motion_pattern: str = ""
    plane_normal: Any = None
    tension_min: Any = None
    tension_max: Any = None
    tension_limits_of: str = ""
    platform_size: Any = None
    frame_size: Any = None
    test_box: _TestBox | None = None
    source: str = ""
    assumed: dict[str, str] = Field(default_factory=dict)
    notes: str = ""
    tolerances: _Deviations | None = None
    calibration: _Calibration | None = None
    scene: list[Place] = Field(default_factory=list)  # the file's, not the robot's: sagline.files.scene_file

    def robot(self) -> Robot:
        """The robot the file describes.

        Returns:
            The robot, checked.

        Raises:
            InvalidValueError: If a value has a wrong unit, or is none the robot accepts.
        """
        keys = self.model_fields_set - {"scene", "tolerances", "calibration"}
        fields = {key: self.given(key) if key in _UNITS else getattr(self, key) for key in keys}
        check_scene(self.scene)
        fields["cables"] = self.cables.cable()
        if self.winches is not None:
            fields["winches"] = self.winches.winches()
        if self.inertia is not None:
            mass = number(fields["mass"], "mass", "kg", above=0.0)
            fields["inertia"] = self.inertia.about_center(mass)
        if self.test_box is not None:
            fields["test_box"] = PoseBox(*(self.test_box.given(key, "test_box.") for key in ("low", "high", "tilt")))
        return self._trusted(Robot(**fields))

    def _trusted(self, robot: Robot) -> Robot:
        """The robot with how far its numbers are to be trusted, which shares of them may say."""
        about: dict[str, Any] = {}
        if self.tolerances is not None:
            about["tolerances"] = self.tolerances.of(robot, "tolerances.")
        if self.calibration is not None:
            about["calibration"] = self.calibration.provenance(robot)
        return robot.replace(**about) if about else robot
