"""The file `done` of a sweep: a line a task that is done, for people and for whoever goes on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import IO, Final, NamedTuple

import numpy as np

from sagline.core.errors import FileError
from sagline.files.writing import is_taken
from sagline.sweep.folder import STEP, SweepFolder
from sagline.sweep.work import Counts

NAME: Final = "done"
HEAD: Final = "#    task  seconds  feasible infeasible   unable     open     lost   progress"


class Mark(NamedTuple):
    """What is known of a task that is done.

    Attributes:
        seconds: Time it took a worker [s]; 0 where the chunk was found on the disk.
        counts: How its requests ended.
    """

    seconds: float
    counts: Counts


def read_marks(folder: SweepFolder) -> dict[int, Mark]:
    """The tasks that are done, by their numbers.

    Args:
        folder: The folder.

    Returns:
        The marks; lines that are torn or of no task are none.

    Raises:
        FileError: If the file cannot be read.
    """
    try:
        lines = (folder.path / NAME).read_bytes().decode("ascii", "replace").splitlines(keepends=True)
    except FileNotFoundError:
        return {}
    except OSError as error:
        raise FileError(folder.path / NAME, f"cannot be read ({error.strerror or error})", STEP) from None
    marks = (_mark(line) for line in lines if line.endswith("\n"))
    return {number: mark for number, mark in filter(None, marks) if number < folder.tasks}


class Marks:
    """The file while a sweep runs; one process at a time has it."""

    def __init__(self, folder: SweepFolder, file: IO[bytes], marks: dict[int, Mark]) -> None:
        """Go on with what is marked; use `marking`."""
        self._folder, self._file = folder, file
        self.marks = marks

    def add(self, number: int, mark: Mark, left: float | None) -> None:
        """Mark a task.

        Args:
            number: Its number.
            mark: What is known of it.
            left: Time that the rest will take [s]; None where nobody knows.

        Raises:
            FileError: If the disk is full.
        """
        self.marks[number] = mark
        counts = mark.counts
        progress = f"{len(self.marks)} of {self._folder.tasks}"
        progress += "" if left is None else f", {time_text(left)} left"
        text = f"{number:9d} {mark.seconds:8.2f} {counts.feasible:9d} {counts.infeasible:10d} "
        text += f"{counts.unable:8d} {counts.open:8d} {counts.lost:8d}   {progress}\n"
        self._write(text)

    def begin(self) -> None:
        """Say what the columns are, on a line of its own."""
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
def marking(folder: SweepFolder) -> Iterator[Marks]:
    """Have the marks of a folder, alone.

    Args:
        folder: The folder.

    Yields:
        The marks.

    Raises:
        FileError: If another process works on this sweep, or the file cannot be written.
    """
    path = folder.path / NAME
    try:
        file = path.open("a+b", buffering=0)
    except OSError as error:
        raise FileError(path, f"cannot be written ({error.strerror or error})", STEP) from None
    with file:
        if not is_taken(file.fileno(), if_unknown=True):
            raise FileError(folder.path, "is being worked on by another process", "Wait for it, or stop it.")
        marks = Marks(folder, file, read_marks(folder))
        marks.begin()
        yield marks


def total_of(marks: Mapping[int, Mark]) -> Counts:
    """All counts together."""
    counts = np.array([mark.counts for mark in marks.values()], dtype=np.int64).reshape(-1, len(Counts._fields))
    return Counts(*counts.sum(axis=0).tolist())


def time_text(seconds: float) -> str:
    """A time as people read it: 1:02:03, or 0:07."""
    whole = max(0, round(seconds))
    hours, minutes = whole // 3600, whole // 60 % 60
    return f"{hours}:{minutes:02d}:{whole % 60:02d}" if hours else f"{minutes}:{whole % 60:02d}"


def _mark(line: str) -> tuple[int, Mark] | None:
    words = line.split()
    try:
        number, seconds, counts = int(words[0]), float(words[1]), Counts(*map(int, words[2:7]))
    except (ValueError, IndexError, TypeError):
        return None
    return (number, Mark(seconds, counts)) if number >= 0 else None
