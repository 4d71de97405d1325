"""Data sets into files in NetCDF, whole or not at all, and back once it is known that they are as they were written."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Literal

import numpy as np

from sagline.core.errors import FileError, InvalidValueError
from sagline.files.content import Content
from sagline.files.kinds import kind_of
from sagline.files.seal import Seal, seal, seal_of
from sagline.files.variables import PARTS
from sagline.files.whole import written_whole

if TYPE_CHECKING:
    from xarray import Dataset

_BEGIN: Final = b"\x89HDF\r\n\x1a\n"  # of every file in NetCDF-4
_KINDS: Final = {
    **dict.fromkeys((".yaml", ".yml"), "a YAML file"),
    **dict.fromkeys((".xml", ".wcrfx"), "an XML file"),
    **{f".{kind}": f"a {kind.upper()} file" for kind in ("csv", "json", "png", "svg")},
}
INFLATION = 1000  # times the size of a file that its numbers may take in memory: nobody packs them so well
HEADERS: Final = 1 << 18  # bytes, more than all names and attributes take beside texts, such as the robot


def labeled_dataset(
    variables: Mapping[str, Any], attributes: Mapping[str, Any], coordinates: Mapping[str, Any] | None = None
) -> Dataset:
    """Make a data set whose dimensions carry labels, without indexes: whoever reads the file builds those needed.

    Args:
        variables: Dimensions, values and attributes of each variable, by name.
        attributes: Attributes of the data set.
        coordinates: Coordinates besides the labels of `PARTS`.

    Returns:
        The data set.
    """
    from xarray import Coordinates, Dataset

    parts = {dimension for dimensions, *_ in variables.values() for dimension in dimensions} & PARTS.keys()
    labels = {part: (part, list(PARTS[part])) for part in sorted(parts)}
    return Dataset(variables, Coordinates({**labels, **(coordinates or {})}, indexes={}), attributes)


def numbered(dimension: str, count: int) -> tuple[str, Any, dict[str, str]]:
    """Coordinate that counts cables or the like from 0."""
    return dimension, np.arange(count), {"long_name": f"{dimension}, counted from 0"}


def write_dataset(data: Dataset, file: Path, groups: Mapping[str, Dataset] | None = None) -> None:
    """Write a data set, with a digest over all values and attributes at the end, behind what NetCDF reads.

    Args:
        data: The data set; one of its attributes is the robot.
        file: The file; a regular file that exists is replaced, anything else is refused.
        groups: Data sets that stand in groups of their own inside, each with its robot.

    Raises:
        FileError: If the file cannot be written; what was there before is untouched.
    """
    parts: list[tuple[str | None, Dataset]] = [(None, data), *(groups or {}).items()]
    texts = [value for _, part in parts for value in part.attrs.values() if isinstance(value, str)]
    size = sum(part.nbytes + HEADERS for _, part in parts) + sum(len(text.encode()) for text in texts)
    with written_whole(file, size=size) as partial:
        try:
            for group, part in parts:
                # _FillValue None: numbers are stored as they are, and NaN needs no second meaning
                encoding = {str(name): {"_FillValue": None} for name in part.variables}
                mode: Literal["w", "a"] = "w" if group is None else "a"
                # absolute: xarray takes ~ for the home
                part.to_netcdf(partial.absolute(), mode, group=group, engine="h5netcdf", encoding=encoding)
        except RuntimeError as error:  # what h5py makes of a disk that fills up meanwhile
            raise OSError(str(error)) from error
        seal(partial)


def read_dataset(path: Path, content: Content) -> tuple[Dataset, Seal]:
    """A whole file.

    Args:
        path: The file.
        content: What it should be of, for the messages.

    Returns:
        What is in it, and whether it carries a digest: one that is wrong is refused before anything else is read.

    Raises:
        FileError: If it is missing, no file, not readable, damaged, or no NetCDF file.
    """
    found = _seal(path, content)
    return _opened(path, content), found


@contextmanager
def file_errors(path: Path) -> Iterator[None]:
    """Tell what is wrong with the values of a file with the file that has them.

    Args:
        path: The file.

    Raises:
        FileError: If a variable or an attribute is missing, or a value is none that will do.
    """
    try:
        yield
    except KeyError as error:
        step = "Write it again; it is incomplete or was edited."
        raise FileError(path, f"has no {error.args[0]}", step, item=str(error.args[0])) from None
    except InvalidValueError as error:
        raise FileError.of(path, error) from None


def is_of(path: Path, content: Content) -> bool:
    """Whether a file says that it is of this content; nothing else of it is looked at.

    Args:
        path: The file; of one that is none, or cannot be read, `read_dataset` says why.
        content: What it may be of.
    """
    from h5py import File

    try:
        if kind_of(path.stat().st_mode):
            return False
        with File(path) as file:
            return content.key in file.attrs
    except (OSError, RuntimeError, ValueError):
        return False


def _seal(path: Path, content: Content) -> Seal:
    """What a file's end says, before anything else in it is believed."""
    try:
        if kind := kind_of(path.stat().st_mode):  # opening a pipe would wait for its writer
            raise FileError(path, f"is {kind.text}", kind.next_step)
        found = seal_of(path)
    except FileNotFoundError:
        raise FileError(path, "does not exist", "Check its name.") from None
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        reason = getattr(error, "strerror", None) or error
        raise FileError(path, f"cannot be read ({reason})", "Check its name and its permissions.") from None
    if found is Seal.BROKEN:
        raise FileError(path, "is not as it was written: it was damaged or edited", content.again)
    return found


def _opened(path: Path, content: Content) -> Dataset:
    from h5py import File
    from xarray import open_dataset

    size = path.stat().st_size
    try:
        with File(path) as file:  # h5netcdf writes to stderr about a file of which this cannot be read
            dict(file.attrs)
        with open_dataset(path.absolute(), engine="h5netcdf", decode_times=False, mask_and_scale=False) as data:
            if data.nbytes > INFLATION * size:
                raise ValueError(f"{size} bytes that say to hold {data.nbytes:.2g}")
            return data.load()
    except Exception as error:  # h5py, h5netcdf and xarray have no error of their own for a damaged file: any will do
        raise FileError(path, *_cause(path, content)) from error


def _cause(path: Path, content: Content) -> tuple[str, str]:
    """Why a file is none of ours, and what to do; what the libraries say of it is for those who know its format."""
    with path.open("rb") as file:
        begin = file.read(len(_BEGIN))
    if begin == _BEGIN:
        return "is damaged, or was cut off", content.again
    kind = _KINDS.get(path.suffix.lower(), "empty" if not begin else "another kind of file")
    return f"is {kind}, no {content.made}", content.give
