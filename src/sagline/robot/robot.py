"""The robot: geometry, cables, winches and platform; inertia of simple bodies; copies of a robot with changes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal, get_args

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import ArrayLike

from sagline.cables.cable import Cable
from sagline.core.arguments import brief, choice, instance, label, optional, text, whole_number
from sagline.core.arrays import Array, exactly, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, given_by_name, if_known, reduced, rule
from sagline.core.results import Shown, set_fields
from sagline.robot import checks
from sagline.robot.checks import MOTION_PATTERNS, MotionPattern, freedom_matrix
from sagline.robot.pose import PoseBox
from sagline.robot.tolerances import UNCERTAIN, Provenance, deviations, value_of
from sagline.robot.winch import Winch

TensionLimitsOf = Literal["chord", "frame_end"]


def _given_or_none(value: ArrayLike | None) -> Array:
    """Converter that returns a value or None unchanged; the check of the field later replaces None by a value."""
    return value  # type: ignore[return-value]


@frozen(eq=False, repr=False, weakref_slot=False)
class Robot(Shown):
    """Data of a cable-driven parallel robot. Cable i connects frame_anchors[i] and platform_anchors[i].

    Attributes:
        name: Name of the robot.
        frame_anchors: Frame ends of the cables in the world [m], z up, shape (m, 3).
        platform_anchors: Platform ends of the cables in the platform frame [m], shape (m, 3).
        cables: Material of the cables, given once for all cables or per cable; fields of shape (m,).
        winches: Pulleys, dead lengths, drums and motors, given once for all cables or per cable, fields of shape (m,).
            None for a robot without winch data, whose cables start at the frame anchors.
        mass: Mass of the platform [kg], > 0.
        inertia: Inertia about the center of mass in the platform frame [kg m^2], shape (3, 3). Must be positive
            definite, with no principal moment larger than the sum of the two other moments. A planar pattern requires
            only a positive moment about plane_normal. May be omitted for a pattern without rotation.
        center_of_mass: Center of mass in the platform frame [m], shape (3,).
        gravity: Gravitational acceleration along -z [m/s^2], >= 0.
        motion_pattern: "3R3T", "3T" (point mass), "1R2T" (planar) or "2T" (planar without rotation).
        plane_normal: Normal of the plane of a planar pattern, world axes, shape (3,), of any nonzero length, and
            normalized by the constructor; None for the other patterns.
        tension_min: Lower tension limits [N], >= 0, given once for all cables or per cable, shape (m,).
        tension_max: Upper tension limits [N], may be infinite, given once for all cables or per cable, shape (m,).
        tension_limits_of: Tension to which the limits apply, "chord" or "frame_end".
        platform_size: Edges of the platform, for drawing [m], shape (3,), or None.
        frame_size: Edges of the frame, for drawing [m], shape (3,), or None.
        test_box: Box of poses from which tests and examples take poses, almost all wrench-feasible; or None.
        source: Publication or document from which the numbers are taken.
        assumed: Reasons for values that are not from `source`, by field name.
        notes: Further remarks for users.
        tolerances: Standard deviations of quantities before a calibration, by name, in SI units, > 0, for example from
            a data sheet; infinite if unknown. A deviation is one number for the whole field, one number per axis for a
            quantity with three components, or an array of the shape of the field. Names: frame_anchors,
            platform_anchors, center_of_mass (with three components each), mass, and per cable length_zero, drum_radius,
            linear_density, axial_stiffness, pulley_radius, dead_cable, load_cell_gain, load_cell_bias.
        calibration: Origin and standard errors of values that a calibration has identified; or None.

    Raises:
        InvalidValueError: If a field is wrong; the message names the field and the index of the wrong value.

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

    name: str
    frame_anchors: Array = field(converter=given, metadata=rule("m"))
    platform_anchors: Array = field(converter=given, metadata=rule("m"))
    cables: Cable
    winches: Winch | None = field(default=None, kw_only=True)
    mass: float = field(metadata=rule("kg"))
    inertia: Array = field(default=None, converter=_given_or_none)
    center_of_mass: Array = field(default=(0.0, 0.0, 0.0), kw_only=True, converter=given, metadata=rule("m"))
    gravity: float = field(default=9.81, kw_only=True, metadata=rule("m/s^2"))
    motion_pattern: MotionPattern = field(default="3R3T", kw_only=True)
    plane_normal: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule(""))
    tension_min: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("N"))
    tension_max: Array = field(default=np.inf, kw_only=True, converter=given, metadata=rule("N"))
    tension_limits_of: TensionLimitsOf = field(default="chord", kw_only=True)
    platform_size: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m"))
    frame_size: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m"))
    test_box: PoseBox | None = field(default=None, kw_only=True)
    source: str = field(default="", kw_only=True)
    assumed: Mapping[str, str] = field(default=MappingProxyType({}), kw_only=True)
    notes: str = field(default="", kw_only=True)
    tolerances: Mapping[str, Array] = field(default=MappingProxyType({}), kw_only=True, converter=given_by_name)
    calibration: Provenance | None = field(default=None, kw_only=True)

    def __attrs_post_init__(self) -> None:
        """Check every field. A single value for all cables is expanded to one value per cable."""
        frame, platform = checks.anchors(self.frame_anchors, self.platform_anchors)
        pattern = choice(self.motion_pattern, "motion_pattern", MOTION_PATTERNS)
        normal = checks.plane_normal(self.plane_normal, pattern)
        lower, upper = checks.limits_of_each_cable(self.tension_min, self.tension_max, len(frame))
        winches = optional(self.winches, Winch, "winches")
        calibration = optional(self.calibration, Provenance, "calibration")
        set_fields(
            self,
            name=label(self.name, "name"),
            frame_anchors=frame,
            platform_anchors=platform,
            cables=checks.cables(self.cables, len(frame)),
            winches=None if winches is None else winches.per_cable(len(frame))._run_to(frame),
            mass=number(self.mass, "mass", "kg", above=0.0),
            inertia=checks.inertia(self.inertia, pattern, normal),
            center_of_mass=exactly(self.center_of_mass, "center_of_mass", "m", (3,)),
            gravity=number(self.gravity, "gravity", "m/s^2", low=0.0),
            motion_pattern=pattern,
            plane_normal=normal,
            tension_min=lower,
            tension_max=upper,
            tension_limits_of=choice(self.tension_limits_of, "tension_limits_of", get_args(TensionLimitsOf)),
            platform_size=checks.size(self.platform_size, "platform_size"),
            frame_size=checks.size(self.frame_size, "frame_size"),
            test_box=optional(self.test_box, PoseBox, "test_box"),
            source=text(self.source, "source"),
            assumed=_known_fields(self.assumed),
            notes=text(self.notes, "notes"),
            tolerances=deviations(self.tolerances, "tolerances", len(frame), above=0.0),
            calibration=None if calibration is None else calibration._of(len(frame)),
        )

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
        """Matrix (n, 6) with orthonormal rows that selects the free motions of a wrench or twist in world axes."""
        return freedom_matrix(self.motion_pattern, self.plane_normal)

    def replace(self, **changes: Any) -> Robot:
        """Copy of the robot with some fields changed; the constructor checks the copy.

        Tolerances are unchanged. Standard errors of the replaced values are removed from `calibration`.

        Args:
            changes: Fields of `Robot` and their new values.

        Returns:
            New robot; the original robot is unchanged.

        Raises:
            InvalidValueError: If a field does not exist, or the constructor does not accept the new values.

        Examples:
            >>> import sagline as sl
            >>> heavy = sl.load_robot("cogiro").replace(mass=300.0, tension_min=50.0)
            >>> print(heavy.mass, heavy.tension_min[0])
            300.0 50.0
        """
        for name in changes:
            choice(name, "field", Robot.__slots__)
        guides = None if self.winches is None else self.winches.guides
        if self.winches is not None and guides is not None and "frame_anchors" in changes and "winches" not in changes:
            changes["winches"] = self.winches.replace(guides=guides)  # the new robot computes the dead length again
        return evolve(self, **changes)._kept(self) if "calibration" not in changes else evolve(self, **changes)

    def with_payload(self, mass: float, *, at: ArrayLike | None = None) -> Robot:
        """Copy of the robot with a payload on the platform.

        Args:
            mass: Mass of the payload [kg], >= 0.
            at: Position of the payload, a point mass, in the platform frame [m], shape (3,). None: the payload has the
                same mass distribution as the platform, so that the inertia increases in proportion to the mass.

        Returns:
            New robot; the original robot is unchanged.

        Raises:
            InvalidValueError: If the mass is negative, or `at` is not three numbers.

        Examples:
            >>> import sagline as sl
            >>> loaded = sl.load_robot("cogiro").with_payload(100.0, at=(0, 0, -0.5))
            >>> print(f"{loaded.mass:g} kg, center of mass at {loaded.center_of_mass[2]:.3f} m")
            191.058 kg, center of mass at -0.136 m
        """
        load = number(mass, "mass of the payload", "kg", low=0.0)
        whole = self.mass + load
        if at is None:
            return self.replace(mass=whole, inertia=self.inertia * (whole / self.mass))
        lever = exactly(at, "at", "m", (3,)) - self.center_of_mass
        share = load / whole
        # parallel axis theorem for two bodies about their common center of mass, with the reduced mass
        added = share * self.mass * (lever @ lever * np.eye(3) - np.outer(lever, lever))
        center = self.center_of_mass + share * lever
        return self.replace(mass=whole, inertia=self.inertia + added, center_of_mass=center)

    def _kept(self, before: Robot) -> Robot:
        """Robot without the standard errors of values that have changed since the robot `before`."""
        if self.calibration is None:
            return self
        errors = self.calibration.standard_error
        same = {name: error for name, error in errors.items() if _alike(value_of(self, name), value_of(before, name))}
        if len(same) == len(errors):
            return self
        return evolve(self, calibration=evolve(self.calibration, standard_error=same))

    __reduce__ = reduced


