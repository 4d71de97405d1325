"""Hears what numba compiles: which entry of the kernels, and how far it is."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from numba.core import event

from sagline.cli.entries import ENTRIES, KERNELS


class Stage(NamedTuple):
    """How far the compilation of an entry is.

    Attributes:
        words: What the entry is for.
        done: Kernels compiled for it so far.
        expected: How many there will be, where nothing was compiled before; 0 if not known.
        finished: Whether it is done.
    """

    words: str
    done: int
    expected: int
    finished: bool = False

    @property
    def share(self) -> str:
        """So many of so many."""
        return f"{self.done} of {self.expected}" if 0 < self.expected >= self.done else f"{self.done}"


class _Listener(event.Listener):
    """Follows the nested compilations; numba compiles under one lock, so there is one nest at a time."""

    def __init__(self, tell: Callable[[Stage], None]) -> None:
        super().__init__()
        self._tell = tell
        self._nest: list[str] = []
        self._stage = Stage("", 0, 0)

    def on_start(self, event: Any) -> None:
        function = event.data["dispatcher"].py_func
        path = f"{function.__module__}.{function.__qualname__}"
        if not self._nest:
            self._stage = _stage(path, event.data["args"])
            self._tell(self._stage)
        self._nest.append(path)

    def on_end(self, event: Any) -> None:
        if self._nest.pop().startswith(KERNELS):
            self._stage = self._stage._replace(done=self._stage.done + 1, finished=not self._nest)
            self._tell(self._stage)


@contextmanager
def heard(tell: Callable[[Stage], None]) -> Iterator[None]:
    """While inside, everything that is compiled is told: entries when they begin, after each kernel, and at the end.

    Args:
        tell: Called by the thread that compiles.
    """
    with event.install_listener("numba:compile", _Listener(tell)):
        yield


def first_run_text(stages: Sequence[Stage]) -> str:
    """What is compiled, and how far it is, on one line."""
    if all(stage.done == 0 for stage in stages):
        return f"First run: compiling {' and '.join(stage.words for stage in stages)} ..."
    return f"First run: compiling {', '.join(f'{stage.words} {stage.share}' for stage in stages)} kernels ..."


def _stage(path: str, types: Any) -> Stage:
    """The beginning of an entry. The second version of one takes a flag where the first takes None."""
    version = 1 if any("none" in str(each) for each in types) else 2
    named = [entry for entry in ENTRIES.values() if KERNELS + entry.path == path]
    for entry in named:
        if entry.version == version or len(named) == 1:
            return Stage(entry.words, 0, entry.kernels)
    return Stage(path.rpartition(".")[2].replace("_", " "), 0, 0)
