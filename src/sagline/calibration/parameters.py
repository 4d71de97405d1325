"""Unknowns of a calibration, parameters of a robot, and robots with other parameter values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.calibration.further import with_inertia
from sagline.calibration.log import Sensors, measures_yaw
from sagline.core.arguments import choice, elements, flag, instance
from sagline.core.arrays import Array, Flags, Indices, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result, set_fields
from sagline.kernels.calibration import kinds
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot, with_quantities
from sagline.robot.tolerances import UNCERTAIN, value_of
from sagline.robot.winch import Winch


class Kind(NamedTuple):
    """A kind of unknown: a physical quantity of the robot or of its sensors."""

    owner: str  # object with the quantity: "robot", "cables", "winches", or "system" for the measuring system
    unit: str  # SI unit of the quantity
    first: int  # first row of the kind in `kernels.calibration.kinds`
    axes: tuple[str, ...]  # names of the components, ("",) for a quantity that is a single number
    each: bool  # True if every cable has its own value
    shared: bool  # True if all cables share one value by default
    logarithmic: bool  # True if the logarithm is estimated, because the value is positive and its deviation is relative
    deviation: float  # standard deviation of a value from a drawing or data sheet, relative if logarithmic
    assumed: float  # standard deviation of a value that the robot's source does not state
    needs: str = ""  # readings that depend on the quantity, as in `is_observed`; "" for all
    common: float = 0.0  # share of the prior variance that the values of all cables have in common, 0 to 1

    def is_observed(self, sensors: Sensors, *, counted: bool) -> bool:
        """True if a log has the kind of readings that the unknown needs."""
        return {
            "": True,
            "counts": counted,
            "lengths": not counted,
            "motion": False,  # `calibrate` checks the times of a log
            "load cells": sensors.tension_deviation is not None,
            "frequencies": sensors.frequency_deviation is not None,
            "swivel angles": sensors.swivel_deviation is not None,
            "positions": sensors.position_deviation is not None or measures_yaw(sensors),
        }[self.needs]


_XYZ: Final = ("x", "y", "z")
_SIX: Final = (*_XYZ, "about x", "about y", "about z")
_ONE: Final = ("",)
KINDS: Final[dict[str, Kind]] = {
    "frame_anchors": Kind("robot", "m", kinds.FRAME, _XYZ, True, False, False, 0.05, 0.5),
    "platform_anchors": Kind("robot", "m", kinds.PLATFORM, _XYZ, True, False, False, 0.02, 0.2),
    "length_zero": Kind("winches", "m", kinds.ZERO, _ONE, True, False, False, 0.1, 1.0),
    "drum_radius": Kind("winches", "m", kinds.DRUM, _ONE, True, True, True, 0.02, 0.1, "counts"),
    "linear_density": Kind("cables", "kg/m", kinds.DENSITY, _ONE, True, True, True, 0.1, 0.5),
    "axial_stiffness": Kind("cables", "N", kinds.STIFFNESS, _ONE, True, True, True, 0.3, 1.0),
    "pulley_radius": Kind("winches", "m", kinds.RADIUS, _ONE, True, True, False, 0.002, 0.02),
    "dead_cable": Kind("winches", "m", kinds.DEAD, _ONE, True, False, False, 0.1, 1.0),
    "load_cell_gain": Kind("winches", "", kinds.GAIN, _ONE, True, False, False, 0.07, 0.3, "load cells", 0.5),
    "load_cell_bias": Kind("winches", "N", kinds.BIAS, _ONE, True, False, False, 20.0, 100.0, "load cells"),
    "mass": Kind("robot", "kg", kinds.MASS, _ONE, False, False, True, 0.05, 0.2),
    "center_of_mass": Kind("robot", "m", kinds.CENTER, _XYZ, False, False, False, 0.05, 0.2),
    "inertia": Kind("system", "", kinds.INERTIA, _XYZ, False, False, False, 0.2, 1.0, "frequencies"),
    "measuring_frame": Kind("system", "m", kinds.SHIFT, _SIX, False, False, False, 10.0, 10.0, "positions"),
    "length_scale": Kind("system", "", kinds.SCALE, _ONE, True, False, False, 0.05, 0.1, "lengths"),
    "clock_offset": Kind("system", "s", kinds.CLOCK, _ONE, True, True, False, 0.1, 1.0, "motion"),
    "swivel_zero": Kind("system", "rad", kinds.SWIVEL, _ONE, True, False, False, np.pi, np.pi, "swivel angles"),
    "target": Kind("system", "m", kinds.TARGET, _XYZ, False, False, False, 0.1, 1.0, "positions"),
}


@dataclass(frozen=True, slots=True)
class Unknown:
    """One kind of unknown parameter, and its prior.

    Pulley radii and dead lengths have a lower bound of zero.

    Attributes:
        name: Name of a kind in `KINDS`.
        shared: True if the cables share one value; None for the default of the kind.
        deviation: Standard deviation of the robot's value, in the unit of the quantity; for drum radius, linear
            density, axial stiffness and mass, as a share of the value. Infinite for no prior. None for the robot's
            tolerance or, if the robot has no tolerance, a typical deviation.
    """

    name: str
    shared: bool | None = None
    deviation: float | None = None

    def __post_init__(self) -> None:
        """Check `name`, `shared` and `deviation`.

        Raises:
            InvalidValueError: If `KINDS` does not contain `name`, or `deviation` is not positive.
        """
        set_fields(self, name=str(choice(self.name, "unknown", KINDS)))
        if self.shared is not None:
            set_fields(self, shared=flag(self.shared, f"{self.name}: shared"))
        if self.deviation is not None:
            item, unit = f"{self.name}: deviation", KINDS[self.name].unit
            deviation = exactly(self.deviation, item, unit, (), above=0.0, infinite=True)
            set_fields(self, deviation=float(deviation))


@dataclass(frozen=True, slots=True, eq=False)
class Parameters(Result):
    """The P parameters of a calibration.

    Attributes:
        names: Kind of each parameter, (P,).
        labels: Name of each parameter, for example "frame_anchors[3].x", "axial_stiffness", "measuring_frame.about z".
        units: Unit of each parameter.
        cables: Index of the cable of each parameter; -1 for a parameter that does not belong to one cable.
        where: Index of the parameter for each row of `kernels.calibration.kinds` and each cable, (KIND_ROWS, m); -1 for
            a value that is not estimated.
        prior: Prior values, in the units of the parameters, (P,).
        prior_deviation: Standard deviations of the priors, in the same units, (P,); infinite without a prior.
        stated: True for a parameter with a prior from the robot's tolerances or the caller, (P,).
        logarithmic: True for a parameter of which the logarithm is estimated, (P,).
        counted: True if the log has encoder counts; False if it has lengths, for which length_zero is an offset.
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

    def internal(self, values: Array) -> Array:
        """Internal parameters (P,): the logarithm of a value where `logarithmic` is True, else the value."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.logarithmic, np.log(values), values)

    def external(self, numbers: Array) -> Array:
        """Values (P,) in their units, computed from the internal parameters `numbers`; inverse of `internal`."""
        with np.errstate(over="ignore"):
            return np.where(self.logarithmic, np.exp(numbers), numbers)

    @property
    def internal_deviation(self) -> Array:
        """Standard deviations (P,) of the priors of the internal parameters."""
        return np.asarray(self.prior_deviation / np.where(self.logarithmic, self.prior, 1.0))

    @property
    def usual_deviation(self) -> Array:
        """Usual standard deviations (P,) of internal parameters whose values the robot's source does not state."""
        return np.array([KINDS[name].assumed for name in self.names])

    @property
    def prior_root(self) -> Array:
        """Matrix W (P, P), for which W^T W is the inverse of the covariance of the internal priors."""
        return np.asarray(correlation_root(self) / self.internal_deviation)

    def missed(self, numbers: Array) -> Array:
        """Differences (P,) of the internal parameters `numbers` from their priors, in prior standard deviations."""
        return np.asarray(self.prior_root @ (numbers - self.internal(self.prior)))

    def of_cables(self, values: Array, row: int, otherwise: float) -> Array:
        """Values (m,) of the cables in the row `row` of `kinds`; `otherwise` for a cable without this parameter."""
        where = self.where[row]
        return np.where(where >= 0, values[where], otherwise)

    def length_offset(self, values: Array) -> Array:
        """Offset (m,) that is added to reported lengths [m] after their scaling; zero for counts."""
        return np.zeros(self.where.shape[1]) if self.counted else self.of_cables(values, kinds.ZERO, 0.0)

    def by_quantity(self, numbers: Array) -> dict[str, Array]:
        """Dictionary from names of the robot's quantities to arrays, in which `numbers` (P,) are sorted by quantity."""
        found = {}
        for name in dict.fromkeys(self.names):
            if name not in UNCERTAIN or (name == "length_zero" and not self.counted):
                continue
            kind = KINDS[name]
            rows = numbers[self.where[kind.first : kind.first + len(kind.axes)]].T
            own = rows if kind.each else rows[0]
            found[name] = own if len(kind.axes) > 1 else own[..., 0]
        return found


