"""Whether the variables of a plan's file make a plan: their shapes, types, units, codes, signs and gaps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from sagline.arrays import Flags
from sagline.errors import InvalidValueError
from sagline.files.plan_layout import JERK, MACHINE, MOTION, PARTS, PROOF, QUANTITIES, TIME, WINDING, Known, Quantity
from sagline.kinematics.status import PoseStatus

if TYPE_CHECKING:
    from xarray import Dataset, Variable

STEP = "Write the file again; it was edited, or damaged."
NEWER = "Read it with a newer sagline."


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
    sizes = {"cable": cables, "pose": status.size, **{name: len(labels) for name, labels in PARTS.items()}}
    for name, labels in PARTS.items():
        if name in data.variables and list(data.variables[name].values) != list(labels):
            raise InvalidValueError(name, list(data.variables[name].values), ", ".join(labels), STEP)
    solved = np.asarray(status.values == PoseStatus.SOLVED)
    for quantity in sorted(present(data), key=lambda quantity: quantity.codes is None):  # what a status means, first
        variable = data.variables[quantity.name]
        _check_form(quantity, variable, (*rows, *quantity.parts), sizes)
        if quantity.codes is not None:
            _check_codes(quantity, variable)
        elif not quantity.flag:
            _check_numbers(quantity, np.asarray(variable.values), solved)


def _check_form(quantity: Quantity, variable: Variable, dimensions: Iterable[str], sizes: Mapping[str, int]) -> None:
    wanted = {name: sizes[name] for name in dimensions}
    found = dict(zip(map(str, variable.dims), variable.shape, strict=True))
    if list(found.items()) != list(wanted.items()):
        raise InvalidValueError(f"{quantity.name}: shape", _shape(found), _shape(wanted), STEP)
    if variable.dtype.newbyteorder("=") != quantity.type:
        raise InvalidValueError(f"{quantity.name}: type", variable.dtype, str(quantity.type), STEP)
    unit = variable.attrs.get("units", "")
    if not isinstance(unit, str) or unit != quantity.unit:
        raise InvalidValueError(f"{quantity.name}: units", repr(unit), repr(quantity.unit), STEP)


def _shape(sizes: Mapping[str, int]) -> str:
    return " × ".join(f"{size} {name}" for name, size in sizes.items()) or "one value"


def _check_codes(quantity: Quantity, variable: Variable) -> None:
    """A code means what it meant to the writer."""
    assert quantity.codes is not None
    ours = {code.value: code.name.lower() for code in quantity.codes}
    values = np.atleast_1d(variable.attrs.get("flag_values", ())).tolist()
    theirs = dict(zip(values, str(variable.attrs.get("flag_meanings", "")).split(), strict=False))
    for value in np.unique(variable.values).tolist():
        if value not in ours or theirs.get(value) != ours[value]:
            said = theirs.get(value, "without a meaning")
            raise InvalidValueError(quantity.name, f"{value} ({said})", _codes(ours), NEWER)


def _codes(meanings: Mapping[int, str]) -> str:
    return ", ".join(f"{value} ({meaning})" for value, meaning in meanings.items())


def _check_numbers(quantity: Quantity, values: np.ndarray[Any, Any], solved: Flags) -> None:
    there = np.broadcast_to(solved.reshape(solved.shape + (1,) * (values.ndim - solved.ndim)), values.shape)
    missing = np.isnan(values)
    wrong = values < quantity.low
    if not quantity.infinite:
        wrong |= np.isinf(values)
    if quantity.known is Known.EVERYWHERE:
        wrong |= missing
    elif quantity.known is Known.SOLVED:
        wrong |= missing == there
    if not wrong.any():
        return
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    where = f"{quantity.name}{list(index) if index else ''}"
    bound = f">= {quantity.low:g} {quantity.unit}, " if quantity.low > -np.inf else ""
    finite = "" if quantity.infinite else "finite, "
    raise InvalidValueError(where, f"{values[index]:g}", f"{bound}{finite}{quantity.known.value}", STEP)
