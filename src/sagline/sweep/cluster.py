"""Workers of Dask: processes of this computer, or workers of a cluster whose scheduler has a given address."""

from __future__ import annotations

import logging
import os
import signal
import socket
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from typing import Any, Final

from sagline.core.arguments import brief
from sagline.core.errors import InvalidValueError, SaglineError
from sagline.sweep.folder import check_package, is_installed
from sagline.sweep.work import task

HERE: Final = "127.0.0.1"  # an address that other computers cannot reach
DASHBOARD: Final = 8787
PATIENCE: Final = 15.0  # longest wait for a scheduler, and for a worker [s]
AHEAD: Final = 2  # number of tasks that are sent to each worker, so that the next task is ready when one is finished
LOOK: Final = 5.0  # time between two checks of the number of workers [s]
SCHEMES: Final = ("tcp://", "tls://", "ws://", "wss://")
LOGGERS: Final = ("distributed", "tornado", "bokeh", "asyncio")
SILENT: Final = logging.CRITICAL + 1

SETTINGS: Final = {  # with this setting, workers keep memory instead of releasing and allocating it for each array
    "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_": 1 << 28,
    "distributed.nanny.pre-spawn-environ.MALLOC_MMAP_THRESHOLD_": 1 << 28,
    "distributed.worker.profile.enabled": False,
}

Job = tuple[str, str]  # arguments of a task: folder and digest
Finish = Callable[[int, float, tuple[int, ...]], None]


def cores() -> int:
    """Number of processors that this process may use."""
    with suppress(AttributeError):  # some systems do not have this function
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def local_workers(workers: int, tell: Callable[[str], None]) -> Iterator[Any]:
    """Start worker processes that only this computer can reach; `tell` is called with the dashboard's address."""
    with _silence_dask():
        import dask.config
        import distributed

        api: Any = distributed  # Any, because the package is only partly typed
        settings: Any = dask.config
        free = _is_free(DASHBOARD)
        given: dict[str, Any] = {
            "n_workers": workers,
            "threads_per_worker": 1,
            "processes": True,
            "host": HERE,
            "dashboard_address": f"{HERE}:{DASHBOARD if free else 0}",
            "memory_limit": 0,
            "silence_logs": SILENT,
            "preload": ["sagline.sweep.cluster"],
        }
        try:
            with settings.set(SETTINGS):
                cluster = api.LocalCluster(**given)
        except (RuntimeError, OSError, TimeoutError) as error:
            step = 'In a script, the call of run must be below the line if __name__ == "__main__":'
            raise SaglineError(f"The workers could not be started ({_first_line(error)}). {step}") from None
        with cluster, api.Client(cluster, set_as_default=False) as client:
            taken = "" if free else f"; port {DASHBOARD} is taken"
            tell(f"Dashboard: {cluster.dashboard_link}{taken}")
            yield client


@contextmanager
def remote_workers(address: str) -> Iterator[Any]:
    """Connect to the workers of the scheduler at an address, "tcp://10.0.0.1:8786"; SaglineError without workers."""
    check_address(address)
    check_package("distributed", "a scheduler")
    with _silence_dask():
        import distributed

        api: Any = distributed

        try:
            client = api.Client(address, timeout=PATIENCE, set_as_default=False)
        except (OSError, ValueError, RuntimeError, MemoryError) as error:  # last: another program answers
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
    """Checked address of a scheduler."""
    if isinstance(address, str) and address.isprintable() and address.isascii():
        scheme = next((each for each in SCHEMES if address.startswith(each)), None)
        host, _, port = address.removeprefix(scheme or "").rpartition(":")
        if scheme and host and " " not in host and port.isdecimal() and 0 < int(port) < 1 << 16:
            return address
    raise InvalidValueError("scheduler", brief(address), "an address, tcp://HOST:PORT", "Give the scheduler's address.")


def run_tasks(client: Any, job: Job, numbers: Iterable[int], finish: Finish, tell: Callable[[str], None]) -> None:
    """Run tasks on the workers, a few per worker at a time; after an error or Ctrl-C, wait for the running tasks."""
    import distributed

    api: Any = distributed

    waiting = iter(numbers)
    run = uuid.uuid4().hex[:8]
    which: dict[Any, int] = {}
    ahead = api.as_completed(loop=client.loop)
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
        if future.status == "lost":  # the worker ended before its result was fetched; the scheduler repeats the task
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
    """Suppress Dask's logs and warnings in the block; after a failure, also the logs that come later."""
    loggers = [logging.getLogger(name) for name in LOGGERS]
    levels = [logger.level for logger in loggers]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module=rf"({'|'.join((*LOGGERS, 'dask'))})(\.|$)")
        if is_installed("distributed"):
            import distributed  # noqa: F401 - the import configures the loggers, and must not follow the next lines
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
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HERE, port))
        except OSError:
            return False
    return True


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).splitlines()), type(error).__name__)


def dask_setup(worker: object) -> None:
    """Ignore SIGINT in a worker process, so that it finishes its task; Dask calls this function by its name."""
    if threading.current_thread() is threading.main_thread():
        with suppress(ValueError, OSError):
            signal.signal(signal.SIGINT, signal.SIG_IGN)
