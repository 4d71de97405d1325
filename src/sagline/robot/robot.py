"""The robot: where its cables are fixed, what they are made of, and what they carry."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.cable import Cable
from sagline.core.arguments import brief, choice, label, optional, text
from sagline.core.arrays import Array, exactly, number
from sagline.core.errors import InvalidValueError
from sagline.core.results import Shown
from sagline.robot import checks
from sagline.robot.pattern import MOTION_PATTERNS, MotionPattern, freedom_matrix
from sagline.robot.pose import PoseBox
from sagline.robot.tolerances import Provenance, deviations, value_of
from sagline.robot.winch import Winch

TensionLimitsOf = Literal["chord", "frame_end"]


@dataclass(frozen=True, slots=True, eq=False)
class Robot(Shown):
    """A cable-driven parallel robot. Cable i runs from frame_anchors[i] to platform_anchors[i].

    Attributes:
        name: What the robot is called.
        frame_anchors: Frame ends of the cables in the world [m], z up, shape (m, 3).
        platform_anchors: Platform ends of the cables in the platform frame [m], shape (m, 3).
        cables: Material of the cables, fields of shape (m,).
        winches: Pulleys, dead cable, drums and motors behind the frame anchors, fields of shape (m,); None where cables
            start at the frame anchors and their lengths are given to them directly.
        mass: Mass of the platform [kg], > 0.
        inertia: Inertia about the center of mass in the platform frame [kg m^2], shape (3, 3): positive
            definite, no principal moment larger than the other two together. Only the moment about plane_normal need
            be positive in a planar pattern, and none where the motion pattern has no rotation.
        center_of_mass: Center of mass in the platform frame [m], shape (3,).
        gravity: Gravitational acceleration along -z [m/s^2], >= 0.
        motion_pattern: "3R3T", "3T" (point mass), "1R2T" (planar) or "2T" (planar without rotation).
        plane_normal: Unit normal of the plane of a planar pattern, world axes, shape (3,); None for the others.
        tension_min: Lower tension limits [N], shape (m,), >= 0.
        tension_max: Upper tension limits [N], shape (m,), may be infinite.
        tension_limits_of: The tension that is limited, "chord" or "frame_end".
        platform_size: Edges of the platform, for drawing [m], shape (3,), or None.
        frame_size: Edges of the frame, for drawing [m], shape (3,), or None.
        test_box: Poses of which nearly all are wrench-feasible, or None.
        source: Where the numbers were read.
        assumed: Field name -> why; the fields whose values the source does not give.
        notes: What else a user should know.
        tolerances: Name of a number -> standard deviation of it [SI], in the shape of its field: how far what is given
            here may be off, as a drawing or a data sheet says. Names: frame_anchors, platform_anchors, center_of_mass
            (with three components each), mass, and of every cable length_zero, drum_radius, linear_density,
            axial_stiffness, pulley_radius, dead_cable, load_cell_gain, load_cell_bias.
        calibration: The calibration that found some of the numbers, with their standard errors; None for none.
    """

    name: str
    frame_anchors: Array
    platform_anchors: Array
    cables: Cable
    winches: Winch | None
    mass: float
    inertia: Array
    center_of_mass: Array
    gravity: float
    motion_pattern: MotionPattern
    plane_normal: Array | None
    tension_min: Array
    tension_max: Array
    tension_limits_of: TensionLimitsOf
    platform_size: Array | None
    frame_size: Array | None
    test_box: PoseBox | None
    source: str
    assumed: Mapping[str, str]
    notes: str
    tolerances: Mapping[str, Array]
    calibration: Provenance | None

    def __init__(
        self,
        name: str,
        frame_anchors: ArrayLike,
        platform_anchors: ArrayLike,
        cables: Cable,
        mass: float,
        inertia: ArrayLike | None = None,
        *,
        winches: Winch | None = None,
        center_of_mass: ArrayLike = (0.0, 0.0, 0.0),
        gravity: float = 9.81,
        motion_pattern: MotionPattern = "3R3T",
        plane_normal: ArrayLike | None = None,
        tension_min: ArrayLike = 0.0,
        tension_max: ArrayLike = np.inf,
        tension_limits_of: TensionLimitsOf = "chord",
        platform_size: ArrayLike | None = None,
        frame_size: ArrayLike | None = None,
        test_box: PoseBox | None = None,
        source: str = "",
        assumed: Mapping[str, str] = MappingProxyType({}),
        notes: str = "",
        tolerances: Mapping[str, ArrayLike] = MappingProxyType({}),
        calibration: Provenance | None = None,
    ) -> None:
        """Check every field once; values for all cables at once are spread over the cables.

        Args:
            name: What the robot is called.
            frame_anchors: Frame ends of the cables in the world [m], z up, shape (m, 3).
            platform_anchors: Platform ends in the platform frame [m], shape (m, 3).
            cables: Material of the cables, one for all or one a cable.
            mass: Mass of the platform [kg], > 0.
            inertia: About the center of mass in the platform frame [kg m^2], shape (3, 3); may be left out where the
                platform cannot turn.
            winches: The machine behind the frame anchors, one for all cables or one a cable; None for none.
            center_of_mass: In the platform frame [m], shape (3,).
            gravity: Acceleration along -z [m/s^2], >= 0.
            motion_pattern: "3R3T", "3T", "1R2T" or "2T".
            plane_normal: Normal of the plane of a planar pattern, of any length but zero; None for the others.
            tension_min: Lower limits [N], >= 0, one for all or one a cable.
            tension_max: Upper limits [N], which may be infinite, one for all or one a cable.
            tension_limits_of: The tension that is limited, "chord" or "frame_end".
            platform_size: Edges of the platform, for drawing [m], shape (3,), or None.
            frame_size: Edges of the frame, for drawing [m], shape (3,), or None.
            test_box: Poses of which nearly all are wrench-feasible, or None.
            source: Where the numbers were read.
            assumed: Field name -> why, for values that the source does not give.
            notes: What else a user should know.
            tolerances: Name of a number -> its standard deviation [SI], > 0, infinite where nothing is known: one for
                all of the field, one along each axis where it has three, or the whole field.
            calibration: The calibration that found some of the numbers, or None.

        Raises:
            InvalidValueError: If a field is wrong; the message names it, with its index.

        Examples:
            >>> import numpy as np
            >>> import sagline as sl
            >>> tripod = sl.Robot(
            ...     "tripod",
            ...     frame_anchors=[[3, 0, 3], [-2, 2, 3], [-2, -2, 3]],
            ...     platform_anchors=np.zeros((3, 3)),
            ...     cables=sl.Cable(linear_density=0.05, axial_stiffness=5e4),
            ...     mass=10.0,
            ...     motion_pattern="3T",
            ... )
            >>> sl.inverse(tripod, sl.Pose([0, 0, 1], np.eye(3))).chord_tension.round(1)
            array([72.6, 52.3, 52.3])
        """
        frame, platform = checks.anchors(frame_anchors, platform_anchors)
        pattern = choice(motion_pattern, "motion_pattern", MOTION_PATTERNS)
        normal = checks.plane_normal(plane_normal, pattern)
        lower, upper = checks.tension_limits(tension_min, tension_max, len(frame))
        source_of = optional(calibration, Provenance, "calibration")
        values = {
            "name": label(name, "name"),
            "frame_anchors": frame,
            "platform_anchors": platform,
            "cables": checks.cables(cables, len(frame)),
            "winches": checks.winches(winches, frame),
            "mass": number(mass, "mass", "kg", above=0.0),
            "inertia": checks.inertia(inertia, pattern, normal),
            "center_of_mass": exactly(center_of_mass, "center_of_mass", "m", (3,)),
            "gravity": number(gravity, "gravity", "m/s^2", low=0.0),
            "motion_pattern": pattern,
            "plane_normal": normal,
            "tension_min": lower,
            "tension_max": upper,
            "tension_limits_of": choice(tension_limits_of, "tension_limits_of", get_args(TensionLimitsOf)),
            "platform_size": checks.size(platform_size, "platform_size"),
            "frame_size": checks.size(frame_size, "frame_size"),
            "test_box": optional(test_box, PoseBox, "test_box"),
            "source": text(source, "source"),
            "assumed": _known_fields(assumed),
            "notes": text(notes, "notes"),
            "tolerances": deviations(tolerances, "tolerances", len(frame), above=0.0),
            "calibration": None if source_of is None else source_of._of(len(frame)),
        }
        for field, value in values.items():
            object.__setattr__(self, field, value)

    @property
    def cable_count(self) -> int:
        """Number of cables m."""
        return len(self.frame_anchors)

    @property
    def degrees_of_freedom(self) -> int:
        """Number of free motions n of the platform: 6, 3, 3 or 2."""
        return len(self.freedom)

    @property
    def freedom(self) -> Array:
        """Rows that pick the free motions out of a wrench or twist in world axes, shape (n, 6), orthonormal."""
        return freedom_matrix(self.motion_pattern, self.plane_normal)

    def replace(self, **changes: Any) -> Robot:
        """A robot with some fields changed, checked like a new one.

        Tolerances stay as they are. Of a calibration the standard errors stay of the numbers that stay: one that is
        replaced is none that the calibration found.

        Args:
            changes: Fields of `Robot` and their new values.

        Returns:
            A new robot; this one stays as it is.

        Raises:
            InvalidValueError: If there is no such field, or the new values are none the constructor accepts.

        Examples:
            >>> import sagline as sl
            >>> heavy = sl.load_robot("cogiro").replace(mass=300.0, tension_min=50.0)
            >>> print(heavy.mass, heavy.tension_min[0])
            300.0 50.0
        """
        for field in changes:
            choice(field, "field", Robot.__slots__)
        guides = None if self.winches is None else self.winches.guides
        if self.winches is not None and guides is not None and "frame_anchors" in changes and "winches" not in changes:
            changes["winches"] = self.winches.replace(guides=guides)  # dead cable follows anew
        return replace(self, **changes)._kept(self) if "calibration" not in changes else replace(self, **changes)

    def _kept(self, before: Robot) -> Robot:
        """This robot without the standard errors of what is not as the calibration left it."""
        if self.calibration is None:
            return self
        errors = self.calibration.standard_error
        same = {name: error for name, error in errors.items() if _alike(value_of(self, name), value_of(before, name))}
        if len(same) == len(errors):
            return self
        return replace(self, calibration=replace(self.calibration, standard_error=same))

    def __reduce__(self) -> tuple[Any, tuple[dict[str, Any]]]:
        """Pickle through the constructor, so that a loaded robot is checked and locked too."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return _from_fields, ({**values, "assumed": dict(self.assumed), "tolerances": dict(self.tolerances)},)


def _from_fields(values: dict[str, Any]) -> Robot:
    return Robot(**values)


def _alike(one: Array | None, other: Array | None) -> bool:
    return one is other if one is None or other is None else np.array_equal(one, other)


def _known_fields(assumed: Mapping[str, str]) -> Mapping[str, str]:
    names = Robot.__slots__
    if not isinstance(assumed, Mapping):
        raise InvalidValueError("assumed", brief(assumed), "field names and reasons", 'Give {"mass": "why"}.')
    for field in assumed:
        choice(field, "assumed: field", names)
    return MappingProxyType({field: text(why, f"assumed: {field}") for field, why in assumed.items()})
