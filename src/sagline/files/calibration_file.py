"""Calibrations in NetCDF: every number with its unit, and the robot as it was and as it was found."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sagline.cables.models import MODELS
from sagline.calibration.findings import CrossValidation, Direction, Outlier
from sagline.calibration.result import Calibration
from sagline.calibration.sensors import Sensors
from sagline.calibration.status import CalibrationStatus, Omission
from sagline.calibration.unknowns import Parameters
from sagline.core.arrays import locked
from sagline.files.calibration_checks import check_calibration
from sagline.files.calibration_layout import (
    CROSS_VALIDATION,
    DIRECTIONS,
    FOUND,
    LEFT_OUT,
    OUTLIERS,
    PARAMETERS,
    PLACED,
    READ,
    SENSORS,
)
from sagline.files.dataset import labeled_dataset
from sagline.files.format import Format
from sagline.files.plan_file import choice_attributes, choice_of
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import Quantity
from sagline.robot.pose import Pose

if TYPE_CHECKING:
    from xarray import Dataset

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
