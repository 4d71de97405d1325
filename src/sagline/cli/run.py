"""`sagline run`: the article's two simulated robots along the article's path."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from sagline.cli.options import (
    USUAL_FORMATS,
    FiguresOption,
    FigureStyle,
    FormatsOption,
    JsonOption,
    OutOption,
    StyleOption,
    TableOption,
)
from sagline.cli.output import Output
from sagline.cli.terminal import working

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sagline.cli.study import ConfirmedRun

ROBOTS = ("article-suspended", "article-mixed")
FIGURES = ("figure-18-path", "figure-19-velocity", "figure-20-suspended", "figure-21-mixed", "figure-22-error")
HULLS = ("hull-suspended", "hull-mixed")  # the article names workspaces with sag as future work
CELLS = (
    20  # cells along the longest edge of the frame: this takes half a second per robot, and volumes are within 0.2 %
)


def run(
    folder: OutOption = Path("output"),
    figures: FiguresOption = True,
    formats: FormatsOption = USUAL_FORMATS,
    style: StyleOption = FigureStyle.PLAIN,
    table: TableOption = False,
    as_json: JsonOption = False,
) -> int:
    """Run the article's test: two simulated robots, the empirical and the exact cable model, figures 18 to 22.

    The tension distribution has the least norm of the horizontal tensions T_x, as in the article's figures.
    """
    from sagline.cables.models import Catenary, Empirical
    from sagline.cli.study import run_along, run_name, tell
    from sagline.files.robot_file import load_robot
    from sagline.motion.rest_to_rest import article_path
    from sagline.tension.methods import MinimumNorm
    from sagline.workspaces.workspace import amount_of, workspace

    models = Empirical(), Catenary()
    # The article's equation (55) selects the tensions closest to the previous ones. However, its figures show lower
    # cables near their minimum tension, and curves that return to their start. Both mean the minimum norm of T_x.
    tension = MinimumNorm("horizontal")
    robots = [load_robot(name) for name in ROBOTS]
    plans = [run_name(robot, model) for robot in robots for model in models]
    files = [f"{name}.{kind}" for name in plans for kind in ("nc", *["csv"] * table)]
    drawn = [*FIGURES, *HULLS] if figures else []
    output = Output(folder, "", [*files, *(f"{name}.glb" for name in HULLS)], drawn, formats, style)
    path, runs = article_path(), []
    with working("planning the article's path, and confirming it with exact cables") as line:
        for robot in robots:
            runs += [run_along(robot, path, model, tension, line) for model in models]
    with working("workspaces of both robots") as line:
        spaces = [workspace(robot, cells=CELLS, progress=line.progress) for robot in robots]
    with working("writing runs, hulls and figures"):
        for name, run in zip(plans, runs, strict=True):
            run.plan.save(output.file(f"{name}.nc"))
            if table:
                output.table(f"{name}.csv", run.plan.table().rows)
        if figures:
            from sagline import plot

            empirical = (run for run in runs if isinstance(run.plan.state.cables.model, Empirical))
            output.draw(*_figures(*empirical), *(partial(plot.workspace, space) for space in spaces))
        for name, space in zip(HULLS, spaces, strict=True):
            space.surface.export(output.file(f"{name}.glb"))
    notes = [f"The article's path, {len(path):,} poses in {path.duration:g} s; least norm of the horizontal tensions."]
    for space in spaces:
        name, mass = space.robot.name, space.robot.mass
        notes.append(f"The workspace of {name} in its frame is {amount_of(space)}, level, with its {mass:g} kg.")
    return tell(runs, output, notes, as_json=as_json)


def _figures(suspended: ConfirmedRun, mixed: ConfirmedRun) -> tuple[Callable[[], Figure | Axes], ...]:
    """The article's figures 18 to 22, computed with the article's cable model, in the order of FIGURES."""
    from sagline import plot

    path = suspended.plan.path
    assert path is not None
    return (
        lambda: plot.path(path),
        lambda: plot.velocity(path),
        lambda: plot.overview(suspended.plan),
        lambda: plot.overview(mixed.plan),
        lambda: plot.errors(suspended.confirmation, mixed.confirmation),
    )
