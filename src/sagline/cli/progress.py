"""The progress line on a terminal: the name of the work, and the remaining time if the work is long."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from sagline.core.errors import printable
from sagline.core.progress import Progress as ProgressCallback

PATIENCE = 2.0  # time [s] after which the line shows a bar and the remaining time


class ProgressLine:
    """One line that is updated on a terminal; no effect outside a terminal."""

    def __init__(self, bar: Progress, what: str) -> None:
        """Add the work to a progress bar; the bar is disabled outside a terminal."""
        self._bar = bar
        self._task = bar.add_task(printable(what), total=None)

    def stage(self, what: str) -> ProgressCallback:
        """Begin a new part of the work; returns the function that reports the progress of this part."""
        self._bar.reset(self._task, total=None, description=printable(what))
        return self.progress

    def progress(self, done: int, total: int) -> None:
        """Show the progress of the current part."""
        self._bar.update(self._task, completed=done, total=total)

    def name(self, what: str) -> None:
        """Rename the work."""
        self._bar.update(self._task, description=printable(what))


@contextmanager
def progress_line(console: Console, what: str) -> Iterator[ProgressLine]:
    """Show a progress line while inside."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        _Late(BarColumn()),
        _Late(TimeRemainingColumn()),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield ProgressLine(bar, what)


class _Late(ProgressColumn):
    """A column that appears if work of known size takes longer than `PATIENCE`."""

    def __init__(self, column: ProgressColumn) -> None:
        super().__init__()
        self._column = column

    def render(self, task: Task) -> RenderableType:
        return self._column(task) if task.total and (task.elapsed or 0.0) > PATIENCE else Text()
