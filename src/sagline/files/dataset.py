"""Files in NetCDF into memory, once it is known that they are as they were written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sagline.errors import FileError
from sagline.files.kinds import kind_of
from sagline.files.seal import Seal, seal_of

if TYPE_CHECKING:
    from xarray import Dataset

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
        raise FileError(path, "is not as it was written: its digest differs", "Take it from its source again.")
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
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise FileError(
            path, f"is no complete NetCDF file ({reason})", "Write it again; it may have been cut off."
        ) from None
