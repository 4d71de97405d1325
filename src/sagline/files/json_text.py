"""The one way sagline writes JSON: numbers as numbers, null for what is not finite."""

from __future__ import annotations

import json
import math
import os
from pathlib import PurePath
from typing import Any

import numpy as np

from sagline.files.whole import write_text


def plain(what: Any) -> Any:
    """What JSON knows: arrays as lists, keys and paths as texts, None for numbers that are not finite.

    Args:
        what: Dictionaries, sequences, arrays, numbers, texts and paths, in one another.

    Returns:
        The same in dictionaries, lists, numbers, texts and None; anything else is left for `json` to refuse.
    """
    match what:
        case dict():
            return {str(key): plain(value) for key, value in what.items()}
        case list() | tuple():
            return [plain(value) for value in what]
        case np.ndarray() | np.generic():
            return plain(what.tolist())
        case float():
            return what if math.isfinite(what) else None
        case PurePath():
            return str(what)
        case _:
            return what


def json_text(what: Any) -> str:
    """One JSON document, for `plain` data and all that `plain` makes so.

    Args:
        what: As for `plain`.

    Returns:
        The document, without a line end.

    Raises:
        TypeError: If something in it has no form in JSON.
    """
    return json.dumps(plain(what), indent=2, ensure_ascii=False, allow_nan=False)


def save_json(what: Any, file: os.PathLike[str] | str) -> None:
    """Write one JSON document, whole or not at all.

    Args:
        what: As for `plain`.
        file: The file; one that exists is replaced.

    Raises:
        FileError: If the file cannot be written.
        TypeError: If something in it has no form in JSON.
    """
    write_text(file, json_text(what) + "\n")
