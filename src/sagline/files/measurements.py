"""Measurements in CSV: lengths or counts of all cables; or span, rise, length and tension of one cable."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from sagline.core.arguments import file_path
from sagline.core.arrays import Array, locked
from sagline.files.reading import read_text
from sagline.files.table import TABLE_LIMIT, CsvTable

# for each kind of column: name of the other kind, and the next step if the file has that kind
_OTHERS: Final = {
    "length": ("count", "these are counts: add --counts"),
    "count": ("length", "these are lengths: omit --counts"),
}
UNITS = {"span": "m", "rise": "m", "length": "m", "tension": "N"}


class LengthSamples(NamedTuple):
    """N samples of the unstrained lengths of m cables."""

    time: Array | None  # times [s], shape (N,); None if the file has no times
    unstrained_length: Array  # lengths [m], shape (N, m)


class CountSamples(NamedTuple):
    """N samples of the counts of m encoders."""

    time: Array | None  # times [s], shape (N,); None if the file has no times
    counts: Array  # counts, shape (N, m)


def load_lengths(file: os.PathLike[str] | str, cable_count: int, size: float = np.inf) -> LengthSamples:
    """Read a CSV file with one column per cable, length_0, length_1, ..., and optionally the time."""
    # Units are in brackets, `time [s],length_0 [mm],length_1 [mm]`; the defaults are s and m. `L0` is another name of
    # `length_0`. cable_count: number of cables m of the robot; size: largest extent of the robot [m]; lengths that are
    # a hundred times larger must have another unit
    table, names = _read(file, "length", "m", cable_count)
    for name in names:
        table.refuse(table.columns[name] <= 0.0, name, table.columns[name], "m", "> 0 m")
        table.refuse_millimeters(name, size, f"the robot's {size:.3g} m")
    return LengthSamples(*_samples(table, names))


def load_counts(file: os.PathLike[str] | str, cable_count: int) -> CountSamples:
    """Read a CSV file with one column per encoder, count_0, count_1, ..., and optionally the time."""
    # The result has times [s] (None if the file has no times) and counts
    return CountSamples(*_samples(*_read(file, "count", "", cable_count)))


def _read(file: os.PathLike[str] | str, kind: str, unit: str, cable_count: int) -> tuple[CsvTable, list[str]]:
    """Read a table with one column per cable; return it with the names of these columns."""
    path = Path(file)
    names = _columns(kind, cable_count)
    other, hint = _OTHERS[kind]
    units, strangers = {"time": "s", **dict.fromkeys(names, unit)}, dict.fromkeys(_columns(other, cable_count), hint)
    table = CsvTable.read(path, read_text(path, TABLE_LIMIT), units, strangers)
    table.check_columns(names, f"; the robot has {cable_count} cables")
    table.check_rows()
    return table, names


def _columns(kind: str, cable_count: int) -> list[str]:
    return [f"{kind}_{k}" for k in range(cable_count)]


def _samples(table: CsvTable, names: list[str]) -> tuple[Array | None, Array]:
    """Times, and values with one row for each sample."""
    time = table.columns.get("time")
    if time is not None:
        late = np.diff(time, prepend=-np.inf) <= 0.0
        table.refuse(late, "time", time, "s", "a time after the time of the previous row")
    return time, locked(np.stack([table.columns[name] for name in names], axis=-1))


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
    table = CsvTable.read(path, read_text(path, TABLE_LIMIT), UNITS)
    table.check_columns(UNITS, f"; found: {', '.join(table.columns)}")
    for name, unit in UNITS.items():
        if name != "rise":
            table.refuse(table.columns[name] <= 0.0, name, table.columns[name], unit, f"> 0 {unit}")
    chord, length = np.hypot(table.columns["span"], table.columns["rise"]), table.columns["length"]
    table.refuse_millimeters("length", chord, "the distance of the ends")
    for name in ("span", "rise"):
        table.refuse_millimeters(name, length, "the cable")
    return Measurements(*(locked(table.columns[name]) for name in UNITS))
