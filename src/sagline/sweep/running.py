"""Start and continuation of sweeps in this process, on local Dask workers, or on the Dask workers of a cluster."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import socket
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from importlib import import_module
from itertools import islice
from pathlib import Path
from typing import Any, Final

from sagline.core.arguments import brief, callback, file_path, instance, whole_number
from sagline.core.arrays import Progress
from sagline.core.errors import FileError, InvalidValueError, SaglineError
from sagline.sweep.folder import (
    SweepFolder,
    check_made_here,
    check_package,
    is_installed,
    make_folder,
    request_digest,
)
from sagline.sweep.request import Request
from sagline.sweep.result import Sweep, TaskMarks, load, open_marks
from sagline.sweep.work import Counts, count_outcomes, measured_size, task

MOST_WORKERS: Final = 1024
FEW: Final = 4  # up to this number of tasks, this process computes them faster than workers start
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
    """Run a sweep, or continue a stopped sweep, and store the results in a folder.

    The first results are in the folder after at most a minute. The file `done` in the folder has one line per finished
    task. A second call with the same arguments continues a stopped sweep without repeating finished tasks. Ctrl-C stops
    the sweep as soon as the running tasks are finished. If a worker is killed, another worker repeats its task.

    Args:
        request: The request.
        folder: Path of the folder, which is created if missing. An existing folder must be empty or contain the same
            sweep.
        workers: Number of worker processes on this computer; None for one per processor. This process computes all
            tasks itself if `workers` is 1, if Dask is missing, or if there are at most four tasks.
        scheduler: Address of a cluster's Dask scheduler, such as "tcp://10.0.0.1:8786"; None for local workers. All
            workers of the cluster must have access to the folder under the same name.
        progress: Function that is called with the number of finished tasks and the number of all tasks.
        tell: Function that is called with a message, for example with the address of the dashboard.

    Returns:
        The sweep, as returned by `load`.

    Raises:
        InvalidValueError: If an argument has a wrong type, or Zarr is not installed.
        FileError: If the folder contains other files, or cannot be written; finished tasks are kept.
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
    count = _cores() if workers is None else whole_number(workers, "workers", 1, MOST_WORKERS)
    if scheduler is not None:
        check_address(scheduler)
        if workers is not None:
            step = "Leave one of them out."
            raise InvalidValueError("workers", "given with scheduler", "one of the two", step)
    report, say = callback(progress, "progress"), callback(tell, "tell") or (lambda text: None)
    check_package("zarr", "sweeps")
    with ExitStack() as entered:
        # connect first, because no folder may be created if the scheduler cannot be reached
        remote = None if scheduler is None else entered.enter_context(_remote_workers(scheduler))
        opened = _open_or_make_folder(path, request)
        marks = entered.enter_context(open_marks(opened))
        waiting = _waiting(opened, marks)
        start, done = 0.0, 0

        def finish(number: int, seconds: float, counts: tuple[int, ...]) -> None:
            nonlocal done
            done += 1
            left = (time.monotonic() - start) / done * (len(waiting) - done)
            marks.add(number, (seconds, Counts(*counts)), left)
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
    """Open the folder of a sweep; raises an error if the folder contains another request than `request`."""
    opened = SweepFolder(path)
    if opened.digest != request_digest(request):
        step = "Give another folder, or remove this one."
        raise FileError(path, f"contains another sweep, of {len(opened.request):,} requests", step)
    return opened


def _open_or_make_folder(path: Path, request: Request) -> SweepFolder:
    """Open the folder of a sweep, or create the folder if it is missing."""
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
    """Numbers of the tasks that must be computed; a task with complete chunks on the disk is marked as finished."""
    waiting = []
    for number in range(folder.tasks):
        numbers = folder.read(number)
        if numbers is None:
            marks.marks.pop(number, None)
            waiting.append(number)
        elif number not in marks.marks:
            marks.add(number, (0.0, count_outcomes(numbers)), None)
    return waiting


@contextmanager
def _workers(count: int, tasks: int, tell: Tell) -> Iterator[Any]:
    """Dask client with workers on this computer; None if this process computes all tasks itself."""
    if count > 1 and tasks > FEW and is_installed("distributed"):
        # A worker whose start runs the user's script again must end here. The parent process reports the reason.
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise SystemExit(1)
        with local_workers(min(count, tasks), tell) as client:
            yield client
    else:
        if count > 1 and tasks > FEW:
            tell('Without Dask, tasks run one after the other. For parallel tasks, pip install "sagline[sweep]".')
        yield None


HERE: Final = "127.0.0.1"  # only processes of this computer can connect to this address
DASHBOARD: Final = 8787
PATIENCE: Final = 15.0  # [s], longest time to wait for a scheduler and for a worker
AHEAD: Final = 2  # number of tasks that each worker has, so that it need not wait for its next task
LOOK: Final = 5.0  # [s], time between two checks of the number of workers
SCHEMES: Final = ("tcp://", "tls://", "ws://", "wss://")
LOGGERS: Final = ("distributed", "tornado", "bokeh", "asyncio")
SILENT: Final = logging.CRITICAL + 1

SETTINGS: Final = {  # workers keep freed memory, because its release and new allocation for each array take time
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 28,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": 1 << 28,
    "distributed.worker.profile.enabled": False,
}

Job = tuple[str, str]  # folder and digest of the sweep to which a task belongs
Finish = Callable[[int, float, tuple[int, ...]], None]


