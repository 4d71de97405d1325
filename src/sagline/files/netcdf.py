"""Formats of results, and NetCDF files with a digest at the end. Damaged files are not read."""

# An HDF5 file states its own length, and HDF5 ignores all bytes after it. The digest is therefore appended to the file.
# The digest is checked first, because reading a damaged file may take any amount of memory and time. A file without a
# digest is not read.

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from hashlib import sha256
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, Generic, Literal, TypeVar

import numpy as np

from sagline.core.arguments import file_path, instance
from sagline.core.errors import FileError, InvalidValueError, shortened
from sagline.files.reading import HDF_BEGIN, check_regular, system_errors
from sagline.files.robot_file import dump_robot, parse_robot
from sagline.files.variables import PARTS
from sagline.files.writing import atomic_file
from sagline.robot.robot import Robot

if TYPE_CHECKING:
    from xarray import Dataset

OTHERS: Final = {
    "sagline_format": ("a plan", "Read it with load_plan, or look at it: sagline view ROBOT FILE."),
    "sagline_simulation_format": ("a simulation", "Read it with load_simulation, or play it: sagline view ROBOT FILE."),
    "sagline_execution_format": ("an execution", "Open it with xarray.open_dataset; the plan is the group 'plan'."),
    "sagline_workspace_format": ("a workspace", "Read it with load_workspace."),
    "sagline_calibration_format": ("a calibration", "Read it with load_calibration."),
    "sagline_frequency_map_format": ("a frequency map", "Open it with xarray.open_dataset."),
}
Choice = TypeVar("Choice")
T = TypeVar("T")
_KINDS: Final = {
    **dict.fromkeys((".yaml", ".yml"), "a YAML file"),
    **dict.fromkeys((".xml", ".wcrfx"), "an XML file"),
    **{f".{kind}": f"a {kind.upper()} file" for kind in ("csv", "json", "png", "svg")},
}
INFLATION = 1000  # largest allowed ratio of the size in memory to the file size; files of sagline have smaller ratios
HEADERS: Final = 1 << 18  # allowed size [bytes] of all names and attributes, except for long texts such as the robot
_HEAD, _TAIL = b"\nsagline sha256 ", b"\n"
_LENGTH = len(_HEAD) + sha256().digest_size * 2 + len(_TAIL)
_BLOCK = 1 << 20  # bytes per read


def seal(file: Path) -> None:
    """Append the digest of a file to the file."""
    with file.open("rb+") as handle:
        handle.write(_line(handle, file.stat().st_size))


def _digest_is_right(file: Path) -> bool | None:
    """True if the digest at the end of the file matches the content before it. None if the file has no digest."""
    with file.open("rb") as handle:
        before = max(0, file.stat().st_size - _LENGTH)
        handle.seek(before)
        found = handle.read()
        if not (found.startswith(_HEAD) and found.endswith(_TAIL)):
            return None
        handle.seek(0)
        return found == _line(handle, before)


