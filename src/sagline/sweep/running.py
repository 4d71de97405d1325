"""Start and continuation of sweeps, on workers of Dask or in this process."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import Any, Final

from sagline.core.arguments import callback, file_path, instance, whole_number
from sagline.core.errors import FileError, InvalidValueError
from sagline.core.progress import Progress
from sagline.sweep.cluster import check_address, cores, local_workers, remote_workers, run_tasks
from sagline.sweep.folder import (
    SweepFolder,
    check_made_here,
    check_package,
    is_installed,
    make_folder,
    open_folder,
    request_digest,
)
from sagline.sweep.request import Request
from sagline.sweep.result import Sweep, TaskMark, TaskMarks, load, open_marks
from sagline.sweep.work import Counts, found_counts, measured_size, task

MOST_WORKERS: Final = 1024
FEW: Final = 4  # up to this number, tasks take less time than the start of workers
Tell = Callable[[str], None]


def run(
    request: Request,
    folder: os.PathLike[str] | str,
    workers: int | None = None,
    *,
    scheduler: str | None = None,
    progress: Progress | None = None,
    tell: Tell | None = None,
) -> Sweep:
    """Run a sweep and store its results in a folder, or continue a stopped sweep.

    The folder contains first results after at most a minute, and a file `done` with one line per finished task. The
    same call continues a stopped sweep, and does not repeat finished tasks. Ctrl-C stops the sweep when the running
    tasks are finished. A worker that is killed is replaced, and its task is repeated.

    Args:
        request: The request.
        folder: Path of the folder; a missing folder is created. It may contain the same sweep, but no other files.
        workers: Number of worker processes on this computer; None for one per processor. No workers are started if the
            number is 1, if Dask is missing, or if there are at most four tasks. Then this process computes the tasks
            one after the other.
        scheduler: Address of the Dask scheduler of a cluster, "tcp://10.0.0.1:8786", instead of local workers. All
            workers of the cluster must have access to the folder under the same name.
        progress: Function that is called with the number of finished tasks and the number of all tasks.
        tell: Function that is called with messages, for example with the address of the dashboard.

    Returns:
        The sweep, as returned by `load`.

    Raises:
        InvalidValueError: If an argument is of the wrong kind, or Zarr is not installed.
        FileError: If the folder has other contents or cannot be written; finished tasks are kept.
        SaglineError: If the workers or the scheduler fail; finished tasks are kept.

    Examples:
        >>> import sagline as sl
        >>> poses = sl.Pose.from_euler([[0, 0, 2], [3, 2, 2]], 0, 0, 0)
        >>> request = sl.sweep.Request(sl.load_robot("cogiro"), poses)
        >>> print(sl.sweep.run(request, "sweep", workers=1).values("status"))
        [[[0]
          [0]]]
    """
    instance(request, Request, "request")
    path = file_path(folder, "folder", folder=True)
    count = cores() if workers is None else whole_number(workers, "workers", 1, MOST_WORKERS)
    if scheduler is not None:
        check_address(scheduler)
        if workers is not None:
            step = "Leave one of them out."
            raise InvalidValueError("workers", "given with scheduler", "one of the two", step)
    report, say = callback(progress, "progress"), callback(tell, "tell") or (lambda text: None)
    check_package("zarr", "sweeps")
    with ExitStack() as entered:
        # connect before the folder is created, because nothing may be written without a scheduler
        remote = None if scheduler is None else entered.enter_context(remote_workers(scheduler))
        opened = _open_or_make_folder(path, request)
        marks = entered.enter_context(open_marks(opened))
        waiting = _waiting(opened, marks)
        start, done = 0.0, 0

        def finish(number: int, seconds: float, counts: tuple[int, ...]) -> None:
            nonlocal done
            done += 1
            left = (time.monotonic() - start) / done * (len(waiting) - done)
            marks.add(number, TaskMark(seconds, Counts(*counts)), left)
            if report is not None:
                report(len(marks.marks), opened.tasks)

        if report is not None:
            report(len(marks.marks), opened.tasks)
        job = (str(path.absolute()), opened.digest)
        with nullcontext(remote) if remote is not None else _workers(count, len(waiting), say) as client:
            start = time.monotonic()
            if client is not None:
                run_tasks(client, job, waiting, finish, say)
            else:
                for number in waiting:
                    finish(number, *task(*job, number))
    return load(path)


def open_matching_folder(path: Path, request: Request) -> SweepFolder:
    """Open the folder of a request; raises an error if it contains another request."""
    opened = open_folder(path)
    if opened.digest != request_digest(request):
        step = "Give another folder, or remove this one."
        raise FileError(path, f"contains another sweep, of {len(opened.request):,} requests", step)
    return opened


def _open_or_make_folder(path: Path, request: Request) -> SweepFolder:
    """Folder of a request; a missing folder is created."""
    try:
        empty = not path.exists() or not any(path.iterdir())
    except OSError as error:
        raise FileError(path, f"cannot be used ({error.strerror or error})", "Name another folder.") from None
    if empty:
        make_folder(path, request, measured_size(request))
    opened = open_matching_folder(path, request)
    check_made_here(opened)
    return opened


def _waiting(folder: SweepFolder, marks: TaskMarks) -> list[int]:
    """Numbers of the remaining tasks; tasks whose chunks are complete on the disk are marked as finished."""
    waiting = []
    for number in range(folder.tasks):
        counts = found_counts(folder, number)
        if counts is None:
            marks.marks.pop(number, None)
            waiting.append(number)
        elif number not in marks.marks:
            marks.add(number, TaskMark(0.0, counts), None)
    return waiting


@contextmanager
def _workers(count: int, tasks: int, tell: Tell) -> Iterator[Any]:
    """Client of Dask with workers on this machine; None if this process computes the tasks one after the other."""
    if count > 1 and tasks > FEW and is_installed("distributed"):
        _check_not_imported()
        with local_workers(min(count, tasks), tell) as client:
            yield client
    else:
        if count > 1 and tasks > FEW:
            tell('Without Dask, tasks run one after the other. For parallel tasks, pip install "sagline[sweep]".')
        yield None


def _check_not_imported() -> None:
    """End a worker whose start runs the user's script again; the parent process reports the reason."""
    if getattr(multiprocessing.current_process(), "_inheriting", False):
        raise SystemExit(1)
