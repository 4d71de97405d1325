"""Base classes of results, which are immutable and can be pickled, displayed and saved; tables; status codes."""

from __future__ import annotations

import csv
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields
from enum import IntEnum
from importlib import import_module
from inspect import getdoc
from io import StringIO
from types import MappingProxyType
from typing import Any, ClassVar, Final, Self

import numpy as np
from numpy.typing import NDArray

from sagline.core.arguments import file_path
from sagline.core.arrays import locked
from sagline.core.errors import FileError
from sagline.core.numbers import counted

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


# module that is imported when a table is written, because `files` imports this module
_WRITING: Final = "sagline.files.writing"
_WIDTH, _ENDS = 80, 4  # width of a terminal; number of printed rows at each end of a table

# Declaration of the columns of a result. A column is a text "label=attribute [unit]", or a tuple of this text and the
# type of the status codes in the column. An attribute can be a path with dots, such as "pose.position"; a number after
# a dot is an index of the last axis. In a label, # is replaced by the index of a cable, and @ by x, y, z (and w). The
# default label is the name of the attribute. The default unit is the unit in the documentation of the attribute.
Columns = tuple[str | tuple[str, type[Any]], ...]


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """Text of a CSV file: a line of column names with units, then rows with all digits of the numbers."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


class Table:
    """Table with columns of equal length, each with a name and a unit.

    Attributes:
        columns: Dictionary from the name of each column to its numbers or words, shape (rows,).
        units: Dictionary from the name of each column to its unit; "" for a column without a unit.
    """

    __slots__ = ("columns", "units")

    def __init__(self, columns: Mapping[str, NDArray[Any]], units: Mapping[str, str]) -> None:
        """Store columns and units."""
        self.columns, self.units = MappingProxyType(dict(columns)), MappingProxyType(dict(units))

    def __len__(self) -> int:
        """Number of rows."""
        return len(next(iter(self.columns.values()), ()))

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Numbers or words of the column `name`, shape (rows,)."""
        return self.columns[name]

    @property
    def head(self) -> list[str]:
        """Names of the columns, with units in brackets."""
        return [f"{name} [{self.units[name]}]" if self.units[name] else name for name in self.columns]

    @property
    def rows(self) -> list[list[object]]:
        """Row of the column names, then all rows of values; "" for NaN."""
        body = zip(*(column.tolist() for column in self.columns.values()), strict=True)
        return [[*self.head], *(["" if cell != cell else cell for cell in row] for row in body)]

    def __repr__(self) -> str:
        """Text of the table that fits into a terminal: the first and last rows, and the first columns."""
        count = len(self)
        some = [*range(_ENDS), *range(count - _ENDS, count)] if count > 2 * _ENDS else list(range(count))
        texts: list[list[str]] = []
        for name, column in zip(self.head, self.columns.values(), strict=True):
            cells = [name, *(f"{column[k]:.6g}" if column.dtype.kind in "fc" else str(column[k]) for k in some)]
            width = max(map(len, cells))
            if texts and sum(len(each[0]) + 2 for each in texts) + width > _WIDTH:
                break
            texts.append([cell.rjust(width) for cell in cells])
        lines = ["  ".join(row) for row in zip(*texts, strict=True)]
        if count > len(some):
            lines.insert(_ENDS + 1, "...")
        hidden = list(self.columns)[len(texts) :]
        more = f"; not shown: {' to '.join(dict.fromkeys((hidden[0], hidden[-1])))}" if hidden else ""
        return "\n".join([*lines, f"{counted(count, 'row')}, {len(self.columns)} columns{more}"])

    def to_csv(self, file: os.PathLike[str] | str | None = None) -> str | None:
        """Write the table as CSV; see `Tabular.to_csv`."""
        text = csv_text(self.rows)
        if file is None:
            return text
        import_module(_WRITING).write_text(file_path(file), text)
        return None

    def to_dataframe(self) -> Any:
        """Convert the table to a DataFrame; see `Tabular.to_dataframe`."""
        try:
            pandas = import_module("pandas")
        except ModuleNotFoundError:
            raise FileError("package pandas", "is not installed", "A DataFrame needs it: pip install pandas") from None
        frame = pandas.DataFrame(dict(self.columns))
        frame.attrs["units"] = dict(self.units)
        return frame


