"""What the commands say and how they end: results on stdout, everything else on stderr, an exit code that tells."""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any

import typer
from rich.console import Console, RenderableType
from rich.text import Text

from sagline.errors import SaglineError
from sagline.files.json_text import json_text
from sagline.files.whole import finished_files

if TYPE_CHECKING:
    from sagline.cli.line import Line

OUTSIDE, BAD_INPUT, INTERRUPTED = 1, 2, 130
MOST_NAMES = 6  # of files, told when something failed after them

_out = Console(highlight=False, markup=False)
_err = Console(stderr=True, highlight=False, markup=False)


@contextmanager
def reported() -> Iterator[None]:
    """Turn what goes wrong inside into one message and an exit code.

    Raises:
        typer.Exit: With BAD_INPUT for an error that sagline raised on purpose, INTERRUPTED for Ctrl-C.
    """
    with finished_files() as finished:
        try:
            with _interrupts_heard():
                yield
        except SaglineError as error:
            note("Error: ", str(error), style="bold red")
            _tell_finished(finished)
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            note("", "Interrupted. What has been written is whole.")
            raise typer.Exit(INTERRUPTED) from None


def _tell_finished(files: Sequence[Path]) -> None:
    """What was written before something failed, where anything was."""
    if files:
        names = ", ".join(file.name for file in files[:MOST_NAMES])
        more = f" and {len(files) - MOST_NAMES} more" if len(files) > MOST_NAMES else ""
        note("", f"Written before, and whole: {names}{more} in {files[0].parent}")


@contextmanager
def _interrupts_heard() -> Iterator[None]:
    """Ctrl-C ends what is inside even where Python loses it, as it does in a finalizer.

    Raises:
        KeyboardInterrupt: At the moment of Ctrl-C, or, if that one was lost, at the end.
    """
    heard = False

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        heard = True
        sys.unraisablehook = lambda _: None  # what half-made objects say when they are thrown away helps nobody
        signal.default_int_handler(number, frame)

    ours = threading.current_thread() is threading.main_thread()
    if not ours or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        return
    signal.signal(signal.SIGINT, hear)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if heard:
        raise KeyboardInterrupt


@contextmanager
def working(what: str, *needed: str) -> Iterator[Line]:
    """Say what is being done while it is done, where a person watches; and what is compiled, whoever watches.

    Args:
        what: What is being done.
        needed: Entries of the kernels (`sagline.cli.entries`) that it needs: compiled before it begins.
    """
    from sagline.cli.line import shown

    with shown(_err, what) as line:
        line.compile(needed)
        yield line


@contextmanager
def counting(what: str, *needed: str) -> Iterator[Callable[[int, int, str], None]]:
    """The same for parts that have names: how many of how many are done, and which one comes next."""
    with working(what, *needed) as line:

        def tell(done: int, total: int, name: str) -> None:
            line.name(f"{what}: {name}")
            line.progress(done, total)

        yield tell


def note(head: str, text: str, style: str = "") -> None:
    """A message beside the result, on stderr; paths in it are not broken into lines."""
    _err.print(Text.assemble((head, style), text), soft_wrap=True)


def show(what: RenderableType) -> None:
    """Part of the result, for a person; plain text keeps its lines, so that paths in it can be copied."""
    _out.print(what, soft_wrap=isinstance(what, str))


def show_json(what: Any) -> None:
    """The result, for a program: one JSON document; null stands for what is not finite."""
    typer.echo(json_text(what))
