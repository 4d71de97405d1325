"""Figures of all commands and examples: axes with units, and texts that are neither cut nor overlapping."""

from __future__ import annotations

import doctest
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from tests.files.executions import execution
from tests.plot.readable import SHOWN, defects
from tests.plot.test_workspace import front_of
from tests.tiers import extended

EXAMPLES = (
    "drawing", "energy", "error", "errors", "frequencies", "frequency_map", "lengths", "overview", "path", "polygon",
    "response", "robot", "simulation", "slice", "small_multiples", "tensions", "velocity", "workspace",
)  # fmt: skip
COMMANDS = {
    "track cogiro own_path.yaml": 4,
    "tension ipanema-1": 1,
    "run": 7,
    "tension cogiro": 1,
    "vibrate cogiro": 1,
    "vibrate cogiro --map 3x3x2 --up-to 2": 2,
    "simulate cogiro --break 3@1s": 2,
    "workspace cogiro --cells 12": 2,
    "workspace own_planar.yaml --cells 12": 1,
    "design winches_robot.yaml design.yaml --evaluations 40": 1,
    "calibrate winches_robot.yaml winches.csv --plot calibration.png": 1,
    "article": 65,
}


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """All figures written during the test."""
    found, plain = list[Figure](), Figure.savefig

    def note(figure: Figure, *arguments: Any, **named: Any) -> None:
        if figure not in found:
            found.append(figure)
        plain(figure, *arguments, **named)

    monkeypatch.setattr(Figure, "savefig", note)
    return found


@extended
@pytest.mark.parametrize(("command", "count"), COMMANDS.items())
def test_figures_of_commands(
    command: str, count: int, figures: list[Figure], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    run = CliRunner().invoke
    assert run(app, ["examples", "--out", "."]).exit_code == 0
    result = run(app, command.split())
    assert result.exit_code == 0, result.stderr
    assert len(figures) == count
    assert {k: found for k, figure in enumerate(figures) if (found := defects(figure))} == {}


@extended
@pytest.mark.parametrize("style", [None, "ieee", "mdpi"])
@pytest.mark.parametrize("name", EXAMPLES)
def test_figures_of_examples(name: str, style: str | None) -> None:
    function = getattr(sl.plot, name)
    test, space = doctest.DocTestFinder(recurse=False).find(function, name)[0], dict[str, Any]()
    test.globs = space
    with sl.plot.style(style) if style else nullcontext():
        doctest.DocTestRunner().run(test, clear_globs=False)
    drawn = {id(one): one for value in space.values() if (one := figure_of(value)) is not None}
    assert drawn
    shown = np.inf if style else SHOWN  # a figure of a journal is not scaled
    assert [defect for figure in drawn.values() for defect in defects(figure, shown)] == []


@extended
@pytest.mark.parametrize("style", [None, "ieee", "mdpi"])
def test_figures_of_executions_and_optimizations(style: str | None) -> None:
    done, goals = execution(), ("mean_margin", "least_margin", "largest_sag")
    with sl.plot.style(style) if style else nullcontext():
        names = ("execution", "states", "measured_tensions", "mendable_tensions", "place_errors")
        drawn = [figure_of(getattr(sl.plot, name)(done)) for name in names]
        drawn += [sl.plot.front(front_of(*goals)), sl.plot.front(front_of(*goals[:1]))]
    shown = np.inf if style else SHOWN
    assert [defect for figure in drawn if figure is not None for defect in defects(figure, shown)] == []


def test_every_figure_is_tested() -> None:
    rest = {"execution", "states", "measured_tensions", "mendable_tensions", "place_errors", "front", "calibration"}
    assert {*EXAMPLES, *rest, "film", "save", "style"} == {*dir(sl.plot)}


def figure_of(value: object) -> Figure | None:
    """The figure of an object that is a figure or belongs to one."""
    if isinstance(value, Axes):
        return value.get_figure(root=True)
    return value if isinstance(value, Figure) else None


@pytest.mark.parametrize(
    ("spoil", "part"),
    [
        (lambda figure: figure.axes[1].tick_params(axis="y", labelleft=False), "no numbers"),
        (lambda figure: figure.axes[3].set_ylabel(""), "no label"),
        (lambda figure: figure.axes[2].set_ylabel("tension"), "no unit"),
        (lambda figure: figure.text(0.99, 0.5, "a long remark"), "cut"),
        (lambda figure: figure.axes[3].xaxis.label.set_fontsize(8.0), " pt"),
        (lambda figure: [figure.text(0.5, 0.5, text) for text in ("one", "other")], "is over"),
        (lambda figure: figure.axes[0].legend([figure.axes[0].lines[0]] * 2, ["one", "other"]), "looks like"),
    ],
)
def test_a_deliberate_defect_is_found(spoil: Any, part: str) -> None:
    plan = sl.inverse(sl.load_robot("cogiro"), sl.quintic_path([(0, 0, 1.5), (2, 1, 2.5)], speed=1.0))
    figure = sl.plot.overview(plan)
    assert defects(figure) == []
    spoil(figure)
    found = defects(figure)
    assert len(found) == 1
    assert part in found[0]
