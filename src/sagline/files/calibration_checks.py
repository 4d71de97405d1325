"""Whether a file's calibration hangs together: its shapes, units and indices, and the robots inside."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sagline.calibration.status import Omission
from sagline.calibration.unknowns import KINDS
from sagline.core.arguments import choice, text
from sagline.core.errors import InvalidValueError
from sagline.files.calibration_layout import (
    CROSS_VALIDATION,
    DIRECTIONS,
    FOUND,
    LEFT_OUT,
    OUTLIERS,
    PARAMETERS,
    PLACED,
    READ,
)
from sagline.files.variable_checks import STEP, check_indices, check_labels, check_variable
from sagline.files.variables import Quantity
from sagline.kernels.calibration.kinds import KIND_ROWS
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from xarray import Dataset

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
