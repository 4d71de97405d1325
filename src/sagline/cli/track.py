"""`sagline track`: one robot along one path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sagline.cli.choices import Model, Tension, Variable
from sagline.cli.entries import FORWARD, needed_for
from sagline.cli.lengths import plan_text
from sagline.cli.results import tell, write_figures, write_plans
from sagline.cli.study import Run, run_along
from sagline.cli.terminal import working
from sagline.cli.values import loaded, wrench_of
from sagline.files.path_file import load_path
from sagline.files.robot_file import load_robot
from sagline.files.whole import check_folder, write_text
from sagline.motion.planar import article_path

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def track(
    robot: str,
    path: Path | None,
    model: Model,
    tension: Tension,
    variable: Variable,
    wrench: str | None,
    payload: str | None,
    folder: Path,
    *,
    figures: bool,
    table: bool,
    as_json: bool,
) -> int:
    """Plan, confirm, write and tell; returns the exit code.

    Raises:
        SaglineError: If an input is wrong or the folder cannot be written; then nothing has been.
    """
    load = wrench_of(wrench)
    machine = loaded(load_robot(robot), payload)
    way = article_path() if path is None else load_path(path)
    check_folder(folder)
    shared = tension.build(variable)
    with working(f"{machine.name}: planning and confirming {len(way):,} poses", *needed_for(shared), FORWARD) as line:
        run = run_along(machine, way, model.build(), shared, line, load)
    with working("writing"):
        files = write_plans([run], folder)
        if table:
            files.append(folder / f"{run.name}.csv")
            write_text(files[-1], plan_text(run.plan))
        if figures:
            files += write_figures(_figures(run), folder)
    return tell([run], files, folder, as_json=as_json)


def _figures(run: Run) -> dict[str, Figure | Axes]:
    from sagline import plot

    way = run.plan.path
    assert way is not None
    return {
        f"{run.name}-path": plot.path(way),
        f"{run.name}-velocity": plot.velocity(way),
        f"{run.name}-cables": plot.overview(run.plan),
        f"{run.name}-error": plot.error(run.confirmation),
    }
