"""Tables of numbers in CSV, with units in the header."""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path as FilePath
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array
from sagline.errors import FileError, InvalidValueError
from sagline.files.quantity import in_si

_COLUMN = re.compile(r"\s*(\w+)\s*(?:\[(.*)\])?\s*")  # name, or name [unit]


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """Columns of numbers in SI.

    Attributes:
        path: The file, for messages.
        columns: Name and numbers of each column, shape (rows,).
        lines: Line of each row in the file, from 1.
        header: Line of the columns' names.
    """

    path: FilePath
    columns: dict[str, Array]
    lines: array[int]
    header: int

    @classmethod
    def read(cls, path: FilePath, text: str, units: Mapping[str, str]) -> Table:
        """Read a CSV text whose first row names its columns, `name` or `name [unit]`.

        Args:
            path: The file, for messages.
            text: What is in it.
            units: The columns it may have, and the SI unit of each.

        Returns:
            The table, all its numbers finite.

        Raises:
            FileError: If it is no such text; the message names the line.
        """
        reader = csv.reader(io.StringIO(text), strict=True)
        factors: dict[str, float] = {}
        numbers, lines, header = array("d"), array("q"), 0
        try:
            for row in reader:
                if not "".join(row).strip():  # a blank line, or the bare commas of a spreadsheet
                    continue
                if not factors:
                    factors, header = _factors(path, reader.line_num, row, units), reader.line_num
                else:
                    numbers.extend(_numbers(path, reader.line_num, row, tuple(factors)))
                    lines.append(reader.line_num)
        except csv.Error as error:
            raise line_error(path, reader.line_num, f"it is no CSV ({error})") from None
        if not factors:
            raise FileError(path, f"no columns; allowed: {', '.join(units)}", "Give the names of the columns first.")
        values = np.array(numbers).reshape(len(lines), len(factors))
        table = cls(
            path, {name: values[:, k] * factor for k, (name, factor) in enumerate(factors.items())}, lines, header
        )
        for name, column in table.columns.items():
            table.refuse(~np.isfinite(column), name, column, units[name], "a finite number")
        return table

    def refuse(self, wrong: NDArray[np.bool_], item: str, values: Array, unit: str, allowed: str) -> None:
        """Refuse the first row that is wrong.

        Args:
            wrong: Which rows are wrong, shape (rows,).
            item: What is wrong in them, for the message.
            values: Its values, shape (rows,).
            unit: Their unit; "" for none.
            allowed: What would do.

        Raises:
            FileError: If a row is wrong; it names the line.
        """
        if wrong.any():
            k = int(np.argmax(wrong))
            value = f"{values[k]:.12g} {unit}".rstrip()
            raise line_error(self.path, self.lines[k], f"{item} is {value}; allowed: {allowed}")


def _factors(path: FilePath, line: int, header: list[str], units: Mapping[str, str]) -> dict[str, float]:
    """Column names, and what to multiply their numbers by to have them in SI."""
    factors: dict[str, float] = {}
    for cell in header:
        found = _COLUMN.fullmatch(cell)
        name, unit = (found[1], found[2]) if found else (cell, None)
        if name not in units:
            nearest = get_close_matches(name, units, n=1)
            hint = f" (did you mean {nearest[0]}?)" if nearest else ""
            raise line_error(path, line, f"unknown column {name!r}{hint}; allowed: {', '.join(units)}")
        if name in factors:
            raise line_error(path, line, f"column {name} is there twice; allowed: once")
        factors[name] = 1.0 if unit is None else _factor(path, line, name, unit, units[name])
    return factors


def _factor(path: FilePath, line: int, name: str, unit: str, wanted: str) -> float:
    try:
        return cast(float, in_si(f"1 {unit}", wanted, name))  # of one text, so no list
    except InvalidValueError:
        allowed = f"a unit that converts to {wanted}" if wanted else "none"
        raise line_error(path, line, f"the unit of {name} is [{unit}]; allowed: {allowed}") from None


def _numbers(path: FilePath, line: int, row: list[str], names: tuple[str, ...]) -> list[float]:
    if len(row) != len(names):
        raise line_error(path, line, f"{len(row)} columns; allowed: {len(names)}, as in the header")
    try:
        return [float(cell) for cell in row]
    except ValueError:
        name, cell = next((name, cell) for name, cell in zip(names, row, strict=True) if not _is_number(cell))
        raise line_error(path, line, f"{name} is {cell.strip() or 'empty'}; allowed: a number") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return True


def line_error(path: FilePath, line: int, reason: str) -> FileError:
    """An error that names the line.

    Args:
        path: The file.
        line: The line, from 1.
        reason: What is wrong with it, and what is allowed.

    Returns:
        The error, to be raised.
    """
    return FileError(path, f"line {line}: {reason}", f"Correct line {line}.")
