"""What answers have in common: they cannot be changed, whatever process they come from."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np

from sagline.arrays import locked
from sagline.shown import Shown


class ByFields:
    """A frozen dataclass that is pickled by its fields, and whose arrays are write-locked where it is loaded or copied.

    What is loaded is what was saved: it does not go through a constructor that takes other words.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[Any, tuple[type[ByFields], dict[str, Any]]]:
        """Pickle by fields, so that the arrays of what is loaded are locked too."""
        return _again, (type(self), {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]


class Result(ByFields, Shown):
    """An answer: what cannot be changed, whatever process it comes from."""

    __slots__ = ()

    def __repr__(self) -> str:
        """The first line of the text, for results whose arrays are too long to be read: `dataclass(repr=False)`."""
        return f"<{type(self).__name__}: {str(self).splitlines()[0]}>"


def _again(kind: type[ByFields], values: dict[str, Any]) -> ByFields:
    made = object.__new__(kind)
    for name, value in values.items():
        for part in value.values() if isinstance(value, dict) else (value,):
            if isinstance(part, np.ndarray):
                locked(part)
        object.__setattr__(made, name, value)
    return made