def _cores() -> int:
    """Number of processors that this process may use."""
    with suppress(AttributeError):  # the function does not exist on all systems
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def local_workers(workers: int, tell: Callable[[str], None]) -> Iterator[Any]:
    """Start local worker processes; the function `tell` is called with the address of the dashboard."""
    with _silence_dask():
        distributed, settings = import_module("distributed"), import_module("dask.config")
        free = _is_free(DASHBOARD)
        given: dict[str, Any] = {
            "n_workers": workers,
            "threads_per_worker": 1,
            "processes": True,
            "host": HERE,
            "dashboard_address": f"{HERE}:{DASHBOARD if free else 0}",
            "memory_limit": 0,
            "silence_logs": SILENT,
            "preload": ["sagline.sweep.running"],
        }
        try:
            with settings.set(SETTINGS):
                cluster = distributed.LocalCluster(**given)
        except (RuntimeError, OSError, TimeoutError) as error:
            step = 'In a script, the call of run must be below the line if __name__ == "__main__":'
            raise SaglineError(f"The workers could not be started ({_first_line(error)}). {step}") from None
        with cluster, distributed.Client(cluster, set_as_default=False) as client:
            taken = "" if free else f"; port {DASHBOARD} is taken"
            tell(f"Dashboard: {cluster.dashboard_link}{taken}")
            yield client


@contextmanager
def _remote_workers(address: str) -> Iterator[Any]:
    """Connect to the scheduler at `address`, such as "tcp://10.0.0.1:8786"; SaglineError without workers there."""
    check_package("distributed", "a scheduler")
    with _silence_dask():
        distributed = import_module("distributed")
        try:
            client = distributed.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, RuntimeError, MemoryError) as error:  # MemoryError: another program answers
            step = "Start a scheduler: dask scheduler; and workers: dask worker ADDRESS."
            raise SaglineError(f"No scheduler answers at {address} ({_first_line(error)}). {step}") from None
        with client:
            try:
                client.wait_for_workers(1, timeout=PATIENCE)
            except (TimeoutError, OSError):
                step = f"Start a worker: dask worker {address}"
                raise SaglineError(f"The scheduler at {address} has no workers. {step}") from None
            yield client


def check_address(address: object) -> str:
    """Checked text of a scheduler's address."""
    if isinstance(address, str) and address.isprintable() and address.isascii():
        scheme = next((each for each in SCHEMES if address.startswith(each)), None)
        host, _, port = address.removeprefix(scheme or "").rpartition(":")
        if scheme and host and " " not in host and port.isdecimal() and 0 < int(port) < 1 << 16:
            return address
    raise InvalidValueError("scheduler", brief(address), "an address, tcp://HOST:PORT", "Give the scheduler's address.")


def run_tasks(client: Any, job: Job, numbers: Iterable[int], finish: Finish, tell: Callable[[str], None]) -> None:
    """Run the tasks `numbers` on the workers. After an error or Ctrl-C, wait until the running tasks are finished."""
    distributed = import_module("distributed")
    waiting = iter(numbers)
    run = uuid.uuid4().hex[:8]
    which: dict[Any, int] = {}
    ahead = distributed.as_completed(loop=client.loop)
    width, looked = 0, -LOOK

    def send() -> None:
        nonlocal width, looked
        if time.monotonic() - looked > LOOK:
            width, looked = AHEAD * max(1, sum(client.ncores().values())), time.monotonic()
        for number in islice(waiting, max(0, width - len(which))):
            future = client.submit(task, *job, number, key=f"sagline-{run}-{number}", pure=False)
            which[future] = number
            ahead.add(future)

    def take(future: Any) -> None:
        if future.status == "lost":  # the worker ended before its result was fetched: the task runs again
            ahead.add(future)
            return
        number = which.pop(future)
        seconds, counts = _result(future)
        future.release()
        finish(number, seconds, counts)

    try:
        send()
        for future in ahead:
            take(future)
            send()
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            tell("Stopping after the running tasks; Ctrl-C again abandons them.")
        if client.status == "running":
            for future in ahead:
                with suppress(Exception):
                    take(future)
        raise


@contextmanager
def _silence_dask() -> Iterator[None]:
    """Context manager that suppresses Dask's logs and warnings; after a failure, later logs are also suppressed."""
    loggers = [logging.getLogger(name) for name in LOGGERS]
    levels = [logger.level for logger in loggers]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=rf"({'|'.join((*LOGGERS, 'dask'))})(\.|$)")
        if is_installed("distributed"):
            import_module("distributed")  # imported first, because the import configures the loggers
        for logger in loggers:
            logger.setLevel(SILENT)
        yield
    for logger, level in zip(loggers, levels, strict=True):
        logger.setLevel(level)


def _result(future: Any) -> tuple[float, tuple[int, ...]]:
    from distributed import KilledWorker

    if future.status == "cancelled":
        raise SaglineError(
            "The scheduler does not respond. Finished tasks are kept: run the same command again to continue."
        )
    try:
        found: tuple[float, tuple[int, ...]] = future.result()
    except KilledWorker as error:
        text = f"A task stopped every worker that ran it ({_first_line(error)[:80]})"
        raise SaglineError(f"{text}. Check the memory of the workers; then run the same command again.") from None
    return found


def _is_free(port: int) -> bool:
    try:
        with socket.create_server((HERE, port)):
            return True
    except OSError:
        return False


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)


def dask_setup(worker: object) -> None:
    """Ignore SIGINT in a worker, so that Ctrl-C does not stop its task; Dask calls this function by its name."""
    if threading.current_thread() is threading.main_thread():
        with suppress(ValueError, OSError):
            signal.signal(signal.SIGINT, signal.SIG_IGN)
