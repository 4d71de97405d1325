"""Text and YAML files in, with one clear message for whatever is wrong with them."""

from __future__ import annotations

from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from sagline.errors import FileError


def read_text(path: Path) -> str:
    """A whole text file in UTF-8, with or without a byte order mark.

    Args:
        path: The file.

    Returns:
        The text, without a byte order mark.

    Raises:
        FileError: If it is missing, a folder, unreadable, or not text.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise FileError(path, "is not UTF-8 text", "Check that this is the file you mean.") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a zero byte
        reason = getattr(error, "strerror", None) or error
        raise FileError(path, f"cannot be read ({reason})", "Check its name and its permissions.") from None
    if "\0" in text:
        raise FileError(path, "is not text, it holds zero bytes", "Check that this is the file you mean.")
    return text


def parse_mapping(text: str, origin: Path | str) -> dict[Any, Any]:
    """A YAML text whose top level is a mapping, no key given twice.

    Args:
        text: The YAML text.
        origin: The file or whatever else the text came from, for the message.

    Returns:
        The mapping.

    Raises:
        FileError: If it is empty, not YAML, cut off, or not a mapping.
    """
    try:
        data = yaml.load(text, Loader=_UniqueKeyLoader)
    except yaml.MarkedYAMLError as error:
        line = "" if error.problem_mark is None else f"line {error.problem_mark.line + 1}: "
        raise FileError(
            origin, f"is not complete YAML ({line}{error.problem})", "Correct it; it may have been cut off."
        ) from None
    except (yaml.YAMLError, RecursionError, ValueError) as error:  # ValueError: a date such as 2020-99-99
        reason = str(error).splitlines()[0]
        raise FileError(origin, f"is not YAML ({reason})", "Check that this is the file you mean.") from None
    if data is None:
        raise FileError(origin, "is empty", "Write it again; it may have been cut off.")
    if not isinstance(data, dict):
        raise FileError(origin, "has no keys at its top level", "Check that this is the file you mean.")
    return data


class _UniqueKeyLoader(yaml.SafeLoader):
    """PyYAML keeps the last of two equal keys and says nothing; this one refuses the second."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.MarkedYAMLError(problem=f"key {key.value} is given twice", problem_mark=key.start_mark)
            seen.add(key.value)
        return super().construct_mapping(node, deep)
