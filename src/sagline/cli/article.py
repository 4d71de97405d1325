"""`sagline run`: the article's test, both simulated robots along its path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sagline.cables.catenary import Catenary
from sagline.cables.empirical import Empirical
from sagline.cli.entries import FORWARD, INVERSE
from sagline.cli.results import tell, write_figures, write_plans
from sagline.cli.study import Run, run_along
from sagline.cli.terminal import show, working
from sagline.files.robot_file import load_robot
from sagline.files.whole import check_folder
from sagline.motion.planar import article_path
from sagline.tension.minimum_norm import MinimumNorm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROBOTS = ("article-suspended", "article-mixed")

# The article describes (55), closest to the tensions before, but shows lower cables near their minimum wherever they
# are not needed and curves that return to where they began: that is the least norm, in its variable T_x.
TENSION = MinimumNorm("horizontal")


def run_article(folder: Path, *, as_json: bool) -> int:
    """Plan, confirm, draw and tell both robots with the article's model and the exact one; returns the exit code.

    Raises:
        SaglineError: If the folder cannot be written; then nothing has been.
    """
    check_folder(folder)
    path, runs = article_path(), []
    with working("planning and confirming the article's path", INVERSE, FORWARD) as line:
        for robot in map(load_robot, ROBOTS):
            runs += [run_along(robot, path, model, TENSION, line) for model in (Empirical(), Catenary())]
    with working("writing runs and figures"):
        files = write_plans(runs, folder)
        files += write_figures(_figures(*(run for run in runs if _is_empirical(run))), folder)
    if not as_json:
        show(f"The article's path, {len(path):,} poses in {path.duration:g} s; least norm of the horizontal tensions.")
    return tell(runs, files, folder, as_json=as_json)


def _is_empirical(run: Run) -> bool:
    return isinstance(run.plan.state.cables.model, Empirical)


def _figures(suspended: Run, mixed: Run) -> dict[str, Figure | Axes]:
    """The article's figures 18 to 22, with its own cable model."""
    from sagline import plot

    path = suspended.plan.path
    assert path is not None
    return {
        "figure-18-path": plot.path(path),
        "figure-19-velocity": plot.velocity(path),
        "figure-20-suspended": plot.overview(suspended.plan),
        "figure-21-mixed": plot.overview(mixed.plan),
        "figure-22-error": plot.errors(suspended.confirmation, mixed.confirmation),
    }
