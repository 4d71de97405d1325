"""CSV tables of numbers with units in the header, and measurements of cables in such tables."""

from __future__ import annotations

import contextlib
import csv
import io
import os
import re
from array import array
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Final, NamedTuple, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray

from sagline.core.arguments import file_path
from sagline.core.arrays import Array, locked
from sagline.core.errors import FileError, InvalidValueError, nearest
from sagline.files.quantity import LARGEST, QUATERNION_TOLERANCE, REACH, in_si, plain_number
from sagline.files.reading import read_text

TABLE_LIMIT: Final = 64.0  # largest size [MB], about half a million rows
_TOO_LONG: Final = 100.0  # a length without a unit that exceeds the size of the object by this factor must be in mm
_NONE: Final[Mapping[str, str]] = MappingProxyType({})
_COLUMN = re.compile(r"\s*(\w+)\s*(?:\[(.*)\])?\s*")  # name, or name [unit]
_SHORT, _OF_CABLE = re.compile(r"([LC])([0-9]+)"), {"L": "length", "C": "count"}
_PLAIN_ROW = re.compile(
    r"(?:[-+.0-9eE \t]*,|nan,)*"
)  # if a text has only these characters, the fast function `float` converts it
_DECIMAL_COMMA = re.compile(r"\s*[-+]?[0-9]+,[0-9]+(?:[eE][-+]?[0-9]+)?\s*")


CsvRow: TypeAlias = tuple[int, list[str]]  # line number in the file, from 1, and cells


class CsvTable:
    """Table with columns of numbers in SI."""

    def __init__(
        self,
        path: Path,
        rows: Iterable[CsvRow],
        units: Mapping[str, str],
        strangers: Mapping[str, str] = _NONE,
        gaps: Collection[str] = (),
    ) -> None:
        """Read the rows of a table; the first row contains the names of the columns, `name` or `name [unit]`."""
        found: dict[str, float | None] = {}
        numbers, lines = array("d"), array("q")
        # lines: line number of each row in the file, from 1; path is for messages
        self.path, self.lines, self.header = path, lines, 0
        for line, row in rows:
            if not found:
                found, self.header = _factors(path, line, row, units, strangers), line
            else:
                numbers.extend(_numbers(path, line, row, tuple(found), gaps))
                lines.append(line)
        if not found:
            reason, step = f"no columns; allowed: {', '.join(units)}", "Give the names of the columns first."
            raise FileError(path, reason, step, item="columns")
        values = np.array(numbers).reshape(len(lines), len(found))
        factors = [1.0 if factor is None else factor for factor in found.values()]
        with np.errstate(over="ignore"):  # a later check reports values that are too large
            # name and numbers of each column, shape (rows,)
            self.columns = {
                name: values[:, k] * factor for k, (name, factor) in enumerate(zip(found, factors, strict=True))
            }
        # names of columns without a unit in the header; the values are in SI
        self.plain = frozenset(name for name, factor in found.items() if factor is None)
        for name, column in self.columns.items():
            wrong = np.isinf(column) if name in gaps else ~np.isfinite(column)
            self.refuse(wrong, name, column, units[name], "a finite number")
            self.refuse(np.abs(column) > LARGEST, name, column, units[name], f"{REACH} {units[name]}".rstrip())

    def check_columns(self, names: Iterable[str], hint: str) -> None:
        """Refuse a table in which one of the columns `names` is missing. `hint`: end of the message."""
        if missing := [name for name in names if name not in self.columns]:
            raise line_error(self.path, self.header, f"missing column {', '.join(missing)}{hint}")

    def check_rows(self) -> None:
        """Refuse a table without rows."""
        if not self.lines:
            raise line_error(self.path, self.header, "no rows below the names of the columns; allowed: at least one")

    def refuse(self, wrong: NDArray[np.bool_], item: str, values: Array, unit: str, allowed: str) -> None:
        """Refuse a table with wrong rows. The message gives line, value, unit and allowed values of the first one."""
        if wrong.any():
            k = int(np.argmax(wrong))
            value = f"{values[k]:.12g} {unit}".rstrip()
            raise line_error(self.path, self.lines[k], f"{item} is {value}; allowed: {allowed}")

    def refuse_millimeters(self, name: str, size: Array | float, whole: str) -> None:
        """Refuse lengths without a unit if they exceed 100 times the `size` [m] of the object, shape () or (rows,)."""
        if name in self.plain:
            far = self.columns[name] > _TOO_LONG * size
            allowed = f"lengths like {whole}; if these are millimeters, call the column {name} [mm]"
            self.refuse(far, name, self.columns[name], "m", allowed)

    def normalized(self, quaternion: Array, names: str) -> Array:
        """Unit quaternions (rows, 4) from the columns `names` with few decimals; NaN stays NaN."""
        length = np.linalg.norm(quaternion, axis=1)
        wrong = np.abs(length - 1.0) > QUATERNION_TOLERANCE
        self.refuse(wrong, f"the length of {names}", length, "", f"1 to {QUATERNION_TOLERANCE:g}")
        return np.asarray(quaternion / length[:, None])


