"""State of a sweep on the disk: results, and the file `done` with one line per finished task."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sagline.core.arguments import brief, check_memory, choice, file_path, part_of
from sagline.core.arrays import locked
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.numbers import counted
from sagline.core.results import Result
from sagline.files.variables import PARTS
from sagline.files.writing import try_lock
from sagline.sweep.folder import GROUP, STEP, SweepFolder, check_package
from sagline.sweep.request import Request, variables_of
from sagline.sweep.work import Counts

if TYPE_CHECKING:
    from xarray import Dataset


NAME: Final = "done"
HEAD: Final = "#    task  seconds  feasible infeasible   unable     open     lost   progress"


# Mark of a finished task: computing time [s], which is 0 if the chunks existed already, and outcomes of the requests.
TaskMark: TypeAlias = tuple[float, Counts]


def _read_marks(folder: SweepFolder) -> dict[int, TaskMark]:
    """Dictionary from the number of each finished task to its mark; damaged lines are ignored."""
    try:
        lines = (folder.path / NAME).read_bytes().decode("ascii", "replace").splitlines(keepends=True)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise FileError(folder.path / NAME, f"cannot be read ({error.strerror or error})", STEP) from None
    marks = (_mark(line) for line in lines if line.endswith("\n"))
    return {number: mark for number, mark in filter(None, marks) if number < folder.tasks}


class TaskMarks:
    """File `done` of a running sweep, locked for other processes."""

    def __init__(self, folder: SweepFolder, file: IO[bytes], marks: dict[int, TaskMark]) -> None:
        """Store the open file and the existing marks; use `open_marks` to create an instance."""
        self._folder, self._file = folder, file
        self.marks = marks

    def add(self, number: int, mark: TaskMark, left: float | None) -> None:
        """Add the mark of the task `number`; left: remaining time of the sweep [s], None if not known."""
        self.marks[number] = mark
        seconds, counts = mark
        progress = f"{len(self.marks)} of {self._folder.tasks}"
        progress += "" if left is None else f", {_time_text(left)} left"
        text = f"{number:9d} {seconds:8.2f} {counts.feasible:9d} {counts.infeasible:10d} "
        text += f"{counts.unable:8d} {counts.open:8d} {counts.lost:8d}   {progress}\n"
        self._write(text)

    def begin(self) -> None:
        """Write the headings of the columns to the file, on a new line."""
        size = self._file.seek(0, 2)
        torn = False
        if size:
            self._file.seek(size - 1)
            torn = self._file.read(1) != b"\n"
        what = f"# {len(self._folder.request):,} requests in {self._folder.tasks:,} tasks, {self._folder.digest[:12]}\n"
        self._write("\n" * torn + (what if not size else "") + f"{HEAD}\n")

    def _write(self, text: str) -> None:
        try:
            self._file.write(text.encode("ascii"))
            self._file.flush()
        except OSError as error:
            reason = f"cannot be written ({error.strerror or error})"
            raise FileError(self._folder.path / NAME, reason, STEP) from None


@contextmanager
def open_marks(folder: SweepFolder) -> Iterator[TaskMarks]:
    """Open and lock the file `done` of a folder; raises FileError if another process works on the sweep."""
    path = folder.path / NAME
    try:
        file = path.open("a+b", buffering=0)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error})", STEP) from None
    with file:
        if not try_lock(file.fileno(), if_unknown=True):
            raise FileError(folder.path, "is in use by another process", "Wait for that process, or stop it.")
        marks = TaskMarks(folder, file, _read_marks(folder))
        marks.begin()
        yield marks


def _time_text(seconds: float) -> str:
    """Text of a time, such as 1:02:03 or 0:07."""
    whole = max(0, round(seconds))
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


def _mark(line: str) -> tuple[int, TaskMark] | None:
    words = line.split()
    try:
        number, seconds, counts = int(words[0]), float(words[1]), Counts(*map(int, words[2:7]))
    except (ValueError, IndexError, TypeError):
        return None
    return (number, (seconds, counts)) if number >= 0 else None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Sweep(Result):
    """Results of a sweep in a folder. Values are read from the disk when they are requested.

    Attributes:
        folder: Path of the folder.
        request: The request.
        tasks: Number of tasks.
        done: Number of finished tasks.
        counts: Outcomes of the requests in the finished tasks.
        seconds: Computing time of all workers together [s].
    """

    folder: Path
    request: Request
    tasks: int
    done: int
    counts: Counts
    seconds: float

    @property
    def complete(self) -> bool:
        """True if all tasks are finished."""
        return self.done == self.tasks

    def __str__(self) -> str:
        """Text with the size of the request, the number of finished tasks and the outcomes of the requests."""
        ends = ", ".join(f"{count:,} {name}" for name, count in self.counts._asdict().items() if count)
        return f"{self.request}; {self.done:,} of {counted(self.tasks, 'task')} done" + f": {ends}" * bool(ends)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables."""
        return tuple(variable.name for variable in variables_of(self.request.quantities))

    def values(self, name: str, index: Any = ()) -> NDArray[Any]:
        """Read the values of one variable.

        Args:
            name: One of `names`.
            index: Selection of robots, poses, wrenches and cables, for example (0, slice(10)). Each element of the
                index is a whole number, a slice, or an array of whole numbers or booleans. Default: all values.

        Returns:
            Array of shape (R, P, W), or (R, P, W, m) for tensions and lengths, or the part that `index` selects. The
            value of a request without a solution is NaN. Before its computation, a request has the value NaN and the
            status -1.

        Raises:
            InvalidValueError: If no variable has this name, if `index` is invalid, or if the values need too much
                memory.
            FileError: If a chunk is damaged.
        """
        choice(name, "name", self.names)
        array: Any = SweepFolder(self.folder).group[name]
        parts = index if isinstance(index, tuple) else (index,)
        if not parts:
            check_memory(f"all of {name}", 2.0 * array.nbytes, "Give an index that selects a part.")
        if len(parts) > array.ndim:
            allowed = f"at most {array.ndim} whole numbers and slices"
            raise InvalidValueError("index", brief(index), allowed, "The axes are robot, pose, wrench and cable.")
        chosen = tuple(part_of(part, (size,), "value") for part, size in zip(parts, array.shape, strict=False))
        try:
            return locked(np.asarray(array.oindex[chosen]))
        except IndexError:
            raise InvalidValueError("index", brief(index), "slices upward", "Reverse the result instead.") from None
        except (ValueError, RuntimeError, OSError) as error:
            step = "Run the sweep again; it repeats the damaged part."
            raise FileError(self.folder, f"{name} cannot be read ({error})", step) from None

    @property
    def field(self) -> Any:
        """Dataset of xarray with all variables, units and labels. Values are read when they are requested."""
        import xarray

        data: Dataset = xarray.open_zarr(
            self.folder / GROUP, chunks=None, consolidated=False, zarr_format=3, mask_and_scale=False
        )
        request = self.request
        labels = {"robot": [robot.name for robot in request.robots], "cable": list(range(request.cable_count))}
        labels |= {part: list(PARTS[part]) for part in ("axis", "quaternion_part", "wrench_part")}
        return data.assign_coords({name: values for name, values in labels.items() if name in data.dims})


def load(folder: os.PathLike[str] | str) -> Sweep:
    """Open the results of a sweep, which may be running.

    Args:
        folder: The folder.

    Returns:
        Sweep, from which values can be read.

    Raises:
        FileError: If the folder does not contain a sweep, or is damaged.
        InvalidValueError: If Zarr is not installed.

    Examples:
        >>> import sagline as sl
        >>> result = sl.sweep.load("output/sweep")  # doctest: +SKIP
    """
    path = file_path(folder, "folder", folder=True)
    check_package("zarr", "sweeps")
    opened = SweepFolder(path)
    marks = _read_marks(opened)
    seconds = sum(seconds for seconds, _ in marks.values())
    outcomes = np.array([counts for _, counts in marks.values()], dtype=np.int64).reshape(-1, len(Counts._fields))
    counts = Counts(*outcomes.sum(axis=0).tolist())
    return Sweep(path, opened.request, opened.tasks, len(marks), counts, seconds)
