"""The first run: what a command needs is compiled before it begins, on two cores side by side.

numba compiles under one lock, so a second process is needed. It compiles into a folder of its own, because two
processes that write the same index may mix up their files; what it has finished is moved over, entry by entry.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from sagline.cli.compiling import Stage, heard
from sagline.cli.entries import ENTRIES

PREFIX = "compiling-"
REMOVE = "import shutil, sys; shutil.rmtree(sys.argv[1], ignore_errors=True)"


def cold(names: Sequence[str]) -> list[str]:
    """Those of some entries that are not compiled yet."""
    return [name for name in names if not ENTRIES[name].is_compiled]


def cores() -> int:
    """Processors that this process may use."""
    with suppress(AttributeError):  # not on every system
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def shares(names: Sequence[str]) -> tuple[list[str], list[str]]:
    """What to compile here, and what beside: about the same time for both.

    An entry stays with the one that it comes after, or that would be compiled twice; where that is compiled already,
    here it is found, and here is the file that another version is written into.
    """
    groups: dict[str, list[str]] = {}
    for name in names:
        groups.setdefault(_root(name), []).append(name)
    here: list[str] = []
    beside: list[str] = []
    for group in sorted(groups.values(), key=lambda group: (_begins(group), -_seconds(group))):
        (here if not _begins(group) or _seconds(here) <= _seconds(beside) else beside).extend(group)
    return here, beside


def compile_all(names: Sequence[str], tell: Callable[[Stage], None]) -> None:
    """Have entries compiled and return when all are, with two cores side by side; nothing is left if interrupted.

    Args:
        names: Words of the entries; those that are compiled take no time.
        tell: Told what the other process compiles, from a thread of its own.
    """
    waiting = cold(names)
    here, beside = shares(waiting) if cores() > 1 else (waiting, [])
    if not beside:
        for name in here:
            ENTRIES[name].compile()
        return
    with suppress(OSError), Side(beside) as side:

        def listen() -> None:
            for stage in side.stages():
                tell(stage)

        listener = threading.Thread(target=listen, daemon=True)
        listener.start()
        for name in here:
            ENTRIES[name].compile()
        while listener.is_alive():
            listener.join(0.1)  # an interrupt is heard in between
        side.take_over()
    for name in cold(waiting):  # the other process failed
        ENTRIES[name].compile()


class Side:
    """Another process that compiles entries; it ends with the block, and with this process, whatever ends that."""

    def __init__(self, names: Sequence[str]) -> None:
        """Start it.

        Args:
            names: Words of the entries.

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
            [sys.executable, "-m", "sagline.cli.cold_start", *names],
            env={**os.environ, "NUMBA_CACHE_DIR": str(self._folder)},
            stdin=subprocess.PIPE,  # its end of file tells that this process has ended
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,  # Ctrl-C is for this process, which then ends that one
        )

    def __enter__(self) -> Side:
        """It runs already."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End it, if it has not ended."""
        self.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            assert stream is not None
            with suppress(OSError, ValueError):
                stream.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def kill(self) -> None:
        """End it at once; from any thread."""
        self._process.kill()

    def stages(self) -> Iterator[Stage]:
        """What it says, until it ends."""
        assert self._process.stdout is not None
        for line in self._process.stdout:
            words, done, expected, finished = line.rstrip("\n").split("\t")
            yield Stage(words, int(done), int(expected), finished == "1")

    def take_over(self) -> None:
        """Move what it has compiled to where this process looks, if nothing is there; waits while this one compiles."""
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
    """Compile entries and say how far it is, a line for every kernel; what the other process runs."""
    threading.Thread(target=_end_with_parent, daemon=True).start()
    ended: list[Stage] = []  # numba tells of an end before it writes the machine code, which is taken over on our word

    def tell(stage: Stage) -> None:
        written()
        if stage.finished:
            ended.append(stage)
        else:
            _say(stage)

    def written() -> None:
        while ended:
            _say(ended.pop())

    with heard(tell):
        for name in names:
            ENTRIES[name].compile()
            written()


def _say(stage: Stage) -> None:
    print(stage.words, stage.done, stage.expected, int(stage.finished), sep="\t", flush=True)


def _end_with_parent() -> None:
    from sagline.kernels.jit import FOLDER

    os.read(0, 1)  # nothing is ever written: it returns when the other process has ended
    if FOLDER.parent.name.startswith(PREFIX):
        # another program in this process: nothing compiles on and writes a file behind what is removed
        os.execv(sys.executable, [sys.executable, "-c", REMOVE, str(FOLDER.parent)])
    os._exit(1)


def _root(name: str) -> str:
    """The first of the entries that are compiled for one."""
    after = ENTRIES[name].after
    return name if after is None else _root(after)


def _begins(group: Sequence[str]) -> bool:
    """Whether what each comes after is to be compiled as well."""
    return all(ENTRIES[name].after in (None, *group) for name in group)


def _seconds(names: Sequence[str]) -> float:
    return sum(ENTRIES[name].seconds for name in names)


if __name__ == "__main__":
    main(sys.argv[1:])
