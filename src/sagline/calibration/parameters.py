"""Unknowns of a calibration: their kinds, the parameters of a robot, and robots with other parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.calibration.log import Sensors
from sagline.core.arguments import choice, elements, flag, instance
from sagline.core.arrays import Array, Flags, Indices, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.core.results import Result
from sagline.kernels.calibration import kinds
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot, with_quantities
from sagline.robot.tolerances import UNCERTAIN, value_of
from sagline.robot.winch import Winch


class Kind(NamedTuple):
    """A kind of unknown."""

    owner: str  # object that has the field: "robot", its "cables" or "winches", or the measuring "system"
    unit: str  # its unit in SI
    first: int  # first row of the kind in `kernels.calibration.kinds`
    axes: tuple[str, ...]  # names of its components, ("",) for a single number
    each: bool  # True if every cable has its own value
    shared: bool  # True if all cables share one value by default
    logarithmic: bool  # True if the logarithm is estimated, because the value is positive and its deviation is relative
    deviation: float  # standard deviation of a value from a drawing or data sheet, relative if logarithmic
    assumed: float  # standard deviation of a value that is missing in the robot's source
    needs: str = ""  # the readings that observe the kind: "counts", "load cells", "positions"; "" for any readings
    common: float = 0.0  # share of the prior variance that the values of all cables have in common, 0 to 1


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
    "measuring_frame": Kind("system", "m", kinds.SHIFT, _SIX, False, False, False, 10.0, 10.0, "positions"),
    "target": Kind("system", "m", kinds.TARGET, _XYZ, False, False, False, 0.1, 1.0, "positions"),
}


@dataclass(frozen=True, slots=True)
class Unknown:
    """One kind of unknown parameter, and its prior.

    Pulley radii and dead lengths have a lower bound of zero.

    Attributes:
        name: Name of a kind in `KINDS`.
        shared: True if the cables share one value; None for the default of the kind.
        deviation: Standard deviation of the robot's value, in the unit of the kind; for drum radius, linear density,
            axial stiffness and mass, as a share of the value. Infinite without a prior. None for the robot's tolerance
            or, if it has none, the usual deviation of the kind.
    """

    name: str
    shared: bool | None = None
    deviation: float | None = None

    def __post_init__(self) -> None:
        """Check name, shared and deviation.

        Raises:
            InvalidValueError: If the kind does not exist, or the deviation is not positive.
        """
        object.__setattr__(self, "name", str(choice(self.name, "unknown", KINDS)))
        if self.shared is not None:
            object.__setattr__(self, "shared", flag(self.shared, f"{self.name}: shared"))
        if self.deviation is not None:
            item, unit = f"{self.name}: deviation", KINDS[self.name].unit
            deviation = exactly(self.deviation, item, unit, (), above=0.0, infinite=True)
            object.__setattr__(self, "deviation", float(deviation))


@dataclass(frozen=True, slots=True, eq=False)
class Parameters(Result):
    """The P parameters of a calibration.

    Attributes:
        names: Kind of each parameter, (P,).
        labels: Name of each parameter, for example "frame_anchors[3].x", "axial_stiffness", "measuring_frame.about z".
        units: Unit of each parameter.
        cables: Cable of each parameter, or -1 for a parameter of all cables or of the platform.
        where: Index of the parameter for each row of `kernels.calibration.kinds` and each cable, (KIND_ROWS, m); -1 if
            it is not an unknown.
        prior: Prior values, in the units of the parameters, (P,).
        prior_deviation: Standard deviations of the priors, in the same units, (P,); infinite without a prior.
        stated: True where the robot's tolerances or the caller give the prior, (P,).
        logarithmic: True where the logarithm is estimated, (P,).
        counted: True if the readings are encoder counts; otherwise they are lengths, and length_zero is their offset.
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


UNKNOWNS: Final = ("frame_anchors", "length_zero", "axial_stiffness", "mass", "center_of_mass")
OF_CELLS: Final = ("load_cell_gain", "load_cell_bias")


def default_unknowns(sensors: Sensors) -> tuple[str, ...]:
    """Unknowns if the caller names none: with gains and biases of the load cells as soon as these are read."""
    return UNKNOWNS if sensors.tension_deviation is None else (*UNKNOWNS, *OF_CELLS)


_NOTHING: Final = {"dead_cable": "0 m", "pulley_radius": "0 m"}


def parameters_of(robot: Robot, unknowns: Sequence[str | Unknown], sensors: Sensors, *, counted: bool) -> Parameters:
    """Parameters of the unknowns, in the order of the unknowns; parameters of one unknown are sorted by cable and axis.

    Raises an error for a repeated unknown, for a value that the robot lacks, and for an unknown without a reading and
    without a stated prior.
    """
    m = robot.cable_count
    where = np.full((kinds.KIND_ROWS, m), -1, dtype=np.int64)
    rows: list[tuple[str, str, str, int, float, float, bool, bool]] = []
    for unknown in checked_unknowns(unknowns):
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


