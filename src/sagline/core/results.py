"""Common base classes of results, which are immutable and can be pickled, displayed and saved; status codes."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from dataclasses import fields
from enum import IntEnum
from importlib import import_module
from inspect import getdoc
from typing import Any, Final, Self

import numpy as np

from sagline.core.arrays import locked

# modules that are imported at the first display, because a normal import would be circular
_PAGES = "sagline.notebook"
_SUMMARIES = "sagline.present.summaries"
# module that is imported when a result is saved, because it imports all results
_FORMATS: Final = "sagline.files.netcdf"


def formats() -> Any:
    """Module that selects the file format of a result by its type."""
    return import_module(_FORMATS)


def documented_units(kind: type[Any], name: str) -> list[str]:
    """Units in the documentation of the attribute `name`; the text "force [N], moment [N m]" gives N and N m."""
    own = getattr(kind, name, None)
    text = own.__doc__ if isinstance(own, property) else None
    if text is None:
        found = re.search(rf"^    {name}: (.*(?:\n     .*)*)", getdoc(kind) or "", re.MULTILINE)
        text = found[1] if found else ""
    return [" ".join(unit.split()) for unit in re.findall(r"\s\[([^\[\]]+)\]", text or "")]


def set_fields(target: object, /, **values: Any) -> None:
    """Set fields of the frozen object `target`; only constructors call this function."""
    for name, value in values.items():
        object.__setattr__(target, name, value)


class Shown:
    """Base class of objects that Python displays as a short summary, and Jupyter as a summary with a figure.

    A dataclass with long arrays needs `dataclass(repr=False)`, so that the summary is its representation.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        """Summary in at most 12 lines; the first line states the outcome."""
        text: str = import_module(_SUMMARIES).text_of(self)
        return text

    def _repr_html_(self) -> str | None:
        """Summary and figure as HTML. After an error, the result is None, and Jupyter displays the plain text."""
        with suppress(Exception):  # a notebook cell must not fail because of its display
            shown: str | None = import_module(_PAGES).html_of(self)
            return shown
        return None


class ByFields:
    """Base class of frozen dataclasses that are pickled by their fields; loaded arrays are read-only.

    Loading sets the fields without a call of the constructor, because its arguments may differ from the fields.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[Any, tuple[type[ByFields], dict[str, Any]]]:
        """Pickle the object by its fields; loading makes the arrays read-only."""
        return _again, (type(self), {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]


class Result(ByFields, Shown):
    """Base class of results, which are immutable, also after pickling and loading."""

    __slots__ = ()

    def __repr__(self) -> str:
        """First line of `__str__` if the class defines `__str__`; otherwise the summary."""
        if type(self).__str__ is object.__str__:
            return super().__repr__()
        return f"<{type(self).__name__}: {str(self).splitlines()[0]}>"


class Saved:
    """Base class of results that can be saved in a file; `sagline.files.netcdf` declares the formats."""

    __slots__ = ()

    def save(self, file: os.PathLike[str] | str) -> None:
        """Write the result to a file atomically, with units.

        The type of the result determines the format. Plans, simulations, workspaces, frequency maps and calibrations
        are written as NetCDF (.nc), with the robot in the file. Logs of winches are written as CSV (.csv), calibration
        poses as YAML (.yaml), and executions as MCAP or NetCDF (.mcap, .nc). Functions such as `load_plan` and
        `load_simulation` read the files. The function `load_path` reads calibration poses. Use xarray for frequency
        maps and executions.

        Args:
            file: The file. An existing regular file is replaced; a folder or a device is refused.

        Raises:
            InvalidValueError: If the file could not be read back: a plan of several robots, or a result with a cable
                model, tension method or criterion of your own.
            FileError: If the suffix is wrong, if a package is missing, or if the file cannot be written. An existing
                file then remains unchanged.
        """
        formats().save(self, file)


def _again(kind: type[ByFields], values: dict[str, Any]) -> ByFields:
    made = object.__new__(kind)
    for name, value in values.items():
        for part in value.values() if isinstance(value, dict) else (value,):
            if isinstance(part, np.ndarray):
                locked(part)
        object.__setattr__(made, name, value)
    return made


class Status(IntEnum):
    """Base class of outcomes of a calculation; a member of the enumeration has a code and a sentence.

    Attributes:
        text: Sentence with the meaning of the outcome and the next step.
    """

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """Create a member, whose value is the code."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member
