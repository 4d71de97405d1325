"""Fields of input types: name, default, unit and allowed range stand once, where the type declares the field.

A type is `attrs.frozen`; a field has a converter, from which a type checker knows what the constructor takes, and the
arguments of `sagline.core.arrays.checked` as metadata. `__attrs_post_init__` checks what is given.
"""

from __future__ import annotations

from typing import Any

from attrs import fields
from numpy.typing import ArrayLike

from sagline.core.arrays import Array


def given(value: ArrayLike) -> Array:
    """A value as it is: a converter that tells type checkers what the constructor takes."""
    return value  # type: ignore[return-value]


def if_known(value: ArrayLike | None) -> Array | None:
    """A value or None as it is: the converter of a field that need not be known."""
    return value  # type: ignore[return-value]


def rule(unit: str = "", **limits: Any) -> dict[str, Any]:
    """Metadata of a field: arguments of `checked`."""
    return {"unit": unit, **limits}


def reduced(value: Any) -> tuple[Any, tuple[type[Any], dict[str, Any]]]:
    """Reduction for pickle: through the constructor, so that a loaded value is checked and locked too."""
    kind = type(value)
    return _constructed, (kind, {about.name: getattr(value, about.name) for about in fields(kind)})


def _constructed(kind: type[Any], values: dict[str, Any]) -> Any:
    return kind(**values)


def units(kind: type[Any]) -> dict[str, str]:
    """Unit of each field of an input type, "" for none."""
    return {field.name: field.metadata["unit"] for field in fields(kind)}
