"""Common base classes of results: immutable, pickled by field, displayed in notebooks, saved to files."""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import fields
from importlib import import_module
from typing import Any, Final

import numpy as np

from sagline.core.arrays import locked

# The ring that draws is far out, and loads when something is shown, by its name: an import would close a circle here.
_PAGES = "sagline.notebook.html"
# Files know all results, so no result imports them: the module is loaded by its name when a result is saved.
_FORMATS: Final = "sagline.files.format"


def formats() -> Any:
    """The module that finds the format of a result by its type."""
    return import_module(_FORMATS)


def set_fields(target: object, **values: Any) -> None:
    """Set the fields of a frozen object under construction."""
    for name, value in values.items():
        object.__setattr__(target, name, value)


class Shown:
    """Something that Jupyter shows with its verdict and a figure; elsewhere it is its ordinary text."""

    __slots__ = ()

    def _repr_html_(self) -> str | None:
        """The verdict, and a figure inside; None, whereupon the ordinary text is shown, where there is nothing more."""
        with suppress(Exception):  # a notebook's cell has done its work: how that looks must not spoil it
            shown: str | None = import_module(_PAGES).html_of(self)
            return shown
        return None


class ByFields:
    """A frozen dataclass that is pickled by its fields, and whose arrays are write-locked where it is loaded or copied.

    What is loaded is what was saved: it does not go through a constructor that takes other words.
    """

    __slots__ = ()

    def __reduce__(self) -> tuple[Any, tuple[type[ByFields], dict[str, Any]]]:
        """Pickle by fields, so that the arrays of what is loaded are locked too."""
        return _again, (type(self), {field.name: getattr(self, field.name) for field in fields(self)})  # type: ignore[arg-type]


class Result(ByFields, Shown):
    """A result, which cannot be changed, also after pickling."""

    __slots__ = ()

    def __repr__(self) -> str:
        """The first line of the text, for results whose arrays are too long to be read: `dataclass(repr=False)`."""
        return f"<{type(self).__name__}: {str(self).splitlines()[0]}>"


class Saved:
    """A result with a file format, see `sagline.files.format`."""

    __slots__ = ()

    def save(self, file: os.PathLike[str] | str) -> None:
        """Write the result to a file atomically, with units.

        The format follows from the type: NetCDF with the robot inside for plans, simulations, workspaces, frequency
        maps and calibrations (.nc); CSV for logs of winches (.csv); YAML for calibration poses (.yaml); MCAP or NetCDF
        for executions (.mcap, .nc). `load_plan`, `load_simulation` and so on read it back;
        `load_path` reads calibration poses; xarray opens frequency maps and NetCDF files of executions.

        Args:
            file: The file; a regular file that exists is replaced, anything else is refused.

        Raises:
            InvalidValueError: If the result cannot be read back: a plan of several robots, or a cable model, tension
                method or criterion of your own.
            FileError: If the suffix is wrong, a package is missing or the file cannot be written; the former file is
                unchanged.
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
