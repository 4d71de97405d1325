"""The machine between encoder and cable: motor, gear, drum, dead length and pulley."""

from __future__ import annotations

from typing import Any, ClassVar, Final

import numpy as np
from attrs import Attribute, evolve, field, fields_dict, frozen
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import choice, whole_number
from sagline.core.arrays import SMALLEST, Array, checked, locked, spread
from sagline.core.errors import InvalidValueError
from sagline.core.fields import given, if_known, reduced, rule
from sagline.core.memory import check_memory
from sagline.robot.pose import unit

UPRIGHT: Final = 1e-9  # how far from vertical a swivel axis may be, as the sine of an angle
_AGREEING: Final = 1e-9  # of the dead length: largest difference of a given one to that of the guides
MOST_NAMED: Final = 3  # fields that a message names
_AXES: Final = {"swivel_axis": 1, "guides": 2}  # of a field for one cable, where it is no number


@frozen(eq=False, weakref_slot=False)
class Winch:
    """One winch with its pulley, or those of all cables: every field that is given has one shape, () or (m,).

    A field that is None is not known: what needs it says so by name.

    A cable ends at its platform anchor: one that runs over a pulley at the platform and back to the frame, a loop, is
    not modeled.

    Attributes:
        pulley_radius: Radius of the pulley at the frame, to the middle of the cable [m], >= 0; 0 for an eyelet. The
            pulley swivels about a vertical axis through the frame anchor, where the cable enters it.
        swivel_axis: Unit vector along the cable's travel where it enters the pulley, shape (..., 3): up (0, 0, 1), from
            a drum below, or down (0, 0, -1).
        pulley_friction: Coefficient mu of the cable's friction on the pulley and at the guides: tensions on the two
            sides of a bend differ by exp(mu psi), psi its angle, the larger one on the side that the cable runs to.
            Friction counts where the direction of `winding` is given, as in `inverse` and `forward`.
        rolling_friction: Share f of the tension that the pulley's bearing takes, >= 0, < 1: behind the pulley it is
            1 + f times what it would be while winding in, 1 - f times while paying out.
        dead_cable: Length of the straight guided run from drum to pulley [m], >= 0; where it leaves the drum opposite
            the first pulley. Where there are guides a robot fills it in: the sum of the distances.
        dead_rise: Height of the pulley's entry above the drum [m], within dead_cable; downward negative. Where there
            are guides a robot fills it in.
        guides: Eyelets, or pulleys small enough to be points, that a cable passes on its way from the drum to the frame
            anchor, world axes [m], shape (..., k, 3): the first is where it leaves the drum, the frame anchor is not
            among them. Between two of them it is a free catenary. None: the dead length is guided all along. Stiffness
            and sensitivities are those of a straight guided run of the same length.
        drum_radius: Radius of the drum at the bottom of the cable [m]; None where the drum is not known.
        drum_width: Width that the cable may fill, along the drum's axis [m], >= groove_pitch; a layer has drum_width
            over groove_pitch turns, which need not be whole. None: wide enough for one layer.
        groove_pitch: Distance of two turns along the drum's axis [m].
        layers: Largest number of layers on the drum, a whole number >= 1.
        drum_distance: From the drum to the first pulley, across the drum's axis [m]; None: the cable leaves the drum at
            a fixed place.
        drum_offset: Exit of the cable on the empty drum, at its first groove, along its axis from the middle of the
            first pulley [m]; the grooves of the first layer go on to the positive side. -drum_width/2 for a drum with
            its middle opposite the pulley.
        gear: Turns of the encoder for a turn of the drum, not zero; negative where counts fall as cable is let out.
        counts_per_turn: Counts of the encoder for one of its turns.
        count_zero: Counts at which length_zero is off the drum.
        length_zero: Length of cable off the drum at count_zero, at the winding tension, with dead_cable for the run
            to the pulley [m]; `home` finds it.
        cable_length: Whole length of the cable, on the drum and off it, at the winding tension [m]; no less
            than dead_cable.
        winding_tension: Tension at which the cable lies on the drum [N], >= 0.
        inertia: Moment of inertia of motor, gear and drum at the motor's shaft [kg m^2].
        torque_limit: Largest torque of the motor at its shaft [N m].
        speed_limit: Largest speed of the motor's shaft [rad/s].
        friction: Of the whole drive, as a force at the cable where it leaves the drum [N], >= 0.
        position_gain: k_p of the drive's position loop, at the cable [1/s].
        speed_gain: k_v of its speed loop, at the cable [N s/m].
        integral_gain: k_i of its speed loop, at the cable [N/m].
        load_cell_range: Largest value that the load cell reads [N].
        load_cell_deviation: Standard deviation of a reading [N], >= 0.
        load_cell_bias: Reading without load [N].
        load_cell_gain: Reading per newton.

    All are given in SI, one number for all cables or one a cable. A swivel axis may have any length but zero; guides
    have the shape (k, 3) for all cables or (m, k, 3), k >= 1, and leave dead_cable and dead_rise at 0.

    Raises:
        InvalidValueError: If a value is out of its range, the dead length rises by more than itself or is longer
            than all of the cable, a gear is zero, a swivel axis is not vertical, two guides in a row coincide, or
            the shapes do not fit.

    Examples:
        >>> import sagline as sl
        >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=[4.0, 5.0])
        >>> winch.pulley_radius
        array([0.05, 0.05])
    """

    __slots__: ClassVar[tuple[str, ...]]  # the names of the fields, in order

    pulley_radius: Array = field(default=0.0, converter=given, metadata=rule("m", low=0.0))
    swivel_axis: Array = field(default=(0.0, 0.0, 1.0), kw_only=True, converter=given, metadata=rule(shape=(3,)))
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
        """Check every field once, and give all that are known one shape."""
        values = {
            name: _checked(value, about)
            for name, about in _FIELDS.items()
            if (value := getattr(self, name)) is not None or about.default is not None
        }
        batch = {name: value.ndim - _AXES.get(name, 0) for name, value in values.items()}
        shape = _shape({name: value.shape[: batch[name]] for name, value in values.items()})
        for name, value in values.items():
            object.__setattr__(self, name, spread(value, (*shape, *value.shape[batch[name] :])))
        _check_rise(self.dead_cable, self.dead_rise)
        _check_rolling(self.rolling_friction)
        _check_whole(self.dead_cable, self.cable_length)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of every field that is given, () or (m,)."""
        return self.pulley_radius.shape

    @property
    def anything_behind(self) -> bool:
        """True if a cable runs over a pulley, or has a dead length behind it; guides count once a robot has them."""
        return bool(self.pulley_radius.any() or self.dead_cable.any())

    def per_cable(self, count: int) -> Winch:
        """The winches of so many cables, one value a cable.

        Args:
            count: Number of cables m.

        Returns:
            Winch with fields of shape (m,).

        Raises:
            InvalidValueError: If the fields have another length, or the count is no whole number >= 1.
        """
        count = whole_number(count, "count", 1)
        check_memory("winches", 8.0 * (len(_FIELDS) - len(_AXES)) * count, "Give fewer cables.")
        if self.shape not in ((), (1,), (count,)):
            allowed = f"one value, or {count}, one a cable"
            raise InvalidValueError(self._long(), f"{self.shape[0]} values", allowed, "Give every cable its own.")
        if self.shape == (count,):
            return self
        length = len(self.shape)
        return self.replace(
            **{name: np.broadcast_to(field, (count, *field.shape[length:])) for name, field in self.known().items()}
        )

    def _long(self) -> str:
        """Names for a message of the fields that differ among the cables.

        All fields have one shape, and do not know any more which of them had it first.
        """
        differ = [name for name, field in self.known().items() if (field != field[0]).any()]
        if not differ:
            return "winches"
        return f"winches: {', '.join(differ[:MOST_NAMED])}{', ...' if len(differ) > MOST_NAMED else ''}"

    def _part(self, index: NDArray[Any]) -> Winch:
        """The winches of some of the cables, of fields of shape (m,)."""
        return self.replace(**{name: field[index] for name, field in self.known().items()})

    def replace(self, **changes: Any) -> Winch:
        """A winch with some fields changed, checked like a new one.

        Args:
            changes: Fields of `Winch` and their new values.

        Returns:
            A new winch; this one stays as it is.

        Raises:
            InvalidValueError: If there is no such field, or the constructor does not accept the new values.

        Examples:
            >>> import sagline as sl
            >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=[4.0, 5.0])
            >>> winch.replace(pulley_radius=0.06).pulley_radius
            array([0.06, 0.06])
        """
        for name in changes:
            choice(name, "field", self.__slots__)
        if self.guides is not None and changes.get("guides") is not None:
            changes = {"dead_cable": 0.0, "dead_rise": 0.0, **changes}  # they follow again
        return evolve(self, **changes)

    def _run_to(self, frame_anchors: Array) -> Winch:
        """These winches with the dead length that follows from their guides.

        Args:
            frame_anchors: End points of the guides, world axes [m], shape (m, 3).

        Returns:
            Winch with fields of shape (m,); this one where there are no guides.

        Raises:
            InvalidValueError: If the last guide is at the frame anchor, or a dead length or rise other than 0 is given
                and is not what follows from the guides to a billionth.
        """
        if self.guides is None:
            return self
        points = np.concatenate((self.guides, frame_anchors[:, None]), axis=1)
        spans = np.linalg.norm(np.diff(points, axis=1), axis=-1)
        length = spans.sum(axis=1)
        if (same := spans[:, -1] < SMALLEST).any():
            i = int(np.argmax(same))
            raise InvalidValueError(
                f"winches: guides[{i}, {self.guides.shape[1] - 1}]",
                "at the frame anchor",
                "points before it",
                "List the guides from the drum on, without the frame anchor.",
            )
        rise = np.clip(frame_anchors[:, 2] - self.guides[:, 0, 2], -length, length)  # within it, whatever is rounded
        for name, own, follows in (("dead_cable", self.dead_cable, length), ("dead_rise", self.dead_rise, rise)):
            if (wrong := (own != 0.0) & (np.abs(own - follows) > _AGREEING * length)).any():
                i = int(np.argmax(wrong))
                raise InvalidValueError(
                    f"winches: {name}[{i}]",
                    f"{own[i]:.9g} m",
                    f"{follows[i]:.9g} m, as the guides have it, or 0",
                    "Leave it out where guides are given.",
                )
        return evolve(self, dead_cable=length, dead_rise=rise)

    def known(self) -> dict[str, Array]:
        """The fields that are known, by their names, in order.

        Returns:
            Those that are not None.
        """
        return {name: field for name in self.__slots__ if (field := getattr(self, name)) is not None}

    __reduce__ = reduced


# in the order of the checks
_FIELDS: Final = dict(sorted(fields_dict(Winch).items(), key=lambda each: each[0] in _AXES))


def _checked(value: ArrayLike, about: Attribute[Any]) -> Array:
    """The values of one field."""
    item = f"winches: {about.name}"
    array = checked(value, item, **about.metadata)
    match about.name:
        case "swivel_axis":
            return _vertical(array)
        case "guides":
            return _points(array)
        case "layers" if (wrong := array != np.floor(array)).any():
            item, index = _element(item, wrong)
            raise InvalidValueError(item, f"{array[index]:g}", "whole numbers", "Give how many layers the drum takes.")
        case "gear" if (wrong := array == 0.0).any():
            step = "Give the encoder's turns for one of the drum; negative where counts fall as cable is let out."
            raise InvalidValueError(_element(item, wrong)[0], "0", "not 0", step)
    return array


def _element(item: str, wrong: NDArray[np.bool_]) -> tuple[str, tuple[int, ...]]:
    """The first wrong element of a field: its name and its index."""
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    return (f"{item}[{', '.join(map(str, index))}]" if index else item), index


def _points(points: Array) -> Array:
    """The guides of all cables (k, 3), or of each (m, k, 3)."""
    if points.ndim not in (2, 3) or points.shape[-1] != 3 or 0 in points.shape:
        allowed = "shape (k, 3) or (m, k, 3), k >= 1"
        step = "Give the points from the drum on, or None."
        raise InvalidValueError("winches: guides", f"of shape {points.shape}", allowed, step)
    same = np.linalg.norm(np.diff(points, axis=-2), axis=-1) < SMALLEST
    if same.any():
        index = tuple(int(i) for i in np.argwhere(same)[0])
        index = (*index[:-1], index[-1] + 1)
        raise InvalidValueError(
            f"winches: guides[{', '.join(map(str, index))}]",
            "at the guide before it",
            "points apart",
            "Leave one of the two out.",
        )
    return points


def _shape(shapes: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The one shape of all fields, () or (m,)."""
    longest = max(shapes, key=lambda name: shapes[name])
    for name, shape in shapes.items():
        if len(shape) > 1 or 0 in shape:
            step = "Give one value, or one a cable."
            raise InvalidValueError(f"winches: {name}", f"of shape {shape}", "shape () or (m,)", step)
        if shape not in ((), (1,), shapes[longest]):
            allowed = f"one value, or {shapes[longest][0]}, as {longest} has"
            raise InvalidValueError(f"winches: {name}", f"{shape[0]} values", allowed, "Give one value a cable.")
    return shapes[longest]


