"""Compilation of the kernels that a command needs, before it begins, in two parallel processes.

numba compiles under one lock, so a second process is needed. It compiles into a folder of its own; the files of each
entry are moved when they are complete.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

from numba.core import event

from sagline.cli.entries import ENTRIES, KERNELS

PREFIX = "compiling-"
REMOVE = "import shutil, sys; shutil.rmtree(sys.argv[1], ignore_errors=True)"


class Stage(NamedTuple):
    """Progress of the compilation of an entry.

    Attributes:
        words: Purpose of the entry.
        done: Number of kernels compiled for it so far.
        expected: Number of kernels with an empty cache; 0 if not known.
        finished: Whether it is compiled.
    """

    words: str
    done: int
    expected: int
    finished: bool = False

    @property
    def share(self) -> str:
        """Kernels that are compiled, of all that are expected."""
        return f"{self.done} of {self.expected}" if 0 < self.expected >= self.done else f"{self.done}"


class _Listener(event.Listener):
    """Follows the nested compilations; numba compiles under one lock, so there is one nest at a time."""

    def __init__(self, report: Callable[[Stage], None]) -> None:
        super().__init__()
        self._report = report
        self._nest: list[str] = []
        self._stage = Stage("", 0, 0)

    def on_start(self, event: Any) -> None:
        function = event.data["dispatcher"].py_func
        path = f"{function.__module__}.{function.__qualname__}"
        if not self._nest:
            self._stage = _stage(path, event.data["args"])
            self._report(self._stage)
        self._nest.append(path)

    def on_end(self, event: Any) -> None:
        if self._nest.pop().startswith(KERNELS):
            self._stage = self._stage._replace(done=self._stage.done + 1, finished=not self._nest)
            self._report(self._stage)


@contextmanager
def compilation_events(report: Callable[[Stage], None]) -> Iterator[None]:
    """Report entries while inside: at the begin, after each kernel and at the end, from the thread that compiles."""
    with event.install_listener("numba:compile", _Listener(report)):
        yield


def first_run_text(stages: Sequence[Stage]) -> str:
    """One line on the entries that are being compiled and their progress."""
    if all(stage.done == 0 for stage in stages):
        return f"First run: compiling {' and '.join(stage.words for stage in stages)} ..."
    return f"First run: compiling {', '.join(f'{stage.words} {stage.share}' for stage in stages)} kernels ..."


def _stage(path: str, types: Any) -> Stage:
    """Stage at the start of an entry; in the second version of a kernel, a flag replaces the None of the first."""
    version = 1 if any("none" in str(each) for each in types) else 2
    named = [entry for entry in ENTRIES.values() if KERNELS + entry.path == path]
    for entry in named:
        if entry.version == version or len(named) == 1:
            return Stage(entry.words, 0, entry.kernels)
    return Stage(path.rpartition(".")[2].replace("_", " "), 0, 0)


def not_compiled(names: Sequence[str]) -> list[str]:
    """Names of the entries that are not compiled yet."""
    return [name for name in names if not ENTRIES[name].is_compiled]


def available_cores() -> int:
    """Number of processors that this process may use."""
    with suppress(AttributeError):  # not on every system
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def split_entries(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """Entries for this process and for the other one, with about equal times; dependent entries stay together."""
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(_root(name), []).append(name)
    here: list[str] = []
    beside: list[str] = []
    for group in sorted(groups.values(), key=lambda group: (_begins(group), -_seconds(group))):
        (here if not _begins(group) or _seconds(here) <= _seconds(beside) else beside).extend(group)
    return here, beside


def compile_all(names: Sequence[str], report: Callable[[Stage], None]) -> None:
    """Compile missing entries, in two processes if there are two cores; `report` is called from another thread."""
    waiting = not_compiled(names)
    here, beside = split_entries(waiting) if available_cores() > 1 else (waiting, [])
    if not beside:
        for name in here:
            ENTRIES[name].compile()
        return
    with suppress(OSError), CompilerProcess(beside) as side:

        def listen() -> None:
            for stage in side.stages():
                report(stage)

        listener = threading.Thread(target=listen, daemon=True)
        listener.start()
        for name in here:
            ENTRIES[name].compile()
        while listener.is_alive():
            listener.join(0.1)  # an interrupt is handled in between
        side.move_kernels()
    for name in not_compiled(waiting):  # the other process failed
        ENTRIES[name].compile()


class CompilerProcess:
    """A second process that compiles entries; it ends with the block, and with this process in any case."""

    def __init__(self, names: Sequence[str]) -> None:
        """Start the process for some entries.

        Raises:
            OSError: If it cannot be started.
        """
        from sagline.kernels.jit import FOLDER

        FOLDER.parent.mkdir(parents=True, exist_ok=True)
        self._folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=FOLDER.parent))
        try:
            self._process = self._started(names)
        except OSError:
            shutil.rmtree(self._folder, ignore_errors=True)
            raise

    def _started(self, names: Sequence[str]) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-m", "sagline.cli.compilation", *names],
            env={**os.environ, "NUMBA_CACHE_DIR": str(self._folder)},
            stdin=subprocess.PIPE,  # closed when this process ends, which ends the other process
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,  # Ctrl-C reaches only this process, which then ends the other
        )

    def __enter__(self) -> CompilerProcess:
        """Return the running process."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the process and remove its folder."""
        self.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(OSError, ValueError):
                stream.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def kill(self) -> None:
        """End the process at once; from any thread."""
        self._process.kill()

    def stages(self) -> Iterator[Stage]:
        """Stages reported by the process, until it ends."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            words, done, expected, finished = line.rstrip("\n").split("\t")
            yield Stage(words, int(done), int(expected), finished == "1")

    def move_kernels(self) -> None:
        """Move the compiled kernels into the cache of this process; this process must not compile meanwhile."""
        from numba.core.compiler_lock import global_compiler_lock

        from sagline.kernels.cache import SUFFIX
        from sagline.kernels.jit import FOLDER

        made = self._folder / FOLDER.name
        with global_compiler_lock:
            for code in made.rglob(f"*{SUFFIX}"):
                target = FOLDER / code.relative_to(made)
                if not target.exists():
                    target.parent.mkdir(parents=True, exist_ok=True)
                    os.replace(code, target)


def main(names: Sequence[str]) -> None:
    """Compile entries and print a line for every kernel: main program of the second process."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    ended: list[Stage] = []  # numba reports the end before it writes the machine code, so a line is printed later

    def report(stage: Stage) -> None:
        print_ended()
        if stage.finished:
            ended.append(stage)
        else:
            _print_stage(stage)

    def print_ended() -> None:
        while ended:
            _print_stage(ended.pop())

    with compilation_events(report):
        for name in names:
            ENTRIES[name].compile()
            print_ended()


def _print_stage(stage: Stage) -> None:
    print(stage.words, stage.done, stage.expected, int(stage.finished), sep="\t", flush=True)


def _end_with_parent() -> None:
    from sagline.kernels.jit import FOLDER

    os.read(0, 1)  # returns when the other process has ended, as nothing is ever written
    if FOLDER.parent.name.startswith(PREFIX):
        # replaces the program of this process, so that no compilation writes into the removed folder
        os.execv(sys.executable, [sys.executable, "-c", REMOVE, str(FOLDER.parent)])
    os._exit(1)


def _root(name: str) -> str:
    """First entry of the chain of entries that this entry depends on."""
    after = ENTRIES[name].after
    return name if after is None else _root(after)


def _begins(group: Sequence[str]) -> bool:
    """True if a group contains all entries that its members depend on."""
    return all(ENTRIES[name].after in (None, *group) for name in group)


def _seconds(names: Sequence[str]) -> float:
    return sum(ENTRIES[name].seconds for name in names)


if __name__ == "__main__":
    main(sys.argv[1:])
