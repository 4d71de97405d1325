"""The sensors of a log, as comments above its columns say of them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final

import numpy as np

from sagline.calibration.sensors import Sensors
from sagline.core.arrays import Array
from sagline.core.errors import FileError, InvalidValueError
from sagline.files.pose_entry import PoseEntry, pose_of_entry
from sagline.files.quantity import in_si
from sagline.files.schema import Entry, validated
from sagline.files.yaml_text import parse_mapping

DEVIATIONS: Final = {
    "length_deviation": "m",
    "tension_deviation": "N",
    "position_deviation": "m",
    "rotation_deviation": "rad",
}
_KEYS: Final = (*DEVIATIONS, "frame", "target")
_COMMENT = re.compile(r"\s*#\s*([A-Za-z_ ]+?)\s*:(.*)")
_NEAR: Final = 0.7  # how like one of the keys a word is that was meant to be one: "name" is not like "frame"


class _Sensors(Entry):
    """What the comments above the columns may say."""

    length_deviation: Any = None
    tension_deviation: Any = None
    position_deviation: Any = None
    rotation_deviation: Any = None
    frame: PoseEntry | None = None
    target: Any = None


def sensors_of_comments(text: str, path: Path) -> tuple[Sensors, str]:
    """The sensors that the comments above the columns of a log tell of.

    Args:
        text: Of the file.
        path: The file, for messages.

    Returns:
        The sensors, and the text with blank lines in place of the comments.

    Raises:
        FileError: If a comment says what no sensor is.
    """
    lines = text.split("\n")
    count = next((k for k, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")), len(lines))
    said = [_key_line(line.rstrip("\r")) for line in lines[:count]]
    rows = "\n".join([""] * count + lines[count:])
    if not any(said):
        return Sensors(), rows
    entry = validated(parse_mapping("\n".join(said), path), _Sensors, path)
    try:
        return _sensors(entry), rows
    except InvalidValueError as error:
        raise FileError.of(path, error) from None


def _key_line(line: str) -> str:
    """A comment that says something of the sensors, or is meant to, as YAML; nothing of any other."""
    found = _COMMENT.fullmatch(line)
    if found is None:
        return ""
    key = found[1]
    meant = "deviation" in key or bool(get_close_matches(key.lower(), _KEYS, n=1, cutoff=_NEAR))
    return f"{key}:{found[2]}" if meant else ""


def _sensors(entry: _Sensors) -> Sensors:
    values: dict[str, Any] = {
        name: in_si(value, unit, name)
        for name, unit in DEVIATIONS.items()
        if (value := getattr(entry, name)) is not None
    }
    if entry.frame is not None:
        values["frame"] = pose_of_entry(entry.frame, "frame")
    if entry.target is not None:
        values["target"] = in_si(entry.target, "m", "target")
    return Sensors(**values)


def comments_of_sensors(sensors: Sensors) -> Iterator[str]:
    """Comments from which `sensors_of_comments` has the same sensors.

    Args:
        sensors: The sensors.

    Yields:
        Lines.
    """
    for name, unit in DEVIATIONS.items():
        value: Array | None = getattr(sensors, name)
        if value is not None:
            numbers = [f"{number!r} {unit}" for number in np.atleast_1d(value).tolist()]
            listed = f"[{', '.join(numbers)}]" if value.ndim else numbers[0]
            yield f"# {name}: {listed}"
    position, quaternion = sensors.frame.position.tolist(), sensors.frame.quaternion.tolist()
    if position != [0.0, 0.0, 0.0] or quaternion != [0.0, 0.0, 0.0, 1.0]:
        yield f"# frame: {{position: {position}, quaternion: {quaternion}}}"
    if sensors.target.any():
        yield f"# target: {sensors.target.tolist()}"