UNKNOWNS: Final = ("frame_anchors", "length_zero", "axial_stiffness", "mass", "center_of_mass")
OF_CELLS: Final = ("load_cell_gain", "load_cell_bias")
OF_FORCES: Final = ("axial_stiffness", "linear_density", "mass", "center_of_mass", *OF_CELLS)
DEFAULT: Final = "default"  # in a list of unknowns, it means the default unknowns


def _default_unknowns(sensors: Sensors, *, counted: bool, straight: bool) -> list[Unknown]:
    """Default unknowns, with those of further readings if `sensors` has them; `straight`: no forces."""
    cells = () if sensors.tension_deviation is None else OF_CELLS
    further = [("swivel_zero", sensors.swivel_deviation), ("inertia", sensors.frequency_deviation)]
    others = (*cells, *(name for name, deviation in further if deviation is not None))
    found = [Unknown(name) for name in (UNKNOWNS[:2] if straight else (*UNKNOWNS, *others))]
    # measured positions determine the scale of reported lengths; load cells without them do not
    scaled = sensors.position_deviation is not None and not (counted or cells)
    return [*found, Unknown("length_scale", shared=True)] if scaled else found


_NOTHING: Final = {"dead_cable": "0 m", "pulley_radius": "0 m"}


def parameters_of(robot: Robot, unknowns: Sequence[str | Unknown], sensors: Sensors, *, counted: bool) -> Parameters:
    """Parameters in the order of `unknowns`; the parameters of each unknown are sorted by cable and axis."""
    # Raises an error if an unknown is repeated, has no value in the robot, or has neither readings nor a stated prior.
    m = robot.cable_count
    where = np.full((kinds.KIND_ROWS, m), -1, dtype=np.int64)
    rows: list[tuple[str, str, str, int, float, float, bool, bool]] = []
    for unknown in checked_unknowns(unknowns, sensors, counted=counted):
        kind = KINDS[unknown.name]
        _refuse_unobserved(robot, sensors, unknown, kind, counted)
        own = _value(robot, sensors, unknown.name, counted)
        width, stated = _prior_deviation(robot, unknown, kind, own)
        one_each = kind.each and not _is_shared(unknown, kind, own, width)
        for cable in range(m if one_each else 1):
            for axis, component in enumerate(kind.axes):
                where[kind.first + axis, slice(None) if kind.each and not one_each else cable] = len(rows)
                label = f"{unknown.name}{f'[{cable}]' * one_each}{'.' * bool(component)}{component}"
                unit = "rad" if component.startswith("about") else kind.unit
                number = cable if one_each else -1
                prior, deviation = own[cable, axis], width[cable, axis]
                rows.append((unknown.name, label, unit, number, prior, deviation, stated, kind.logarithmic))
    names, labels, units, *columns = zip(*rows, strict=True)
    cables, priors, deviations, flags, logarithmic = (locked(np.array(column)) for column in columns)
    return Parameters(names, labels, units, cables, locked(where), priors, deviations, flags, logarithmic, counted)


