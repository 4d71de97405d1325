"""The machine between encoder and cable: motor, gear, drum, dead cable and pulley."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sagline.core.arguments import choice, whole_number
from sagline.core.arrays import SMALLEST, Array, checked, locked, spread
from sagline.core.errors import InvalidValueError
from sagline.core.memory import check_memory
from sagline.robot.unit import unit

UPRIGHT: Final = 1e-9  # how far from vertical a swivel axis may be, as the sine of an angle
_AGREEING: Final = 1e-9  # of the dead cable: how far a given one may be from that of the guides
MOST_NAMED: Final = 3  # fields that a message names


class Rule(NamedTuple):
    """What a field's values must be.

    Attributes:
        unit: Their unit.
        low: The least value, or None.
        above: A bound they must exceed, or None.
        needed: Whether the field cannot be left unknown, None.
    """

    unit: str
    low: float | None = None
    above: float | None = None
    needed: bool = False


# every field but the swivel axis and the guides, in order
RULES: Final[Mapping[str, Rule]] = MappingProxyType(
    {
        "pulley_radius": Rule("m", low=0.0, needed=True),
        "pulley_friction": Rule("", low=0.0, needed=True),
        "rolling_friction": Rule("", low=0.0, needed=True),
        "dead_cable": Rule("m", low=0.0, needed=True),
        "dead_rise": Rule("m", needed=True),
        "drum_radius": Rule("m", above=0.0),
        "drum_width": Rule("m", above=0.0),
        "groove_pitch": Rule("m", above=0.0),
        "layers": Rule("", low=1.0, needed=True),
        "drum_distance": Rule("m", above=0.0),
        "drum_offset": Rule("m", needed=True),
        "gear": Rule("", needed=True),
        "counts_per_turn": Rule("", above=0.0),
        "count_zero": Rule("", needed=True),
        "length_zero": Rule("m", above=0.0),
        "cable_length": Rule("m", above=0.0),
        "winding_tension": Rule("N", low=0.0, needed=True),
        "inertia": Rule("kg m^2", above=0.0),
        "torque_limit": Rule("N m", above=0.0),
        "speed_limit": Rule("rad/s", above=0.0),
        "friction": Rule("N", low=0.0, needed=True),
        "position_gain": Rule("1/s", low=0.0),
        "speed_gain": Rule("N s/m", low=0.0),
        "integral_gain": Rule("N/m", low=0.0),
        "load_cell_range": Rule("N", above=0.0),
        "load_cell_deviation": Rule("N", low=0.0, needed=True),
        "load_cell_bias": Rule("N", needed=True),
        "load_cell_gain": Rule("", above=0.0, needed=True),
    }
)


@dataclass(frozen=True, slots=True, eq=False)
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
            among them. Between two of them it hangs freely. None: the dead cable is guided all along. Stiffness and
            sensitivities are those of a straight guided run of the same length.
        drum_radius: Radius of the drum at the bottom of the cable [m]; None where the drum is not known.
        drum_width: Width that the cable may fill, along the drum's axis [m], >= groove_pitch; a layer has drum_width
            over groove_pitch turns, which need not be whole. None: wide enough for one layer.
        groove_pitch: How far along its axis a turn of the drum moves the cable [m].
        layers: How many layers the drum takes, a whole number >= 1.
        drum_distance: From the drum to the first pulley, across the drum's axis [m]; None: the cable leaves the drum at
            a fixed place.
        drum_offset: Where the cable leaves the empty drum, at its first groove, along its axis from the middle of the
            first pulley [m]; the grooves of the first layer go on to the positive side. -drum_width/2 for a drum with
            its middle opposite the pulley.
        gear: Turns of the encoder for a turn of the drum, not zero; negative where counts fall as cable is let out.
        counts_per_turn: Counts of the encoder for one of its turns.
        count_zero: Counts at which length_zero is off the drum.
        length_zero: Length of cable off the drum at count_zero, at the winding tension, with dead_cable for the run
            to the pulley [m]; `home` finds it.
        cable_length: All there is of the cable, on the drum and off it, at the winding tension [m]; no less
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
        load_cell_bias: What it reads without load [N].
        load_cell_gain: What it reads of a newton.
    """

    pulley_radius: Array
    swivel_axis: Array
    pulley_friction: Array
    rolling_friction: Array
    dead_cable: Array
    dead_rise: Array
    guides: Array | None
    drum_radius: Array | None
    drum_width: Array | None
    groove_pitch: Array | None
    layers: Array
    drum_distance: Array | None
    drum_offset: Array
    gear: Array
    counts_per_turn: Array | None
    count_zero: Array
    length_zero: Array | None
    cable_length: Array | None
    winding_tension: Array
    inertia: Array | None
    torque_limit: Array | None
    speed_limit: Array | None
    friction: Array
    position_gain: Array | None
    speed_gain: Array | None
    integral_gain: Array | None
    load_cell_range: Array | None
    load_cell_deviation: Array
    load_cell_bias: Array
    load_cell_gain: Array

    def __init__(
        self,
        pulley_radius: ArrayLike = 0.0,
        *,
        swivel_axis: ArrayLike = (0.0, 0.0, 1.0),
        pulley_friction: ArrayLike = 0.0,
        rolling_friction: ArrayLike = 0.0,
        dead_cable: ArrayLike = 0.0,
        dead_rise: ArrayLike = 0.0,
        guides: ArrayLike | None = None,
        drum_radius: ArrayLike | None = None,
        drum_width: ArrayLike | None = None,
        groove_pitch: ArrayLike | None = None,
        layers: ArrayLike = 1.0,
        drum_distance: ArrayLike | None = None,
        drum_offset: ArrayLike = 0.0,
        gear: ArrayLike = 1.0,
        counts_per_turn: ArrayLike | None = None,
        count_zero: ArrayLike = 0.0,
        length_zero: ArrayLike | None = None,
        cable_length: ArrayLike | None = None,
        winding_tension: ArrayLike = 0.0,
        inertia: ArrayLike | None = None,
        torque_limit: ArrayLike | None = None,
        speed_limit: ArrayLike | None = None,
        friction: ArrayLike = 0.0,
        position_gain: ArrayLike | None = None,
        speed_gain: ArrayLike | None = None,
        integral_gain: ArrayLike | None = None,
        load_cell_range: ArrayLike | None = None,
        load_cell_deviation: ArrayLike = 0.0,
        load_cell_bias: ArrayLike = 0.0,
        load_cell_gain: ArrayLike = 1.0,
    ) -> None:
        """Check every field once, and give all that are known one shape.

        Args:
            pulley_radius: As the attributes, in SI; one number for all cables, or one a cable.
            swivel_axis: Up or down, of any length but zero.
            pulley_friction: See the attributes.
            rolling_friction: See the attributes.
            dead_cable: See the attributes; 0 where it is to follow from guides.
            dead_rise: See the attributes; 0 where it is to follow from guides.
            guides: Shape (k, 3) for all cables or (m, k, 3), k >= 1.
            drum_radius: See the attributes.
            drum_width: See the attributes.
            groove_pitch: See the attributes.
            layers: See the attributes.
            drum_distance: See the attributes.
            drum_offset: See the attributes.
            gear: See the attributes.
            counts_per_turn: See the attributes.
            count_zero: See the attributes.
            length_zero: See the attributes.
            cable_length: See the attributes.
            winding_tension: See the attributes.
            inertia: See the attributes.
            torque_limit: See the attributes.
            speed_limit: See the attributes.
            friction: See the attributes.
            position_gain: See the attributes.
            speed_gain: See the attributes.
            integral_gain: See the attributes.
            load_cell_range: See the attributes.
            load_cell_deviation: See the attributes.
            load_cell_bias: See the attributes.
            load_cell_gain: See the attributes.

        Raises:
            InvalidValueError: If a value is out of its range, the dead cable rises by more than its length or is longer
                than all of the cable, a gear is zero, a swivel axis is not vertical, two guides in a row coincide, or
                the shapes do not fit.

        Examples:
            >>> import sagline as sl
            >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=[4.0, 5.0])
            >>> winch.pulley_radius
            array([0.05, 0.05])
        """
        given = locals()
        values = {
            name: _checked(given[name], name) for name, rule in RULES.items() if rule.needed or given[name] is not None
        }
        axis = _vertical(swivel_axis)
        points = None if guides is None else _points(guides)
        shapes = {name: value.shape for name, value in values.items()} | {"swivel_axis": axis.shape[:-1]}
        shape = _shape(shapes if points is None else shapes | {"guides": points.shape[:-2]})
        for name in RULES:
            object.__setattr__(self, name, spread(values[name], shape) if name in values else None)
        object.__setattr__(self, "swivel_axis", spread(axis, (*shape, 3)))
        if points is not None:
            points = spread(points, (*shape, *points.shape[-2:]))
        object.__setattr__(self, "guides", points)
        _check_rise(self.dead_cable, self.dead_rise)
        _check_rolling(self.rolling_friction)
        _check_whole(self.dead_cable, self.cable_length)

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of every field that is given, () or (m,)."""
        return self.pulley_radius.shape

    @property
    def anything_behind(self) -> bool:
        """Whether a cable runs over a pulley, or has dead cable behind it; guides count once a robot has them."""
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
        check_memory("winches", 8.0 * len(RULES) * count, "Give fewer cables.")
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
        """What has surely been given as one value a cable, for a message: what differs among them.

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
            InvalidValueError: If there is no such field, or the new values are none the constructor accepts.

        Examples:
            >>> import sagline as sl
            >>> winch = sl.Winch(pulley_radius=0.05, dead_cable=[4.0, 5.0])
            >>> winch.replace(pulley_radius=0.06).pulley_radius
            array([0.06, 0.06])
        """
        for field in changes:
            choice(field, "field", self.__slots__)
        if self.guides is not None and changes.get("guides") is not None:
            changes = {"dead_cable": 0.0, "dead_rise": 0.0, **changes}  # they follow anew
        return replace(self, **changes)

    def _run_to(self, frame_anchors: Array) -> Winch:
        """These winches with the dead cable that follows from their guides.

        Args:
            frame_anchors: Where the guides lead to, world axes [m], shape (m, 3).

        Returns:
            Winch with fields of shape (m,); this one where there are no guides.

        Raises:
            InvalidValueError: If the last guide is at the frame anchor, or a dead cable or rise other than 0 is given
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
        for name, given, follows in (("dead_cable", self.dead_cable, length), ("dead_rise", self.dead_rise, rise)):
            if (wrong := (given != 0.0) & (np.abs(given - follows) > _AGREEING * length)).any():
                i = int(np.argmax(wrong))
                raise InvalidValueError(
                    f"winches: {name}[{i}]",
                    f"{given[i]:.9g} m",
                    f"{follows[i]:.9g} m, as the guides have it, or 0",
                    "Leave it out where guides are given.",
                )
        return replace(self, dead_cable=length, dead_rise=rise)

    def known(self) -> dict[str, Array]:
        """The fields that are known, by their names, in order.

        Returns:
            Those that are not None.
        """
        return {name: field for name in self.__slots__ if (field := getattr(self, name)) is not None}

    def __reduce__(self) -> tuple[Any, tuple[dict[str, Any]]]:
        """Pickle through the constructor, so that a loaded winch is checked and locked too."""
        return _from_fields, (self.known(),)