def _vertical(axis: Array) -> Array:
    """Unit vectors of the swivel axes, which are vertical."""
    length = np.linalg.norm(axis, axis=-1)
    if not length.all():
        raise InvalidValueError(
            "winches: swivel_axis", "the zero vector", "up or down", "Give [0, 0, 1] or [0, 0, -1]."
        )
    axis = unit(axis)
    if (np.hypot(axis[..., 0], axis[..., 1]) > UPRIGHT).any():
        slanted = axis.reshape(-1, 3)[np.argmax(np.hypot(axis[..., 0], axis[..., 1]).reshape(-1))]
        raise InvalidValueError(
            "winches: swivel_axis",
            f"({', '.join(f'{x:.3g}' for x in slanted)})",
            "up or down",
            "A pulley that swivels about a slanted axis, or that does not swivel, is not modeled: its cable leaves the "
            "vertical plane. Give [0, 0, 1] or [0, 0, -1].",
        )
    upright = np.zeros(axis.shape)
    upright[..., 2] = np.sign(axis[..., 2])
    return locked(upright)


def _check_rolling(rolling_friction: Array) -> None:
    if (much := rolling_friction >= 1.0).any():
        i = int(np.argmax(much))
        item, shown = f"winches: rolling_friction[{i}]", f"{rolling_friction.flat[i]:g}"
        raise InvalidValueError(item, shown, ">= 0, < 1", "A bearing takes less than all; correct it.")


def _check_rise(dead_cable: Array, dead_rise: Array) -> None:
    steep = np.flatnonzero(np.abs(dead_rise) > dead_cable)
    if steep.size:
        i = int(steep[0])
        raise InvalidValueError(
            f"winches: dead_rise[{i}]",
            f"{dead_rise.flat[i]:g} m",
            f"within +-{dead_cable.flat[i]:g} m, its dead_cable",
            "A straight run rises by no more than its length; correct one of the two.",
        )


def _check_whole(dead_cable: Array, cable_length: Array | None) -> None:
    if cable_length is None:
        return
    short = np.flatnonzero(cable_length < dead_cable)
    if short.size:
        i = int(short[0])
        raise InvalidValueError(
            f"winches: cable_length[{i}]",
            f"{cable_length.flat[i]:g} m",
            f">= {dead_cable.flat[i]:g} m, its dead_cable",
            "A cable reaches from the drum to the pulley at least; correct one of the two.",
        )
