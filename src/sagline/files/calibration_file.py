"""Calibrations in NetCDF: every number with its unit, and the robots before and after."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.cables.models import models_by_name
from sagline.calibration import findings
from sagline.calibration.log import Sensors
from sagline.calibration.parameters import KINDS, Parameters
from sagline.calibration.result import Calibration
from sagline.core.arguments import choice, text
from sagline.core.arrays import locked
from sagline.core.errors import InvalidValueError
from sagline.files import variables as v
from sagline.files.netcdf import Format, choice_attributes, choice_of
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import SOMEWHERE, STEP, Quantity
from sagline.kernels.calibration.kinds import KIND_ROWS
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from xarray import Dataset

READ: Final = ("lengths", "counts")  # quantity that the winches report; the index is Parameters.counted
UNITS = ("m", "kg/m", "N", "kg", "rad", "s", "1")
P: Final = ("parameter",)
N: Final = ("pose",)
TURN: Final = ("quaternion_part",)
PLACE: Final = "index of each parameter by kind and cable, -1 for none"
PARAMETERS: Final = (
    Quantity("parameter_name", P, "", "kind of each parameter", "names", values=str),
    Quantity("parameter_label", P, "", "name of each parameter", "labels", values=str),
    Quantity("parameter_unit", P, "", "unit of each parameter, 1 for none", "units", values=str),
    Quantity("parameter_cable", P, "", "cable of each parameter, -1 for all cables", "cables", values=int),
    Quantity("parameter_place", ("kind_row", "cable"), "", PLACE, "where", values=int),
    Quantity("prior", P, "", "prior values, in the units of the parameters"),
    Quantity("prior_deviation", P, "", "standard deviations of the prior values", infinite=True),
    Quantity("prior_stated", P, "", "source of the prior: tolerances or caller", "stated", values=bool),
    Quantity("logarithmic", P, "", "true if the logarithm was estimated", values=bool),
)
READINGS: Final = "lengths [m], load cells [N], position [m], rotation [rad], swivel angles [rad], frequencies [Hz]"
OLDEST: Final = 27  # number of kinds in the oldest files
FOUND: Final = (
    Quantity("length_offset", ("cable",), "m", "correction of the lengths of the machine"),
    Quantity("status", (), "", "status of the calibration", codes=findings.CalibrationStatus),
    Quantity("value", P, "", "estimated values, in the units of the parameters", "values"),
    Quantity("covariance", (*P, "other_parameter"), "", "covariance of the values", known=SOMEWHERE, infinite=True),
    Quantity("chi_squared", (), "1", "sum of squares of the normalized residuals", low=0.0),
    Quantity("degrees_of_freedom", (), "", "degrees of freedom of chi_squared", values=int),
    Quantity("iterations", (), "", "number of iterations of the least squares", values=int),
    Quantity("row", N, "", "used rows of the log", "rows", values=int),
    Quantity("position", (*N, "axis"), "m", "position of the platform", "poses.position"),
    Quantity("quaternion", (*N, "quaternion_part"), "1", "rotation from platform to world", "poses.quaternion"),
    Quantity("unstrained_length", (*N, "cable"), "m", "true lengths of the cables", low=0.0),
    Quantity("residual", (*N, "reading"), "", f"readings minus predictions: {READINGS}", "residuals", SOMEWHERE),
    Quantity("chi_squared_of_pose", N, "1", "share of each pose in chi_squared", low=0.0),
    Quantity("weight", N, "1", "weight of each pose, below 1 for an outlier", "weights", low=0.0),
)
SENSORS: Final = {  # name in the file: attribute and unit; a value is one number, or one per cable or axis
    "length_deviation": ("cable", "m"),
    "tension_deviation": ("cable", "N"),
    "position_deviation": ("axis", "m"),
    "rotation_deviation": ("axis", "rad"),
    "swivel_deviation": ("cable", "rad"),
    "frequency_deviation": ("mode", "Hz"),
}
PLACED: Final = (
    Quantity("measuring_position", ("axis",), "m", "position of the measuring system", "frame.position"),
    Quantity("measuring_quaternion", TURN, "1", "rotation from measuring system to world", "frame.quaternion"),
    Quantity("target", ("axis",), "m", "measured point of the platform"),
)
LEFT_OUT: Final = (
    Quantity("left_out_row", ("omission",), "", "omitted rows of the log", values=int),
    Quantity("left_out_reason", ("omission",), "", "reason of the omission", codes=findings.Omission),
)
OUTLIERS: Final = (
    Quantity("outlier_row", ("outlier",), "", "row of the log", "row", values=int),
    Quantity("outlier_cable", ("outlier",), "", "cable, -1 for the whole pose", "cable", SOMEWHERE, values=int),
    Quantity("outlier_quantity", ("outlier",), "", "quantity with the deviation", "quantity", values=str),
    Quantity("outlier_size", ("outlier",), "", "size of the deviation [m, N or rad]", "size"),
    Quantity("outlier_deviations", ("outlier",), "1", "size of the deviation in standard deviations", "deviations"),
)
CRITICISMS: Final = (
    Quantity("criticism_name", ("criticism",), "", "parameters without an estimate", "name", values=str),
    Quantity("criticism_kind", ("criticism",), "", "kind of these parameters", "kind", values=str),
    Quantity("criticism_fall", ("criticism",), "1", "reduction of chi_squared by their estimation", "fall", low=0.0),
    Quantity("criticism_chance", ("criticism",), "1", "probability of this reduction by chance", "chance", low=0.0),
    Quantity("criticism_moves", ("criticism",), "", "parameter with the largest change", "moves", values=str),
    Quantity("criticism_change", ("criticism",), "", "largest change, in the unit of this parameter", "change"),
    Quantity("criticism_deviations", ("criticism",), "1", "largest change in standard errors", "deviations", low=0.0),
)
CROSS_VALIDATION: Final = (
    Quantity("folds", (), "", "folds of the cross-validation", values=int),
    *(
        Quantity(f"left_out_{name}", (), unit, f"root mean square {what}", name, SOMEWHERE, 0.0)
        for name, unit, what in (
            ("tension", "N", "of load cells at poses left out"),
            ("position", "m", "of positions at poses left out"),
            ("tension_before", "N", "of load cells with the original robot"),
            ("position_before", "m", "of positions with the original robot"),
        )
    ),
)


DIRECTIONS: Final = {  # unobservable or weakly observable directions in parameter space
    group: (
        Quantity(f"{group}_name", (group,), "", "name of the direction", "name", values=str),
        Quantity(f"{group}_vector", (group, *P), "", "combination of the parameters, in their units", "vector"),
        Quantity(f"{group}_known", (group,), "1", "remaining share of the prior deviation", "known", low=0.0),
        Quantity(f"{group}_step", (group,), "", "next step", "step", values=str),
    )
    for group in ("gauge", "cannot_tell_apart")
}


def _check_calibration(data: Dataset, robot: Robot, before: Robot, sensors: Sequence[Quantity]) -> None:
    """Refuse a data set that is not a calibration of `robot` and `before` with the sensor quantities `sensors`."""
    m = robot.cable_count
    if before.cable_count != m:
        raise InvalidValueError("robot_before", f"of {before.cable_count} cables", f"of {m}, as robot", STEP)
    directions = [one for columns in DIRECTIONS.values() for one in columns]
    quantities = [*FOUND, *PARAMETERS, *PLACED, *sensors, *OUTLIERS, *LEFT_OUT, *directions]
    for group in (CROSS_VALIDATION, CRITICISMS):  # older files do not have the second variable
        if any(one.name in data.variables for one in group):
            quantities += group
    sizes = {str(name): size for name, size in data.sizes.items()}
    kind_rows = max(OLDEST, min(sizes.get("kind_row", 0), KIND_ROWS))  # older files do not have the last kinds
    readings = (3 if "swivel_deviation" in data.variables else 2) * m + 6
    if "frequency_deviation" in data.variables:
        readings = max(sizes.get("reading", 0), readings + 1)
    fixed = {"cable": m, "reading": readings, "kind_row": kind_rows, "other_parameter": sizes.get("parameter", 0)}
    v.check_variables(data, quantities, sizes | fixed)
    ranges = {"parameter_cable": (-1, m), "parameter_place": (-1, sizes["parameter"]), "outlier_cable": (-1, m)}
    v.check_indices(data, ranges | dict.fromkeys(("row", "outlier_row", "left_out_row"), (0, sys.maxsize)))
    words: dict[str, Iterable[str]] = {
        "parameter_name": KINDS,
        "parameter_unit": UNITS,
        "outlier_quantity": findings.QUANTITIES,
        "criticism_kind": KINDS,
        "criticism_moves": data.variables["parameter_label"].values.tolist(),
    }
    for name in words.keys() & set(data.variables):
        for word in data.variables[name].values:
            choice(str(word), name, words[name])
    choice(str(data.attrs["read"]), "read", READ)
    for name in ("log", "date"):
        text(data.attrs[name], name)
    names = [reason.name.lower() for reason in findings.Omission]
    reasons = [choice(word, "left_out", names) for word in text(data.attrs["left_out"], "left_out").split()]
    for code in np.unique(data.variables["left_out_reason"].values).tolist():
        choice(findings.Omission(code).name.lower(), "left_out_reason", reasons)


def load_calibration(file: os.PathLike[str] | str) -> Calibration:
    """Read a calibration from a file of `Calibration.save` or `sagline calibrate`; all numbers are restored exactly.

    Args:
        file: The NetCDF file.

    Returns:
        The calibration.

    Raises:
        FileError: If the file is missing, not a calibration, of a newer format, or changed after it was written.

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


