"""Fields of input types: name, default, unit and allowed range stand once, where the type declares the field.

A type is `attrs.frozen`; a field has a converter, from which a type checker knows what the constructor takes, and the
arguments of `sagline.core.arrays.checked` as metadata. `__attrs_post_init__` checks what is given; it is `check_fields`
where each field declares its whole check. A dataclass of single numbers derives from `NumberFields` and declares its
ranges in the same way.
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
    """A value as it is: a converter that gives type checkers the type of the argument."""
    return value  # type: ignore[return-value]


def if_known(value: ArrayLike | None) -> Array | None:
    """A value or None as it is: the converter of a field that need not be known."""
    return value  # type: ignore[return-value]


def given_or_none(value: ArrayLike | None) -> Array:
    """A value or None as it is: the converter of a field whose check fills in what is missing."""
    return value  # type: ignore[return-value]


def given_by_name(value: Mapping[str, ArrayLike]) -> Mapping[str, Array]:
    """Values by name as they are."""
    return value  # type: ignore[return-value]


def rule(unit: str = "", **limits: Any) -> dict[str, Any]:
    """Metadata of a field: arguments of `checked`."""
    return {"unit": unit, **limits}


def checked_by(check: Callable[..., Any], *arguments: Any, **limits: Any) -> dict[str, Any]:
    """Metadata of a field: a check that is called with value, name and these arguments, as of `core.arguments`."""
    return {"check": lambda value, item: check(value, item, *arguments, **limits)}


def check_fields(made: Any) -> None:
    """Check each field of a new object by its `checked_by`; None is allowed where it is the default."""
    for about in fields(type(made)):
        value = getattr(made, about.name)
        if "check" in about.metadata and not (value is None and about.default is None):
            object.__setattr__(made, about.name, about.metadata["check"](value, about.name))


class NumberFields:
    """Base of dataclasses whose fields are single numbers: those with a `rule` as metadata are checked when made.

    A field whose rule has `most` is a whole number from 0 to that. None is allowed where it is the default.
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
    """Reduction for pickle: through the constructor, so that a loaded value is checked and locked too."""
    kind = type(value)
    values = {about.name: getattr(value, about.name) for about in fields(kind)}
    return _constructed, (kind, {name: dict(own) if isinstance(own, Mapping) else own for name, own in values.items()})


def _constructed(kind: type[Any], values: dict[str, Any]) -> Any:
    return kind(**values)


def units(kind: type[Any]) -> dict[str, str]:
    """Unit of each field of an input type, "" for none."""
    return {field.name: field.metadata["unit"] for field in fields(kind)}