def _line(handle: BinaryIO, size: int) -> bytes:
    """Read the next `size` bytes of a file, and return their digest line."""
    found = sha256()
    while size > 0 and (block := handle.read(min(_BLOCK, size))):
        found.update(block)
        size -= len(block)
    return _HEAD + found.hexdigest().encode() + _TAIL


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Generic[T]):
    """The format of the files of one kind of result, and texts for messages."""

    kind: type[T]  # type of the result
    name: str  # name of the content: "plan"
    made: str  # description of such a file: "run of sagline track"
    give: str  # next step for the user: "Give the .nc file that sagline track wrote."
    again: str  # next step for a damaged file
    key: str  # attribute that holds the version of the format
    version: int = 1  # newest version of the format; incremented with changes that an older sagline could misread
    # `pack` creates the data set of a result, and `unpack` creates the result from a path for messages and a data set;
    # None if another module does this, or if files are only written
    pack: Callable[[T], Dataset] | None = None
    unpack: Callable[[Path, Dataset], T] | None = None

    def save(self, result: T, file: os.PathLike[str] | str) -> None:
        """Write a result to a NetCDF file atomically, with a digest at its end."""
        assert self.pack is not None
        path = file_path(file)
        if path.suffix.lower() not in ("", ".nc"):
            reason = f"the suffix is {path.suffix}; allowed: .nc"
            raise FileError(path, reason, f"Call it {path.stem}.nc, or write a table with to_csv.")
        write_dataset(self.pack(instance(result, self.kind, self.name)), path)

    def load(self, file: os.PathLike[str] | str) -> T:
        """Read a file that `save` wrote."""
        path = file_path(file)
        data = _read_dataset(path, self)
        self.check(path, data.attrs)
        assert self.unpack is not None
        with _file_errors(path):
            return self.unpack(path, data)

    def check(self, path: Path, attributes: Mapping[str, Any]) -> None:
        """Refuse a file with other content, or of a newer version of the format."""
        found = attributes.get(self.key)
        if found is None:
            other = next((said for key, said in OTHERS.items() if key in attributes), None)
            if other is not None:
                raise FileError(path, f"is {other[0]} of sagline, not a {self.name}", other[1])
            reason = f"is not a {self.name} of sagline: it has no {self.key}"
            raise FileError(path, reason, "Check that this is the file you mean.")
        if not isinstance(found, int | np.integer) or found < 1:
            step = "Write the file again, because it was edited or damaged."
            raise FileError(path, f"has the unknown format {found!r}", step, item=self.key)
        check_version(path, int(found), self.version, attributes.get("source"), self.key)

    def matches(self, path: Path) -> bool:
        """True if a file has the attributes of this format. Nothing else is checked."""
        from h5py import File

        try:
            check_regular(path, path.stat().st_mode)
            if not _digest_is_right(path):
                return False
            with File(path) as file:
                return self.key in file.attrs
        except (FileError, OSError, RuntimeError, ValueError):
            return False

    def attributes(self, title: str) -> dict[str, Any]:
        """Attributes of every file of this format."""
        return {"title": title, "source": f"sagline {version('sagline')}", self.key: self.version}

    def dataset(
        self,
        title: str,
        robot: Robot,
        attributes: Mapping[str, Any],
        variables: Mapping[str, Any],
        coordinates: Mapping[str, Any] | None = None,
    ) -> Dataset:
        """Make a data set whose dimensions have no indexes. A reader of the file makes the indexes that it needs."""
        from xarray import Coordinates, Dataset

        parts = {dimension for dimensions, *_ in variables.values() for dimension in dimensions} & PARTS.keys()
        labels = {part: (part, list(PARTS[part])) for part in sorted(parts)}
        known = {**self.attributes(title), **attributes, "robot": dump_robot(robot)}
        return Dataset(variables, Coordinates({**labels, **(coordinates or {})}, indexes={}), known)


def check_version(path: Path, found: int, newest: int, source: Any, item: str | None = None) -> None:
    """Refuse a file of a format that is newer than the `newest` known version."""
    if found > newest:
        here = f"this is sagline {version('sagline')}, which reads up to {newest}"
        raise FileError(path, f"has format {found}, written by {source}; {here}", "Install a newer sagline.", item=item)


def index_coordinate(dimension: str, count: int) -> tuple[str, Any, dict[str, str]]:
    """Coordinate of `dimension`: the indices 0 to `count` - 1, for example of cables."""
    return dimension, np.arange(count), {"long_name": f"{dimension}, counted from 0"}


def write_dataset(data: Dataset, file: Path, groups: Mapping[str, Dataset] | None = None) -> None:
    """Write a data set, then a digest over all its values and attributes."""
    parts: list[tuple[str | None, Dataset]] = [(None, data), *(groups or {}).items()]
    texts = [value for _, part in parts for value in part.attrs.values() if isinstance(value, str)]
    size = sum(part.nbytes + HEADERS for _, part in parts) + sum(len(text.encode()) for text in texts)
    with atomic_file(file, size=size) as partial:
        try:
            for group, part in parts:
                # _FillValue None: numbers are stored unchanged, and NaN does not mean "missing"
                encoding = {str(name): {"_FillValue": None} for name in part.variables}
                mode: Literal["w", "a"] = "w" if group is None else "a"
                # the path is made absolute, because xarray would expand ~ to the home folder
                part.to_netcdf(partial.absolute(), mode, group=group, engine="h5netcdf", encoding=encoding)
        except RuntimeError as error:  # h5py raises this error if the disk is full
            raise OSError(str(error)) from error
        seal(partial)


def _read_dataset(path: Path, content: Format[Any]) -> Dataset:
    """Read the data set of an undamaged file. The digest is checked before the content is read."""
    with system_errors(path):
        check_regular(path, path.stat().st_mode)  # a pipe is not opened, because opening would wait for its writer
        right = _digest_is_right(path)
    if right is False:
        raise FileError(path, "has changed since it was written: it was damaged or edited", content.again)
    if right is None:
        raise FileError(path, *_cause(path, content), item="digest")
    return _load(path, content)


@contextmanager
def _file_errors(path: Path) -> Iterator[None]:
    """Convert errors about values of a file to a FileError with the name of the file."""
    step = "Write it again; it is incomplete or was edited."
    try:
        yield
    except KeyError as error:
        raise FileError(path, f"has no {error.args[0]}", step, item=str(error.args[0])) from None
    except InvalidValueError as error:
        raise FileError.of(path, error) from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:  # parts that do not agree
        (text,) = shortened((f"{type(error).__name__}: {error}",), 120)
        raise FileError(path, f"has parts that do not agree ({text})", step) from error


