"""Calibrations in NetCDF: every number with its unit, and the robots before and after."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.cables.models import MODELS
from sagline.calibration.findings import CalibrationStatus, CrossValidation, Direction, Omission, Outlier
from sagline.calibration.log import Sensors
from sagline.calibration.parameters import KINDS, Parameters
from sagline.calibration.result import Calibration
from sagline.core.arguments import choice, text
from sagline.core.arrays import locked
from sagline.core.errors import InvalidValueError
from sagline.files.format import Format
from sagline.files.netcdf import choice_attributes, choice_of, labeled_dataset
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import STEP, Known, Quantity, check_indices, check_labels, check_variable
from sagline.kernels.calibration.kinds import KIND_ROWS
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from xarray import Dataset

READ: Final = ("lengths", "counts")  # by Parameters.counted: what was read of the winches
P: Final = ("parameter",)
N: Final = ("pose",)
PARAMETERS: Final = (
    Quantity("parameter_name", "names", P, "", "kind of each number", values=str),
    Quantity("parameter_label", "labels", P, "", "what each number is called", values=str),
    Quantity("parameter_unit", "units", P, "", "unit of each number, 1 for none", values=str),
    Quantity("parameter_cable", "cables", P, "", "cable of each number, -1 for one of all", values=int),
    Quantity("parameter_place", "where", ("kind_row", "cable"), "", "number of each row of kinds, -1", values=int),
    Quantity("prior", "prior", P, "", "what was known beforehand, in the units of the numbers"),
    Quantity("prior_deviation", "prior_deviation", P, "", "its standard deviation", infinite=True),
    Quantity("prior_stated", "stated", P, "", "whether tolerances or the caller said so", values=bool),
    Quantity("logarithmic", "logarithmic", P, "", "whether the logarithm was looked for", values=bool),
)
FOUND: Final = (
    Quantity("length_offset", "length_offset", ("cable",), "m", "to be added to lengths that the machine believes"),
    Quantity("status", "status", (), "", "how the calibration ended", codes=CalibrationStatus),
    Quantity("value", "values", P, "", "what was found, in the units of the numbers"),
    Quantity(
        "covariance",
        "covariance",
        (*P, "other_parameter"),
        "",
        "covariance of the values",
        known=Known.SOMEWHERE,
        infinite=True,
    ),
    Quantity("chi_squared", "chi_squared", (), "1", "sum of squares of residuals in deviations", low=0.0),
    Quantity("degrees_of_freedom", "degrees_of_freedom", (), "", "what chi_squared is compared with", values=int),
    Quantity("iterations", "iterations", (), "", "iterations of the least squares", values=int),
    Quantity("row", "rows", N, "", "rows of the log that were used", values=int),
    Quantity("position", "poses.position", (*N, "axis"), "m", "where the platform stood"),
    Quantity("quaternion", "poses.quaternion", (*N, "quaternion_part"), "1", "rotation from platform to world"),
    Quantity("unstrained_length", "unstrained_length", (*N, "cable"), "m", "true lengths of the cables", low=0.0),
    Quantity(
        "residual",
        "residuals",
        (*N, "reading"),
        "",
        "readings less predictions: lengths [m], load cells [N], position [m], rotation [rad]",
        known=Known.SOMEWHERE,
    ),
    Quantity("chi_squared_of_pose", "chi_squared_of_pose", N, "1", "share of each pose in chi_squared", low=0.0),
    Quantity("weight", "weights", N, "1", "less than 1 for a pose that does not fit the rest", low=0.0),
)
SENSORS: Final = {  # name in the file -> attribute, unit; each of one number, or one a cable or axis
    "length_deviation": ("cable", "m"),
    "tension_deviation": ("cable", "N"),
    "position_deviation": ("axis", "m"),
    "rotation_deviation": ("axis", "rad"),
}
PLACED: Final = (
    Quantity("measuring_position", "frame.position", ("axis",), "m", "where the measuring system stands"),
    Quantity("measuring_quaternion", "frame.quaternion", ("quaternion_part",), "1", "its rotation to the world"),
    Quantity("target", "target", ("axis",), "m", "the measured point of the platform"),
)
LEFT_OUT: Final = (
    Quantity("left_out_row", "", ("omission",), "", "rows of the log that were left out", values=int),
    Quantity("left_out_reason", "", ("omission",), "", "why", codes=Omission),
)
OUTLIERS: Final = (
    Quantity("outlier_row", "row", ("outlier",), "", "row of the log", values=int),
    Quantity("outlier_cable", "cable", ("outlier",), "", "its cable, -1 for the whole pose", values=int),
    Quantity("outlier_quantity", "quantity", ("outlier",), "", "what does not fit", values=str),
    Quantity("outlier_size", "size", ("outlier",), "", "by how much [m, N or rad]"),
    Quantity("outlier_deviations", "deviations", ("outlier",), "1", "the same in standard deviations"),
)
CROSS_VALIDATION: Final = (
    Quantity("folds", "folds", (), "", "parts of the poses that were predicted from the others", values=int),
    *(
        Quantity(f"left_out_{name}", name, (), unit, f"root mean square {what}", known=Known.SOMEWHERE, low=0.0)
        for name, unit, what in (
            ("tension", "N", "of load cells at poses left out"),
            ("position", "m", "of positions at poses left out"),
            ("tension_before", "N", "of load cells with the robot as it was"),
            ("position_before", "m", "of positions with the robot as it was"),
        )
    ),
)


def directions(group: str) -> tuple[Quantity, ...]:
    """Variables of the directions that data leave open, or hardly tell.

    Args:
        group: "gauge" or "cannot_tell_apart".
    """
    return (
        Quantity(f"{group}_name", "name", (group,), "", "what each is", values=str),
        Quantity(f"{group}_vector", "vector", (group, *P), "", "combination of the numbers, in their units"),
        Quantity(f"{group}_known", "known", (group,), "1", "share of its prior deviation that is left", low=0.0),
        Quantity(f"{group}_step", "step", (group,), "", "what to do about it", values=str),
    )


DIRECTIONS: Final = {group: directions(group) for group in ("gauge", "cannot_tell_apart")}


UNITS = ("m", "kg/m", "N", "kg", "rad", "1")
OUTLYING = ("length", "load cell", "position", "rotation")


def check_calibration(data: Dataset, robot: Robot, before: Robot, sensors: Sequence[Quantity]) -> None:
    """Refuse a data set that is no calibration, whatever its file looked like.

    Args:
        data: The data set.
        robot: The robot that was found.
        before: The robot as it was.
        sensors: Variables of the sensors' deviations.

    Raises:
        KeyError: If a variable or attribute is missing.
        InvalidValueError: If one is not what the layout says; the message names its first wrong value.
    """
    m = robot.cable_count
    if before.cable_count != m:
        raise InvalidValueError("robot_before", f"of {before.cable_count} cables", f"of {m}, as robot", STEP)
    check_labels(data)
    quantities = [*FOUND, *PARAMETERS, *PLACED, *sensors, *OUTLIERS, *LEFT_OUT, *_all(DIRECTIONS)]
    if "folds" in data.variables:
        quantities += CROSS_VALIDATION
    sizes = {str(name): size for name, size in data.sizes.items()}
    fixed = {"cable": m, "reading": 2 * m + 6, "kind_row": KIND_ROWS, "other_parameter": sizes.get("parameter", 0)}
    for quantity in quantities:
        check_variable(quantity, data.variables[quantity.name], (), sizes | fixed, np.array(True))
    for name, low, high in (
        ("parameter_cable", -1, m),
        ("parameter_place", -1, sizes["parameter"]),
        ("outlier_cable", -1, m),
        ("row", 0, sys.maxsize),
        ("outlier_row", 0, sys.maxsize),
        ("left_out_row", 0, sys.maxsize),
    ):
        check_indices(name, data.variables[name].values, low, high)
    for name, words in (("parameter_name", KINDS), ("parameter_unit", UNITS), ("outlier_quantity", OUTLYING)):
        for word in data.variables[name].values:
            choice(str(word), name, words)
    choice(str(data.attrs["read"]), "read", READ)
    for name in ("log", "date"):
        text(data.attrs[name], name)
    reasons = [choice(word, "left_out", _NAMES) for word in text(data.attrs["left_out"], "left_out").split()]
    for code in np.unique(data.variables["left_out_reason"].values).tolist():
        choice(Omission(code).name.lower(), "left_out_reason", reasons)


_NAMES = {reason.name.lower(): reason for reason in Omission}


def _all(groups: dict[str, tuple[Quantity, ...]]) -> list[Quantity]:
    return [one for columns in groups.values() for one in columns]


_NONE: Final = -1  # cable of an outlier that is a whole pose


def load_calibration(file: os.PathLike[str] | str) -> Calibration:
    """Read a calibration that its `save`, or `sagline calibrate`, wrote: the same calibration to the last bit.

    Args:
        file: The NetCDF file.

    Returns:
        The calibration.

    Raises:
        FileError: If the file is missing, cut off, no NetCDF file, no calibration, of a newer format, or not as it was
            written: its digest, shapes, units and indices are checked.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> places = robot.test_box.low + np.outer(range(1, 6), [0.1, 0.2, 0.1])
        >>> plan = sl.inverse(robot, sl.Pose(places, np.eye(3)))
        >>> log = sl.WinchLog(
        ...     unstrained_length=plan.unstrained_length,
        ...     load_cells=plan.state.cables.frame_end_tension,
        ...     sensors=sl.Sensors(tension_deviation=5.0),
        ... )
        >>> sl.calibrate(robot, log, ["mass"], folds=0).save("found.nc")
        >>> value, error = sl.load_calibration("found.nc").value_of("mass")
        >>> print(f"{value:.1f} kg, in truth {robot.mass:.1f}")
        50.0 kg, in truth 50.0
    """
    return FORMAT.load(file)


def pack(found: Calibration) -> Dataset:
    """Data set of a calibration."""
    quantities = [(one, one.of(found)) for one in FOUND]
    quantities += [(one, one.of(found.parameters)) for one in PARAMETERS]
    quantities += [(one, one.of(found.sensors)) for one in PLACED]
    quantities += [(_sensor(name, np.ndim(value)), value) for name, value in _deviations(found.sensors)]
    quantities += [(one, _column(one, found.outliers)) for one in OUTLIERS]
    for group, columns in DIRECTIONS.items():
        quantities += [(one, _column(one, getattr(found, group), len(found.values))) for one in columns]
    if found.cross_validation is not None:
        quantities += [(one, one.of(found.cross_validation)) for one in CROSS_VALIDATION]
    omitted = [(row, reason.value) for reason, rows in found.left_out.items() for row in rows]
    quantities += list(zip(LEFT_OUT, np.array(omitted, dtype=np.int64).reshape(-1, 2).T, strict=True))
    variables = {one.name: (one.parts, _stored(one, value), one.attributes) for one, value in quantities}
    return labeled_dataset(variables, _attributes(found))


def _stored(quantity: Quantity, values: Any) -> Any:
    """Values of the type that the file has them in; what has no unit is said to be of 1."""
    array = np.asarray(values, dtype=quantity.type)
    return np.where(array == "", "1", array).astype(object) if quantity.name == "parameter_unit" else array


def _column(quantity: Quantity, parts: Sequence[Any], each: int = 0) -> Any:
    """One attribute of several outliers or directions, of which each may have so many numbers."""
    values = [quantity.of(part) for part in parts]
    if quantity.name.endswith("_vector"):
        return np.reshape(values, (len(values), each))
    return [_NONE if value is None else value for value in values]


def _deviations(sensors: Sensors) -> Iterable[tuple[str, Any]]:
    """Those of what measures."""
    return ((name, value) for name in SENSORS if (value := getattr(sensors, name)) is not None)


def _sensor(name: str, axes: int) -> Quantity:
    """The variable of a sensor's deviation, of one number or of one a cable or axis."""
    part, unit = SENSORS[name]
    long_name = f"standard deviation of a {name.removesuffix('_deviation')} that is read"
    return Quantity(name, name, (part,) if axes else (), unit, long_name, low=0.0)


