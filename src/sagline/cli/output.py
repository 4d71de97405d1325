"""Tables and files of the commands."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise, starmap
from math import isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table as RichTable
from rich.text import Text

from sagline.cli.options import Files, figure_style
from sagline.cli.terminal import FREE, show_data, show_json, show_pieces, show_text
from sagline.core.errors import FileError, printable
from sagline.files.writing import check_files, check_folder, create_folder, write_text

if TYPE_CHECKING:
    from sagline.core.results import Table

FigureMaker = Callable[[], Any]  # makes a figure of matplotlib, or the axes of a figure

ENDING = re.compile(r"\.[a-z]{1,5}", re.IGNORECASE)  # suffix by which --out is recognized as a file


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of texts. A table that is too wide is printed in pieces, which repeat the first column."""

    heads: Sequence[str]  # heads of the columns; a head may have several lines
    rows: Sequence[Sequence[str]]  # rows, each with one text per column
    title: str = ""  # title of the table; "" for none
    # indices of the left-aligned columns; all others are right-aligned
    left: frozenset[int] = field(default=frozenset({0}))
    # indices of the columns whose cells may be broken into several lines
    prose: frozenset[int] = field(default=frozenset())

    def show(self, verdict: str = "") -> None:
        """Print `verdict`, and the table below."""
        if verdict:
            show_text(verdict, style="bold")
        show_pieces(self.pieces)

    def pieces(self, console: Console, width: int) -> list[tuple[RichTable, int]]:
        """The smallest number of pieces that fit into `width`, with about equal numbers of columns."""
        full = self._filled(console, width)
        edges = [1 + (len(self.heads) - 1) * k // len(full) for k in range(len(full) + 1)]
        even = list(starmap(range, pairwise(edges)))
        for parts in (even, full):  # distribute the columns evenly if this does not need more pieces
            tables = [self._table([0, *part], first=part[0] == 1) for part in parts]
            pieces = [(table, _least(console, table)) for table in tables]
            if all(least <= width for _, least in pieces):
                break
        return pieces

    def _filled(self, console: Console, width: int) -> list[range]:
        """Columns of each piece: at least one, and as many consecutive columns as fit into `width`."""
        parts, first, count = [], 1, len(self.heads)
        while first < count:
            end = first + 1
            while end < count:
                wider = self._table([0, *range(first, end + 1)], first=False)
                if _least(console, wider) > width:
                    break
                end += 1
            parts.append(range(first, end))
            first = end
        return parts

    def _table(self, columns: Sequence[int], *, first: bool) -> RichTable:
        """A piece of a table. Only the first piece has the title."""
        title = Text(printable(self.title)) if first and self.title else None
        table = RichTable(title=title, title_justify="left", title_style="bold", box=SIMPLE_HEAD, pad_edge=False)
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


def _least(console: Console, table: RichTable) -> int:
    return Measurement.get(console, console.options.update_width(FREE), table).minimum


def number_text(number: float, form: str) -> str:
    """A number with a true minus sign, or a dash for NaN."""
    return "–" if isnan(number) else format(number, f"z{form}").replace("-", "−")  # z: no negative zero


def values_of(thing: object, *names: str) -> dict[str, Any]:
    """Attributes of an object for JSON. In `names`, the unit may follow the name of an attribute: "position_m"."""
    return {name: getattr(thing, name if hasattr(thing, name) else name.rpartition("_")[0]) for name in names}


def is_file(out: Path) -> bool:
    """True if `--out` is a file: it has a suffix, and no folder has this name."""
    return ENDING.fullmatch(out.suffix) is not None and not out.is_dir()


def file_of(out: Path, name: str) -> Path:
    """The file that the option `out` means: `out`, or the file `name` if `out` is a folder. Nothing is created."""
    if is_file(out):
        return out
    check_folder(out)
    return out / name


def write_or_show(text: str, out: Path | None) -> None:
    """Write `text` to the file `out`, or print it if `out` is None."""
    if out is None:
        show_data(text)
    else:
        create_folder(out.parent)
        write_text(out, text)


class Output:
    """The files that a command writes. If a file cannot be written, the command fails before any work."""

    def __init__(
        self, given: Files, stem: str, parts: Iterable[str] = (), figures: Sequence[str] = (), *tables: str
    ) -> None:
        """Check that all files can be written. `parts`, `figures` and `tables` are the ends of their names."""
        # `given.folder` may be the path of the first file, whose stem then replaces `stem`, the beginning of all names;
        # if `stem` is "", it must be a folder. Only the ends of the names of figures are without suffix.
        self._given, self._stem, self._main = given, stem, dict[str, str]()  # name of the first file, if it is given
        self.folder, self.files = given.folder, list[Path]()
        self._figures = list(figures) if given.figures else []
        drawn = [f"{name}.{suffix}" for name in self._figures for suffix in given.formats]
        whole = [*parts, *(tables if given.table else ()), *drawn]
        if is_file(given.folder):
            suffix = Path(f"_{whole[0]}").suffix if stem and whole else ""
            if given.folder.suffix.lower() != suffix:
                step = f"Name a folder{f', or a file that ends in {suffix}' if suffix else ''}."
                raise FileError(given.folder, "is not a valid name for the files of this command", step)
            self.folder, self._stem = given.folder.parent, given.folder.stem
            self._main = {whole[0]: given.folder.name}
        if whole:
            check_files(self.folder, map(self._name, whole))

    def _name(self, part: str) -> str:
        return self._main.get(part, f"{self._stem}{part}")

    def file(self, part: str) -> Path:
        """Path of a file that is written next. A missing folder is created."""
        create_folder(self.folder)
        self.files.append(self.folder / self._name(part))
        return self.files[-1]

    def table(self, part: str, rows: Callable[[], Iterable[Sequence[object]] | Table]) -> None:
        """Write a table as CSV if tables are wanted. `rows` returns its rows, or a table of a result."""
        if self._given.table:
            from sagline.core.results import Table, csv_text  # the help does not load it

            found = rows()
            write_text(self.file(part), csv_text(found.rows if isinstance(found, Table) else found))

    def draw(self, *figures: FigureMaker) -> None:
        """Make and save `figures` if figures are wanted. They have the order of their names."""
        if not self._figures:
            return
        from sagline.plot import save

        for make in figures:
            with figure_style(self._given.style):
                figure, name = make(), self._figures.pop(0)
            for suffix in self._given.formats:
                save(figure, self.file(f"{name}.{suffix}"))

    def report(self, record: Callable[[], Mapping[str, object]], verdict: str, tell: Callable[[], None]) -> None:
        """Print `record` and files as JSON if JSON is wanted; otherwise `verdict`, what `tell` prints, and files."""
        if self._given.as_json:
            show_json({**record(), "files": self.files})
        else:
            show_text(verdict, style="bold")
            tell()
            self.show()

    def show(self) -> None:
        """Print the folder and the names of the written files. Each figure is printed once with all its formats."""
        if not self.files:
            return
        suffixes: dict[str, list[str]] = {}
        for file in self.files:
            suffixes.setdefault(file.stem, []).append(file.suffix)
        names = ", ".join(f"{stem}{'/'.join(found)}" for stem, found in suffixes.items())
        show_text(f"In {self.folder.resolve()}: {names}", whole=True)
