"""Fields of input types. The declaration of a field is the only definition of its name, default, unit and range.

A type is `attrs.frozen`. Each field has a converter, which gives type checkers the type of the constructor argument.
Its metadata are the arguments of `sagline.core.arrays.checked`. `__attrs_post_init__` checks the values. If each field
declares its complete check, this method is `check_fields`. A dataclass of single numbers derives from `NumberFields`
and declares its ranges in the same way.
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
    """Return a value unchanged. This converter gives type checkers the type of the argument."""
    return value  # type: ignore[return-value]


def if_known(value: ArrayLike | None) -> Array | None:
    """Return a value or None unchanged: the converter of an optional field."""
    return value  # type: ignore[return-value]


def given_or_none(value: ArrayLike | None) -> Array:
    """Return a value or None unchanged: the converter of a field whose check then replaces None by a value."""
    return value  # type: ignore[return-value]


def given_by_name(value: Mapping[str, ArrayLike]) -> Mapping[str, Array]:
    """Return values by name unchanged."""
    return value  # type: ignore[return-value]


def rule(unit: str = "", **limits: Any) -> dict[str, Any]:
    """Metadata of a field: the arguments with which `checked` checks its value."""
    return {"unit": unit, **limits}


def checked_by(check: Callable[..., Any], *arguments: Any, **limits: Any) -> dict[str, Any]:
    """Metadata of a field: a check from `core.arguments`, and its arguments after value and name."""
    return {"check": lambda value, item: check(value, item, *arguments, **limits)}


def check_fields(made: Any) -> None:
    """Check each field of the new object `made` with its `checked_by`. None is allowed if None is the default."""
    for about in fields(type(made)):
        value = getattr(made, about.name)
        if "check" in about.metadata and not (value is None and about.default is None):
            object.__setattr__(made, about.name, about.metadata["check"](value, about.name))


class NumberFields:
    """Base of dataclasses with single numbers as fields. Fields with a `rule` as metadata are checked at construction.

    A field whose rule has `most` is a whole number from 0 to `most`. None is allowed if None is the default.
    """

    __slots__ = ()

    def __post_init__(self) -> None:
        """Check the values."""
        for about in dataclasses.fields(self):  # type: ignore[arg-type]
            value, limits = getattr(self, about.name), dict(about.metadata)
            if not limits or (value is None and about.default is None):
                continue
            most = limits.pop("most", None)
            good = number(value, about.name, **limits) if most is None else whole_number(value, about.name, 0, most)
            object.__setattr__(self, about.name, good)


def reduced(value: Any) -> tuple[Any, tuple[type[Any], dict[str, Any]]]:
    """Pickle the object through its constructor, which checks and locks a loaded value."""
    kind = type(value)
    values = {about.name: getattr(value, about.name) for about in fields(kind)}
    return _constructed, (kind, {name: dict(own) if isinstance(own, Mapping) else own for name, own in values.items()})


def _constructed(kind: type[Any], values: dict[str, Any]) -> Any:
    return kind(**values)


def units(kind: type[Any]) -> dict[str, str]:
    """Unit of each field of the input type `kind`, "" if dimensionless."""
    return {field.name: field.metadata["unit"] for field in fields(kind)}
