"""What the commands say and how they end: results on stdout, everything else on stderr, an exit code that tells."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import typer
from rich.console import Console, RenderableType
from rich.text import Text

from sagline.errors import SaglineError
from sagline.files.json_text import json_text

OUTSIDE, BAD_INPUT, INTERRUPTED = 1, 2, 130

_out = Console(highlight=False, markup=False)
_err = Console(stderr=True, highlight=False, markup=False)


@contextmanager
def reported() -> Iterator[None]:
    """Turn what goes wrong inside into one message and an exit code.

    Raises:
        typer.Exit: With BAD_INPUT for an error that sagline raised on purpose, INTERRUPTED for Ctrl-C.
    """
    try:
        yield
    except SaglineError as error:
        note("Error: ", str(error), style="bold red")
        raise typer.Exit(BAD_INPUT) from None
    except KeyboardInterrupt:
        note("", "Interrupted. What has been written is whole.")
        raise typer.Exit(INTERRUPTED) from None


@contextmanager
def working(what: str) -> Iterator[None]:
    """Say what is being done while it is done, where a person watches; and the first time that it compiles."""
    say_if_cold()
    if not _err.is_terminal:
        yield
        return
    with _err.status(f"{what} ..."):
        yield


def say_if_cold() -> None:
    """Say that the first run compiles, where nothing is compiled yet."""
    from sagline.kernels.jit import is_cold

    if is_cold():
        note("First run: ", "compiling the numerical core, about a minute; later runs start at once.", style="bold")


@contextmanager
def counting(what: str) -> Iterator[Callable[[int, int, str], None]]:
    """A progress bar, where a person watches; it is told how much of how much is done, and what comes next."""
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed}/{task.total}"))
    say_if_cold()
    with Progress(*columns, TimeElapsedColumn(), console=_err, transient=True, disable=not _err.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total, name: bar.update(task, completed=done, total=total, description=f"{what}: {name}")


def note(head: str, text: str, style: str = "") -> None:
    """A message beside the result, on stderr; paths in it are not broken into lines."""
    _err.print(Text.assemble((head, style), text), soft_wrap=True)


def show(what: RenderableType) -> None:
    """Part of the result, for a person; plain text keeps its lines, so that paths in it can be copied."""
    _out.print(what, soft_wrap=isinstance(what, str))


def show_json(what: Any) -> None:
    """The result, for a program: one JSON document; null stands for what is not finite."""
    typer.echo(json_text(what))
