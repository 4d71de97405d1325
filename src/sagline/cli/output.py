"""Tables that the commands print, of which no cell is ever cut, tables as CSV, and the files that they write."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from io import StringIO
from itertools import pairwise
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from sagline.cli.terminal import FREE, show, show_pieces
from sagline.core.errors import printable
from sagline.files.writing import check_files, create_folder

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = ("png", "svg")  # of a figure


@dataclass(frozen=True, slots=True)
class Grid:
    """A table of texts that is split between columns where it would not fit.

    Attributes:
        heads: What stands over each column; in lines, if need be.
        rows: A text for each column.
        title: Over the whole; "" for none.
        keys: How many of the first columns say what a row is: they are repeated in each piece.
        left: Numbers of the columns that are set flush left; the others flush right.
        prose: Numbers of the columns that may be broken into lines, between words.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    title: str = ""
    keys: int = 1
    left: frozenset[int] = field(default=frozenset({0}))
    prose: frozenset[int] = field(default=frozenset())

    def pieces(self, console: Console, width: int) -> list[tuple[Table, int]]:
        """In as few pieces as fit, all of about the same number of columns.

        Args:
            console: Where they go.
            width: Columns of it.

        Returns:
            Each table, and the columns that it needs for nothing in it to be cut.
        """
        full = self._filled(console, width)
        even = list(_split(range(self.keys, len(self.heads)), len(full)))
        for parts in (even, full):  # evenly, if that takes no more pieces
            tables = [self._table([*range(self.keys), *part], first=part[0] == self.keys) for part in parts]
            pieces = [(table, _least(console, table)) for table in tables]
            if all(least <= width for _, least in pieces):
                break
        return pieces

    def _filled(self, console: Console, width: int) -> list[range]:
        """Consecutive columns, as many in each piece as fit; one where not even one does."""
        parts, first, count = [], self.keys, len(self.heads)
        while first < count:
            end = first + 1
            while end < count:
                wider = self._table([*range(self.keys), *range(first, end + 1)], first=False)
                if _least(console, wider) > width:
                    break
                end += 1
            parts.append(range(first, end))
            first = end
        return parts

    def _table(self, columns: Sequence[int], *, first: bool) -> Table:
        """A piece; only the first has the title."""
        title = Text(printable(self.title)) if first and self.title else None
        table = Table(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
        for k in columns:
            texts = [printable(row[k], "\n") for row in (self.heads, *self.rows)]
            parts = [part for text in texts for part in (text.split() if k in self.prose else text.split("\n"))]
            table.add_column(
                Text(texts[0]),
                justify="left" if k in self.left else "right",
                no_wrap=k not in self.prose,
                overflow="fold",
                min_width=max(map(cell_len, parts), default=0),
            )
        for row in self.rows:
            table.add_row(*(Text(printable(row[k], "\n")) for k in columns))
        return table


def show_table(grid: Grid) -> None:
    """Print a table as part of the result."""
    show_pieces(grid.pieces)


def _least(console: Console, table: Table) -> int:
    return Measurement.get(console, console.options.update_width(FREE), table).minimum


def _split(columns: range, count: int) -> Iterable[range]:
    """Consecutive parts that differ in size by one at most."""
    edges = [len(columns) * k // count for k in range(count + 1)]
    return [columns[first:end] for first, end in pairwise(edges)]


def written(number: float, form: str) -> str:
    """A number with a true minus sign, or a dash where there is none."""
    return "–" if isnan(number) else format(number, f"z{form}").replace("-", "−")  # z: no minus zero


def csv_text(rows: Iterable[Sequence[object]]) -> str:
    """The text of a CSV file: with units in brackets, every number to the last bit.

    Args:
        rows: The names of the columns, with units in brackets; then floats of Python, which are written to the last
            bit, and words.
    """
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


class Output:
    """The files that a command writes into a folder; it ends before any work where one could not be written."""

    def __init__(self, folder: Path, names: Iterable[str], figures: Sequence[str] = ()) -> None:
        """Check that all files can be written.

        Args:
            folder: The folder; made when the first file is written.
            names: Names of the files that are no figures.
            figures: Names of the figures, without suffix; each is written as PNG and SVG.

        Raises:
            FileError: If the folder or the place of a file is taken.
        """
        self.folder, self.files = folder, list[Path]()
        self._figures = list(figures)
        if every := [*names, *(f"{name}.{suffix}" for name in figures for suffix in SUFFIXES)]:
            check_files(folder, every)

    def file(self, name: str) -> Path:
        """The path of a file that is about to be written."""
        create_folder(self.folder)
        self.files.append(self.folder / name)
        return self.files[-1]

    def draw(self, *figures: Figure | Axes) -> None:
        """Save figures under the names that were checked, in their order."""
        from sagline.plot import save

        for figure in figures:
            name = self._figures.pop(0)
            for suffix in SUFFIXES:
                save(figure, self.file(f"{name}.{suffix}"))

    def show(self) -> None:
        """Print the folder and the names of what was written in it; the two forms of a figure as one."""
        suffixes: dict[str, list[str]] = {}
        for file in self.files:
            suffixes.setdefault(file.stem, []).append(file.suffix)
        names = ", ".join(f"{stem}{'/'.join(found)}" for stem, found in suffixes.items())
        show(f"In {self.folder.resolve()}: {names}", whole=True)
