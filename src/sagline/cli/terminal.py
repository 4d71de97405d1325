"""Output of the commands: results on stdout, notes on stderr. Control characters in texts are removed."""

from __future__ import annotations

import errno
import json
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from rich.console import Console, RenderableType
from rich.padding import Padding
from rich.text import Text

from sagline.core.errors import FileError, SaglineWarning, printable
from sagline.core.numbers import SPACE
from sagline.files.writing import json_text

if TYPE_CHECKING:
    from rich.progress import Progress, Task

    from sagline.core.arrays import Progress as ProgressCallback

PATIENCE = 2.0  # time [s] after which the progress line shows a bar and the remaining time
FREE = 1 << 16  # width of output to a file or a pipe, in characters

_out = Console(highlight=False, markup=False, emoji=False)
_wide = Console(highlight=False, markup=False, emoji=False, width=FREE)  # console for files and pipes
_err = Console(stderr=True, highlight=False, markup=False, emoji=False)


class ProgressLine:
    """One line of a terminal that is updated. Without a terminal, it has no effect."""

    def __init__(self, bar: Progress, what: str) -> None:
        """Add the work `what` to a progress bar."""
        self._bar = bar
        self._task = bar.add_task(printable(what), total=None)

    def stage(self, what: str) -> ProgressCallback:
        """Begin a new part of the work. Returns the function that reports the progress of this part."""
        self._bar.reset(self._task, total=None, description=printable(what))
        return self.progress

    def progress(self, done: int, total: int) -> None:
        """Show the progress of the current part."""
        self._bar.update(self._task, completed=done, total=total)

    def name(self, what: str) -> None:
        """Rename the work."""
        self._bar.update(self._task, description=printable(what))


@contextmanager
def working(what: str, console: Console = _err) -> Iterator[ProgressLine]:
    """Show the name `what` of the work inside the `with` block; for long work, show the remaining time too."""
    from rich.progress import BarColumn, Progress, ProgressColumn, SpinnerColumn, TextColumn, TimeRemainingColumn

    class Late(ProgressColumn):
        """A column that appears if work of known size takes longer than `PATIENCE`."""

        def __init__(self, column: ProgressColumn) -> None:
            super().__init__()
            self._column = column

        def render(self, task: Task) -> RenderableType:
            return self._column(task) if task.total and (task.elapsed or 0.0) > PATIENCE else Text()

    name = TextColumn("{task.description}", markup=False)
    columns = (SpinnerColumn(), name, Late(BarColumn()), Late(TimeRemainingColumn()))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        yield ProgressLine(bar, what)


@contextmanager
def notices() -> Iterator[None]:
    """Print the warnings of sagline as notes on stderr inside the `with` block."""
    with warnings.catch_warnings():
        others = warnings.showwarning

        def tell(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if issubclass(category, SaglineWarning):
                show_note("Note: ", str(message), style="bold")
            else:
                others(message, category, *place, **more)

        warnings.simplefilter("always", SaglineWarning)
        warnings.showwarning = tell
        yield


def show_note(head: str, text: str, style: str = "") -> None:
    """Print one line on stderr. The terminal does not break a path in the line."""
    with suppress(OSError):  # if stderr is closed, the message is lost
        _err.print(Text.assemble((printable(head), style), printable(text).replace(SPACE, " ")), soft_wrap=True)


def show_text(what: str, indent: int = 0, style: str = "", *, whole: bool = False) -> None:
    """Print a part of the result. Long lines are broken between words, except if `whole`, which is meant for paths."""
    if whole:
        _emit(Text(printable(what), style))
    else:
        text = Text(printable(what, "\n" if indent else ""), style)
        show_pieces(lambda console, width: [(Padding(text, (0, 0, 0, indent), expand=False) if indent else text, 0)])


def show_pieces(pieces: Callable[[Console, int], Iterable[tuple[RenderableType, int]]]) -> None:
    """Print parts of the result. `pieces` returns the parts for a width, each with its smallest width."""
    console = _out if _out.is_terminal else _wide
    for piece, least in pieces(console, console.width):
        _emit(piece, max(console.width, least))


def show_json(what: Any) -> None:
    """Print the result as one JSON document, for programs. null replaces numbers that are not finite."""
    _write("".join(c if _fits(c) else json.dumps(c)[1:-1] for c in json_text(what)) + "\n")


def show_data(text: str) -> None:
    """Print the text of a file in UTF-8. On a terminal, control characters are removed."""
    if sys.stdout is None or sys.stdout.isatty():
        _write(printable(text, "\n\t"))
        return
    _write("")
    with _refused():
        sys.stdout.buffer.write(text.encode("utf-8"))
        sys.stdout.buffer.flush()


def _fits(character: str) -> bool:
    try:
        character.encode(_encoding())
    except UnicodeEncodeError:
        return False
    return True


def _emit(what: RenderableType, width: int | None = None) -> None:
    """Print `what` with lines of `width`. If `width` is None, lines are not broken."""
    console = _out if _out.is_terminal else _wide
    with _refused(), console.capture() as captured:
        console.print(what, width=width, soft_wrap=width is None, crop=False)
    _write(captured.get().replace(SPACE, " "))  # plain spaces, so that text in a pipe can be searched


def _write(text: str) -> None:
    """Write to stdout. Only this function and `show_data` write to stdout."""
    with _refused():
        sys.stdout.write(text.encode(_encoding(), "backslashreplace").decode(_encoding()))
        sys.stdout.flush()


@contextmanager
def _refused() -> Iterator[None]:
    """Convert an OSError of stdout to a FileError, except for BrokenPipeError, raised without a reader."""
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, "it is closed")
        yield
    except BrokenPipeError:
        raise
    except OSError as error:
        raise unwritable(error) from None


def unwritable(error: OSError) -> FileError:
    """FileError for a stdout that cannot be written."""
    reason = "it is closed" if error.errno == errno.EBADF else error.strerror or error
    step = "Give it a file with space, a pipe or a terminal."
    return FileError("standard output", f"cannot be written ({reason})", step)


def _encoding() -> str:
    return getattr(sys.stdout, "encoding", None) or "utf-8"