class Tabular:
    """Base class of results that can be converted to a table with one row per pose, sample or mode."""

    __slots__ = ()
    _columns: ClassVar[Columns]

    def table(self) -> Table:
        """Create a table of the result; a printed table shows its first and last rows.

        Returns:
            Table; `table["x"]` is the column x, and `table.units["x"]` is its unit.

        Examples:
            >>> import sagline as sl
            >>> plan = sl.inverse(sl.load_robot("cogiro"), [(0, 0, 2), (1, 1, 2)])
            >>> plan.table()["T0"].round(1)
            array([370.6, 302.4])
        """
        found = list(_columns_of(self))
        return Table({name: values for name, values, _ in found}, {name: unit for name, _, unit in found})

    def to_csv(self, file: os.PathLike[str] | str | None = None) -> str | None:
        """Write the table of the result as CSV. The header contains units in brackets; an empty cell means NaN.

        Args:
            file: File, which is written atomically; None to return the text.

        Returns:
            The text, or None if a file was written.

        Raises:
            FileError: If the file cannot be written; an existing file is then unchanged.

        Examples:
            >>> import sagline as sl
            >>> plan = sl.inverse(sl.load_robot("cogiro"), (0, 0, 2))
            >>> print(plan.to_csv()[:24])
            x [m],y [m],z [m],qx,qy,
        """
        return self.table().to_csv(file)

    def to_dataframe(self) -> Any:
        """Convert the table of the result to a pandas DataFrame.

        Returns:
            DataFrame with the columns of `table`; `attrs["units"]` contains the units of the columns.

        Raises:
            FileError: If pandas is not installed.

        Examples:
            >>> import sagline as sl
            >>> plan = sl.inverse(sl.load_robot("cogiro"), [(0, 0, 2), (1, 1, 2)])
            >>> plan.to_dataframe()["status"].tolist()
            ['SOLVED', 'SOLVED']
        """
        return self.table().to_dataframe()

    def to_xarray(self) -> Any:
        """Convert the result to an xarray Dataset.

        Returns:
            Dataset with units and robot, as `save` writes it to a NetCDF file. The Dataset of a result without a NetCDF
            format contains the columns of `table`, with the dimension `row`.

        Raises:
            InvalidValueError: If the result contains a cable model, a tension method or a criterion of your own.

        Examples:
            >>> import sagline as sl
            >>> plan = sl.inverse(sl.load_robot("cogiro"), [(0, 0, 2), (1, 1, 2)])
            >>> plan.to_xarray()["chord_tension"].dims
            ('pose', 'cable')
        """
        return formats().dataset_of(self)


def _columns_of(result: Tabular) -> Iterator[tuple[str, NDArray[Any], str]]:
    """Name, values (rows,) and unit of each column of a result's table."""
    for declared in type(result)._columns:
        text, codes = declared if isinstance(declared, tuple) else (declared, None)
        text, _, unit = text.removesuffix("]").partition(" [")
        label, _, place = text.rpartition("=")
        value, units = _found(result, place)
        if value is None:
            continue
        label, unit = label or place.rpartition(".")[2], unit or ", ".join(units)
        if hasattr(value, "quaternion"):  # the value is a pose
            yield from _spread(("x", "y", "z"), value.position, "m")
            yield from _spread(("qx", "qy", "qz", "qw"), value.quaternion, "")
        elif "#" in label or "@" in label:
            parts = "xyzw"[: value.shape[-1]] if "@" in label else map(str, range(value.shape[-1]))
            yield from _spread([label.replace("#", part).replace("@", part) for part in parts], value, unit)
        elif codes is not None:
            yield label, np.array([codes(int(code)).name for code in np.atleast_1d(value)]), ""
        else:
            yield label, np.atleast_1d(value), unit


def _spread(names: Any, values: NDArray[Any], unit: str) -> Iterator[tuple[str, NDArray[Any], str]]:
    """Column for each entry of `values` along the last axis; names: name of each column."""
    for k, name in enumerate(names):
        yield name, np.atleast_1d(values[..., k]), unit


def _found(result: Any, place: str) -> tuple[Any, list[str]]:
    """Value and documented units of the attribute `place`, such as "pose.position"; None if the value is missing."""
    units: list[str] = []
    for name in place.split("."):
        if result is None:
            break
        if name.isdigit():
            index, size = int(name), result.shape[-1]
            units = units[index * len(units) // size :][:1]
            result = result[..., index]
        else:
            units = documented_units(type(result), name)
            result = getattr(result, name)
    return result, units