def checked_unknowns(
    unknowns: Sequence[str | Unknown], sensors: Sensors, *, counted: bool, straight: bool = False
) -> list[Unknown]:
    """Checked list of unknowns without repetitions; "default" means the default unknowns that are not named too."""
    given = elements(unknowns, str | Unknown, "unknowns", 'Give ("frame_anchors", "mass"), for example.')
    if not given:
        raise InvalidValueError("unknowns", "none", "at least one", f"Name some of {', '.join(KINDS)}.")
    items = [one if isinstance(one, str) else instance(one, Unknown, "unknown") for one in given]
    named = {one if isinstance(one, str) else one.name for one in items}
    default = [one for one in _default_unknowns(sensors, counted=counted, straight=straight) if one.name not in named]
    own = [default if one == DEFAULT else [Unknown(one) if isinstance(one, str) else one] for one in items]
    found = [one for some in own for one in some]
    names = [one.name for one in found]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InvalidValueError("unknowns", f"{twice[0]} twice", "each once", "Name every unknown once.")
    if idle := [name for name in names if straight and name in OF_FORCES]:
        value, step = "without effect on straight cables", "Leave it out, or use the default model."
        raise InvalidValueError(f"unknown: {idle[0]}", value, "parameters of the geometry", step)
    return found


def _value(robot: Robot, sensors: Sensors, name: str, counted: bool) -> Array:
    """Values of the quantity `name`, shape (m or 1, axes)."""
    m, kind = robot.cable_count, KINDS[name]
    if name == "measuring_frame":
        return np.concatenate((sensors.frame.position, np.zeros(3)))[None]
    if name == "inertia":
        return np.zeros((1, 3))
    if name == "target":
        return np.asarray(sensors.target)[None]
    if name in ("length_scale", "clock_offset", "swivel_zero") or (name == "length_zero" and not counted):
        return np.full((m, 1), float(name == "length_scale"))
    value = _field(robot, name)
    if value is None:
        begin = _NOTHING.get(name, "..., as drawn")
        step = f"Add {kind.owner}: {{{name}: {begin}}} to the robot file, or leave the unknown out."
        raise InvalidValueError(f"unknown: {name}", f"no number of {robot.name}", "a number that the robot has", step)
    if kind.owner == "robot":
        return value.reshape(-1, len(kind.axes))
    return np.broadcast_to(value, (m,))[:, None]


