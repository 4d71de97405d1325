"""Arrays, tables and files as short lists of numbers and names that JSON holds."""

from __future__ import annotations

import csv
import json
import math
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
import yaml

LONGEST: Final = 12  # numbers of a list that are recorded individually
CHANGING: Final = re.compile(
    r"second|us_per_pose|time_taken|created|history|version|duration_of|cpu|memory|workers|started|ended"
)


def values_of(array: Any) -> Any:
    """An array: its numbers if it is short, otherwise its shape, first and last numbers and statistics."""
    found = np.asarray(array)
    if found.dtype.kind in "SUO":
        texts = [text.decode() if isinstance(text, bytes) else str(text) for text in found.reshape(-1)]
        return texts if len(texts) <= LONGEST else {"shape": list(found.shape), "texts": sorted(set(texts))[:LONGEST]}
    if found.dtype.kind not in "biuf":
        return str(found.dtype)
    numbers = found.astype(np.float64)
    if numbers.size <= LONGEST:
        return [rounded(value) for value in numbers.reshape(-1).tolist()]
    finite = numbers[np.isfinite(numbers)]
    summary: dict[str, Any] = {"shape": list(found.shape), "finite": int(finite.size)}
    if finite.size:
        scale = {
            "first": finite[0],
            "last": finite[-1],
            "min": finite.min(),
            "max": finite.max(),
            "mean": finite.mean(),
        }
        summary |= {key: rounded(float(value)) for key, value in scale.items()}
    return summary


def plain(value: Any) -> Any:
    """Nested data without values that change from run to run; long lists of numbers by `values_of`."""
    if isinstance(value, Mapping):
        return {str(key): plain(each) for key, each in value.items() if not CHANGING.search(str(key))}
    if isinstance(value, list | tuple):
        flat = _numbers(value)
        return values_of(flat) if flat is not None and flat.size > LONGEST else [plain(each) for each in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, np.ndarray):
        return values_of(value)
    if isinstance(value, float):
        return rounded(value)
    return value if isinstance(value, str | int | None) else str(value)


def file_values(file: Path) -> Any:
    """Values of a file by its kind; only the name for pictures, pages and programs."""
    read = READERS.get(file.suffix)
    return read(file) if read else "written"


def folder_values(folder: Path) -> dict[str, Any]:
    """Values of all files below a folder."""
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return {file.relative_to(folder).as_posix(): file_values(file) for file in files}


def _netcdf(file: Path) -> Any:
    import h5py

    found: dict[str, Any] = {}

    def visit(name: str, item: Any) -> None:
        attributes = {
            key: plain(value.decode() if isinstance(value, bytes) else value)
            for key, value in item.attrs.items()
            if not key.startswith(("_", "DIM", "REF", "CLASS", "NAME")) and not CHANGING.search(key)
        }
        found[name] = attributes | ({"values": values_of(item[()])} if isinstance(item, h5py.Dataset) else {})

    with h5py.File(file) as opened:
        visit("/", opened)
        opened.visititems(visit)
    return {key: {name: text for name, text in each.items() if name != "robot"} for key, each in found.items()}


def _csv(file: Path) -> Any:
    lines = [line for line in file.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    rows = list(csv.reader(lines))
    columns = zip(*rows[1:], strict=False)
    found = {name: list(column) for name, column in zip(rows[0], columns, strict=False)}
    return {name: values_of(_floats(column)) for name, column in found.items()}


def _xml(file: Path) -> Any:
    tree = ElementTree.fromstring(file.read_text(encoding="utf-8"))
    return [[element.tag, {key: _texts(text) for key, text in element.attrib.items()}] for element in tree.iter()]


def _mcap(file: Path) -> Any:
    from mcap.reader import make_reader

    with file.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    counts = summary.statistics.channel_message_counts
    names = {schema.id: schema.name for schema in summary.schemas.values()}
    return {
        c.topic: [names.get(c.schema_id), c.message_encoding, counts.get(k, 0)] for k, c in summary.channels.items()
    }


def _yaml(file: Path) -> Any:
    return plain(yaml.safe_load(file.read_text(encoding="utf-8")))


READERS: Final[Mapping[str, Callable[[Path], Any]]] = {
    ".nc": _netcdf,
    ".csv": _csv,
    ".xml": _xml,
    ".mcap": _mcap,
    ".yaml": _yaml,
    ".json": lambda file: plain(json.loads(file.read_text(encoding="utf-8"))),
}


def rounded(value: Any) -> Any:
    """A number with ten digits; as text if JSON has none for it."""
    return float(f"{value:.10g}") if math.isfinite(value) else str(value)


def _numbers(value: Any) -> Any:
    try:
        found = np.array(value, dtype=np.float64)
    except (ValueError, TypeError):
        return None
    return found


def _floats(texts: list[str]) -> Any:
    try:
        return np.array([float(text or "nan") for text in texts])
    except ValueError:
        return np.array(texts)


def _texts(text: str) -> Any:
    try:
        return values_of([float(word) for word in text.split()])
    except ValueError:
        return text
