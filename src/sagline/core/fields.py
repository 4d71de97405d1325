"""Fields of input types. The declaration of a field defines its name, default, unit and range.

An input type is a class with `attrs.frozen`. The converter of a field states the type of the constructor argument for
type checkers. The metadata of a field are arguments of `sagline.core.arrays.checked`, with which `__attrs_post_init__`
checks the value. If the metadata of all fields are complete, `check_fields` is used as `__attrs_post_init__`. A
dataclass of single numbers derives from `NumberFields` and declares ranges in the same way.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from typing import Any

from attrs import fields
from numpy.typing import ArrayLike

from sagline.core.arguments import whole_number
from sagline.core.arrays import Array, number


def given(value: ArrayLike) -> Array:
    """Converter that returns a value unchanged, and gives type checkers the type of the constructor's argument."""
    return value  # type: ignore[return-value]


def if_known(value: ArrayLike | None) -> Array | None:
    """Converter of an optional field, which returns a value or None unchanged."""
    return value  # type: ignore[return-value]


def given_by_name(value: Mapping[str, ArrayLike]) -> Mapping[str, Array]:
    """Converter of a field with a dictionary from names to values, which is returned unchanged."""
    return value  # type: ignore[return-value]


def rule(unit: str = "", **limits: Any) -> dict[str, Any]:
    """Metadata of a field that is checked with `checked`: the arguments of `checked`."""
    return {"unit": unit, **limits}


def checked_by(check: Callable[..., Any], *arguments: Any, **limits: Any) -> dict[str, Any]:
    """Metadata of a field that is checked with the function `check`, and further arguments of this function."""
    return {"check": lambda value, item: check(value, item, *arguments, **limits)}


def check_fields(made: Any) -> None:
    """Check each field of the new object `made` with the check in its metadata. A default of None is allowed."""
    for about in fields(type(made)):
        value = getattr(made, about.name)
        if "check" in about.metadata and not (value is None and about.default is None):
            object.__setattr__(made, about.name, about.metadata["check"](value, about.name))


class NumberFields:
    """Base class of dataclasses with single numbers. The constructor checks fields that have a `rule` as metadata.

    A field with `most` in its rule is a whole number from 0 to `most`. None is allowed as a default value.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        """Check all fields that have a rule."""
        for about in dataclasses.fields(self):  # type: ignore[arg-type]
            value, limits = getattr(self, about.name), dict(about.metadata)
            if not limits or (value is None and about.default is None):
                continue
            most = limits.pop("most", None)
            good = number(value, about.name, **limits) if most is None else whole_number(value, about.name, 0, most)
            object.__setattr__(self, about.name, good)


def reduced(value: Any) -> tuple[Any, tuple[type[Any], dict[str, Any]]]:
    """Pickle an object as a call of its constructor, which checks the loaded values and makes them read-only."""
    kind = type(value)
    values = {about.name: getattr(value, about.name) for about in fields(kind)}
    return _constructed, (kind, {name: dict(own) if isinstance(own, Mapping) else own for name, own in values.items()})


def _constructed(kind: type[Any], values: dict[str, Any]) -> Any:
    return kind(**values)


def units(kind: type[Any]) -> dict[str, str]:
    """Dictionary from the fields of the input type `kind` to their units; without fields that have none."""
    return {field.name: field.metadata["unit"] for field in fields(kind) if "unit" in field.metadata}
