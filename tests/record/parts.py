"""The parts of the record, each made by one function, and their files."""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, Final

FOLDER: Final = Path(__file__).parent
PARTS: Final = ("surface", "formats", "poses", "commands")


def recorded(name: str) -> Any:
    """Make one part again, in the form of JSON."""
    make: Callable[[], Any] = import_module(f"tests.record.{name}").record
    return json.loads(json.dumps(make()))


def stored(name: str) -> Any:
    """The recorded part."""
    return json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))


def write(name: str, part: Any) -> None:
    """Write a part with one entry per line, for short diffs."""
    (FOLDER / f"{name}.json").write_text(_indented(part, "") + "\n", encoding="utf-8")


def _indented(value: Any, indent: str) -> str:
    """JSON text of a value; a value that fits on a line of 150 characters is on one line."""
    text = json.dumps(value, ensure_ascii=False)
    if len(text) + len(indent) <= 150 or not isinstance(value, dict | list) or not value:
        return text
    deeper = indent + " "
    if isinstance(value, dict):
        lines = [f"{deeper}{json.dumps(key)}: {_indented(each, deeper)}" for key, each in value.items()]
        return "{\n" + ",\n".join(lines) + f"\n{indent}}}"
    return "[\n" + ",\n".join(deeper + _indented(each, deeper) for each in value) + f"\n{indent}]"