def _pack(found: Calibration) -> Dataset:
    variables = v.variables_of_result(found, FOUND) | v.variables_of_result(found.parameters, PARAMETERS)
    dimensions, units, attributes = variables["parameter_unit"]
    variables["parameter_unit"] = dimensions, np.where(units == "", "1", units).astype(object), attributes
    deviations = {name: getattr(found.sensors, name) for name in SENSORS}
    sensors = [_sensor(name, np.ndim(value)) for name, value in deviations.items() if value is not None]
    variables |= v.variables_of_result(found.sensors, (*PLACED, *sensors))
    variables |= v.record_variables(found.outliers, OUTLIERS)
    for group, columns in DIRECTIONS.items():
        variables |= v.record_variables(getattr(found, group), columns, len(found.values))
    variables |= v.variables_of_result(found.cross_validation, CROSS_VALIDATION)
    variables |= v.record_variables(found.criticisms, CRITICISMS)
    omitted = np.array([(row, reason) for reason, rows in found.left_out.items() for row in rows], dtype=np.int64)
    for one, values in zip(LEFT_OUT, omitted.reshape(-1, 2).T, strict=True):
        variables[one.name] = one.parts, values.astype(one.type), one.attributes
    attributes = {
        "log": found.log,
        "read": READ[found.parameters.counted],
        "date": found.date,
        "left_out": " ".join(reason.name.lower() for reason in found.left_out),
        **choice_attributes("model", found.model, models_by_name()),
        "robot_before": dump_robot(found.before),
    }
    return FORMAT.dataset(f"Calibration of {found.robot.name}", found.robot, attributes, variables)


