"""`sagline design`: the search for a better robot."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import Output, TextTable, number_text
from sagline.cli.terminal import show_note, working
from sagline.files.writing import create_folder

FIGURE: Final = "front"
MOST_ROWS: Final = 12  # largest number of printed robots; front.csv lists all of them


def design(
    robot: str = opt.ROBOT,
    file: Path = opt.argument(opt.NEEDED, "DESIGN", "File with design variables, bounds and goals (design.yaml)."),
    evaluations: str | None = opt.option(
        None, "NUMBER", "Number of robots to evaluate. Default: the number in the file."
    ),
    files: opt.Files = opt.Files(opt.out(Path("front")), table=False),
) -> None:
    r"""Search for a better robot. A file states the design variables (anchors, cables, limits) and the goals.

    The best robots are written as robot files, and front.csv lists these robots. Every robot is written to the folder
    as soon as it is evaluated. Therefore the same command continues the search after Ctrl-C, or with more
    --evaluations.

    For example:

        sagline design own_robot.yaml design.yaml --out front
        sagline design own_robot.yaml design.yaml --out front \
            --evaluations 600
    """
    from sagline.optimization.design import FRONT
    from sagline.optimization.request import MOST_EVALUATIONS

    first, request = sl.load_robot(robot), sl.load_design(file)
    if evaluations is not None:
        request["evaluations"] = opt.whole_of(evaluations, "--evaluations", 1, MOST_EVALUATIONS)
    output = Output(files, "", [FRONT], [FIGURE])
    rated = [0]
    with working(f"{first.name}: evaluating robots") as line:

        def show_progress(done: int, total: int) -> None:
            rated[0] = done
            line.progress(done, total)

        try:
            create_folder(files.folder.absolute().parent)
            front = sl.design(first, **request, folder=files.folder, progress=show_progress)
        except KeyboardInterrupt:
            show_note("", f"{rated[0]:,} evaluated robots are in {files.folder}: the same command continues.")
            raise
        output.files = front.save(files.folder)
        line.stage("drawing")
        output.draw(lambda: sl.plot.front(front))
    output.report(lambda: _record(front), front.text, lambda: _table(front).show())


def _table(front: sl.Front) -> TextTable:
    heads = ["", *(f"{goal.kind}\n[{goal.unit}]" if goal.unit else goal.kind for goal in front.goals)]
    heads += [f"{part.name}\n[{part.unit}]" if part.unit else part.name for part in front.parts]
    rows = [[front.start.name, *_cells(front.start_values), *_cells([part.start for part in front.parts])]]
    rows += [[name, *_cells(values), *_cells(changed)] for name, values, changed in _better(front)]
    return TextTable(heads, rows[:MOST_ROWS])


def _better(front: sl.Front) -> list[tuple[str, Any, Any]]:
    """For each robot that is better than the first one: name, values of the goals, values of the design variables."""
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
