"""Measurements of one cable in CSV: where its ends are, how long it is, how hard it pulls."""

from __future__ import annotations

import csv
import os
import re
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np

from sagline.arrays import Array, locked
from sagline.errors import FileError, InvalidValueError
from sagline.files.quantity import in_si
from sagline.files.text import read_text

UNITS = {"span": "m", "rise": "m", "length": "m", "tension": "N"}

_column = re.compile(r"\s*(\w+)\s*(?:\[(.*)\])?\s*")  # name, or name [unit]


class Measurements(NamedTuple):
    """n measurements of a cable.

    Attributes:
        span: Horizontal distance of the ends [m], shape (n,).
        rise: Height of the platform end above the frame end [m], shape (n,).
        unstrained_length: As an encoder counts it [m], shape (n,).
        tension: [N], shape (n,).
    """

    span: Array
    rise: Array
    unstrained_length: Array
    tension: Array


def load_measurements(file: os.PathLike[str] | str) -> Measurements:
    """Read a CSV file with the columns span, rise, length and tension, in any order.

    Units stand in brackets, `span [m],rise [mm],length [m],tension [kN]`; without, they are m and N.

    Args:
        file: The file.

    Raises:
        FileError: If it cannot be read, or a column or number is wrong; the message names the line.
    """
    path = Path(file)
    rows = [(k, row) for k, row in enumerate(csv.reader(read_text(path).splitlines()), start=1) if "".join(row).strip()]
    if not rows:
        raise FileError(path, "is empty", f"Give the columns {', '.join(UNITS)}.")
    factors = _factors(path, rows[0][1])
    numbers = [[_number(path, line, row, column, factors) for column in range(len(factors))] for line, row in rows[1:]]
    table = np.array(numbers, dtype=np.float64).reshape(-1, len(factors))
    names = list(factors)
    return Measurements(*(locked(table[:, names.index(name)] * factors[name]) for name in UNITS))


def _factors(path: Path, header: list[str]) -> dict[str, float]:
    """Column names, and what to multiply their numbers by to have them in SI."""
    factors: dict[str, float] = {}
    for cell in header:
        found = _column.fullmatch(cell)
        name, unit = (found[1].lower(), found[2]) if found else (cell, None)
        if name not in UNITS or name in factors:
            raise FileError(path, f"line 1: column {name!r}", f"Give each of {', '.join(UNITS)} once, and no other.")
        try:
            factors[name] = 1.0 if unit is None else cast(float, in_si(f"1 {unit}", UNITS[name], name))
        except InvalidValueError:
            step = f"Give a unit that converts to {UNITS[name]}."
            raise FileError(path, f"line 1: the unit of {name} is [{unit}]", step) from None
    if missing := [name for name in UNITS if name not in factors]:
        raise FileError(path, f"line 1: missing column {', '.join(missing)}", "Add it.")
    return factors


def _number(path: Path, line: int, row: list[str], column: int, factors: dict[str, float]) -> float:
    if len(row) != len(factors):
        raise FileError(path, f"line {line}: {len(row)} columns; allowed: {len(factors)}", f"Correct line {line}.")
    try:
        value = float(row[column])
    except ValueError:
        value = float("nan")
    name = list(factors)[column]
    if not np.isfinite(value) or (name != "rise" and value <= 0.0):
        allowed = "a finite number" if name == "rise" else "a number > 0"
        raise FileError(
            path,
            f"line {line}: {name} is {row[column].strip() or 'empty'}; allowed: {allowed}",
            f"Correct line {line}.",
        )
    return value
