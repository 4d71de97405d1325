"""Folder of a design search: the record of rated candidates, with which a search continues, and the results.

`design.json` identifies the search by a digest of the request without the number of evaluations. `evaluations.csv` has
one line with a checksum per candidate; lines are appended after each generation. After a crash or on a full disk, the
last line may be incomplete. A continued search removes an incomplete line and rates the candidate again. `front.csv`
and the robot files are written at the end.
"""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import fields, is_dataclass
from hashlib import sha256
from io import StringIO
from pathlib import Path
from typing import Any, Final
from zlib import crc32

import attrs
import numpy as np

from sagline.core.arguments import file_path
from sagline.core.arrays import Array
from sagline.core.errors import FileError
from sagline.files.quantity import plain_number
from sagline.files.reading import read_text
from sagline.files.writing import check_file, check_files, create_folder, json_text, try_lock, write_text
from sagline.optimization.request import Request, heading

REQUEST, EVALUATIONS = "design.json", "evaluations.csv"
LIMIT: Final = 1000.0  # largest file of evaluations [MB]
ANOTHER: Final = "Give another folder, or remove this one."


class DesignFolder:
    """Record of a design search: rows (K, d + g) of K known candidates, and a file to which new rows are appended."""

    def __init__(self, file: Path, handle: int, known: Array) -> None:
        """Store the path `file`, the open file `handle`, and the rows of the known candidates."""
        self._file, self._handle, self.known = file, handle, known

    def add(self, rows: Array) -> None:
        """Append rows (N, d + g) with design variables and goal values of candidates, and flush the file."""
        self.add_lines([repr(float(x)) for x in row] for row in rows)

    def add_lines(self, lines: Iterable[list[str]]) -> None:
        """Append lines, each given as a list of cells, and flush the lines to the disk."""
        data = "".join(map(_line, lines)).encode()
        try:
            while data:
                data = data[os.write(self._handle, data) :]
            os.fsync(self._handle)
        except OSError as error:
            step = "Free some space and start again; the search continues from here."
            raise FileError(self._file, f"cannot be written ({error.strerror})", step) from None


@contextmanager
def open_record(folder: Path | str, request: Request) -> Iterator[DesignFolder]:
    """Open or create the record in `folder`; raises an error if the record is of another search or in use."""
    place = file_path(folder, "folder", folder=True)
    check_files(place, [REQUEST, EVALUATIONS])
    create_folder(place, parents=False)
    heads = [heading(part.name, part.unit) for part in request.candidates.parts]
    heads += [heading(goal.kind, goal.unit) for goal in request.goals]
    digest = sha256(_canonical(request).encode()).hexdigest()
    file = place / EVALUATIONS
    _check_request(place, digest, request)
    handle = os.open(file, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
    try:
        if not try_lock(handle, if_unknown=True):
            raise FileError(place, "is in use by another process", "Wait for that process, or give another folder.")
        if not os.path.exists(place / REQUEST):
            stored = {"request": digest, "robot": request.robot.name, "optimizer": request.optimizer}
            write_text(place / REQUEST, json_text({**stored, "seed": request.seed}) + "\n")
        known, whole = _read(file, heads)
        os.ftruncate(handle, whole)
        record = DesignFolder(file, handle, known)
        if not whole:
            record.add_lines([heads])
        yield record
    finally:
        os.close(handle)


def _canonical(value: Any) -> str:
    """Text of a value for the digest. Different values have different texts."""
    if isinstance(value, np.ndarray):
        return f"array({value.dtype.str}, {value.shape}, {np.ascontiguousarray(value).tobytes().hex()})"
    if is_dataclass(value) or attrs.has(type(value)):
        names = [field.name for field in (fields(value) if is_dataclass(value) else attrs.fields(type(value)))]
        inside = ", ".join(f"{name}={_canonical(getattr(value, name))}" for name in names)
        return f"{type(value).__name__}({inside})"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key!r}: {_canonical(value[key])}" for key in sorted(value)) + "}"
    if isinstance(value, tuple):
        return "(" + ", ".join(map(_canonical, value)) + ")"
    return repr(value)


def _check_request(place: Path, digest: str, request: Request) -> None:
    """Raise an error if the folder contains the record of another search."""
    file = place / REQUEST
    if not os.path.exists(file):
        if os.path.exists(place / EVALUATIONS):
            raise FileError(place / EVALUATIONS, f"has no {REQUEST} in its folder, so its search is not known", ANOTHER)
        return
    try:
        stored = json.loads(read_text(file, 1.0))
        own = str(stored["request"])
    except (ValueError, TypeError, KeyError, RecursionError):
        raise FileError(file, "is not the request of a search", ANOTHER) from None
    if own != digest:
        asked = f"{request.robot.name} with {request.optimizer} and seed {request.seed}"
        reason = f"contains another search ({own[:8]}) than the requested one ({digest[:8]}): {asked}"
        raise FileError(place, reason, "Give the same request, or another folder.", item="request")


def _read(file: Path, heads: list[str]) -> tuple[Array, int]:
    """Rows in the complete lines of `file`, and size of these lines in bytes; an incomplete last line is ignored."""
    none = np.zeros((0, len(heads)))
    lines = read_text(check_file(file), LIMIT).splitlines(keepends=True)
    if not lines:
        return none, 0
    rows: list[list[float]] = []
    whole = 0
    for k, line in enumerate(lines):
        cells = _cells(line)
        expected = heads if k == 0 else None
        numbers = [] if cells is None else [plain_number(cell) for cell in cells]
        right = cells == expected if k == 0 else len(numbers) == len(heads) and None not in numbers
        if not right:
            if k == len(lines) - 1:
                break  # the last line is incomplete
            raise FileError(file, f"line {k + 1} is damaged", ANOTHER, item=f"line {k + 1}")
        whole += len(line.encode())
        if k:
            rows.append([float(x) for x in numbers if x is not None])
    return (np.array(rows) if rows else none), whole


def _line(cells: list[str]) -> str:
    """CSV line with a last cell that contains the checksum of all other cells."""
    text = StringIO()
    csv.writer(text, lineterminator="").writerow(cells)
    return f"{text.getvalue()},{crc32(text.getvalue().encode()):08x}\n"


def _cells(line: str) -> list[str] | None:
    """Cells of a CSV line without the checksum; None if the checksum is wrong."""
    text, _, check = line.rpartition(",")
    if not line.endswith("\n") or check != f"{crc32(text.encode()):08x}\n":
        return None
    return next(csv.reader([text]))
