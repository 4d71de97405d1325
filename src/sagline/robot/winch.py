"""Data of winches: motor, encoder, gear, drum, dead length and pulley."""

from __future__ import annotations

from typing import Any, ClassVar, Final

import numpy as np
from attrs import Attribute, evolve, field, fields_dict, frozen
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import check_memory, choice, whole_number
from sagline.core.arrays import SMALLEST, Array, Flags, checked, locked, refuse_first, spread
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, if_known, reduced, rule
from sagline.robot.pose import unit

UPRIGHT: Final = 1e-9  # sine of the largest angle between a swivel axis and the vertical
# largest relative difference between a given dead length and the sum of the distances between guides
_AGREEING: Final = 1e-9
MOST_LAYERS: Final = 1000
LARGEST_PULLEY: Final = 10.0  # [m], larger than the sheaves of mine hoists and cable cars
MOST_NAMED: Final = 3  # largest number of fields that a message lists
# number of array axes of a field's value for one cable, if the value is not a single number
_AXES: Final = {"swivel_axis": 1, "guides": 2}


@frozen(eq=False, weakref_slot=False)
class Winch:
    """One winch with its pulley, or the winches of all cables. All known fields have the same shape, () or (m,).

    A field that is None is unknown. A function that needs an unknown field raises an error with the name of the field.
    The model does not include cables that run from the frame over a pulley on the platform and back to the frame.

    Attributes:
        pulley_radius: Radius of the pulley at the frame, measured to the centerline of the cable [m], 0 to 10; 0 for an
            eyelet. The cable enters the pulley at the frame anchor, and the pulley swivels about the swivel axis, which
            passes through the frame anchor.
        swivel_axis: Unit vector of shape (..., 3) in the direction in which the cable enters the pulley, world axes: up
            (0, 0, 1) for a drum below the pulley, down (0, 0, -1), or any other direction. With another direction,
            `inverse`, `forward`, `confirm`, `stiffness`, `modes`, `calibrate` and `simulate` (without cable mass)
            compute the robot, with the models `Catenary` and `Elastic` and without friction; functions that do not
            support it refuse it.
        on_platform: True if winch and pulley are on the platform. The cable then enters the pulley at the platform
            anchor and ends at the frame anchor; the swivel axis is in the platform frame. The dead length is on the
            swivel axis; guides and dead_rise are not allowed. Mass, center of mass and inertia of the robot include
            winches, pulleys and the whole cable, as if all of it were on the drum. `inverse`, `forward`, `confirm`,
            `stiffness` and `modes` compute the robot; other functions refuse it.
        pulley_friction: Friction coefficient mu of the cable on the pulley and at the guides. The tensions on the two
            sides of a bend of angle psi differ by the factor exp(mu psi). The tension is larger on the side toward
            which the cable moves. Friction is included only if the argument `winding` of a function, such as `inverse`
            or `forward`, is given.
        rolling_friction: Share f of the tension that the pulley's bearing takes, >= 0, < 1. On the drum side of the
            pulley, the tension is multiplied by 1 + f while winding in and by 1 - f while paying out.
        dead_cable: Length of the straight guided cable between drum and pulley [m], >= 0. If drum_distance is given,
            the cable leaves the drum at a moving point; dead_cable is then the length for the point opposite to the
            first pulley. If guides are given, the robot computes dead_cable as the sum of the distances.
        dead_rise: Height of the pulley's entry above the drum [m], negative for a pulley below the drum, at most
            dead_cable in magnitude. If guides are given, the robot computes dead_rise.
        guides: Eyelets, or pulleys small enough to be points, along the cable from the drum to the frame anchor, world
            axes [m], shape (..., k, 3). The first guide is the point at which the cable leaves the drum. The frame
            anchor is not a guide. Between two guides, the cable is a free catenary. None: the whole dead length is
            guided. Stiffness and sensitivities assume a straight guided cable of the same length.
        drum_radius: Radius of the drum to the surface under the cable [m]; None if the drum is not known.
        drum_width: Usable width along the drum axis [m], >= groove_pitch. A layer has drum_width/groove_pitch turns,
            which need not be a whole number. None: one layer is wide enough for the whole cable.
        groove_pitch: Distance between adjacent turns along the drum axis [m].
        layers: Largest possible number of layers on the drum, a whole number from 1 to 1000.
        drum_distance: Distance from the drum to the first pulley, perpendicular to the drum axis [m]; None: the cable
            leaves the drum at a fixed point.
        drum_offset: Position of the first groove along the drum axis, relative to the center of the first pulley [m].
            The cable leaves the empty drum at the first groove. The next grooves are in the positive direction. Use
            -drum_width/2 if the center of the drum is opposite to the pulley.
        gear: Encoder turns per drum turn, not zero; negative if counts decrease while the winch pays out.
        counts_per_turn: Encoder counts per encoder turn.
        count_zero: Encoder counts at which the length off the drum is length_zero.
        length_zero: Length of cable off the drum at count_zero, at the winding tension, including dead_cable [m]. The
            function `home` determines length_zero.
        cable_length: Length of the whole cable, on and off the drum, at the winding tension [m]; at least dead_cable.
        winding_tension: Tension of the cable on the drum [N], >= 0.
        inertia: Moment of inertia of motor, gear and drum at the motor's shaft [kg m^2].
        torque_limit: Largest torque of the motor at its shaft [N m].
        speed_limit: Largest speed of the motor's shaft [rad/s].
        friction: Friction of the whole drive, as an equivalent force on the cable at the drum [N], >= 0.
        position_gain: k_p of the drive's position loop, referred to the cable [1/s].
        speed_gain: k_v of the drive's speed loop, referred to the cable [N s/m].
        integral_gain: k_i of the drive's speed loop, referred to the cable [N/m].
        load_cell_range: Largest value that the load cell measures [N].
        load_cell_deviation: Standard deviation of a measured value [N], >= 0.
        load_cell_bias: Measured value without load [N].
        load_cell_gain: Measured value per newton of load.

    All fields are in SI units, one number for all cables or one number per cable. A swivel axis may have any nonzero
    length. Guides have the shape (k, 3) for all cables or (m, k, 3), k >= 1. With guides, omit dead_cable and
    dead_rise.

    Raises:
        InvalidValueError: If a value is out of its range, or the shapes do not fit; if the dead rise exceeds the dead
            length, or the dead length exceeds the cable length; if a gear or a swivel axis is zero, or two consecutive
            guides coincide.

    Examples:
        >>> import sagline as sl
        >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=[4.0, 5.0])
        >>> winch.pulley_radius
        array([0.05, 0.05])
    """

    __slots__: ClassVar[tuple[str, ...]]  # field names in the order of the constructor

    pulley_radius: Array = field(default=0.0, converter=given, metadata=rule("m", low=0.0))
    swivel_axis: Array = field(default=(0.0, 0.0, 1.0), kw_only=True, converter=given, metadata=rule(shape=(3,)))
    on_platform: Flags = field(default=False, kw_only=True, converter=given, metadata=rule())
    pulley_friction: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule(low=0.0))
    rolling_friction: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule(low=0.0))
    dead_cable: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("m", low=0.0))
    dead_rise: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("m"))
    guides: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m"))
    drum_radius: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    drum_width: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    groove_pitch: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    layers: Array = field(default=1.0, kw_only=True, converter=given, metadata=rule(low=1.0))
    drum_distance: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    drum_offset: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("m"))
    gear: Array = field(default=1.0, kw_only=True, converter=given, metadata=rule())
    counts_per_turn: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule(above=0.0))
    count_zero: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule())
    length_zero: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    cable_length: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("m", above=0.0))
    winding_tension: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("N", low=0.0))
    inertia: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("kg m^2", above=0.0))
    torque_limit: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("N m", above=0.0))
    speed_limit: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("rad/s", above=0.0))
    friction: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("N", low=0.0))
    position_gain: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("1/s", low=0.0))
    speed_gain: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("N s/m", low=0.0))
    integral_gain: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("N/m", low=0.0))
    load_cell_range: Array | None = field(default=None, kw_only=True, converter=if_known, metadata=rule("N", above=0.0))
    load_cell_deviation: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("N", low=0.0))
    load_cell_bias: Array = field(default=0.0, kw_only=True, converter=given, metadata=rule("N"))
    load_cell_gain: Array = field(default=1.0, kw_only=True, converter=given, metadata=rule(above=0.0))

    def __attrs_post_init__(self) -> None:
        """Check every field, and expand all known fields to a common shape."""
        values = {
            name: _checked(value, about)
            for name, about in _FIELDS.items()
            if (value := getattr(self, name)) is not None or about.default is not None
        }
        batch = {name: value.ndim - _AXES.get(name, 0) for name, value in values.items()}
        shape = _shape({name: value.shape[: batch[name]] for name, value in values.items()})
        for name, value in values.items():
            object.__setattr__(self, name, spread(value, (*shape, *value.shape[batch[name] :])))
        _check_pairs(self)

    @property
    def shape(self) -> tuple[int, ...]:
        """Common shape of all known fields, () or (m,)."""
        return self.pulley_radius.shape

    @property
    def anything_behind(self) -> bool:
        """True if any winch has a pulley, a dead length (of guides: known in a robot), or is on the platform."""
        return bool(self.pulley_radius.any() or self.dead_cable.any() or self.on_platform.any())

    @property
    def slanted(self) -> Flags:
        """True for a pulley whose swivel axis is not vertical, and on the platform; an eyelet's axis has no effect."""
        return np.asarray((self.swivel_axis[..., :2].any(axis=-1) & (self.pulley_radius > 0.0)) | self.on_platform)

    def per_cable(self, count: int) -> Winch:
        """Copy of the winch data for `count` cables, with one value per cable in every field.

        Args:
            count: Number of cables m.

        Returns:
            Winch with known fields of shape (m,).

        Raises:
            InvalidValueError: If the fields have values for other numbers of cables, or if `count` is not >= 1.
        """
        count = whole_number(count, "count", 1)
        check_memory("winches", 8.0 * (len(_FIELDS) - len(_AXES)) * count, "Give fewer cables.")
        if self.shape not in ((), (1,), (count,)):
            allowed = f"one value, or {count}, one per cable"
            raise InvalidValueError(self._long(), f"{self.shape[0]} values", allowed, "Give one value per cable.")
        if self.shape == (count,):
            return self
        length = len(self.shape)
        return self.replace(
            **{name: np.broadcast_to(field, (count, *field.shape[length:])) for name, field in self.known().items()}
        )

    def _long(self) -> str:
        """Part of a message: names of the fields whose values differ between cables, or are slanted axes."""
        general = "on_platform" if self.on_platform.any() else "swivel_axis"
        differ = [
            name
            for name, field in self.known().items()
            if (field != field[0]).any() or (name == general and self.slanted.any())
        ]
        if not differ:
            return "winches"
        return f"winches: {', '.join(differ[:MOST_NAMED])}{', ...' if len(differ) > MOST_NAMED else ''}"

    def _part(self, index: NDArray[Any]) -> Winch:
        """Winches of the cables that `index` selects; the fields must have the shape (m,)."""
        return self.replace(**{name: field[index] for name, field in self.known().items()})

    def replace(self, **changes: Any) -> Winch:
        """Copy of the winch with some fields changed; the constructor checks the copy.

        Args:
            changes: Fields of `Winch` and their new values.

        Returns:
            New winch; the original winch is unchanged.

        Raises:
            InvalidValueError: If a field does not exist, or the constructor does not accept the new values.

        Examples:
            >>> import sagline as sl
            >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=[4.0, 5.0])
            >>> winch.replace(pulley_radius=0.06).pulley_radius
            array([0.06, 0.06])
        """
        for name in changes:
            choice(name, "field", self.__slots__)
        if self.guides is not None and changes.get("guides") is not None:
            changes = {"dead_cable": 0.0, "dead_rise": 0.0, **changes}  # computed again by the robot
        return evolve(self, **changes)

    def _run_to(self, frame_anchors: Array) -> Winch:
        """Copy with dead lengths, measured from the drums along the guides to `frame_anchors` (m, 3) [m]."""
        if self.guides is None:
            return self
        points = np.concatenate((self.guides, frame_anchors[:, None]), axis=1)
        spans = np.linalg.norm(np.diff(points, axis=1), axis=-1)
        length = spans.sum(axis=1)
        if (same := spans[:, -1] < SMALLEST).any():
            item = f"winches: guides[{int(np.argmax(same))}, {self.guides.shape[1] - 1}]"
            step = "List the guides in order, starting at the drum, without the frame anchor."
            raise InvalidValueError(item, "at the frame anchor", "a point before the frame anchor", step)
        # rounding must not make the rise larger than the length
        rise = np.clip(frame_anchors[:, 2] - self.guides[:, 0, 2], -length, length)
        for name, own, follows in (("dead_cable", self.dead_cable, length), ("dead_rise", self.dead_rise, rise)):
            if (wrong := (own != 0.0) & (np.abs(own - follows) > _AGREEING * length)).any():
                i = int(np.argmax(wrong))
                item, allowed = f"winches: {name}[{i}]", f"{follows[i]:.9g} m, from the guides, or 0"
                raise InvalidValueError(item, f"{own[i]:.9g} m", allowed, "Omit it if guides are given.")
        return evolve(self, dead_cable=length, dead_rise=rise)

    def known(self) -> dict[str, Array]:
        """Names and values of the known fields, in the order of the constructor.

        Returns:
            Dictionary of the fields that are not None.
        """
        return {name: field for name in self.__slots__ if (field := getattr(self, name)) is not None}

    __reduce__ = reduced


