"""The one way sagline writes JSON: numbers as numbers, null for what is not finite."""

from __future__ import annotations

import json
import math
import re
from pathlib import PurePath
from typing import Any

import numpy as np

from sagline.core.errors import is_seen

_OTHERS = re.compile(r"[^\n -~]+")  # beside ASCII that prints; json escapes what of it is below the space


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
    """One JSON document, for `plain` data and all that `plain` makes so; safe for a terminal, whatever texts hold.

    Args:
        what: As for `plain`.

    Returns:
        The document, without a line end.

    Raises:
        TypeError: If something in it has no form in JSON.
    """
    text = json.dumps(plain(what), indent=2, ensure_ascii=False, allow_nan=False)
    return _OTHERS.sub(lambda found: "".join(c if is_seen(c) else json.dumps(c)[1:-1] for c in found[0]), text)
