"""Logs of other programs: a map of columns converts a CSV, .npz or .mat file to the rows of a log."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Iterator, Mapping
from itertools import chain
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from pydantic import model_validator

from sagline.core.errors import FileError, did_you_mean
from sagline.files.quantity import plain_number
from sagline.files.reading import read_bytes
from sagline.files.table import TABLE_LIMIT, CsvRow, commented_rows, line_error
from sagline.files.yaml_text import YamlEntry

ARRAYS: Final = (".npz", ".mat")  # files with arrays; their rows have the line numbers from 2
_OF_CABLES: Final = ("length", "count", "load_cell", "swivel")  # keys for one column of the file per cable
_VECTORS: Final = {"position": ("x", "y", "z"), "quaternion": ("qx", "qy", "qz", "qw")}  # keys for matrices
_POSE: Final = ("pose", "time")  # columns that number the poses of a table with one row per cable
_WITH_UNIT: Final = re.compile(r"(.*?)\s*\[(.*)\]")
_CORRECT: Final = "Correct the map of columns."


class ColumnEntry(YamlEntry):
    """Column of a file that becomes a column of the log, or one column of the log per cable."""

    name: str  # name in the file; {} is replaced by the number of the cable
    unit: str = ""  # unit of the scaled values; "" for the unit in the header of the file, or SI
    scale: int | float = 1  # factor of the values in the file; a negative factor changes the sign
    cables: list[int] | None = None  # for each cable of the robot: its number in the file

    @model_validator(mode="before")
    @classmethod
    def _accept_name(cls, data: object) -> object:
        return {"name": data} if isinstance(data, str) else data


class _Source(NamedTuple):
    """Columns of a file."""

    cells: dict[str, list[str]]  # texts of each column; column k of a matrix is "name[k]"
    units: dict[str, str]  # units in the header
    lines: list[int]  # line number of each row
    header: int  # line number of the header
    comments: list[str]  # lines above the header


def log_rows(path: Path, columns: Mapping[str, ColumnEntry] | None) -> tuple[list[str], Iterator[CsvRow]]:
    """Comments and rows of a log from a file of another form. None: the names in the file are those of a log."""
    source = _read_arrays(path) if path.suffix.lower() in ARRAYS else _read_csv(path)
    if columns is None:
        columns = {
            name: ColumnEntry(name=name) for name in dict.fromkeys(name.partition("[")[0] for name in source.cells)
        }
    numbers = None
    if "cable" in columns:
        source, numbers = _one_row_per_pose(path, source, columns)
    table: dict[str, list[str]] = {}
    for key, entry in columns.items():
        for name, column in _pairs(path, key, entry, source, numbers):
            if column not in source.cells:
                shown = ", ".join(list(source.cells)[:12])
                step = did_you_mean(column, source.cells, f"The file has: {shown}.")
                raise FileError(path, f"has no column {column!r}", step, item=f"columns.{key}")
            unit = entry.unit or source.units.get(column, "")
            table[f"{name} [{unit}]" if unit else name] = _scaled(source.cells[column], entry.scale)
    if len({*map(len, table.values())}) > 1:
        sizes = ", ".join(f"{name} {len(column)}" for name, column in table.items())
        raise FileError(path, f"has columns of different lengths: {sizes}", _CORRECT, item="columns")
    rows = chain(
        [(source.header, list(table))], zip(source.lines, map(list, zip(*table.values(), strict=True)), strict=False)
    )
    return source.comments, ((line, row) for line, row in rows if "".join(row).strip())


def _pairs(
    path: Path, key: str, entry: ColumnEntry, source: _Source, numbers: list[int] | None
) -> Iterator[tuple[str, str]]:
    """Names in the log and in the file for one key of the map. `numbers`: cables of a table with one row per cable."""
    if key in ("cable", "pose"):
        return
    if key in _VECTORS:
        yield from ((name, f"{entry.name}[{k}]") for k, name in enumerate(_VECTORS[key]))
    elif key in _OF_CABLES:
        pattern = entry.name if "{}" in entry.name else f"{entry.name}[{{}}]"
        cables = entry.cables or numbers
        if cables is None:
            cables = [k for k in range(len(source.cells)) if pattern.replace("{}", str(k)) in source.cells]
        if not cables:
            reason = f"has no column {pattern.replace('{}', '0')!r}"
            raise FileError(path, reason, "Give the numbers, such as cables: [1, 2, 3, 4].", item=f"columns.{key}")
        yield from ((f"{key}_{k}", pattern.replace("{}", str(cable))) for k, cable in enumerate(cables))
    else:
        yield key, entry.name


def _scaled(cells: list[str], scale: float) -> list[str]:
    """Texts of the scaled numbers; blanks and texts that are not numbers stay."""
    if scale == 1:
        return cells
    numbers = map(plain_number, cells)
    return [cell if x is None or math.isnan(x) else repr(scale * x) for cell, x in zip(cells, numbers, strict=True)]


def _read_csv(path: Path) -> _Source:
    """Columns of a CSV file; the comments above the header stay."""
    comments, found_rows = commented_rows(path)
    header, rows, numbers = 0, [], []
    names: list[str] = []
    units: dict[str, str] = {}
    for line, row in found_rows:
        if not names:
            header = line
            for cell in row:
                found = _WITH_UNIT.fullmatch(cell.strip())
                names.append(found[1] if found else cell.strip())
                units |= {found[1]: found[2]} if found else {}
        elif len(row) != len(names):
            raise line_error(path, line, f"{len(row)} columns; allowed: {len(names)}, as in the header")
        else:
            rows.append(row)
            numbers.append(line)
    if not rows:
        raise FileError(path, "has no rows", "Check that this is the file you mean.", item="columns")
    cells = {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True)}
    return _Source(cells, units, numbers, header, comments)


def _read_arrays(path: Path) -> _Source:
    """Vectors and matrices of numbers in an .npz or .mat file; the parts of a MATLAB structure are "structure.part"."""
    data = io.BytesIO(read_bytes(path, TABLE_LIMIT))
    step = "Check that this is the file you mean."
    try:
        if path.suffix.lower() == ".npz":
            with np.load(data, allow_pickle=False) as file:
                arrays = dict(file)
        else:
            from scipy.io import loadmat

            arrays = dict(_parts("", loadmat(data, squeeze_me=True, struct_as_record=False)))
    except NotImplementedError:
        raise FileError(path, "is a MATLAB file of version 7.3", "Save it with the option '-v7'.") from None
    except Exception as error:  # numpy and scipy have no common error class for a damaged file
        kind = f"an {path.suffix}" if path.suffix.lower() == ".npz" else f"a {path.suffix}"
        raise FileError(path, f"is not {kind} file that can be read", step) from error
    cells = {}
    for name, array in arrays.items():
        values = np.asarray(array)
        if values.dtype.kind in "biuf" and values.ndim in (1, 2):
            matrix = values if values.ndim == 2 and 1 not in values.shape else values.reshape(-1, 1)
            for k, column in enumerate(matrix.T.astype(float).tolist()):
                cells[f"{name}[{k}]" if matrix.shape[1] > 1 else name] = ["" if x != x else repr(x) for x in column]
    if not cells:
        raise FileError(path, "has no array of numbers", step)
    return _Source(cells, {}, list(range(2, 2 + max(map(len, cells.values())))), 1, [])


def _parts(name: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Arrays of MATLAB variables by name, without the variables of the file format."""
    found = value if isinstance(value, dict) else getattr(value, "__dict__", None)
    if found is None:
        yield name, value
        return
    for key, part in found.items():
        if not key.startswith("_"):
            yield from _parts(f"{name}.{key}" if name else key, part)


