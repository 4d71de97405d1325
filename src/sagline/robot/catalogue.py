"""Robot presets, an initial robot design from a few numbers, and winch drives with the values of data sheets."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from math import pi
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from attrs import field, frozen

from sagline.cables.cable import ROPES, SAFETY
from sagline.core.arguments import brief, choice
from sagline.core.arrays import Array, checked, number, refuse_first
from sagline.core.errors import InvalidValueError, did_you_mean
from sagline.core.fields import given
from sagline.core.results import set_fields
from sagline.robot.pose import PoseBox
from sagline.robot.robot import Robot, box_inertia
from sagline.robot.winch import Winch

_PRESETS = files("sagline.robot") / "presets"


def robot_names() -> tuple[str, ...]:
    """Names of the presets.

    Returns:
        Names in alphabetical order.

    Examples:
        >>> import sagline as sl
        >>> sl.robot_names()[:3]
        ('article-mixed', 'article-prototype', 'article-suspended')
    """
    return tuple(
        sorted(entry.name.removesuffix(".yaml") for entry in _PRESETS.iterdir() if entry.name.endswith(".yaml"))
    )


def preset_text(name: str) -> str:
    """Text of a preset's robot file."""
    names = robot_names()
    if name not in names:
        step = f"{did_you_mean(name, names, '')} To use a robot file, give its path, such as robot.yaml."
        raise InvalidValueError("robot", repr(name), ", ".join(names), step.lstrip())
    return (_PRESETS / f"{name}.yaml").read_text(encoding="utf-8")


LAYOUTS: Final = ("top", "mixed", "bottom")
COUNTS: Final = {"top": (8, 6), "mixed": (8, 7)}
THINNEST, THICKEST = 0.0003, 0.08  # smallest and largest allowed diameter of a rope [m]
SLACK_LIMIT = 0.05  # lower tension limit of a cable, relative to the weight of the platform
# corners in counter-clockwise order; coordinates are divided by the edges of the frame
_CORNERS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])
_POSTS = np.array([[0.5, -0.5], [-0.5, -0.5], [0.0, 0.5]])  # posts at the corners of a triangle


@frozen(eq=False)
class Design:
    """Data of an initial robot design.

    Attributes:
        name: Name of the robot.
        frame: Edges of the frame [m], shape (3,). The frame is on the floor, with its center above the origin.
        platform: Edges of the platform [m], shape (3,), smaller than the edges of the frame.
        mass: Mass of the platform with its payload [kg].
        rope: Name of the rope in the catalogue of ropes.
        diameter: Diameter of the rope [m], 0.3 mm to 80 mm.
        cables: Number of cables, 6 to 8.
        layout: "top" (all cables come from above) or "mixed" (cables come from above and from below).
    """

    name: str
    frame: Array = field(converter=given)
    platform: Array = field(converter=given)
    mass: float = field(converter=float)
    rope: str = "dyneema-sk78"
    diameter: float = field(default=0.006, converter=float)
    cables: int = field(default=8, converter=int)
    layout: str = "top"

    def __attrs_post_init__(self) -> None:
        """Check the data of the design, whose messages are clearer than messages about the resulting robot."""
        outer, inner = (checked(getattr(self, k), k, "m", shape=(3,), above=0.0) for k in ("frame", "platform"))
        set_fields(self, frame=outer, platform=inner)
        step = "Take a smaller platform."
        refuse_first(inner >= outer, "platform", inner, "m", "< frame[{i}], {limit:g} m", step, outer)
        if choice(self.layout, "layout", LAYOUTS) == "bottom":
            step = "Cables from below only pull down; add cables from above."
            raise InvalidValueError("layout", "'bottom'", "top, mixed", step)
        if self.cables not in COUNTS[self.layout]:
            item, allowed = f"cables of layout {self.layout}", " or ".join(map(str, COUNTS[self.layout]))
            raise InvalidValueError(item, self.cables, allowed, "Choose another number or layout.")
        choice(self.rope, "rope", tuple(ROPES))
        if not THINNEST <= self.diameter <= THICKEST:
            allowed = f"{1e3 * THINNEST:g} mm to {1e3 * THICKEST:g} mm"
            raise InvalidValueError("diameter", f"{self.diameter:g} m", allowed, "Give it with its unit.")

    def robot(self) -> Robot:
        """Robot of this design, with tension limits that are computed from platform weight and rope strength."""
        rope = ROPES[self.rope]
        cable = rope.cable(self.diameter)
        weakest = SLACK_LIMIT * self.mass * 9.81
        strongest = rope.breaking_force(self.diameter) / SAFETY
        if strongest <= weakest:
            value, allowed = f"{1e3 * self.diameter:g} mm", "a rope that can carry the load"
            raise InvalidValueError("diameter", value, allowed, "Take a thicker rope.")
        frame, platform = self._anchors()
        return Robot(
            name=self.name,
            frame_anchors=frame,
            platform_anchors=platform,
            cables=cable,
            mass=self.mass,
            inertia=box_inertia(self.mass, *self.platform),
            tension_min=weakest,
            tension_max=strongest,
            platform_size=self.platform,
            frame_size=self.frame,
            source=f"sagline new: {self.cables} cables, {self.layout}, {rope.description}, {1e3 * self.diameter:g} mm",
            assumed={
                "cables": f"{rope.source}; {rope.assumed}",
                "inertia": "a solid box of the platform's size",
                "tension_min": f"{100 * SLACK_LIMIT:g} % of the platform's weight, so that no cable is slack",
                "tension_max": f"breaking force {SAFETY * strongest:,.0f} N divided by a safety factor of {SAFETY:g}",
            },
        )

    def placed(self, share: float) -> PoseBox:
        """Box of platform positions around the center of the frame; share: size relative to the free space, 0 to 1."""
        middle = np.array([0.0, 0.0, 0.5 * self.frame[2]])
        half = 0.5 * share * (self.frame - self.platform)
        return PoseBox(middle - half, middle + half)

    def _anchors(self) -> tuple[Array, Array]:
        """Frame anchors and platform anchors of this design [m], shape (m, 3) each."""
        top = self.frame[2]
        if self.layout == "top" and self.cables == 8:
            frame, platform = _crossed()
        elif self.layout == "top":
            frame, platform = _octahedron()
        else:
            frame, platform = _mixed(_CORNERS if self.cables == 8 else _POSTS)
        return frame * self.frame + np.array([0.0, 0.0, 0.5 * top]), platform * self.platform