def _field(robot: Robot, name: str) -> Array | None:
    """Values of a quantity of a robot; None if the robot does not have this quantity."""
    if robot.winches is None and name in OF_CELLS:  # default load cells have no gain or bias error
        return np.asarray(getattr(Winch(), name))
    return value_of(robot, name)


def _refuse_unobserved(robot: Robot, sensors: Sensors, unknown: Unknown, kind: Kind, counted: bool) -> None:
    """Reject unknowns with neither observations nor a prior."""
    known = unknown.deviation is not None or unknown.name in robot.tolerances
    if known or kind.needs == "motion" or kind.is_observed(sensors, counted=counted):
        return
    add = {
        "counts": "Add counts to the log, or leave it out.",
        "lengths": "Give lengths in place of counts, or leave it out; drum_radius is the scale of counts.",
        "load cells": "Add load cells to the log, or give a prior: Unknown(name, deviation=...); or leave it out.",
        "positions": "Add measured positions to the log, or leave it out.",
        "frequencies": "Add natural frequencies to the log, or leave it out.",
        "swivel angles": "Add swivel angles to the log, or leave it out.",
    }[kind.needs]
    raise InvalidValueError(f"unknown: {unknown.name}", "observed by no reading", f"{kind.needs} in the log", add)


def _is_shared(unknown: Unknown, kind: Kind, own: Array, width: Array) -> bool:
    """True if all cables share one value. Sharing requires equal values and equal deviations of all cables."""
    alike = bool((own == own[0]).all() and (width == width[0]).all())
    if unknown.shared is None:
        return kind.shared and alike
    if unknown.shared and kind.each and not alike:
        allowed = "equal, with the same deviation, for all cables if shared"
        step = "Leave shared out; each cable then has its own value."
        raise InvalidValueError(f"unknown: {unknown.name}", "shared", allowed, step)
    return unknown.shared