def _from_fields(values: dict[str, Any]) -> Winch:
    return Winch(**values)


def _checked(value: ArrayLike, name: str) -> Array:
    """The values of one field."""
    rule, item = RULES[name], f"winches: {name}"
    low, above = (-np.inf if bound is None else bound for bound in (rule.low, rule.above))
    array = checked(value, item, rule.unit, low=low, above=above)
    if name not in ("layers", "gear"):
        return array
    wrong = array != np.floor(array) if name == "layers" else array == 0.0
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        if index:
            item += f"[{', '.join(map(str, index))}]"
        if name == "layers":
            raise InvalidValueError(item, f"{array[index]:g}", "whole numbers", "Give how many layers the drum takes.")
        step = "Give the encoder's turns for one of the drum; negative where counts fall as cable is let out."
        raise InvalidValueError(item, "0", "not 0", step)
    return array


def _points(given: ArrayLike) -> Array:
    """The guides of all cables (k, 3), or of each (m, k, 3)."""
    points = checked(given, "winches: guides", "m")
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


def _vertical(given: ArrayLike) -> Array:
    """Unit vectors of the swivel axes, which are vertical."""
    axis = checked(given, "winches: swivel_axis", "", shape=(3,))
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
            "All there is of a cable reaches from the drum to the pulley at least; correct one of the two.",
        )
