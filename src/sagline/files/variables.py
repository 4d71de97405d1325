"""Variables of NetCDF files: declarations of quantities, and checks of shape, type, unit, codes, signs and NaN."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from enum import Enum, IntEnum
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sagline.core.arrays import Flags, locked
from sagline.core.errors import InvalidValueError, printable
from sagline.motion.anchors import AnchorMotion

if TYPE_CHECKING:
    from xarray import Dataset, Variable

STEP = "Write the file again, because it was edited or damaged."
NEWER = "Read it with a newer sagline."
NONE: Final = -1  # number that means a missing index or code
# names of the entries along all dimensions except rows and cable
PARTS = {
    "axis": ("x", "y", "z"),
    "quaternion_part": ("x", "y", "z", "w"),
    "wrench_part": ("force x", "force y", "force z", "moment x", "moment y", "moment z"),
    "twist_part": ("linear x", "linear y", "linear z", "angular x", "angular y", "angular z"),
    "residual_part": ("force", "moment"),
    "bracket_part": ("proved", "sufficient"),
}


class _Known(Enum):
    """Poses at which a quantity has values; the quantity is NaN at all other poses."""

    EVERYWHERE = "at every pose"
    SOLVED = "at the solved poses alone"
    SOMEWHERE = "at any poses"


EVERYWHERE, SOLVED, SOMEWHERE = _Known


class Quantity(NamedTuple):
    """One variable of a file, and the range of its values."""

    name: str  # name in the file
    parts: tuple[str, ...]  # dimensions after the dimensions of the rows (poses, or samples in time)
    unit: str  # unit in the file; "" for a plain number
    long_name: str  # description
    # attribute of the result, with dots for nested attributes; `name` is appended if it is "" or ends with a dot
    source: str = ""
    # poses with values; in records, a missing integer of a quantity with values SOMEWHERE is `NONE`
    known: _Known = EVERYWHERE
    low: float = -np.inf  # lowest value
    infinite: bool = False  # True if values may be infinite
    codes: type[IntEnum] | None = None  # enumeration of statuses, if the values are codes
    # type of values that are not codes: float, int, np.int8, bool or str
    values: type[float | int | np.int8 | bool | str] = float

    @property
    def place(self) -> str:
        """Attribute of the result that contains the values, with dots for nested attributes."""
        return self.source + self.name if self.source[-1:] in ("", ".") else self.source

    @property
    def type(self) -> np.dtype[Any]:
        """Type of the values in the file."""
        return np.dtype(np.int8 if self.codes is not None else object if self.values is str else self.values)

    @property
    def blank(self) -> int | str:
        """Value in records without the quantity."""
        return "" if self.values is str else NONE

    def of(self, result: Any) -> Any:
        """Values of the quantity in a result; None if the result has none, for example a plan without a proof."""
        for name in self.place.split("."):
            result = None if result is None else getattr(result, name)
        return result

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the variable, with the meanings of status codes as the CF conventions require."""
        found: dict[str, Any] = {"long_name": self.long_name}
        if self.unit:
            found["units"] = self.unit
        if self.codes is not None:
            found["flag_values"] = np.array([code.value for code in self.codes], dtype=np.int8)
            found["flag_meanings"] = " ".join(code.name.lower() for code in self.codes)
        return found


def variables_of_result(result: Any, quantities: Iterable[Quantity], rows: tuple[str, ...] = ()) -> dict[str, Any]:
    """Dimensions, values and attributes of the quantities of a result, by name."""
    found: dict[str, Any] = {}
    for one in quantities:
        if (values := one.of(result)) is not None:
            found[one.name] = ((*rows, *one.parts), np.asarray(values, dtype=one.type), one.attributes)
    return found


def record_variables(records: Sequence[Any], quantities: Iterable[Quantity], width: int = 0) -> dict[str, Any]:
    """Variables with one row per record. For lists, `width` is the second dimension. None is stored as `one.blank`."""
    found: dict[str, Any] = {}
    for one in quantities:
        values = [one.blank if (value := one.of(record)) is None else value for record in records]
        shape = (len(records), width)[: len(one.parts)]
        found[one.name] = (one.parts, np.array(values, dtype=one.type).reshape(shape), one.attributes)
    return found


def values_of(data: Dataset, name: str) -> Any:
    """Values of the variable `name` as a write-locked array in C order."""
    return locked(np.asarray(data[name].values, order="C"))


def fields_of(data: Dataset, quantities: Iterable[Quantity]) -> dict[str, Any]:
    """Mapping from attributes of the result to values of a data set. Nested attributes give nested mappings."""
    found: dict[str, Any] = {}
    for one in quantities:
        if one.name in data.variables:
            *parts, name = one.place.split(".")
            branch = found
            for part in parts:
                branch = branch.setdefault(part, {})
            branch[name] = values_of(data, one.name)
    return found


PATHS: Final = "positions of moving frame anchors in the world; cubic splines between the samples"
ANCHORS: Final = (
    Quantity("anchor_time", ("anchor_sample",), "s", "time of the samples of moving frame anchors", "anchors.time"),
    Quantity("anchor_position", ("anchor_sample", "cable", "axis"), "m", PATHS, "anchors.position"),
)


def check_anchors(data: Dataset, cables: int) -> None:
    """Refuse a data set whose moving anchors, if any, have another number of cables, or wrong values."""
    if any(one.name in data.variables for one in ANCHORS):
        if "time" not in data.variables:
            raise InvalidValueError("time", "not given", "given with moving anchors", STEP)
        check_variables(data, ANCHORS, {"anchor_sample": data.sizes.get("anchor_sample", 0), "cable": cables})