# the order of the checks determines which error is reported
_FIELDS: Final = dict(sorted(fields_dict(Winch).items(), key=lambda each: each[0] in _AXES))


def _checked(value: ArrayLike, about: Attribute[Any]) -> Array:
    """Checked values of the field that `about` describes."""
    item = f"winches: {about.name}"
    array = checked(value, item, **about.metadata)
    match about.name:
        case "swivel_axis":
            return _axes_of(array)
        case "guides":
            return _points(array)
        case "on_platform":
            refuse_first(~np.isin(array, (0.0, 1.0)), item, array, "", "true or false", "Say where the winch is.")
            return locked(array.astype(np.bool_))
        case "layers":
            step = "Give the number of layers on the drum."
            refuse_first(array != np.floor(array), item, array, "", "whole numbers", step)
            refuse_first(array > MOST_LAYERS, item, array, "", f"1 to {MOST_LAYERS}", step)
        case "pulley_radius":
            allowed, step = f"0 to {LARGEST_PULLEY:g} m", "Give the radius in meters."
            refuse_first(array > LARGEST_PULLEY, item, array, "m", allowed, step)
        case "gear":
            step = "Give the encoder turns per drum turn; negative if counts decrease when cable is paid out."
            refuse_first(array == 0.0, item, np.abs(array), "", "not 0", step)  # np.abs prints -0 as 0
    return array


