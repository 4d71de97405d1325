"""Common base classes of results: immutable, pickled by field, displayed in notebooks, saved to files; status codes."""

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

# imported by name at the first display, because a normal import would be circular
_PAGES = "sagline.notebook"
_SUMMARIES = "sagline.present.summaries"
# imported by name when a result is saved, because the formats import all results
_FORMATS: Final = "sagline.files.netcdf"


def formats() -> Any:
    """The module that selects the file format of a result by the type of the result."""
    return import_module(_FORMATS)


def documented_units(kind: type[Any], name: str) -> list[str]:
    """Units in the documentation of the attribute `name` of `kind`: "force [N], moment [N m]" gives N and N m."""
    own = getattr(kind, name, None)
    text = own.__doc__ if isinstance(own, property) else None
    if text is None:
        found = re.search(rf"^    {name}: (.*(?:\n     .*)*)", getdoc(kind) or "", re.MULTILINE)
        text = found[1] if found else ""
    return [" ".join(unit.split()) for unit in re.findall(r"\s\[([^\[\]]+)\]", text or "")]


def set_fields(target: object, **values: Any) -> None:
    """Set the fields `values` of the frozen object `target` during its construction."""
    for name, value in values.items():
        object.__setattr__(target, name, value)


class Shown:
    """Base class of objects that are displayed as a short summary, and in Jupyter also as a figure.

    A class with long arrays uses `dataclass(repr=False)`, so that its representation is this summary.
    """

    __slots__ = ()

    def __repr__(self) -> str:
        """Summary in at most 12 lines; the first line is the verdict."""
        text: str = import_module(_SUMMARIES).text_of(self)
        return text

    def _repr_html_(self) -> str | None:
        """Summary and figure as HTML. If the result is None, Jupyter displays the plain text instead."""
        with suppress(Exception):  # an error in the display must not make a successful cell of the notebook fail
            shown: str | None = import_module(_PAGES).html_of(self)
            return shown
        return None


class ByFields:
    """Frozen dataclass that is pickled by its fields; its arrays are write-locked after loading or copying.

    Loading restores the fields without a call of the constructor, whose arguments may differ from the fields.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[Any, tuple[type[ByFields], dict[str, Any]]]:
        """Pickle the object by its fields; loading locks the arrays."""
        return _again, (type(self), {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]


class Result(ByFields, Shown):
    """A result that is immutable, also after it was pickled and loaded."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Representation: the first line of `__str__` if the class defines `__str__`; otherwise the summary."""
        if type(self).__str__ is object.__str__:
            return super().__repr__()
        return f"<{type(self).__name__}: {str(self).splitlines()[0]}>"


class Saved:
    """A result that can be saved in a file; `sagline.files.netcdf` declares the formats."""

    __slots__ = ()

    def save(self, file: os.PathLike[str] | str) -> None:
        """Write the result to a file atomically, with units.

        The format follows from the type: NetCDF with the robot inside for plans, simulations, workspaces, frequency
        maps and calibrations (.nc); CSV for logs of winches (.csv); YAML for calibration poses (.yaml); MCAP or NetCDF
        for executions (.mcap, .nc). Each type has a function that reads its file, such as `load_plan` and
        `load_simulation`; `load_path` reads calibration poses; xarray opens frequency maps and NetCDF files of
        executions.

        Args:
            file: The file; an existing regular file is replaced. If the name belongs to a folder or a device, an error
                is raised.

        Raises:
            InvalidValueError: If the result cannot be read back. This is true for a plan of several robots, and for a
                cable model, tension method or criterion of your own.
            FileError: If the suffix is wrong, a package is missing or the file cannot be written. An existing file
                remains unchanged.
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
    """Outcome of a calculation. Each member has a code and an explanatory sentence.

    Attributes:
        text: Meaning of the outcome, and next step, in one sentence.
    """

    text: str

    def __new__(cls, code: int, text: str = "") -> Self:
        """Create a member with its code as value."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member
