"""Drives of winches (motors with their gears), from data sheets of the manufacturers."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi
from types import MappingProxyType
from typing import Any, Final

from sagline.core.arguments import brief
from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError, nearest
from sagline.robot.winch import Winch

_TURN: Final = 2.0 * pi / 60.0  # [rad/s] per revolution per minute
_SHORT: Final = 1e-4  # unit of the data sheets [kg m^2]


@dataclass(frozen=True, slots=True)
class WinchDrive:
    """Data sheet of a motor, and of its gear if it has one.

    Attributes:
        name: Name for `winch_drive`.
        gear: Turns of the motor per turn of the gear's output shaft.
        inertia: Moment of inertia of motor and gear at the motor's shaft [kg m^2].
        rated_torque: Continuous torque at the motor's shaft [N m].
        torque_limit: Peak torque at the motor's shaft [N m].
        rated_speed: Speed of the motor's shaft at rated torque [rad/s].
        speed_limit: Largest speed of the motor's shaft [rad/s].
        source: The data sheet.
        assumed: Assumptions, and data in the sheet that are not used.
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
            fields: Other fields of `Winch`, position_gain for instance.

        Returns:
            The winch with gear, inertia and limits of the drive. The inertia includes the inertia of the drum.

        Raises:
            InvalidValueError: If a value is out of its range, or if a field does not exist in `Winch` or belongs to the
                drive.

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
        for field in fields:
            if field in given or field not in Winch.__slots__:
                allowed = f"a field of Winch other than {', '.join(given)}"
                step = "For another drive, use Winch(...)."
                raise InvalidValueError("field", brief(field), allowed, step)
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
    geared = (
        WinchDrive(
            f"yaskawa-sgmah-{model}",
            gear,
            inertia * _SHORT,
            rated / gear,
            peak / gear,
            3000.0 * _TURN,
            4000.0 * _TURN,
            _GEARED_SOURCE,
            _GEARED_ASSUMED,
        )
        for model, (gear, rated, peak, inertia) in _GEARED.items()
    )
    direct = (
        WinchDrive(
            f"yaskawa-sgmsh-{model}",
            1.0,
            inertia * _SHORT,
            rated,
            peak,
            3000.0 * _TURN,
            5000.0 * _TURN,
            _DIRECT_SOURCE,
            _DIRECT_ASSUMED,
        )
        for model, (rated, peak, inertia) in _DIRECT.items()
    )
    return {drive.name: drive for drive in (*geared, *direct)}


_DRIVES: Final = MappingProxyType(_catalogue())


def winch_drive_names() -> tuple[str, ...]:
    """Names of the drives in the catalogue.

    Returns:
        The names are in alphabetical order.

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
        InvalidValueError: If the drive does not exist; the message suggests a similar name.

    Examples:
        >>> import sagline as sl
        >>> drive = sl.winch_drive("yaskawa-sgmah-01aj1")
    """
    given: Any = name  # a caller without type checks may pass anything
    word = str(given) if isinstance(given, str) else ""
    if word in _DRIVES:
        return _DRIVES[word]
    near = nearest(word, _DRIVES)
    step = f"Did you mean {near}?" if near else "winch_drive_names() lists them."
    raise InvalidValueError("name", brief(given), f"one of the {len(_DRIVES)} drives of the catalogue", step)
