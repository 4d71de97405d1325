"""`sagline run`: the article's test, both simulated robots along its path."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sagline.cli.entries import FORWARD, INVERSE, SIGNED_MARGINS
from sagline.cli.options import JsonOption, OutOption
from sagline.cli.results import figure_files, write_figures
from sagline.cli.terminal import show, working
from sagline.files.writing import check_files

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sagline.cli.line import Line
    from sagline.cli.study import Run
    from sagline.robot.robot import Robot
    from sagline.workspaces.space import Workspace

ROBOTS = ("article-suspended", "article-mixed")
FIGURES = ("figure-18-path", "figure-19-velocity", "figure-20-suspended", "figure-21-mixed", "figure-22-error")
HULLS = ("hull-suspended", "hull-mixed")  # the article's future work: where its robots can work, with sag
CELLS = 20  # along the longest edge of the frame: half a second a robot, volumes to 0.2 %


def run(folder: OutOption = Path("output"), as_json: JsonOption = False) -> int:
    """Run the article's test: both simulated robots, its empirical model and the exact one, figures 18 to 22.

    Tensions are the least norm of the horizontal tensions T_x, as the article's figures show them.
    """
    from sagline.cables.models import Catenary, Empirical
    from sagline.cli.study import run_along, run_name, tell, write_plans
    from sagline.files.robot_file import load_robot
    from sagline.motion.rest_to_rest import article_path
    from sagline.tension.methods import MinimumNorm
    from sagline.workspaces.space import amount_of

    models = Empirical(), Catenary()
    # The article describes (55), closest to the tensions before, but shows lower cables near their minimum wherever
    # they are not needed and curves that return to where they began: that is the least norm, in its variable T_x.
    tension = MinimumNorm("horizontal")
    robots = [load_robot(name) for name in ROBOTS]
    plans = [f"{run_name(robot, model)}.nc" for robot in robots for model in models]
    hulls = [f"{name}.glb" for name in HULLS]
    check_files(folder, [*plans, *figure_files([*FIGURES, *HULLS]), *hulls])
    path, runs = article_path(), []
    with working("planning and confirming the article's path", INVERSE, FORWARD) as line:
        for robot in robots:
            runs += [run_along(robot, path, model, tension, line) for model in models]
    with working("where both robots can work", SIGNED_MARGINS) as line:
        spaces = _workspaces(robots, line)
    with working("writing runs, hulls and figures"):
        files = write_plans(runs, folder)
        figures = _figures(*(run for run in runs if isinstance(run.plan.state.cables.model, Empirical)))
        files += write_figures(dict(zip(FIGURES, figures, strict=True)), folder)
        files += _write_hulls(spaces, folder)
    if not as_json:
        show(f"The article's path, {len(path):,} poses in {path.duration:g} s; least norm of the horizontal tensions.")
        for space in spaces:
            name, mass = space.robot.name, space.robot.mass
            show(f"{name} can work in {amount_of(space)} of its frame, level, bearing its {mass:g} kg.")
    return tell(runs, files, folder, as_json=as_json)


def _workspaces(robots: list[Robot], line: Line) -> list[Workspace]:
    """Where the robots can work within their frames, level, bearing their own weight."""
    from sagline.workspaces.workspace import workspace

    return [workspace(robot, cells=CELLS, progress=line.progress) for robot in robots]


def _write_hulls(spaces: list[Workspace], folder: Path) -> list[Path]:
    """A figure and the surface of each; returns the files."""
    from sagline import plot

    files = write_figures({name: plot.workspace(space) for name, space in zip(HULLS, spaces, strict=True)}, folder)
    for name, space in zip(HULLS, spaces, strict=True):
        files.append(folder / f"{name}.glb")
        space.surface.export(files[-1])
    return files


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
