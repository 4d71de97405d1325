"""A sweep on the disk, as far as it is done."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sagline.core.arguments import brief, choice, file_path
from sagline.core.arrays import locked
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.memory import check_memory
from sagline.core.numbers import counted
from sagline.core.results import Result
from sagline.sweep.dataset import dataset_of
from sagline.sweep.folder import check_packages, open_folder
from sagline.sweep.marks import read_marks, total_of
from sagline.sweep.quantities import variables_of
from sagline.sweep.request import Request
from sagline.sweep.work import Counts


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sweep(Result):
    """A sweep as its folder has it; numbers are read when they are asked for.

    Attributes:
        folder: Where it is.
        request: What was asked.
        tasks: How many tasks it has.
        done: How many of them are done.
        counts: How the requests of these ended.
        seconds: Time that they took all workers together [s].
    """

    folder: Path
    request: Request
    tasks: int
    done: int
    counts: Counts
    seconds: float

    @property
    def complete(self) -> bool:
        """Whether all is done."""
        return self.done == self.tasks

    def __str__(self) -> str:
        """What was asked, how far it is, and how the requests ended."""
        ends = ", ".join(f"{count:,} {name}" for name, count in self.counts._asdict().items() if count)
        return f"{self.request}; {self.done:,} of {counted(self.tasks, 'task')} done" + f": {ends}" * bool(ends)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables that there are."""
        return tuple(variable.name for variable in variables_of(self.request.quantities))

    def values(self, name: str, index: Any = ()) -> NDArray[Any]:
        """The numbers of one variable.

        Args:
            name: One of `names`.
            index: Which robots, poses, wrenches and cables, as numpy takes whole numbers and slices: (0, slice(10)).
                All of them by default.

        Returns:
            Array of shape (R, P, W), for tensions and lengths (R, P, W, m), or what the index leaves of it: NaN where
            there is no answer or not yet one; a status not yet known is -1.

        Raises:
            InvalidValueError: If there is no such variable, the index is none of its own, or it needs more memory than
                there is.
            FileError: If a chunk is damaged.
        """
        choice(name, "name", self.names)
        array: Any = open_folder(self.folder).group[name]
        if isinstance(index, tuple) and not index:
            check_memory(f"all of {name}", 2.0 * array.nbytes, "Read a part, by an index.")
        try:
            return locked(np.asarray(array[index]))
        except IndexError as error:
            allowed = f"within {', '.join(map(str, array.shape))}"
            step = f"Give whole numbers and slices ({error})."
            raise InvalidValueError("index", brief(index), allowed, step) from None
        except (ValueError, RuntimeError, OSError) as error:
            step = "Run the sweep again: what is damaged is done again."
            raise FileError(self.folder, f"{name} cannot be read ({error})", step) from None

    @property
    def field(self) -> Any:
        """All variables with units and labels, as a Dataset of xarray; nothing is read before it is used."""
        return dataset_of(self.folder, self.request)


def load(folder: os.PathLike[str] | str) -> Sweep:
    """Read the folder of a sweep, which may still be running.

    Args:
        folder: The folder.

    Returns:
        The sweep.

    Raises:
        FileError: If it is no folder of a sweep, or damaged.
        InvalidValueError: If Zarr is not installed.
    """
    path = file_path(folder, "folder", folder=True)
    check_packages()
    opened = open_folder(path)
    marks = read_marks(opened)
    seconds = sum(mark.seconds for mark in marks.values())
    return Sweep(path, opened.request, opened.tasks, len(marks), total_of(marks), seconds)