def anchors_of(data: Dataset) -> AnchorMotion | None:
    """Moving anchors in a data set; None for fixed anchors."""
    found = fields_of(data, ANCHORS)
    return AnchorMotion(**found["anchors"]) if found else None


def records_of(data: Dataset, quantities: Iterable[Quantity]) -> list[dict[str, Any]]:
    """Restore records of `record_variables`. Integers and texts that have values only SOMEWHERE may be None."""
    columns: dict[str, list[Any]] = {}
    for one in quantities:
        values = data[one.name].values
        column = values.tolist() if values.ndim == 1 else [locked(row.copy()) for row in values]
        if one.values in (int, str) and one.known is SOMEWHERE:
            column = [None if value == one.blank else value for value in column]
        columns[one.place] = column
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def check_variables(
    data: Dataset,
    quantities: Iterable[Quantity],
    sizes: Mapping[str, int],
    rows: Iterable[str] = (),
    solved: Flags | None = None,
) -> None:
    """Refuse a data set if its labels or variables contradict the declared `quantities`."""
    # data: the data set
    # quantities: declared quantities, in the order of the checks
    # sizes: number of entries along each dimension without labels
    # rows: dimensions of the rows, which precede the declared dimensions
    # solved: rows with a solution; None: all
    for name, labels in PARTS.items():
        if name in data.variables and list(data.variables[name].values) != list(labels):
            raise InvalidValueError(name, list(data.variables[name].values), ", ".join(labels), STEP)
    every = {**{name: len(labels) for name, labels in PARTS.items()}, **sizes}
    for quantity in quantities:
        variable = data.variables[quantity.name]
        _check_form(quantity, variable, {name: every[name] for name in (*rows, *quantity.parts)})
        if quantity.codes is not None:
            _check_codes(quantity, variable)
        elif quantity.values is float:
            _check_numbers(quantity, np.asarray(variable.values), np.array(True) if solved is None else solved)
        elif quantity.values is str:
            _check_texts(quantity, variable)


def check_indices(data: Dataset, ranges: Mapping[str, tuple[int, int]]) -> None:
    """Refuse indices outside their range. A range includes its first number, but not its second number."""
    for name, (low, high) in ranges.items():
        values = data.variables[name].values
        wrong = (values < low) | (values >= high)
        if wrong.any():
            allowed = f"{low} to {high - 1}" if high < sys.maxsize else f">= {low}"
            raise InvalidValueError(name, int(values[wrong][0]), allowed, STEP)


def _check_form(quantity: Quantity, variable: Variable, wanted: Mapping[str, int]) -> None:
    found = dict(zip(map(str, variable.dims), variable.shape, strict=True))
    if list(found.items()) != list(wanted.items()):
        raise InvalidValueError(f"{quantity.name}: shape", _shape(found), _shape(wanted), STEP)
    # texts may have different types; a later check reads each text
    if quantity.values is not str and variable.dtype.newbyteorder("=") != quantity.type:
        raise InvalidValueError(f"{quantity.name}: type", variable.dtype, str(quantity.type), STEP)
    unit = variable.attrs.get("units", "")
    if not isinstance(unit, str) or unit != quantity.unit:
        raise InvalidValueError(f"{quantity.name}: units", repr(unit), repr(quantity.unit), STEP)


def _shape(sizes: Mapping[str, int]) -> str:
    return " × ".join(f"{size} {name}" for name, size in sizes.items()) or "one value"


def _check_codes(quantity: Quantity, variable: Variable) -> None:
    """Refuse codes that are unknown, or that have another meaning in the file."""
    assert quantity.codes is not None
    ours = {code.value: code.name.lower() for code in quantity.codes}
    values = np.atleast_1d(variable.attrs.get("flag_values", ())).tolist()
    theirs = dict(zip(values, str(variable.attrs.get("flag_meanings", "")).split(), strict=False))
    for value in np.unique(variable.values).tolist():
        if value not in ours or theirs.get(value) != ours[value]:
            said, known = theirs.get(value, "without a meaning"), (f"{code} ({word})" for code, word in ours.items())
            raise InvalidValueError(quantity.name, f"{value} ({said})", ", ".join(known), NEWER)


def _check_texts(quantity: Quantity, variable: Variable) -> None:
    for index, value in np.ndenumerate(variable.values):
        empty = value == "" and quantity.known is not SOMEWHERE
        if not isinstance(value, str) or empty or value != printable(value):
            raise InvalidValueError(f"{quantity.name}{list(index)}", repr(value), "printable characters", STEP)


def _check_numbers(quantity: Quantity, values: np.ndarray[Any, Any], solved: Flags) -> None:
    there = np.broadcast_to(solved.reshape(solved.shape + (1,) * (values.ndim - solved.ndim)), values.shape)
    missing = np.isnan(values)
    wrong = values < quantity.low
    if not quantity.infinite:
        wrong |= np.isinf(values)
    if quantity.known is EVERYWHERE:
        wrong |= missing
    elif quantity.known is SOLVED:
        wrong |= missing == there
    if not wrong.any():
        return
    index = tuple(int(i) for i in np.argwhere(wrong)[0])
    where = f"{quantity.name}{list(index) if index else ''}"
    bound = f">= {quantity.low:g} {quantity.unit}, " if quantity.low > -np.inf else ""
    finite = "" if quantity.infinite else "finite, "
    raise InvalidValueError(where, f"{values[index]:g}", f"{bound}{finite}{quantity.known.value}", STEP)