def _points(points: Array) -> Array:
    """Checked guides, (k, 3) for all cables or (m, k, 3) for m cables."""
    if points.ndim not in (2, 3) or points.shape[-1] != 3 or 0 in points.shape:
        allowed = "shape (k, 3) or (m, k, 3), k >= 1"
        step = "Give the points in order, starting at the drum, or None."
        raise InvalidValueError("winches: guides", f"of shape {points.shape}", allowed, step)
    same = np.linalg.norm(np.diff(points, axis=-2), axis=-1) < SMALLEST
    if same.any():
        *cable, before = map(int, np.argwhere(same)[0])
        item = f"winches: guides[{', '.join(map(str, (*cable, before + 1)))}]"
        raise InvalidValueError(item, "at the previous guide", "different points", "Omit one of the two guides.")
    return points


def _shape(shapes: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """Common shape of all fields, () or (m,), from the shape of each field."""
    longest = max(shapes, key=lambda name: shapes[name])
    for name, shape in shapes.items():
        if len(shape) > 1 or 0 in shape:
            step = "Give one value, or one value per cable."
            raise InvalidValueError(f"winches: {name}", f"of shape {shape}", "shape () or (m,)", step)
        if shape not in ((), (1,), shapes[longest]):
            allowed = f"one value, or {shapes[longest][0]}, as {longest} has"
            raise InvalidValueError(f"winches: {name}", f"{shape[0]} values", allowed, "Give one value per cable.")
    return shapes[longest]


def _axes_of(axis: Array) -> Array:
    """Checked unit vectors of swivel axes; an axis within UPRIGHT of the vertical becomes exactly vertical."""
    if not (length := np.linalg.norm(axis, axis=-1)).all():
        item = "winches: swivel_axis" + (f"[{int(np.argmin(length))}]" if axis.ndim > 1 else "")
        step = "Give the direction in which the cable enters the pulley, such as [0, 0, 1]."
        raise InvalidValueError(item, "the zero vector", "a direction", step)
    axis = unit(axis)
    upright = np.zeros(axis.shape)
    upright[..., 2] = np.sign(axis[..., 2])
    slanted = np.hypot(axis[..., 0], axis[..., 1]) > UPRIGHT
    return locked(np.where(slanted[..., None], axis, upright))


def _check_pairs(winch: Winch) -> None:
    """Refuse fields that contradict each other, and a bearing that would take the whole tension."""
    dead_cable, dead_rise, friction = map(np.atleast_1d, (winch.dead_cable, winch.dead_rise, winch.rolling_friction))
    steep, allowed = np.abs(dead_rise) > dead_cable, "within +-{limit:g} m, its dead_cable"
    step = "A straight cable rises by at most its length; correct one of the two values."
    refuse_first(steep, "winches: dead_rise", dead_rise, "m", allowed, step, dead_cable)
    step = "A bearing takes only part of the tension; correct it."
    refuse_first(friction >= 1.0, "winches: rolling_friction", friction, "", ">= 0, < 1", step)
    if winch.on_platform.any():
        cable, step = int(np.argmax(winch.on_platform)), "Its cable runs along the swivel axis; leave this out."
        if winch.guides is not None:
            raise InvalidValueError(f"winches: on_platform[{cable}]", "true", "false with guides", step)
        turned = (dead_rise != 0.0) & winch.on_platform
        refuse_first(turned, "winches: dead_rise", dead_rise, "m", "0 m on the platform", step)
    if winch.cable_length is not None:
        short, allowed = winch.cable_length < dead_cable, ">= {limit:g} m, its dead_cable"
        step = "The cable must be longer than the distance from drum to pulley; correct one of the two values."
        refuse_first(short, "winches: cable_length", winch.cable_length, "m", allowed, step, dead_cable)
