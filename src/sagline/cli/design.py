"""`sagline design`: the search for a better robot."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Final

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.terminal import show_note, working
from sagline.files.writing import create_folder

FIGURE: Final = "front"
MOST_ROWS: Final = 12  # largest number of printed robots; front.csv lists all of them


def design(
    robot: opt.RobotArgument,
    file: Annotated[Path, opt.argument("DESIGN", "File with design variables, their bounds and goals, design.yaml.")],
    out: opt.OutOption = Path("front"),
    evaluations: Annotated[
        str | None, opt.option("NUMBER", "Number of robots to evaluate. Default: the number in the file.")
    ] = None,
    figures: opt.FiguresOption = True,
    formats: opt.FormatsOption = opt.USUAL_FORMATS,
    style: opt.StyleOption = opt.FigureStyle.PLAIN,
    as_json: opt.JsonOption = False,
) -> None:
    r"""Search for a better robot; a file states the design variables (anchors, cables, limits) and the goals.

    The best robots are written as robot files, and front.csv lists them. The folder receives every robot as soon as it
    is evaluated. Therefore the same command continues the search after Ctrl-C, or with more --evaluations.

    For example:

        sagline design own_robot.yaml design.yaml --out front
        sagline design own_robot.yaml design.yaml --out front \
            --evaluations 600
    """
    from sagline.optimization.front import FRONT
    from sagline.optimization.request import MOST_EVALUATIONS

    first, request = sl.load_robot(robot), sl.load_design(file)
    if evaluations is not None:
        request["evaluations"] = opt.whole_of(evaluations, "--evaluations", 1, MOST_EVALUATIONS)
    output = Output(out, "", [FRONT], [FIGURE] * figures, formats, style)
    rated = [0]
    with working(f"{first.name}: evaluating robots") as line:

        def show_progress(done: int, total: int) -> None:
            rated[0] = done
            line.progress(done, total)

        try:
            create_folder(out.absolute().parent)
            front = sl.design(first, **request, folder=out, progress=show_progress)
        except KeyboardInterrupt:
            show_note("", f"{rated[0]:,} evaluated robots are in {out}: the same command continues.")
            raise
        output.files = front.save(out)
        if figures:
            line.stage("drawing")
            output.draw(lambda: sl.plot.front(front))
    output.report(lambda: _record(front), front.text, lambda: show_table(_table(front)), as_json=as_json)


def _table(front: sl.Front) -> TextTable:
    """The first robot and the best robots: goals, then the design variables."""
    heads = ["", *(f"{goal.kind}\n[{goal.unit}]" if goal.unit else goal.kind for goal in front.goals)]
    heads += [f"{part.name}\n[{part.unit}]" if part.unit else part.name for part in front.parts]
    rows = [[front.start.name, *_cells(front.start_values), *_cells([part.start for part in front.parts])]]
    rows += [[name, *_cells(values), *_cells(changed)] for name, values, changed in _better(front)]
    return TextTable(heads, rows[:MOST_ROWS])


def _better(front: sl.Front) -> list[tuple[str, Any, Any]]:
    """Name, goals and design variables of each robot that is better than the first one."""
    names = [robot.name for robot in front.robots]
    return list(zip(names, front.values, front.changed, strict=True)) if front.better else []


def _cells(values: Any) -> list[str]:
    return [number_text(float(value), ".4g") for value in values]


def _record(front: sl.Front) -> dict[str, object]:
    goals, parts = [goal.kind for goal in front.goals], [part.name for part in front.parts]
    units = {goal.kind: goal.unit for goal in front.goals} | {part.name: part.unit for part in front.parts}
    return {
        "robot": front.start.name,
        "better": front.better,
        "evaluations": len(front.evaluated),
        "goals": dict(zip(goals, front.start_values, strict=True)),
        "units": units,
        "robots": [
            {
                "robot": name,
                "goals": dict(zip(goals, values, strict=True)),
                "changed": dict(zip(parts, changed, strict=True)),
            }
            for name, values, changed in _better(front)
        ],
    }
