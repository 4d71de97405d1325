"""`sagline run`: the article's test, both simulated robots along its path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sagline.cables.catenary import Catenary
from sagline.cables.empirical import Empirical
from sagline.cli.entries import FORWARD, INVERSE
from sagline.cli.results import figure_files, tell, write_figures, write_plans
from sagline.cli.study import Run, run_along, run_name
from sagline.cli.terminal import show, working
from sagline.files.robot_file import load_robot
from sagline.files.whole import check_files
from sagline.motion.planar import article_path
from sagline.tension.minimum_norm import MinimumNorm

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROBOTS = ("article-suspended", "article-mixed")
MODELS = (Empirical(), Catenary())
FIGURES = ("figure-18-path", "figure-19-velocity", "figure-20-suspended", "figure-21-mixed", "figure-22-error")

# The article describes (55), closest to the tensions before, but shows lower cables near their minimum wherever they
# are not needed and curves that return to where they began: that is the least norm, in its variable T_x.
TENSION = MinimumNorm("horizontal")


def run_article(folder: Path, *, as_json: bool) -> int:
    """Plan, confirm, draw and tell both robots with the article's model and the exact one; returns the exit code.

    Raises:
        SaglineError: If the folder cannot be written; then nothing has been.
    """
    robots = [load_robot(name) for name in ROBOTS]
    plans = [f"{run_name(robot, model)}.nc" for robot in robots for model in MODELS]
    check_files(folder, [*plans, *figure_files(FIGURES)])
    path, runs = article_path(), []
    with working("planning and confirming the article's path", INVERSE, FORWARD) as line:
        for robot in robots:
            runs += [run_along(robot, path, model, TENSION, line) for model in MODELS]
    with working("writing runs and figures"):
        files = write_plans(runs, folder)
        figures = _figures(*(run for run in runs if _is_empirical(run)))
        files += write_figures(dict(zip(FIGURES, figures, strict=True)), folder)
    if not as_json:
        show(f"The article's path, {len(path):,} poses in {path.duration:g} s; least norm of the horizontal tensions.")
    return tell(runs, files, folder, as_json=as_json)


def _is_empirical(run: Run) -> bool:
    return isinstance(run.plan.state.cables.model, Empirical)


def _figures(suspended: Run, mixed: Run) -> tuple[Figure | Axes, ...]:
    """The article's figures 18 to 22, with its own cable model, in the order of FIGURES."""
    from sagline import plot

    path = suspended.plan.path
    assert path is not None
    return (
        plot.path(path),
        plot.velocity(path),
        plot.overview(suspended.plan),
        plot.overview(mixed.plan),
        plot.errors(suspended.confirmation, mixed.confirmation),
    )
