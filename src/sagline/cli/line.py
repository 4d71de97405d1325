"""The one line that says what is going on: what is done, how long it will take, what is compiled before it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from sagline.cli.cold_start import compile_all
from sagline.cli.compiling import Stage, first_run_text, heard
from sagline.core.errors import printable
from sagline.core.progress import Progress as Told

PATIENCE = 2.0  # s: work that takes longer shows a bar and the time left


class Line:
    """On a terminal one live line; elsewhere only what is compiled is told, each entry once."""

    def __init__(self, console: Console, bar: Progress, what: str) -> None:
        """Begin.

        Args:
            console: Where it is.
            bar: Running, or disabled where nobody watches.
            what: What is being done.
        """
        self._console = console
        self._bar = bar
        self._what = what = printable(what)
        self._task = bar.add_task(what, total=None, visible=bool(what))
        self._compiling: dict[str, Stage] = {}
        self._told: set[str] = set()

    def stage(self, what: str) -> Told:
        """A new part of the work, whose count begins at zero; returns what to call with the count and its end."""
        self._what = what = printable(what)
        self._bar.reset(self._task, total=None, description=what)
        return self.progress

    def progress(self, done: int, total: int) -> None:
        """So much of so much is done."""
        self._bar.update(self._task, completed=done, total=total)

    def name(self, what: str) -> None:
        """The same work, called by another name."""
        self._what = what = printable(what)
        self._bar.update(self._task, description=what)

    def compile(self, entries: Sequence[str]) -> None:
        """Have entries of the kernels compiled before they are needed."""
        if entries:
            compile_all(entries, self.hear)
            self.stage(self._what)  # the time left does not count what was compiled

    def hear(self, stage: Stage) -> None:
        """Something is compiled; from any thread."""
        self._compiling[stage.words] = stage
        stages = [each for each in self._compiling.values() if not each.finished]
        if self._bar.disable:
            if stage.words not in self._told:
                self._console.print(Text.assemble(first_run_text([stage])), soft_wrap=True)
        else:
            text = first_run_text(stages) if stages else self._what
            self._bar.update(self._task, description=text, visible=bool(text))
        self._told.add(stage.words)


@contextmanager
def shown(console: Console, what: str) -> Iterator[Line]:
    """A line while inside."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}", markup=False),
        _Late(BarColumn()),
        _Late(TimeRemainingColumn()),
    )
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        line = Line(console, bar, what)
        with heard(line.hear):
            yield line


class _Late(ProgressColumn):
    """A column that appears when the work takes its time, if it is known how much there is."""

    def __init__(self, column: ProgressColumn) -> None:
        super().__init__()
        self._column = column

    def render(self, task: Task) -> RenderableType:
        return self._column(task) if task.total and (task.elapsed or 0.0) > PATIENCE else Text()