def _at(plane: Array, height: float) -> Array:
    """Points (k, 3) with the horizontal coordinates `plane` (k, 2) and the same `height`."""
    return np.column_stack((plane, np.full(len(plane), height)))


def _crossed() -> tuple[Array, Array]:
    """Crossed cables: two from each top corner of the frame, to the next upper and the previous lower corner."""
    frame = np.repeat(_at(_CORNERS, 0.5), 2, axis=0)
    upper, lower = _at(np.roll(_CORNERS, -1, axis=0), 0.5), _at(np.roll(_CORNERS, 1, axis=0), -0.5)
    return frame, np.stack((upper, lower), axis=1).reshape(-1, 3)


def _octahedron() -> tuple[Array, Array]:
    """Two cables from each of three posts, which end at the nearest two corners of a triangular platform."""
    frame = np.repeat(_at(_POSTS, 0.5), 2, axis=0)
    triangle = _at(-_POSTS, 0.5)  # corner k is opposite to post k
    return frame, triangle[[1, 2, 2, 0, 0, 1]]


def _mixed(below: Array) -> tuple[Array, Array]:
    """Cables from the top corners to lower platform corners, and from points `below` on the floor to upper corners."""
    frame = np.concatenate((_at(_CORNERS, 0.5), _at(below, -0.5)))
    return frame, np.concatenate((_at(_CORNERS, -0.5), _at(below, 0.5)))


_TURN: Final = 2.0 * pi / 60.0  # one revolution per minute [rad/s]
_SHORT: Final = 1e-4  # unit of inertia in the data sheets, 1e-4 kg m^2 [kg m^2]


@dataclass(frozen=True, slots=True)
class WinchDrive:
    """Data sheet of a motor with or without a gear.

    Attributes:
        name: Name of the drive, as an argument of `winch_drive`.
        gear: Turns of the motor per turn of the gear's output shaft.
        inertia: Moment of inertia of motor and gear at the motor's shaft [kg m^2].
        rated_torque: Continuous torque at the motor's shaft [N m].
        torque_limit: Peak torque at the motor's shaft [N m].
        rated_speed: Speed of the motor's shaft at rated torque [rad/s].
        speed_limit: Largest speed of the motor's shaft [rad/s].
        source: The data sheet.
        assumed: Assumptions about the drive, and data of the sheet that are not used.
    """

    name: str
    gear: float
    inertia: float
    rated_torque: float
    torque_limit: float
    rated_speed: float
    speed_limit: float
    source: str
    assumed: str

    def winch(self, drum_radius: float, drum_inertia: float = 0.0, **fields: Any) -> Winch:
        """A winch with this drive.

        Args:
            drum_radius: Radius of the drum to the surface under the cable [m].
            drum_inertia: Moment of inertia of the drum about its axis [kg m^2], >= 0.
            fields: Other fields of `Winch`, such as position_gain.

        Returns:
            The winch with gear, inertia and limits of the drive; the inertia of the drum is included.

        Raises:
            InvalidValueError: If a value is out of its range, if a field does not exist in `Winch`, or if the drive
                already defines the field.

        Examples:
            >>> import sagline as sl
            >>> drive = sl.winch_drive("yaskawa-sgmah-01aj3")
            >>> winch = drive.winch(drum_radius=0.05, drum_inertia=1e-3)
            >>> most = winch.torque_limit * winch.gear / winch.drum_radius
            >>> print(f"{most:.0f} N")
            178 N
        """
        own = number(drum_inertia, "drum_inertia", "kg m^2", low=0.0)
        given = {
            "gear": self.gear,
            "inertia": self.inertia + own / self.gear**2,
            "torque_limit": self.torque_limit,
            "speed_limit": self.speed_limit,
        }
        for name in fields:
            if name in given or name not in Winch.__slots__:
                allowed = f"a field of Winch other than {', '.join(given)}"
                step = "For another drive, use Winch(...)."
                raise InvalidValueError("field", brief(name), allowed, step)
        radius = number(drum_radius, "drum_radius", "m", above=0.0)
        return Winch(drum_radius=radius, **given, **fields)