def _one_row_per_pose(path: Path, source: _Source, columns: Mapping[str, ColumnEntry]) -> tuple[_Source, list[int]]:
    """Table with one row per pose from a table with one row per cable, and the numbers of the cables."""
    key = next((name for name in _POSE if name in columns), None)
    if key is None:
        step = "Add the column that is equal in all rows of a pose: pose or time."
        raise FileError(path, "has one row per cable, but the map has no pose", step, item="columns.pose")
    names = [columns[name].name for name in ("cable", key)]
    for name in names:
        if name not in source.cells:
            step = f"The file has: {', '.join(source.cells)}."
            raise FileError(path, f"has no column {name!r}", step, item="columns")
    poses: dict[str, dict[int, int]] = {}  # for each pose: row of each cable
    for row, (cable, pose) in enumerate(zip(*(source.cells[name] for name in names), strict=True)):
        number = plain_number(cable)
        if number is None or number != round(number):
            raise line_error(path, source.lines[row], f"{names[0]} is {cable or 'empty'}; allowed: a whole number")
        if poses.setdefault(pose, {}).setdefault(round(number), row) != row:
            raise line_error(path, source.lines[row], f"cable {number:g} is given twice; allowed: once per {key}")
    numbers = columns["cable"].cables or sorted({number for rows in poses.values() for number in rows})
    first = [next(iter(rows.values())) for rows in poses.values()]
    cells = {name: [column[row] for row in first] for name, column in source.cells.items()}
    for name, column in source.cells.items():
        for number in numbers:
            cells[f"{name}[{number}]"] = [column[rows[number]] if number in rows else "" for rows in poses.values()]
    units = source.units | {f"{name}[{number}]": unit for name, unit in source.units.items() for number in numbers}
    return source._replace(cells=cells, units=units, lines=[source.lines[row] for row in first]), numbers