def box_inertia(mass: float, x: float, y: float, z: float) -> Array:
    """Inertia (3, 3) of a solid box about its center of mass [kg m^2]; x, y, z: edge lengths [m]; mass [kg]."""
    return np.diag([y * y + z * z, x * x + z * z, x * x + y * y]) * (mass / 12.0)


def cylinder_inertia(mass: float, radius: float, height: float) -> Array:
    """Inertia (3, 3) of a solid cylinder about its center of mass [kg m^2]; the axis is z; mass [kg], lengths [m]."""
    across = (3.0 * radius * radius + height * height) / 12.0
    return np.diag([across, across, 0.5 * radius * radius]) * mass


def with_mass(robot: Robot, mass: float) -> Robot:
    """Copy of a robot with the platform mass `mass` [kg]; the inertia changes in proportion to the mass."""
    return robot.replace(mass=mass, inertia=robot.inertia * (mass / robot.mass))


def with_anchors(robot: Robot, places: Array) -> tuple[Robot, ...]:
    """Copies of a checked robot without guides, with the frame anchors `places` (N, m, 3) [m], not checked again."""
    copies = tuple(object.__new__(Robot) for _ in places)
    names: tuple[str, ...] = Robot.__slots__
    for name in names:
        fill, value = getattr(Robot, name).__set__, getattr(robot, name)
        for copy in copies:
            fill(copy, value)
    for copy, place in zip(copies, places, strict=True):
        set_fields(copy, frame_anchors=place)
    return copies


