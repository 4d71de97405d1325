"""A task of a sweep: a pure function of its number, which writes a chunk and returns a few numbers."""

from __future__ import annotations

import time
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from sagline.core.arrays import Indices
from sagline.core.errors import FileError
from sagline.sweep.folder import SweepFolder, TaskSize, check_made_here, open_folder
from sagline.sweep.quantities import variables_of
from sagline.sweep.request import Request
from sagline.sweep.work import Counts, Part, counts_of, numbers_of

SECONDS: Final = 0.75  # of a task: what a scheduler does for it is a hundredth of that
LONGEST: Final = 10.0  # s, of a task of a sweep that takes days
TASKS: Final = 4000  # at most, until tasks are as long as that
LARGEST: Final = 1 << 26  # bytes that a task may write
SAMPLES, SAMPLE = 16, 4096  # parts that are timed, and requests in each
ENOUGH: Final = 0.5  # s: what has been timed for so long is known well enough


def task(folder: str, digest: str, number: int) -> tuple[float, tuple[int, ...]]:
    """Work out one task and write its chunk; whoever has the folder can do it.

    Args:
        folder: The folder of the sweep, as this machine sees it.
        digest: Of the request that the folder must hold.
        number: Of the task.

    Returns:
        Seconds that it took, and the `Counts` of its requests.

    Raises:
        FileError: If the folder is not there, holds another sweep, or cannot be written.
    """
    start = time.perf_counter()
    opened = _opened(folder, digest)
    numbers = opened.read(number)  # of a worker that ended before it told
    if numbers is None:
        numbers = numbers_of(opened.request, opened.part(number))
        opened.write(number, numbers)
    return time.perf_counter() - start, tuple(counts_of(numbers))


@lru_cache(maxsize=4)
def _opened(folder: str, digest: str) -> SweepFolder:
    """The folder, kept open from task to task."""
    found = open_folder(Path(folder))
    if found.digest != digest:
        step = "Let all workers see the same folder under the same name."
        raise FileError(folder, "holds another sweep where a worker sees it", step)
    check_made_here(found)
    return found


def found_counts(folder: SweepFolder, number: int) -> Counts | None:
    """The counts of a task whose chunks are on the disk, whole; None where one is missing or torn."""
    numbers = folder.read(number)
    return None if numbers is None else counts_of(numbers)


def measured_size(request: Request) -> TaskSize:
    """Size of tasks that take long enough, from the time that a few requests take.

    Args:
        request: The request.

    Returns:
        The size.
    """
    places = np.linspace(0, len(request) - 1, min(SAMPLES, len(request))).astype(np.int64)
    parts = [_sample(place, request) for place in np.transpose(np.unravel_index(places, request.shape))]
    numbers_of(request, parts[0])  # loads the machine code
    count, seconds = 0, 0.0
    for part in parts:
        start = time.process_time()  # others may keep the processor busy
        numbers_of(request, part)
        seconds += time.process_time() - start
        count += part.shape[0] * part.shape[1]
        if seconds > ENOUGH or count >= len(request):
            break
    each = max(seconds / count, 1e-9)
    wanted = min(max(SECONDS, each * len(request) / TASKS), LONGEST)
    size = sum(8 * (request.cable_count if one.a_cable else 1) for one in variables_of(request.quantities))
    rows = max(1, min(int(wanted / each), LARGEST // size))
    return _size(rows, *request.shape[1:])


def _size(rows: int, poses: int, wrenches: int) -> TaskSize:
    """So many requests as a task: rather wrenches than poses, because the proof of one holds for others of its pose."""
    wide = min(wrenches, rows)
    return TaskSize(min(poses, max(1, rows // wide)), wide)


def _sample(place: Indices, request: Request) -> Part:
    """A few requests from one on: robot, pose and wrench, (3,)."""
    robot, pose, wrench = (int(k) for k in place)
    _, poses, wrenches = request.shape
    tall, wide = _size(SAMPLE, poses, wrenches)
    first, left = min(pose, poses - tall), min(wrench, wrenches - wide)
    return Part(robot, slice(first, first + tall), slice(left, left + wide))
