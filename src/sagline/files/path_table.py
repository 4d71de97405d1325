"""Paths sampled in CSV: one row for each time, with the position and, if it changes, the orientation."""

from __future__ import annotations

import csv
import io
import re
from array import array
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path as FilePath
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array
from sagline.errors import FileError, InvalidValueError
from sagline.files.quantity import in_si
from sagline.motion.path import Path
from sagline.motion.sampled import path_from_samples
from sagline.robot.pose import Pose

PLACE = ("time", "x", "y", "z")
EULER = ("alpha", "beta", "gamma")
QUATERNION = ("qx", "qy", "qz", "qw")
UNITS = dict(zip(PLACE + EULER + QUATERNION, ("s", "m", "m", "m", "rad", "rad", "rad", "", "", "", ""), strict=True))
QUATERNION_TOLERANCE = 1e-3  # of a length 1, printed with three decimals; more is a mistake

_COLUMN = re.compile(r"\s*(\w+)\s*(?:\[(.*)\])?\s*")  # name, or name [unit]


def path_from_table(path: FilePath, text: str) -> Path:
    """The path of a CSV text; `path` is for messages.

    Raises:
        FileError: If a column, row or number is wrong; it names the line.
        InvalidValueError: If the samples are no path for a reason that is no single line's.
    """
    table = _Table.read(path, text)
    time, *place = (table.columns[name] for name in PLACE)
    late = np.diff(time, prepend=-np.inf) <= 0.0
    table.refuse(late, "time", time, "s", "a time after that of the row before")
    if time.size < 2:
        raise FileError(path, f"number of samples {time.size}; allowed: at least two", "Add the samples of the path.")
    position = np.stack(place, axis=-1)
    if "alpha" in table.columns:
        return path_from_samples(time, Pose.from_euler(position, *(table.columns[name] for name in EULER)))
    if "qx" not in table.columns:
        return path_from_samples(time, Pose.from_euler(position, 0.0, 0.0, 0.0))
    quaternion = np.stack([table.columns[name] for name in QUATERNION], axis=-1)
    length = np.linalg.norm(quaternion, axis=1)
    wrong = np.abs(length - 1.0) > QUATERNION_TOLERANCE
    table.refuse(wrong, "the length of qx, qy, qz, qw", length, "", f"1 to {QUATERNION_TOLERANCE:g}")
    return path_from_samples(time, Pose.from_quaternion(position, quaternion / length[:, np.newaxis]))


@dataclass(frozen=True, slots=True, eq=False)
class _Table:
    """Columns of numbers in SI.

    Attributes:
        path: The file, for messages.
        columns: Name and numbers of each column, shape (rows,).
        lines: Line of each row in the file, from 1.
    """

    path: FilePath
    columns: dict[str, Array]
    lines: array[int]

    @classmethod
    def read(cls, path: FilePath, text: str) -> _Table:
        reader = csv.reader(io.StringIO(text), strict=True)
        factors: dict[str, float] = {}
        numbers, lines = array("d"), array("q")
        try:
            for row in reader:
                if not "".join(row).strip():  # a blank line, or the bare commas of a spreadsheet
                    continue
                if not factors:
                    factors = _factors(path, reader.line_num, row)
                else:
                    numbers.extend(_numbers(path, reader.line_num, row, tuple(factors)))
                    lines.append(reader.line_num)
        except csv.Error as error:
            raise _line_error(path, reader.line_num, f"it is no CSV ({error})") from None
        if not factors:
            raise FileError(path, f"no columns; allowed: {', '.join(UNITS)}", "Give the names of the columns first.")
        values = np.array(numbers).reshape(len(lines), len(factors))
        table = cls(path, {name: values[:, k] * factor for k, (name, factor) in enumerate(factors.items())}, lines)
        for name, column in table.columns.items():
            table.refuse(~np.isfinite(column), name, column, UNITS[name], "a finite number")
        return table

    def refuse(self, wrong: NDArray[np.bool_], item: str, values: Array, unit: str, allowed: str) -> None:
        """Raise a FileError for the first row that is wrong."""
        if wrong.any():
            k = int(np.argmax(wrong))
            value = f"{values[k]:.12g} {unit}".rstrip()
            raise _line_error(self.path, self.lines[k], f"{item} is {value}; allowed: {allowed}")


def _factors(path: FilePath, line: int, header: list[str]) -> dict[str, float]:
    """Column names, and what to multiply their numbers by to have them in SI."""
    factors: dict[str, float] = {}
    for cell in header:
        found = _COLUMN.fullmatch(cell)
        name, unit = (found[1], found[2]) if found else (cell, None)
        if name not in UNITS:
            nearest = get_close_matches(name, UNITS, n=1)
            hint = f" (did you mean {nearest[0]}?)" if nearest else ""
            raise _line_error(path, line, f"unknown column {name!r}{hint}; allowed: {', '.join(UNITS)}")
        if name in factors:
            raise _line_error(path, line, f"column {name} is there twice; allowed: once")
        factors[name] = 1.0 if unit is None else _factor(path, line, name, unit)
    orientation = factors.keys() & set(EULER + QUATERNION)
    wanted = PLACE + next((way for way in (EULER, QUATERNION) if orientation & set(way)), ())
    if missing := [name for name in wanted if name not in factors]:
        raise _line_error(path, line, f"missing column {', '.join(missing)}; found: {', '.join(factors)}")
    if surplus := factors.keys() - set(wanted):
        raise _line_error(
            path, line, f"columns {', '.join(sorted(surplus))} beside {', '.join(EULER)}; allowed: one way"
        )
    return factors


def _factor(path: FilePath, line: int, name: str, unit: str) -> float:
    try:
        return cast(float, in_si(f"1 {unit}", UNITS[name], name))  # of one text, so no list
    except InvalidValueError:
        allowed = f"a unit that converts to {UNITS[name]}" if UNITS[name] else "none"
        raise _line_error(path, line, f"the unit of {name} is [{unit}]; allowed: {allowed}") from None


def _numbers(path: FilePath, line: int, row: list[str], names: tuple[str, ...]) -> list[float]:
    if len(row) != len(names):
        raise _line_error(path, line, f"{len(row)} columns; allowed: {len(names)}, as in the header")
    try:
        return [float(cell) for cell in row]
    except ValueError:
        name, cell = next((name, cell) for name, cell in zip(names, row, strict=True) if not _is_number(cell))
        raise _line_error(path, line, f"{name} is {cell.strip() or 'empty'}; allowed: a number") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def _line_error(path: FilePath, line: int, reason: str) -> FileError:
    return FileError(path, f"line {line}: {reason}", f"Correct line {line}.")