def _prior_deviation(robot: Robot, unknown: Unknown, kind: Kind, own: Array) -> tuple[Array, bool]:
    """Prior standard deviations of the values `own`, and True if they come from the caller or from tolerances."""
    if unknown.deviation is not None:
        width = np.full(own.shape, unknown.deviation)
        return (width * np.abs(own) if kind.logarithmic else width), True
    if unknown.name in robot.tolerances:
        tolerance = np.asarray(robot.tolerances[unknown.name])
        if tolerance.ndim == 1 and kind.each and len(kind.axes) == 1:
            tolerance = tolerance[:, None]
        return np.broadcast_to(tolerance, own.shape).astype(np.float64), True
    field = kind.owner if kind.owner in ("cables", "winches") else unknown.name
    width = np.full(own.shape, kind.assumed if field in robot.assumed else kind.deviation)
    if unknown.name == "measuring_frame":
        width[:, 3:] = np.pi
    return (width * np.abs(own) if kind.logarithmic else width), False


@lru_cache(maxsize=8)  # a search needs the root of the same parameters many times
def correlation_root(parameters: Parameters) -> Array:
    """Symmetric root (P, P) of the inverse prior correlation; the identity if no kind has a `common` share."""
    root = np.eye(len(parameters.names))
    for kind in KINDS.values():
        which = parameters.where[kind.first]
        if kind.common and which[0] >= 0 and (m := len(np.unique(which))) > 1:
            mean = np.full((m, m), 1.0 / m)
            alone, shared = (1.0 - kind.common) ** -0.5, (1.0 + (m - 1) * kind.common) ** -0.5
            root[np.ix_(which, which)] = alone * (np.eye(m) - mean) + shared * mean
    return locked(root)


def slopes_of_values(robot: Robot, parameters: Parameters) -> Array:
    """Derivatives (P,) of the values by the internal parameters: the value for a logarithm, otherwise 1."""
    slopes = np.ones(len(parameters.names))
    for name in dict.fromkeys(parameters.names):
        kind = KINDS[name]
        if kind.logarithmic:
            which = parameters.where[kind.first]
            there = which >= 0
            slopes[which[there]] = np.broadcast_to(np.asarray(_field(robot, name)), which.shape)[there]
    return slopes


def with_values(robot: Robot, parameters: Parameters, values: Array) -> Robot:
    """Robot with the parameter values `values` (P,); raises an error if a value is invalid."""
    changed = with_quantities(robot, parameters.by_quantity(values))
    if "inertia" not in parameters.names:
        return changed
    return with_inertia(changed, values[parameters.where[kinds.INERTIA : kinds.INERTIA + 3, 0]])


def sensors_with(sensors: Sensors, parameters: Parameters, values: Array) -> Sensors:
    """Sensors with the target and measuring frame of `values` (P,), which are relative to `sensors.frame`."""
    changes: dict[str, Any] = {}
    if "target" in parameters.names:
        changes["target"] = values[parameters.where[kinds.TARGET : kinds.TARGET + 3, 0]]
    if "measuring_frame" in parameters.names:
        turn = Rotation.from_rotvec(values[parameters.where[kinds.TURN : kinds.TURN + 3, 0]])
        shift = values[parameters.where[kinds.SHIFT : kinds.SHIFT + 3, 0]]
        changes["frame"] = Pose(shift, turn.as_matrix() @ sensors.frame.matrix)
    return sensors.replace(**changes) if changes else sensors


_FIXED: Final = 5e-2  # a parameter is known if its stated deviation is less than this share of the usual deviation
_WIDE: Final = 1e3  # largest used prior deviation, in multiples of the usual deviation of an unknown value


class PriorUnits:
    """Units in which directions are computed: standard deviations of the priors."""

    def __init__(self, parameters: Parameters) -> None:
        """Unit of each parameter: its prior deviation or, without a prior, the usual deviation of an unknown value."""
        # A unit is at most `_WIDE` usual deviations, because rounding would otherwise hide the other parameters.
        size = np.where(parameters.logarithmic, np.abs(parameters.prior), 1.0)
        usual = parameters.usual_deviation * size
        units = np.where(np.isfinite(parameters.prior_deviation), parameters.prior_deviation, usual)
        self.units = np.minimum(units, _WIDE * usual)  # one standard deviation in the units of the parameters, (P,)
        self.scale = self.units / size  # one standard deviation in the internal parameters, (P,)
        common = np.array([KINDS[name].deviation for name in parameters.names])
        fixed = parameters.stated & (self.scale < _FIXED * common)
        # indices of the parameters that do not count as known
        self.free: Indices = np.flatnonzero(~fixed).astype(np.int64)