def without_cables(robot: Robot, *cables: int) -> Robot:
    """Robot after the failure of some cables. The broken cables do not load the platform with their weight.

    Args:
        robot: The robot before the failure.
        cables: Indices of the broken cables, 0 to m - 1.

    Returns:
        Robot with the remaining cables in the same order; all other data are unchanged.

    Raises:
        InvalidValueError: If an index is out of range, or no cable remains.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("cogiro")
        >>> sl.without_cables(robot, 3).cable_count
        7
    """
    kept = np.ones(instance(robot, Robot, "robot").cable_count, dtype=bool)
    for cable in cables:
        kept[whole_number(cable, "cable", 0, robot.cable_count - 1)] = False
    if not kept.any():
        raise InvalidValueError("cables", "all cables of the robot", "fewer", "Keep at least one cable.")
    return robot.replace(
        frame_anchors=robot.frame_anchors[kept],
        platform_anchors=robot.platform_anchors[kept],
        cables=robot.cables._part(kept, kept.shape),
        winches=None if robot.winches is None else robot.winches._part(kept),
        tension_min=robot.tension_min[kept],
        tension_max=robot.tension_max[kept],
    )


def with_quantities(robot: Robot, values: Mapping[str, Array]) -> Robot:
    """Copy of a robot with the `values` of quantities in `UNCERTAIN`; winches are added if the values need them."""
    owned: dict[str, dict[str, Any]] = {}
    for name, value in values.items():
        owner, _, field = UNCERTAIN[name].place.rpartition(".")
        owned.setdefault(owner, {})[field] = value
    changes = owned.pop("", {})
    parts = {owner: (getattr(robot, owner) or Winch()).replace(**own) for owner, own in owned.items()}
    return robot.replace(**parts, **changes)


def standard_errors(robot: Robot) -> dict[str, Array]:
    """Standard errors by name: tolerances of the robot, or errors of its calibration if these are smaller."""
    errors = dict(robot.tolerances)
    for name, error in {} if robot.calibration is None else robot.calibration.standard_error.items():
        errors[name] = np.minimum(error, errors.get(name, np.where(np.isfinite(error), error, 0.0)))
    return errors


def _alike(one: Array | None, other: Array | None) -> bool:
    return one is other if one is None or other is None else np.array_equal(one, other)


def _known_fields(assumed: Mapping[str, str]) -> Mapping[str, str]:
    if not isinstance(assumed, Mapping):
        raise InvalidValueError("assumed", brief(assumed), "field names and reasons", 'Give {"mass": "why"}.')
    for name in assumed:
        choice(name, "assumed: field", Robot.__slots__)
    return MappingProxyType({name: text(why, f"assumed: {name}") for name, why in assumed.items()})
