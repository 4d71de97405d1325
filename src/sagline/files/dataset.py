"""Files in NetCDF into memory, once it is known that they are as they were written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Final

from sagline.errors import FileError
from sagline.files.kinds import kind_of
from sagline.files.seal import Seal, seal_of

if TYPE_CHECKING:
    from xarray import Dataset

AGAIN: Final = "Run sagline track again, or take the file from where it came."
_BEGIN: Final = b"\x89HDF\r\n\x1a\n"  # of every file in NetCDF-4
_KINDS: Final = {
    **dict.fromkeys((".yaml", ".yml"), "a YAML file"),
    **dict.fromkeys((".xml", ".wcrfx"), "an XML file"),
    **{f".{kind}": f"a {kind.upper()} file" for kind in ("csv", "json", "png", "svg")},
}
INFLATION = 1000  # times the size of a file that its numbers may take in memory: nobody packs them so well


def read_dataset(path: Path) -> tuple[Dataset, Seal]:
    """A whole file.

    Args:
        path: The file.

    Returns:
        What is in it, and whether it carries a digest: one that is wrong is refused before anything else is read.

    Raises:
        FileError: If it is missing, no file, not readable, damaged, or no NetCDF file.
    """
    found = _seal(path)
    return _opened(path), found


def _seal(path: Path) -> Seal:
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
        raise FileError(path, "is not as it was written: it was damaged or edited", AGAIN)
    return found


def _opened(path: Path) -> Dataset:
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
        raise FileError(path, *_cause(path)) from error


def _cause(path: Path) -> tuple[str, str]:
    """Why a file is none of ours, and what to do; what the libraries say of it is for those who know its format."""
    with path.open("rb") as file:
        begin = file.read(len(_BEGIN))
    if begin == _BEGIN:
        return "is damaged, or was cut off", AGAIN
    kind = _KINDS.get(path.suffix.lower(), "empty" if not begin else "another kind of file")
    return f"is {kind}, no run of sagline track", "Give the .nc file that sagline track wrote."
