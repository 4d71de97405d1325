"""Measured lengths in CSV: one row a sample, one column a cable."""

from __future__ import annotations

import os
from pathlib import Path
from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, locked
from sagline.files.table import TABLE_LIMIT, Table, line_error
from sagline.files.text import read_text


class Lengths(NamedTuple):
    """N samples of the unstrained lengths of m cables.

    Attributes:
        time: [s], shape (N,); None where the file has none.
        unstrained_length: [m], shape (N, m).
    """

    time: Array | None
    unstrained_length: Array


def load_lengths(file: os.PathLike[str] | str, cable_count: int, size: float = np.inf) -> Lengths:
    """Read a CSV file with a column for each cable, L0, L1, ..., and perhaps the time.

    Units stand in brackets, `time [s],L0 [mm],L1 [mm]`; without, they are s and m.

    Args:
        file: The file.
        cable_count: Number of cables m of the robot.
        size: Largest extent of the robot [m]; lengths a hundred times longer must have another unit.

    Returns:
        Times, if there are any, and lengths in SI.

    Raises:
        FileError: If it cannot be read, a column is missing or unknown, a length is not positive or in
            millimeters without saying so, or the times do not increase; the message names the line.
    """
    path = Path(file)
    names = [f"L{k}" for k in range(cable_count)]
    table = Table.read(path, read_text(path, TABLE_LIMIT), {"time": "s", **dict.fromkeys(names, "m")})
    if missing := [name for name in names if name not in table.columns]:
        raise line_error(path, table.header, f"missing column {', '.join(missing)}; the robot has {cable_count} cables")
    if not table.lines:
        raise line_error(path, table.header, "no rows below the columns' names; allowed: at least one")
    for name in names:
        table.refuse(table.columns[name] <= 0.0, name, table.columns[name], "m", "> 0 m")
        table.refuse_millimeters(name, size, f"the robot's {size:.3g} m")
    time = table.columns.get("time")
    if time is not None:
        late = np.diff(time, prepend=-np.inf) <= 0.0
        table.refuse(late, "time", time, "s", "a time after that of the row before")
    return Lengths(time, locked(np.stack([table.columns[name] for name in names], axis=-1)))
