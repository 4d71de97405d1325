"""What answers have in common: they cannot be changed, whatever process they come from."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from sagline.arrays import locked


class Result:
    """A frozen dataclass whose arrays are write-locked, and are so again where it is unpickled or copied."""

    __slots__ = ()

    def __repr__(self) -> str:
        """The first line of the text, for results whose arrays are too long to be read: `dataclass(repr=False)`."""
        return f"<{type(self).__name__}: {str(self).splitlines()[0]}>"

    def __reduce__(self) -> tuple[Any, tuple[type[Result], dict[str, Any]]]:
        """Pickle by fields, so that the arrays of a loaded result are locked too."""
        return _again, (type(self), {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]


def _again(kind: type[Result], values: dict[str, Any]) -> Result:
    for value in values.values():
        if isinstance(value, np.ndarray):
            locked(value)
    return kind(**values)