def _load(path: Path, content: Format[Any]) -> Dataset:
    from h5py import File
    from xarray import open_dataset

    size = path.stat().st_size
    try:
        with File(path) as file:  # h5netcdf would write to stderr if the file cannot be opened
            dict(file.attrs)
        with open_dataset(
            path.absolute(), engine="h5netcdf", phony_dims="sort", decode_times=False, mask_and_scale=False
        ) as data:
            if data.nbytes > INFLATION * size:
                raise ValueError(f"{size} bytes for {data.nbytes:.2g} bytes of data")
            return data.load()
    except Exception as error:  # the libraries have no common error class for a damaged file
        raise FileError(path, "is not a NetCDF file of sagline, but ends with a digest", content.again) from error


def _cause(path: Path, content: Format[Any]) -> tuple[str, str]:
    """Reason why a file cannot be read, and the next step. The reason replaces technical messages of the libraries."""
    with path.open("rb") as file:
        begin = file.read(len(HDF_BEGIN))
    if begin == HDF_BEGIN:
        reason = f"was cut off or edited, or is not a {content.made}: it does not end with a digest"
        return reason, content.again
    kind = _KINDS.get(path.suffix.lower(), "empty" if not begin else "another kind of file")
    return f"is {kind}, not a {content.made}", content.give


def choice_attributes(key: str, choice: Any, choices: Mapping[str, type[Any]]) -> dict[str, Any]:
    """Attributes that store the type and the options of a model, a method or a similar object."""
    if choices.get(type(choice).__name__) is not type(choice):
        raise InvalidValueError(key, type(choice).__name__, ", ".join(choices), "Only these can be read back.")
    options = {f"{key}_{field.name}": getattr(choice, field.name) for field in fields(choice)}
    return {key: type(choice).__name__, **{name: value for name, value in options.items() if value is not None}}


def choice_of(
    path: Path, attributes: Mapping[str, Any], key: str, choices: Mapping[str, type[Choice]], **known: Any
) -> Choice:
    """Restore an object from attributes of `choice_attributes`. Raise FileError for an unknown type or option."""
    name = attributes[key]
    if name not in choices:
        refused = InvalidValueError(key, repr(name), ", ".join(choices), "Read it with a newer sagline.")
        raise FileError.of(path, refused)
    choice: Any = choices[name]
    given = {field.name: attributes.get(f"{key}_{field.name}") for field in fields(choice)}
    try:
        plain = {option: value.item() if isinstance(value, np.generic) else value for option, value in given.items()}
        options = {option: value for option, value in plain.items() if value is not None}
        found: Choice = choice(**{**options, **known})
    except TypeError as error:  # the cause is, for example, a text in place of a number
        raise FileError(path, f"{key}: {error}", "Write it again; it was edited.") from None
    return found


def robot_of(path: Path, data: Dataset, item: str = "robot") -> Robot:
    """Read the robot of a data set. Raise FileError if the robot is invalid or has another number of cables."""
    robot = parse_robot(str(data.attrs["robot"]), f"{path}, {item}")
    if data.sizes["cable"] != robot.cable_count:
        reason = f"has {data.sizes['cable']} cables, its robot {robot.cable_count}"
        raise FileError(path, reason, "Write it again.", item="cable")
    return robot


# Writer of each type of result: a module with a function save(result, file), or a format in a module. The module is
# loaded when a result of this type is saved.
WRITERS: Final = {
    "Calibration": "calibration_file.FORMAT",
    "CalibrationPoses": "path_file",
    "Execution": "execution_file",
    "FrequencyMap": "simulation_file.FREQUENCY_MAP",
    "Plan": "plan_file.FORMAT",
    "Simulation": "simulation_file.FORMAT",
    "Surface": "mesh_file",
    "WinchLog": "log_file",
    "Workspace": "workspace_file",
}


def writer_of(result: object) -> Any:
    """Find the writer for the type of `result` or for one of its base classes; None if no writer exists."""
    name = next((kind.__name__ for kind in type(result).__mro__ if kind.__name__ in WRITERS), None)
    if name is None:
        return None
    module, _, form = WRITERS[name].partition(".")
    found = import_module(f"sagline.files.{module}")
    return getattr(found, form) if form else found


def dataset_of(result: Any) -> Dataset:
    """Data set of a result in its NetCDF format. A result without a format becomes a table with the dimension row."""
    pack = getattr(writer_of(result), "pack", None)
    if pack is not None:
        found: Dataset = pack(result)
        return found
    from xarray import Dataset

    table = result.table()
    return Dataset({name: ("row", values, {"units": table.units[name]}) for name, values in table.columns.items()})


def save(result: object, file: os.PathLike[str] | str) -> None:
    """Write a result to a file atomically, in the format of the result's type."""
    writer_of(result).save(result, file)
