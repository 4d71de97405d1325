"""What a run leaves behind: files in a folder, and their names."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMS = ("png", "svg")  # of a figure


def figure_files(names: Iterable[str]) -> list[str]:
    """Names of the files of figures of these names."""
    return [f"{name}.{suffix}" for name in names for suffix in FORMS]


def write_figures(figures: Mapping[str, Figure | Axes], folder: Path) -> list[Path]:
    """Save each figure as PNG and SVG under its name; returns the files."""
    from sagline.plot import save

    files = []
    for name, figure in figures.items():
        for file in figure_files([name]):
            files.append(folder / file)
            save(figure, files[-1])
    return files


def listed(files: Sequence[Path]) -> str:
    """Names, those of a figure's two forms as one."""
    suffixes: dict[str, list[str]] = {}
    for file in files:
        suffixes.setdefault(file.stem, []).append(file.suffix)
    return ", ".join(f"{stem}{'/'.join(found)}" for stem, found in suffixes.items())
