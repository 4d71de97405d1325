"""What a calibration may ask for: kinds of unknowns, and the single numbers that they are."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

from sagline.core.arguments import choice
from sagline.core.arrays import Array, Flags, Indices, exactly
from sagline.core.results import Result
from sagline.kernels.calibration import kinds


class Kind(NamedTuple):
    """A kind of unknown.

    Attributes:
        unit: Its unit in SI.
        first: Its first row of `kernels.calibration.kinds`.
        axes: Names of its components, ("",) for a single number.
        each: Whether every cable has its own.
        shared: Whether those of all cables are one number unless told otherwise.
        logarithmic: Whether the logarithm is what is found: a positive number known to a share of itself.
        deviation: Standard deviation of what a drawing or a data sheet says, a share of the value where logarithmic.
        assumed: The same of a value that the robot's source does not give.
        needs: The readings without which nothing tells of it: "counts", "load cells", "positions"; "" for any.
    """

    unit: str
    first: int
    axes: tuple[str, ...]
    each: bool
    shared: bool
    logarithmic: bool
    deviation: float
    assumed: float
    needs: str = ""


_XYZ: Final = ("x", "y", "z")
KINDS: Final[dict[str, Kind]] = {
    "frame_anchors": Kind("m", kinds.FRAME, _XYZ, True, False, False, 0.05, 0.5),
    "platform_anchors": Kind("m", kinds.PLATFORM, _XYZ, True, False, False, 0.02, 0.2),
    "length_zero": Kind("m", kinds.ZERO, ("",), True, False, False, 0.1, 1.0),
    "drum_radius": Kind("m", kinds.DRUM, ("",), True, True, True, 0.02, 0.1, "counts"),
    "linear_density": Kind("kg/m", kinds.DENSITY, ("",), True, True, True, 0.1, 0.5),
    "axial_stiffness": Kind("N", kinds.STIFFNESS, ("",), True, True, True, 0.3, 1.0),
    "pulley_radius": Kind("m", kinds.RADIUS, ("",), True, True, False, 0.002, 0.02),
    "dead_cable": Kind("m", kinds.DEAD, ("",), True, False, False, 0.1, 1.0),
    "load_cell_gain": Kind("", kinds.GAIN, ("",), True, False, False, 0.05, 0.2, "load cells"),
    "load_cell_bias": Kind("N", kinds.BIAS, ("",), True, False, False, 20.0, 100.0, "load cells"),
    "mass": Kind("kg", kinds.MASS, ("",), False, False, True, 0.05, 0.2),
    "center_of_mass": Kind("m", kinds.CENTER, _XYZ, False, False, False, 0.05, 0.2),
    "measuring_frame": Kind(
        "m", kinds.SHIFT, (*_XYZ, "about x", "about y", "about z"), False, False, False, 10.0, 10.0, "positions"
    ),
    "target": Kind("m", kinds.TARGET, _XYZ, False, False, False, 0.1, 1.0, "positions"),
}


@dataclass(frozen=True, slots=True)
class Unknown:
    """One kind of unknown, and what is known of it beforehand.

    Pulley radii and dead cable end at zero where less than nothing would fit best.

    Attributes:
        name: Of `KINDS`.
        shared: Whether the cables share one number; None for what is usual of the kind.
        deviation: Standard deviation of what the robot has, in the unit of the kind (a share of the value for drum
            radius, linear density, axial stiffness and mass); infinite where nothing is known; None for that of the
            robot's tolerances, or what is usual.
    """

    name: str
    shared: bool | None = None
    deviation: float | None = None

    def __post_init__(self) -> None:
        """Refuse names that are none.

        Raises:
            InvalidValueError: If there is no such kind, or the deviation is not positive.
        """
        object.__setattr__(self, "name", str(choice(self.name, "unknown", KINDS)))
        if self.deviation is not None:
            item, unit = f"{self.name}: deviation", KINDS[self.name].unit
            deviation = exactly(self.deviation, item, unit, (), above=0.0, infinite=True)
            object.__setattr__(self, "deviation", float(deviation))


@dataclass(frozen=True, slots=True, eq=False)
class Parameters(Result):
    """The P numbers that a calibration looks for.

    Attributes:
        names: Kind of each, (P,).
        labels: What each is called: "frame_anchors[3].x", "axial_stiffness", "measuring_frame.about z".
        units: Of each.
        cables: Cable of each, or -1 for those of all cables or of the platform.
        where: Index of the number of each row of `kernels.calibration.kinds` and cable, (KIND_ROWS, m), -1 for none.
        prior: What is known beforehand, in the units, (P,).
        prior_deviation: Its standard deviation in the units, (P,); infinite where nothing is.
        stated: Whether the robot's tolerances or the caller said so, (P,).
        logarithmic: Whether the logarithm is looked for, (P,).
        counted: Whether encoders count turns of drums; otherwise lengths are read, and length_zero is what is to be
            added to them, no number of the robot.
    """

    names: tuple[str, ...]
    labels: tuple[str, ...]
    units: tuple[str, ...]
    cables: Indices
    where: Indices
    prior: Array
    prior_deviation: Array
    stated: Flags
    logarithmic: Flags
    counted: bool
