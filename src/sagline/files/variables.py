"""Variables of NetCDF files: declaration of a quantity, and checks of its shape, type, unit, codes, signs and gaps."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from enum import Enum, IntEnum
from operator import attrgetter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from sagline.core.arrays import Flags
from sagline.core.errors import InvalidValueError, printable

if TYPE_CHECKING:
    from xarray import Dataset, Variable

# labels along the dimensions beside rows and cable
PARTS = {
    "axis": ("x", "y", "z"),
    "quaternion_part": ("x", "y", "z", "w"),
    "wrench_part": ("force x", "force y", "force z", "moment x", "moment y", "moment z"),
    "twist_part": ("linear x", "linear y", "linear z", "angular x", "angular y", "angular z"),
    "residual_part": ("force", "moment"),
    "bracket_part": ("proved", "sufficient"),
}


class Known(Enum):
    """Where a quantity has values; elsewhere it is NaN."""

    EVERYWHERE = "at every pose"
    SOLVED = "at the solved poses alone"
    SOMEWHERE = "at any poses"


class Quantity(NamedTuple):
    """One variable of the file, and what its values may be.

    Attributes:
        name: Its name in the file.
        place: Where a result has it, as a dotted attribute.
        parts: Its dimensions after that of the rows: poses, or samples in time.
        unit: Unit as the file states it; "" for a plain number.
        long_name: What it is, in a reader's words.
        codes: The status it holds codes of, if any.
        known: Where it has values.
        low: Its lowest value.
        infinite: Whether it may be infinite.
        values: What its values are where they are no codes: float, int, bool for yes or no, or str.
    """

    name: str
    place: str
    parts: tuple[str, ...]
    unit: str
    long_name: str
    codes: type[IntEnum] | None = None
    known: Known = Known.EVERYWHERE
    low: float = -np.inf
    infinite: bool = False
    values: type[float | int | bool | str] = float

    @property
    def type(self) -> np.dtype[Any]:
        """The type of its values."""
        return np.dtype(np.int8 if self.codes is not None else object if self.values is str else self.values)

    def of(self, result: Any) -> Any:
        """The values of a result.

        Args:
            result: The result.

        Returns:
            Array, or None where it does not have it, such as a proof that a plan lacks.
        """
        return attrgetter(self.place)(result)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes of the variable; status codes are explained as the CF conventions want it."""
        found: dict[str, Any] = {"long_name": self.long_name}
        if self.unit:
            found["units"] = self.unit
        if self.codes is not None:
            found["flag_values"] = np.array([code.value for code in self.codes], dtype=np.int8)
            found["flag_meanings"] = " ".join(code.name.lower() for code in self.codes)
        return found


STEP = "Write the file again; it was edited, or damaged."
NEWER = "Read it with a newer sagline."


def check_labels(data: Dataset) -> None:
    """Refuse a data set whose dimensions are labeled as none of ours is.

    Args:
        data: The data set.

    Raises:
        InvalidValueError: If there is such a one; the message has its labels.
    """
    for name, labels in PARTS.items():
        if name in data.variables and list(data.variables[name].values) != list(labels):
            raise InvalidValueError(name, list(data.variables[name].values), ", ".join(labels), STEP)


def check_variable(
    quantity: Quantity, variable: Variable, rows: Iterable[str], sizes: Mapping[str, int], solved: Flags
) -> None:
    """Refuse a variable that is not what the layout says.

    Args:
        quantity: What it should be.
        variable: What it is.
        rows: Its dimensions before those of the layout.
        sizes: How many entries each dimension has that has no labels.
        solved: At which rows there is an answer.

    Raises:
        InvalidValueError: If it is something else; the message names its first wrong value.
    """
    every = {**{name: len(labels) for name, labels in PARTS.items()}, **sizes}
    _check_form(quantity, variable, {name: every[name] for name in (*rows, *quantity.parts)})
    if quantity.codes is not None:
        _check_codes(quantity, variable)
    elif quantity.values is float:
        _check_numbers(quantity, np.asarray(variable.values), solved)
    elif quantity.values is str:
        _check_texts(quantity, variable)


def check_indices(name: str, values: np.ndarray[Any, Any], low: int, high: int) -> None:
    """Refuse indices out of range.

    Args:
        name: What they are, for the message.
        values: The indices.
        low: The least allowed.
        high: One more than the largest allowed.

    Raises:
        InvalidValueError: If one is out of range; the message has the first.
    """
    wrong = (values < low) | (values >= high)
    if wrong.any():
        allowed = f"{low} to {high - 1}" if high < sys.maxsize else f">= {low}"
        raise InvalidValueError(name, int(values[wrong][0]), allowed, STEP)


def _check_form(quantity: Quantity, variable: Variable, wanted: Mapping[str, int]) -> None:
    found = dict(zip(map(str, variable.dims), variable.shape, strict=True))
    if list(found.items()) != list(wanted.items()):
        raise InvalidValueError(f"{quantity.name}: shape", _shape(found), _shape(wanted), STEP)
    # texts may come in several types; each of them is looked at
    if quantity.values is not str and variable.dtype.newbyteorder("=") != quantity.type:
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


def _check_texts(quantity: Quantity, variable: Variable) -> None:
    for index, value in np.ndenumerate(variable.values):
        if not isinstance(value, str) or not value or value != printable(value):
            raise InvalidValueError(f"{quantity.name}{list(index)}", repr(value), "a word that prints", STEP)


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