def _sensor(name: str, axes: int) -> Quantity:
    """Read the standard deviation of a sensor: one number, or one per cable or axis."""
    part, unit = SENSORS[name]
    long_name = f"standard deviation of a {name.removesuffix('_deviation')} that is read"
    infinite = name == "rotation_deviation"  # `Sensors` allows an unmeasured yaw only
    return Quantity(name, (part,) if axes else (), unit, long_name, low=0.0, infinite=infinite)


def _unpack(path: Path, data: Dataset) -> Calibration:
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, robot")
    before = parse_robot(str(data.attrs["robot_before"]), f"{path}, robot_before")
    measured = ["length_deviation", *(name for name in SENSORS if name in data.variables)]  # this one always exists
    sensors = [_sensor(name, data.variables[name].ndim) for name in dict.fromkeys(measured)]
    _check_calibration(data, robot, before, sensors)
    found, numbers, placed = (v.fields_of(data, each) for each in (FOUND, PARAMETERS, (*PLACED, *sensors)))
    found |= {one.place: data[one.name].values.item() for one in FOUND if not one.parts}
    missing = ((0, KIND_ROWS - len(numbers["where"])), (0, 0))
    numbers["where"] = locked(np.pad(numbers["where"], missing, constant_values=-1))
    texts: dict[str, Any] = {name: tuple(numbers.pop(name).tolist()) for name in ("names", "labels", "units")}
    texts["units"] = tuple("" if unit == "1" else unit for unit in texts["units"])
    omissions = [findings.Omission[name.upper()] for name in data.attrs["left_out"].split()]
    rows, reasons = (data[one.name].values for one in LEFT_OUT)
    checked = {one.place: data[one.name].values.item() for one in CROSS_VALIDATION if "folds" in data.variables}
    criticisms = CRITICISMS if CRITICISMS[0].name in data.variables else ()
    directions: dict[str, Any] = {
        name: tuple(findings.Direction(**row) for row in v.records_of(data, columns))
        for name, columns in DIRECTIONS.items()
    }
    return Calibration(
        robot=robot,
        before=before,
        sensors=Sensors(**placed | {"frame": Pose._adopt(**placed["frame"])}),
        parameters=Parameters(**numbers, **texts, counted=READ.index(data.attrs["read"]) == 1),
        **found | {"status": findings.CalibrationStatus(found["status"]), "poses": Pose._adopt(**found["poses"])},
        left_out={reason: locked(rows[reasons == reason.value]) for reason in omissions},
        outliers=tuple(findings.Outlier(**row) for row in v.records_of(data, OUTLIERS)),
        criticisms=tuple(findings.Criticism(**row) for row in v.records_of(data, criticisms)),
        cross_validation=findings.CrossValidation(**checked) if checked else None,
        **directions,
        model=choice_of(path, data.attrs, "model", models_by_name()),
        log=str(data.attrs["log"]),
        date=str(data.attrs["date"]),
    )


FORMAT: Final = Format(
    kind=Calibration,
    name="calibration",
    made="calibration of sagline",
    give="Give a .nc file of sagline calibrate, or of Calibration.save.",
    again="Save the calibration again, or get the original file.",
    key="sagline_calibration_format",
    pack=_pack,
    unpack=_unpack,
)