def commented_rows(path: Path) -> tuple[list[str], Iterator[CsvRow]]:
    """Blank lines and comments above the header of a CSV file, and the rows from the header on."""
    lines = read_text(path, TABLE_LIMIT).split("\n")
    written = (k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#"))
    above = next(written, len(lines))
    return lines[:above], csv_rows(path, "\n".join(lines[above:]), above)


def csv_rows(path: Path, text: str, above: int = 0) -> Iterator[CsvRow]:
    """Rows of a CSV text that are not blank, the header first. `above`: number of lines of the file above the text."""
    # Columns are separated by commas, or, if the header has no comma, by semicolons or tabs. Decimal commas between the
    # latter become points.
    header = re.sub(r"\[.*?\]", "", next((line for line in text.split("\n") if line.strip()), "")).strip()
    mark, is_header = next((mark for mark in ",;\t" if mark in header), ","), True
    reader = csv.reader(io.StringIO(text), strict=True, delimiter=mark)
    try:
        for row in reader:
            if not "".join(row).strip():  # a blank line, or a line with only commas, as a spreadsheet writes it
                continue
            if mark != "," and not is_header:
                row = [cell.replace(",", ".") if _DECIMAL_COMMA.fullmatch(cell) else cell for cell in row]
            is_header = False
            yield above + reader.line_num, row
    except csv.Error as error:
        raise line_error(path, above + reader.line_num, f"it is not CSV ({error})") from None


def column_of_cable(name: str) -> str:
    """Standard name of a column: `L0` becomes `length_0`, and `C0` becomes `count_0`."""
    found = _SHORT.fullmatch(name)
    return name if found is None else f"{_OF_CABLE[found[1]]}_{found[2]}"


def _factors(
    path: Path, line: int, header: list[str], units: Mapping[str, str], strangers: Mapping[str, str]
) -> dict[str, float | None]:
    """For each column name, the factor that converts its numbers to SI; None for a column without a unit."""
    factors: dict[str, float | None] = {}
    for cell in header:
        found = _COLUMN.fullmatch(cell)
        name, unit = (column_of_cable(found[1]), found[2]) if found else (cell, None)
        if name in strangers:
            raise line_error(path, line, f"unknown column {name!r}: {strangers[name]}")
        if name not in units:
            near = nearest(name, units)
            hint = f" (did you mean {near}?)" if near else " (a number, no name)" if plain_number(cell) else ""
            raise line_error(path, line, f"unknown column {name!r}{hint}; allowed: {', '.join(units)}")
        if name in factors:
            raise line_error(path, line, f"column {name} is given twice; allowed: once")
        factors[name] = None if unit is None else _factor(path, line, name, unit, units[name])
    return factors


def _factor(path: Path, line: int, name: str, unit: str, wanted: str) -> float:
    try:
        if unit.strip():
            return cast(float, in_si(f"1 {unit.strip()}", wanted, name))  # equal texts give equal numbers
    except InvalidValueError:
        pass
    allowed = f"a unit that converts to {wanted}" if wanted else "none"
    raise line_error(path, line, f"the unit of {name} is [{unit}]; allowed: {allowed}")


def _numbers(path: Path, line: int, row: list[str], names: tuple[str, ...], gaps: Collection[str]) -> list[float]:
    if row[0].lstrip().startswith("#"):
        raise line_error(path, line, "a comment; allowed: comments above the names of the columns")
    if len(row) != len(names):
        comma = ", and decimal points, or semicolons between the columns" if len(row) == 2 * len(names) else ""
        raise line_error(path, line, f"{len(row)} columns; allowed: {len(names)}, as in the header{comma}")
    if gaps:
        row = [cell if name not in gaps or cell.strip() else "nan" for name, cell in zip(names, row, strict=True)]
    if _PLAIN_ROW.fullmatch(",".join(row) + ","):
        with contextlib.suppress(ValueError):  # after an error, slower code searches the wrong cell
            return [float(cell) for cell in row]
    numbers = [plain_number(cell) for cell in row]
    if None in numbers:
        k = numbers.index(None)
        allowed = "a number with a point, not a comma" if _DECIMAL_COMMA.fullmatch(row[k]) else "a number"
        raise line_error(path, line, f"{names[k]} is {row[k].strip() or 'empty'}; allowed: {allowed}")
    return cast(list[float], numbers)


def line_error(path: Path, line: int, reason: str) -> FileError:
    """Create the FileError for the line with the number `line`."""
    found = FileError(path, f"line {line}: {reason}", f"Correct line {line}.", item=f"line {line}")
    found.value, _, found.allowed = reason.partition("; allowed: ")
    return found


# for each kind of columns: the other kind, and the next step for the user if the file has the other kind
_OTHERS: Final = {
    "length": ("count", "these are counts: add --counts"),
    "count": ("length", "these are lengths: omit --counts"),
}
UNITS = {"span": "m", "rise": "m", "length": "m", "tension": "N"}


def load_readings(
    file: os.PathLike[str] | str, kind: str, cable_count: int, size: float = np.inf
) -> tuple[Array | None, Array]:
    """Read a CSV file with one column per cable or encoder, and optionally the time; return times and readings."""
    # The times [s], shape (N,), are None if the file has no column of times. Readings have the shape (N, m). kind:
    # "length" for columns length_0, length_1, ... [m], or "count" for count_0, ...; `L0` is another name of `length_0`.
    # Units are in brackets, `time [s],length_0 [mm]`. cable_count: number of cables m of the robot; size: largest
    # extent of the robot [m]; lengths that are a hundred times larger must have another unit
    path = Path(file)
    names = names_of_cables(kind, cable_count)
    other, hint = _OTHERS[kind]
    units = {"time": "s", **dict.fromkeys(names, "m" if kind == "length" else "")}
    strangers = dict.fromkeys(names_of_cables(other, cable_count), hint)
    table = CsvTable(path, csv_rows(path, read_text(path, TABLE_LIMIT)), units, strangers)
    table.check_columns(names, f"; the robot has {cable_count} cables")
    table.check_rows()
    for name in names if kind == "length" else ():
        table.refuse(table.columns[name] <= 0.0, name, table.columns[name], "m", "> 0 m")
        table.refuse_millimeters(name, size, f"the robot's {size:.3g} m")
    time = table.columns.get("time")
    if time is not None:
        late = np.diff(time, prepend=-np.inf) <= 0.0
        table.refuse(late, "time", time, "s", "a time after the time of the previous row")
    return time, locked(np.stack([table.columns[name] for name in names], axis=-1))


def names_of_cables(kind: str, cable_count: int) -> list[str]:
    """Names of the columns of all cables: `length_0`, `length_1`, ..."""
    return [f"{kind}_{k}" for k in range(cable_count)]


class Measurements(NamedTuple):
    """n measurements of a cable."""

    span: Array  # horizontal distance of the ends [m], shape (n,)
    rise: Array  # height of the platform end above the frame end [m], shape (n,)
    unstrained_length: Array  # length measured by the encoder [m], shape (n,)
    tension: Array  # tension [N], shape (n,)


def load_measurements(file: os.PathLike[str] | str) -> Measurements:
    """Read a CSV file with the columns span, rise, length and tension, in any order.

    Units are in brackets, `span [m],rise [mm],length [m],tension [kN]`; the defaults are m and N.

    Args:
        file: The file.

    Returns:
        The four columns in SI units.

    Raises:
        FileError: If the file cannot be read, or a column or number is wrong; the message names the line.

    Examples:
        >>> import sagline as sl
        >>> sl.load_measurements("cable.csv")  # doctest: +SKIP
    """
    path = file_path(file)
    table = CsvTable(path, csv_rows(path, read_text(path, TABLE_LIMIT)), UNITS)
    table.check_columns(UNITS, f"; found: {', '.join(table.columns)}")
    for name, unit in UNITS.items():
        if name != "rise":
            table.refuse(table.columns[name] <= 0.0, name, table.columns[name], unit, f"> 0 {unit}")
    chord, length = np.hypot(table.columns["span"], table.columns["rise"]), table.columns["length"]
    table.refuse_millimeters("length", chord, "the distance of the ends")
    for name in ("span", "rise"):
        table.refuse_millimeters(name, length, "the cable")
    return Measurements(*(locked(table.columns[name]) for name in UNITS))
