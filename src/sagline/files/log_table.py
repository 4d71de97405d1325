"""The columns of a log in CSV: readings of encoders, load cells and a measuring system, and commanded poses."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline.calibration.log import WinchLog
from sagline.core.arrays import Array, locked
from sagline.files.path_table import EULER, QUATERNION, QUATERNION_TOLERANCE
from sagline.files.table import Table, line_error
from sagline.robot.pose import Pose

XYZ: Final = ("x", "y", "z")
COMMANDED: Final = "_commanded"
_MOST: Final = 1000  # cables
_OF_CABLE: Final = {"count": "", "length": "m", "load_cell": "N"}  # and their units
_NUMBERED = re.compile(rf"\s*(count|length)_([0-9]{{1,{len(str(_MOST))}}})\s*(?:\[.*\])?\s*")


def log_fields(path: Path, text: str) -> dict[str, Any]:
    """The fields of a log, but for its sensors, from the text of a table.

    Args:
        path: The file, for messages.
        text: What is in it.

    Returns:
        Name and value of each field.

    Raises:
        FileError: If a column or a number is wrong; the message names the line.
    """
    return _fields(*_read(path, text))


def _read(path: Path, text: str) -> tuple[Table, int]:
    """The table, and of how many cables it is."""
    header = next((line for line in text.split("\n") if line.strip()), "")
    found = [_NUMBERED.fullmatch(cell) for cell in header.replace('"', "").split(",")]
    cables = max((min(int(match[2]), _MOST - 1) + 1 for match in found if match), default=1)
    optional_units = {f"load_cell_{k}": "N" for k in range(cables)}
    optional_units |= dict.fromkeys(XYZ, "m") | dict.fromkeys(EULER, "rad") | dict.fromkeys(QUATERNION, "")
    readings = {f"{kind}_{k}": _OF_CABLE[kind] for kind in ("count", "length") for k in range(cables)}
    commanded = {name + COMMANDED: unit for name, unit in optional_units.items() if not name.startswith("load_cell")}
    units = {"time": "s", **readings, **optional_units, **commanded}
    strangers = {f"C{k}": f"counts are called count_{k}" for k in range(cables)}
    strangers |= {f"L{k}": f"lengths are called length_{k}" for k in range(cables)}
    table = Table.read(path, text, units, strangers, frozenset((*readings, *optional_units)))
    kinds = [kind for kind in ("count", "length") if any(name in table.columns for name in _names(kind, cables))]
    if len(kinds) != 1:
        what = "columns of counts and of lengths" if kinds else "neither columns count_0, ... nor length_0, ..."
        raise line_error(path, table.header, f"{what}; allowed: one of the two")
    if missing := [name for name in _names(kinds[0], cables) if name not in table.columns]:
        shown = ", ".join(missing[:3]) + (", ..." if len(missing) > 3 else "")
        raise line_error(path, table.header, f"missing column {shown}; the last is {kinds[0]}_{cables - 1}")
    if not table.lines:
        raise line_error(path, table.header, "no rows below the columns' names; allowed: at least one")
    return table, cables


def _names(kind: str, cables: int) -> list[str]:
    return [f"{kind}_{k}" for k in range(cables)]


def _fields(table: Table, cables: int) -> dict[str, Any]:
    """Fields of the log but for its sensors."""
    columns = table.columns
    for name in _names("length", cables):
        if name in columns:
            table.refuse(columns[name] < 0.0, name, columns[name], "m", ">= 0 m")
    position = _chosen(table, XYZ, all_of_them=False)
    return {
        "counts": _chosen(table, _names("count", cables)),
        "unstrained_length": _chosen(table, _names("length", cables)),
        "load_cells": _chosen(table, _names("load_cell", cables), all_of_them=False),
        "position": position,
        "rotation": _rotation(table, ""),
        "time": columns.get("time"),
        "commanded": _commanded(table),
    }


def _chosen(table: Table, names: Iterable[str], *, all_of_them: bool = True) -> Array | None:
    """Columns side by side, NaN for those that are missing; None where all are."""
    names = list(names)
    found = [name for name in names if name in table.columns]
    if not found:
        return None
    if all_of_them and (missing := [name for name in names if name not in found]):
        raise line_error(table.path, table.header, f"missing column {', '.join(missing)} beside {', '.join(found)}")
    none = np.full(len(table.lines), np.nan)
    return locked(np.stack([table.columns.get(name, none) for name in names], axis=-1))


def _rotation(table: Table, suffix: str) -> Array | None:
    """Rotations as unit quaternions, rows of NaN where there is none."""
    angles = _chosen(table, [name + suffix for name in EULER])
    quaternion = _chosen(table, [name + suffix for name in QUATERNION])
    if angles is not None and quaternion is not None:
        way = f"columns alpha{suffix} beside qx{suffix}; allowed: one way"
        raise line_error(table.path, table.header, way)
    given = angles if angles is not None else quaternion
    if given is None:
        return None
    missing = np.isnan(given)
    part = missing.any(axis=1) & ~missing.all(axis=1)
    names = ", ".join(name + suffix for name in (EULER if quaternion is None else QUATERNION))
    table.refuse(np.asarray(part), f"one of {names}", np.full(len(given), np.nan), "", "all of them, or blanks in all")
    known = ~missing.all(axis=1)
    found = np.full((len(given), 4), np.nan)
    if quaternion is None:
        found[known] = Pose.from_euler(np.zeros(3), *given[known].T).quaternion
        return found
    length = np.linalg.norm(np.where(missing, 0.5, given), axis=1)
    wrong = np.abs(length - 1.0) > QUATERNION_TOLERANCE
    table.refuse(wrong, f"the length of {names}", length, "", f"1 to {QUATERNION_TOLERANCE:g}")
    found[known] = given[known] / length[known, None]
    return found


def _commanded(table: Table) -> Pose | None:
    position = _chosen(table, [name + COMMANDED for name in XYZ])
    rotation = _rotation(table, COMMANDED)
    if position is None:
        if rotation is not None:
            raise line_error(table.path, table.header, f"missing column x{COMMANDED} beside commanded rotations")
        return None
    if rotation is None:
        return Pose.from_euler(position, 0.0, 0.0, 0.0)
    return Pose.from_quaternion(position, rotation)


def log_columns(log: WinchLog) -> Iterator[tuple[str, Array]]:
    """The columns from which `log_fields` has the same fields.

    Args:
        log: The log.

    Yields:
        Names with units, and the numbers, shape (N,).
    """
    m = log.readings.shape[1]
    if log.time is not None:
        yield "time [s]", log.time
    pairs: list[tuple[Iterable[str], str, Array | None]] = [
        (_names("count", m), "", log.counts),
        (_names("length", m), " [m]", log.unstrained_length),
        (_names("load_cell", m), " [N]", log.load_cells),
        (XYZ, " [m]", log.position),
        (QUATERNION, "", log.rotation),
    ]
    if log.commanded is not None:
        pairs.append(([name + COMMANDED for name in XYZ], " [m]", log.commanded.position))
        pairs.append(([name + COMMANDED for name in QUATERNION], "", log.commanded.quaternion))
    for names, unit, values in pairs:
        if values is not None:
            yield from ((f"{name}{unit}", column) for name, column in zip(names, values.T, strict=True))
