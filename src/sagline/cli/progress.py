"""The progress line: the work, the remaining time, and the compilation of kernels before the work."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from sagline.cli.compilation import Stage, compilation_events, compile_all, first_run_text
from sagline.core.errors import printable
from sagline.core.progress import Progress as ProgressCallback

PATIENCE = 2.0  # s: work that takes longer shows a bar and the time left


class ProgressLine:
    """One live line on a terminal; elsewhere one line per compiled entry."""

    def __init__(self, console: Console, bar: Progress, what: str) -> None:
        """Add the work to a progress bar; the bar is disabled outside a terminal."""
        self._console = console
        self._bar = bar
        self._what = what = printable(what)
        self._task = bar.add_task(what, total=None, visible=bool(what))
        self._compiling: dict[str, Stage] = {}
        self._reported: set[str] = set()

    def stage(self, what: str) -> ProgressCallback:
        """Begin a new part of the work; returns the function that takes its progress."""
        self._what = what = printable(what)
        self._bar.reset(self._task, total=None, description=what)
        return self.progress

    def progress(self, done: int, total: int) -> None:
        """Show the part that is done."""
        self._bar.update(self._task, completed=done, total=total)

    def name(self, what: str) -> None:
        """Rename the work."""
        self._what = what = printable(what)
        self._bar.update(self._task, description=what)

    def compile(self, entries: Sequence[str]) -> None:
        """Compile entries of the kernels."""
        if entries:
            compile_all(entries, self.show_compilation)
            self.stage(self._what)  # the time left does not include the compilation

    def show_compilation(self, stage: Stage) -> None:
        """Show a stage of a compilation; from any thread."""
        self._compiling[stage.words] = stage
        stages = [each for each in self._compiling.values() if not each.finished]
        if self._bar.disable:
            if stage.words not in self._reported:
                self._console.print(Text.assemble(first_run_text([stage])), soft_wrap=True)
        else:
            text = first_run_text(stages) if stages else self._what
            self._bar.update(self._task, description=text, visible=bool(text))
        self._reported.add(stage.words)


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
        line = ProgressLine(console, bar, what)
        with compilation_events(line.show_compilation):
            yield line


class _Late(ProgressColumn):
    """A column that appears when known work takes longer than `PATIENCE`."""

    def __init__(self, column: ProgressColumn) -> None:
        super().__init__()
        self._column = column

    def render(self, task: Task) -> RenderableType:
        return self._column(task) if task.total and (task.elapsed or 0.0) > PATIENCE else Text()
