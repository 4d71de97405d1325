"""Measurements of one cable in CSV: where its ends are, how long it is, how hard it pulls."""

from __future__ import annotations

import os
from typing import NamedTuple

import numpy as np

from sagline.core.arguments import file_path
from sagline.core.arrays import Array, locked
from sagline.files.table import TABLE_LIMIT, Table, line_error
from sagline.files.text import read_text

UNITS = {"span": "m", "rise": "m", "length": "m", "tension": "N"}


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

    Returns:
        The four columns in SI.

    Raises:
        FileError: If it cannot be read, or a column or number is wrong; the message names the line.
    """
    path = file_path(file)
    table = Table.read(path, read_text(path, TABLE_LIMIT), UNITS)
    if missing := [name for name in UNITS if name not in table.columns]:
        raise line_error(path, table.header, f"missing column {', '.join(missing)}; found: {', '.join(table.columns)}")
    for name, unit in UNITS.items():
        if name != "rise":
            table.refuse(table.columns[name] <= 0.0, name, table.columns[name], unit, f"> 0 {unit}")
    chord, length = np.hypot(table.columns["span"], table.columns["rise"]), table.columns["length"]
    table.refuse_millimeters("length", chord, "the distance of the ends")
    for name in ("span", "rise"):
        table.refuse_millimeters(name, length, "the cable")
    return Measurements(*(locked(table.columns[name]) for name in UNITS))