_GEARED_SOURCE: Final = (
    "Yaskawa, Sigma-II series user's manual, 3.1, ratings and specifications of SGMAH (3000 min^-1), servomotors with "
    "standard backlash gears, page 3-7"
)
_GEARED_ASSUMED: Final = (
    "torques: output torque divided by the gear ratio, so that losses in the gear reduce the torque; speed: "
    "speed of the motor, 4000 min^-1; backlash and torsion of the gear neglected"
)
# model: turns of the motor per output turn, rated and peak torque at the output [N m], inertia of motor and gear [1e-4
# kg m^2]
_GEARED: Final = {
    "a3aj1": (5.0, 0.238, 1.16, 0.044),
    "a3aj3": (31.0 / 3.0, 0.687, 2.37, 0.033),
    "a3ajc": (21.0, 1.60, 5.48, 0.023),
    "a3aj7": (33.0, 2.51, 8.61, 0.021),
    "a5aj1": (5.0, 0.557, 1.92, 0.050),
    "a5aj3": (31.0 / 3.0, 1.15, 3.95, 0.040),
    "a5ajc": (21.0, 2.67, 9.07, 0.036),
    "a5aj7": (33.0, 4.20, 14.3, 0.032),
    "01aj1": (5.0, 1.27, 4.32, 0.099),
    "01aj3": (31.0 / 3.0, 2.63, 8.88, 0.054),
    "01ajc": (21.0, 5.34, 18.1, 0.071),
    "01aj7": (33.0, 8.40, 28.4, 0.057),
    "02aj1": (5.0, 2.55, 8.60, 0.299),
}
_DIRECT_SOURCE: Final = (
    "Yaskawa, Sigma II user's manual, 8.1.4, SGMSH servomotors, ratings and specifications for standard servomotors, "
    "200 V, page 8-15"
)
_DIRECT_ASSUMED: Final = "only the motor: no gear, no brake"
# model: rated and peak torque [N m], inertia [1e-4 kg m^2]
_DIRECT: Final = {
    "10aa": (3.18, 9.54, 1.74),
    "15aa": (4.9, 14.7, 2.47),
    "20aa": (6.36, 19.1, 3.19),
    "30aa": (9.8, 29.4, 7.00),
    "40aa": (12.6, 37.8, 9.60),
    "50aa": (15.8, 47.6, 12.3),
}


def _catalogue() -> dict[str, WinchDrive]:
    found = []
    for model, (gear, rated, peak, inertia) in _GEARED.items():
        numbers = gear, inertia * _SHORT, rated / gear, peak / gear, 3000.0 * _TURN, 4000.0 * _TURN
        found.append(WinchDrive(f"yaskawa-sgmah-{model}", *numbers, _GEARED_SOURCE, _GEARED_ASSUMED))
    for model, (rated, peak, inertia) in _DIRECT.items():
        numbers = 1.0, inertia * _SHORT, rated, peak, 3000.0 * _TURN, 5000.0 * _TURN
        found.append(WinchDrive(f"yaskawa-sgmsh-{model}", *numbers, _DIRECT_SOURCE, _DIRECT_ASSUMED))
    return {drive.name: drive for drive in found}


_DRIVES: Final = MappingProxyType(_catalogue())


def winch_drive_names() -> tuple[str, ...]:
    """Names of the drives in the catalogue.

    Returns:
        Names in alphabetical order.

    Examples:
        >>> import sagline as sl
        >>> sl.winch_drive_names()[:2]
        ('yaskawa-sgmah-01aj1', 'yaskawa-sgmah-01aj3')
    """
    return tuple(sorted(_DRIVES))


def winch_drive(name: str) -> WinchDrive:
    """A motor with gear for winches, from the catalogue.

    Args:
        name: One of `winch_drive_names`.

    Returns:
        The drive, with its source and assumptions.

    Raises:
        InvalidValueError: If no drive has this name; the message suggests a similar name.

    Examples:
        >>> import sagline as sl
        >>> drive = sl.winch_drive("yaskawa-sgmah-01aj1")
    """
    given: Any = name  # an untyped caller may pass any object
    word = str(given) if isinstance(given, str) else ""
    if word in _DRIVES:
        return _DRIVES[word]
    step = did_you_mean(word, _DRIVES, "winch_drive_names() lists them.")
    raise InvalidValueError("name", brief(given), f"one of the {len(_DRIVES)} drives of the catalogue", step)
