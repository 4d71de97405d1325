"""Whether the variables of a plan's file make a plan: their shapes, types, units, codes, signs and gaps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sagline.core.errors import InvalidValueError
from sagline.files.plan_layout import JERK, MACHINE, MOTION, PROOF, QUANTITIES, TIME, WINDING
from sagline.files.variable_checks import STEP, check_labels, check_variable
from sagline.files.variables import Quantity
from sagline.kinematics.status import PoseStatus

if TYPE_CHECKING:
    from xarray import Dataset


def present(data: Dataset) -> tuple[Quantity, ...]:
    """The quantities that a data set has, or should have.

    Args:
        data: The data set.

    Returns:
        All that a plan has, the proofs that are there, and those of a path if there is one.
    """
    motion = (TIME, *MOTION) if TIME.name in data.variables else ()
    machine = MACHINE if MACHINE[0].name in data.variables else ()
    beside = (some for some in (WINDING, *PROOF, JERK) if some.name in data.variables)
    return (*QUANTITIES, *machine, *motion, *beside)


def check_plan(data: Dataset, cables: int) -> None:
    """Refuse a data set that is no plan, whatever its file looked like.

    Args:
        data: The data set.
        cables: How many cables the robot has.

    Raises:
        KeyError: If a variable is missing.
        InvalidValueError: If one is not what the layout says; the message names its first wrong value.
    """
    status = data.variables["pose_status"]
    rows = tuple(str(name) for name in status.dims)
    if rows not in ((), ("pose",)):
        raise InvalidValueError("pose_status: dimensions", rows, "none, or pose", STEP)
    sizes = {"cable": cables, "pose": status.size}
    check_labels(data)
    solved = np.asarray(status.values == PoseStatus.SOLVED)
    for quantity in sorted(present(data), key=lambda quantity: quantity.codes is None):  # what a status means, first
        check_variable(quantity, data.variables[quantity.name], rows, sizes, solved)