def _attributes(found: Calibration) -> dict[str, Any]:
    return {
        **FORMAT.attributes(f"Calibration of {found.robot.name}"),
        "log": found.log,
        "read": READ[found.parameters.counted],
        "date": found.date,
        "left_out": " ".join(reason.name.lower() for reason in found.left_out),
        **choice_attributes("model", found.model, MODELS),
        "robot": dump_robot(found.robot),
        "robot_before": dump_robot(found.before),
    }


def unpack(path: Path, data: Dataset) -> Calibration:
    """The calibration of a data set; its path is for messages."""
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, robot")
    before = parse_robot(str(data.attrs["robot_before"]), f"{path}, robot_before")
    measured = ["length_deviation", *(name for name in SENSORS if name in data.variables)]  # which is always there
    sensors = [_sensor(name, data.variables[name].ndim) for name in dict.fromkeys(measured)]
    check_calibration(data, robot, before, sensors)

    def values(name: str) -> Any:
        return locked(np.asarray(data[name].values, order="C"))

    def number(quantity: Quantity) -> Any:
        return data[quantity.name].values.item()

    whole = {one.place: values(one.name) if one.parts else number(one) for one in FOUND if "." not in one.place}
    units = [unit if unit != "1" else "" for unit in values("parameter_unit")]
    texts = {"names": values("parameter_name"), "labels": values("parameter_label"), "units": units}
    numbers: dict[str, Any] = {one.place: values(one.name) for one in PARAMETERS if one.values is not str}
    rows, reasons = values("left_out_row"), values("left_out_reason")
    omissions = [Omission[name.upper()] for name in data.attrs["left_out"].split()]
    checked = {one.place: number(one) for one in CROSS_VALIDATION if "folds" in data.variables}
    return Calibration(
        robot=robot,
        before=before,
        sensors=Sensors(
            **{one.name: values(one.name) for one in sensors},
            frame=Pose._adopt(values("measuring_position"), values("measuring_quaternion")),
            target=values("target"),
        ),
        parameters=Parameters(
            **numbers | {name: tuple(map(str, text)) for name, text in texts.items()},
            counted=READ.index(data.attrs["read"]) == 1,
        ),
        **{**whole, "status": CalibrationStatus(whole["status"])},
        poses=Pose._adopt(values("position"), values("quaternion")),
        left_out={reason: locked(rows[reasons == reason.value]) for reason in omissions},
        outliers=tuple(_outlier(*row) for row in zip(*(values(one.name).tolist() for one in OUTLIERS), strict=True)),
        cross_validation=CrossValidation(**checked) if checked else None,
        gauge=_directions(*(values(one.name) for one in DIRECTIONS["gauge"])),
        cannot_tell_apart=_directions(*(values(one.name) for one in DIRECTIONS["cannot_tell_apart"])),
        model=choice_of(path, data.attrs, "model", MODELS),
        log=str(data.attrs["log"]),
        date=str(data.attrs["date"]),
    )


def _outlier(row: int, cable: int, quantity: str, size: float, deviations: float) -> Outlier:
    return Outlier(row, None if cable == _NONE else cable, quantity, size, deviations)


def _directions(names: Any, vectors: Any, known: Any, steps: Any) -> tuple[Direction, ...]:
    rows = zip(names, vectors, known.tolist(), steps, strict=True)
    return tuple(Direction(str(name), locked(vector.copy()), share, str(step)) for name, vector, share, step in rows)


FORMAT: Final = Format(
    kind=Calibration,
    name="calibration",
    made="calibration of sagline",
    give="Give the .nc file that sagline calibrate wrote, or a calibration's save.",
    again="Save the calibration again, or take the file from where it came.",
    key="sagline_calibration_format",
    version=1,
    pack=pack,
    unpack=unpack,
)
save = FORMAT.save