def checked_unknowns(unknowns: Sequence[str | Unknown]) -> list[Unknown]:
    """Checked list of unknowns without repetitions."""
    items = elements(unknowns, str | Unknown, "unknowns", 'Give ("frame_anchors", "mass"), for example.')
    if not items:
        raise InvalidValueError("unknowns", "none", "one at least", f"Name some of {', '.join(KINDS)}.")
    found = [Unknown(one) if isinstance(one, str) else instance(one, Unknown, "unknown") for one in items]
    names = [one.name for one in found]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InvalidValueError("unknowns", f"{twice[0]} twice", "each once", "Name every unknown once.")
    return found


def _value(robot: Robot, sensors: Sensors, name: str, counted: bool) -> Array:
    """Values of a kind, shape (m or 1, axes)."""
    m, kind = robot.cable_count, KINDS[name]
    if name == "measuring_frame":
        return np.concatenate((sensors.frame.position, np.zeros(3)))[None]
    if name == "target":
        return np.asarray(sensors.target)[None]
    if name == "length_zero" and not counted:
        return np.zeros((m, 1))
    value = _field(robot, name)
    if value is None:
        begin = _NOTHING.get(name, "..., as drawn")
        step = f"Add {kind.owner}: {{{name}: {begin}}} to the robot file, or leave the unknown out."
        raise InvalidValueError(f"unknown: {name}", f"no number of {robot.name}", "a number that the robot has", step)
    if kind.owner == "robot":
        return value.reshape(-1, len(kind.axes))
    return np.broadcast_to(value, (m,))[:, None]


def _field(robot: Robot, name: str) -> Array | None:
    """Values of a kind in a robot; None if the robot does not have them."""
    if robot.winches is None and name in OF_CELLS:  # load cells without winches read the tension
        return np.asarray(getattr(Winch(), name))
    return value_of(robot, name)


def is_observed(kind: Kind, sensors: Sensors, counted: bool) -> bool:
    """True if there are readings of the type that a kind of unknown needs."""
    return {
        "": True,
        "counts": counted,
        "load cells": sensors.tension_deviation is not None,
        "positions": sensors.position_deviation is not None or sensors.rotation_deviation is not None,
    }[kind.needs]


def _refuse_unobserved(robot: Robot, sensors: Sensors, unknown: Unknown, kind: Kind, counted: bool) -> None:
    """Reject unknowns with neither observations nor a prior."""
    if is_observed(kind, sensors, counted) or unknown.deviation is not None or unknown.name in robot.tolerances:
        return
    add = {
        "counts": "Add counts to the log, or leave it out.",
        "load cells": "Add load cells to the log, or give a prior: Unknown(name, deviation=...); or leave it out.",
        "positions": "Add measured positions to the log, or leave it out.",
    }[kind.needs]
    raise InvalidValueError(f"unknown: {unknown.name}", "observed by no reading", f"{kind.needs} in the log", add)


def _is_shared(unknown: Unknown, kind: Kind, own: Array, width: Array) -> bool:
    """True if the cables share one value, which requires equal values and equal deviations."""
    alike = bool((own == own[0]).all() and (width == width[0]).all())
    if unknown.shared is None:
        return kind.shared and alike
    if unknown.shared and kind.each and not alike:
        allowed = "equal, with the same deviation, for all cables if shared"
        step = "Leave shared out; each cable then has its own value."
        raise InvalidValueError(f"unknown: {unknown.name}", "shared", allowed, step)
    return unknown.shared


def _prior_deviation(robot: Robot, unknown: Unknown, kind: Kind, own: Array) -> tuple[Array, bool]:
    """Prior deviation in the unit of the kind, shape of `own`, and True if it was stated."""
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


