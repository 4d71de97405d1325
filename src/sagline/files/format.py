"""NetCDF files of one kind of result: how a result is written and read."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

from sagline.core.arguments import file_path, instance
from sagline.files.content import Content
from sagline.files.dataset import file_errors, read_dataset, write_dataset

if TYPE_CHECKING:
    from xarray import Dataset

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Format(Content, Generic[T]):
    """The NetCDF format of one kind of result.

    Attributes:
        kind: Type of the result.
        pack: Data set of a result.
        unpack: Result of a data set; takes the path for messages. None for results that are only written.
        sealed_from: First version whose files end with a digest.
    """

    kind: type[T]
    pack: Callable[[T], Dataset]
    unpack: Callable[[Path, Dataset], T] | None = None
    sealed_from: int = 1

    def save(self, result: T, file: os.PathLike[str] | str) -> None:
        """Write a result to a file, whole or not at all, with a digest at its end.

        Args:
            result: The result.
            file: The file; a regular file that exists is replaced, anything else is refused.

        Raises:
            InvalidValueError: If the result is of another type, or cannot be read back.
            FileError: If the file cannot be written; the former file is unchanged.
        """
        write_dataset(self.pack(instance(result, self.kind, self.name)), file_path(file))

    def load(self, file: os.PathLike[str] | str, unsealed: Callable[[Path], None] | None = None) -> T:
        """Read a file that `save` wrote.

        Args:
            file: The file.
            unsealed: Called with the path of a file whose version has no digest.

        Returns:
            The result.

        Raises:
            FileError: If the file is missing, damaged, of another kind or of a newer version, or a value is not valid.
        """
        path = file_path(file)
        data, found = read_dataset(path, self)
        if self.format_of(path, data.attrs) >= self.sealed_from:
            self.check_sealed(path, found)
        elif unsealed is not None:
            unsealed(path)
        assert self.unpack is not None
        with file_errors(path):
            return self.unpack(path, data)