def internal(parameters: Parameters, values: Array) -> Array:
    """Internal parameters (P,) of values: the logarithms where `logarithmic` is True."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(parameters.logarithmic, np.log(values), values)


def external(parameters: Parameters, numbers: Array) -> Array:
    """Values in their units (P,) of internal parameters."""
    with np.errstate(over="ignore"):
        return np.where(parameters.logarithmic, np.exp(numbers), numbers)


@lru_cache(maxsize=8)  # a search asks many times for the root of the same parameters
def prior_root(parameters: Parameters) -> Array:
    """Symmetric root of the inverse prior correlation, (P, P): the identity, except for kinds with a common share."""
    root = np.eye(len(parameters.names))
    for kind in KINDS.values():
        which = parameters.where[kind.first]
        if kind.common and which[0] >= 0 and (m := len(np.unique(which))) > 1:
            mean = np.full((m, m), 1.0 / m)
            alone, shared = (1.0 - kind.common) ** -0.5, (1.0 + (m - 1) * kind.common) ** -0.5
            root[np.ix_(which, which)] = alone * (np.eye(m) - mean) + shared * mean
    return locked(root)


def slopes_of_values(robot: Robot, parameters: Parameters) -> Array:
    """Derivatives of the values by the internal parameters (P,): the value for a logarithm, otherwise 1."""
    slopes = np.ones(len(parameters.names))
    for name in dict.fromkeys(parameters.names):
        kind = KINDS[name]
        if kind.logarithmic:
            which = parameters.where[kind.first]
            there = which >= 0
            slopes[which[there]] = np.broadcast_to(np.asarray(_field(robot, name)), which.shape)[there]
    return slopes


def quantities_of(parameters: Parameters, numbers: Array) -> dict[str, Array]:
    """Numbers of the parameters (P,) by quantity of the robot, each in the shape of the quantity."""
    found = {}
    for name in dict.fromkeys(parameters.names):
        if name not in UNCERTAIN or (name == "length_zero" and not parameters.counted):
            continue
        kind = KINDS[name]
        rows = numbers[parameters.where[kind.first : kind.first + len(kind.axes)]].T
        own = rows if kind.each else rows[0]
        found[name] = own if len(kind.axes) > 1 else own[..., 0]
    return found


def with_values(robot: Robot, parameters: Parameters, values: Array) -> Robot:
    """Robot with other parameter values (P,); an error if they are invalid."""
    return with_quantities(robot, quantities_of(parameters, values))


def sensors_with(sensors: Sensors, parameters: Parameters, values: Array) -> Sensors:
    """Sensors with other values (P,) of frame and target; rotations are relative to the given frame."""
    changes: dict[str, Any] = {}
    if "target" in parameters.names:
        changes["target"] = values[parameters.where[kinds.TARGET : kinds.TARGET + 3, 0]]
    if "measuring_frame" in parameters.names:
        from scipy.spatial.transform import Rotation

        turn = Rotation.from_rotvec(values[parameters.where[kinds.TURN : kinds.TURN + 3, 0]])
        shift = values[parameters.where[kinds.SHIFT : kinds.SHIFT + 3, 0]]
        changes["frame"] = Pose(shift, turn.as_matrix() @ sensors.frame.matrix)
    return sensors.replace(**changes) if changes else sensors


def offset_with(robot: Robot, parameters: Parameters, values: Array) -> Array:
    """Offset of reported lengths [m], (m,)."""
    if parameters.counted or "length_zero" not in parameters.names:
        return np.zeros(robot.cable_count)
    return np.asarray(values[parameters.where[kinds.ZERO]])


_SMALL = 1e-4  # [rad], for a smaller angle, the first terms of the series are sufficient


def left_jacobian(vector: Array) -> Array:
    """J with exp(v + dv) = exp(J dv) exp(v), for a rotation vector [rad] of shape (3,)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < _SMALL:
        first, second = 0.5, 1.0 / 6.0
    else:
        first, second = (1.0 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)


_FIXED: Final = 5e-2  # a parameter counts as known if its stated deviation, relative to the usual deviation, is smaller
_WIDE: Final = 1e3  # largest prior deviation, relative to the usual deviation of an unknown value


class PriorUnits(NamedTuple):
    """Unknowns in standard deviations of their priors."""

    scale: Array  # one standard deviation in the internal parameters, (P,)
    units: Array  # one standard deviation in the units of the parameters, (P,)
    free: Indices  # indices of the parameters that do not count as known


def prior_units(parameters: Parameters) -> PriorUnits:
    """Units of the directions: prior deviations, or the usual deviation of an unknown value if there is no prior.

    A larger prior deviation is reduced to `_WIDE`, because rounding would otherwise hide the other parameters.
    """
    usual = np.array([KINDS[name].assumed for name in parameters.names])
    usual = np.where(parameters.logarithmic, usual * np.abs(parameters.prior), usual)
    units = np.where(np.isfinite(parameters.prior_deviation), parameters.prior_deviation, usual)
    units = np.minimum(units, _WIDE * usual)
    scale = units / np.where(parameters.logarithmic, np.abs(parameters.prior), 1.0)
    common = np.array([KINDS[name].deviation for name in parameters.names])
    fixed = parameters.stated & (scale < _FIXED * common)
    return PriorUnits(scale, units, np.flatnonzero(~fixed).astype(np.int64))
