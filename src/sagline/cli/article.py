"""`sagline run`, `article` and `experiment`: the article's test, studies and experiment."""

from __future__ import annotations

from collections import Counter
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import FigureMaker, Output, TextTable, number_text
from sagline.cli.terminal import show_json, show_note, show_text, working
from sagline.cli.track import ConfirmedRun, run_name, tell
from sagline.core.errors import nearest
from sagline.core.numbers import n

if TYPE_CHECKING:
    from sagline.article.experiment import Experiment, Tell

ROBOTS = ("article-suspended", "article-mixed")
FIGURES = ("figure-18-path", "figure-19-velocity", "figure-20-suspended", "figure-21-mixed", "figure-22-error")
HULLS = ("hull-suspended", "hull-mixed")  # workspaces with sag, which the article names as future work
CELLS = 20  # cells along the longest edge of the frame: half a second per robot, and volumes are within 0.2 %


def run(files: opt.Files = opt.Files()) -> int:
    """Run the article's test with two simulated robots and two cable models (empirical, exact). Draw figures 18 to 22.

    The tension distribution has the least norm of the horizontal tensions T_x, as in the article's figures.
    """
    from sagline.workspaces.workspace import amount_of

    models = sl.Empirical(), sl.Catenary()
    # The article's equation (55) selects the tensions closest to the previous ones. However, in its figures,
    # the lower cables are near their minimum tension, and the curves return to their start. Both indicate the minimum
    # norm of T_x.
    tension = sl.MinimumNorm("horizontal")
    robots = [sl.load_robot(name) for name in ROBOTS]
    plans = [run_name(robot, model) for robot in robots for model in models]
    parts = [*(f"{name}.nc" for name in plans), *(f"{name}.glb" for name in HULLS)]
    output = Output(files, "", parts, [*FIGURES, *HULLS], *(f"{name}.csv" for name in plans))
    path, runs = sl.article_path(), []
    with working("planning the article's path, and confirming it with exact cables") as line:
        for robot in robots:
            runs += [ConfirmedRun.along(robot, path, line, model=model, tension=tension) for model in models]
    with working("workspaces of both robots") as line:
        spaces = [sl.workspace(robot, cells=CELLS, progress=line.progress) for robot in robots]
    with working("writing runs, hulls and figures"):
        for name, run in zip(plans, runs, strict=True):
            run.plan.save(output.file(f"{name}.nc"))
            output.table(f"{name}.csv", run.plan.table)
        empirical = (run for run in runs if isinstance(run.plan.state.cables.model, sl.Empirical))
        output.draw(*_figures(*empirical), *(partial(sl.plot.workspace, space) for space in spaces))
        for name, space in zip(HULLS, spaces, strict=True):
            space.surface.export(output.file(f"{name}.glb"))
    notes = [f"The article's path, {len(path):,} poses in {path.duration:g} s; least norm of the horizontal tensions."]
    for space in spaces:
        name, mass = space.robot.name, space.robot.mass
        notes.append(f"The workspace of {name} in its frame is {amount_of(space)}, level, with its {mass:g} kg.")
    return tell(runs, output, notes)


def _figures(suspended: ConfirmedRun, mixed: ConfirmedRun) -> tuple[FigureMaker, ...]:
    """Functions that draw the article's figures 18 to 22 with its cable model, in the order of `FIGURES`."""
    path = suspended.plan.path
    assert path is not None
    return (
        lambda: sl.plot.path(path),
        lambda: sl.plot.velocity(path),
        lambda: sl.plot.overview(suspended.plan),
        lambda: sl.plot.overview(mixed.plan),
        lambda: sl.plot.errors(suspended.confirmation, mixed.confirmation),
    )


def article(
    parts: list[str] | None = opt.argument(
        None,
        "PART",
        "figures N-M, table 2, or a chapter: feasible-sets, intercept, sag, constants, identify, models, simulation, "
        "poses, workspace, errata. Default: everything.",
    ),
    folder: Path = opt.OUTPUT,
    as_json: bool = opt.JSON,
) -> None:
    """Reproduce the article's figures, tables and errata, as one page that compares the article with computed values.

    The page is DIR/article.html and needs no other file. The numbers are in DIR/article.json.

    For example:

        sagline article
        sagline article figures 6-9 --out results
        sagline article errata table 2
    """
    from sagline.article.report import NAMES, write_article

    Output(opt.data_files(folder, table=False), "", NAMES)  # raises an error if a file cannot be written
    what = "reproducing the studies of the article"
    with working(what) as line:

        def progress(done: int, total: int, name: str) -> None:
            line.name(f"{what}: {name}")
            line.progress(done, total)

        report = write_article(folder, parts or [], progress)
    if as_json:
        show_json(report.numbers)
        return
    verdicts = Counter(finding.verdict for chapter in report.chapters for finding in chapter.findings)
    show_note("", ", ".join(f"{count} × {verdict}" for verdict, count in verdicts.items()))
    show_note("", f"The report: {report.page.resolve()}; its numbers: {report.data.name}")


KNOWN: Final = ("article",)
TABLE: Final = "experiment.csv"
PARTS: Final = 1000  # steps of the progress bar


def experiment(
    name: str = opt.argument(opt.NEEDED, "NAME", "article: ten points, Table 2 and figures 25-27."),
    waits: bool = opt.flag(
        False, "Run without real time and network, in half a minute instead of 14 minutes.", "--in-process"
    ),
    true: str | None = opt.TRUE,
    seed: int = opt.seed(1),
    files: opt.Files = opt.data_files(),
) -> None:
    """Repeat the article's experiment: home, the ten points of Table 2, home. One page compares the numbers.

    The controller drives a twin of the prototype, which runs in another process, over S7 and in real time. The
    experiment takes 14 minutes.
    The page is DIR/experiment.html and needs no other file. The numbers are in DIR/experiment.json.

    For example:

        sagline experiment article --in-process
        sagline experiment article
        sagline experiment article --in-process --true worn.yaml --out worn
    """
    from sagline.article.experiment import PROTOTYPE, in_process
    from sagline.article.experiment_page import NAMES, experiment_chapter, write_experiment
    from sagline.files.writing import plain

    if name not in KNOWN:
        near = nearest(name, KNOWN)
        raise sl.InvalidValueError("experiment", repr(name), ", ".join(KNOWN), f"Did you mean {near or KNOWN[0]}?")
    nominal = sl.load_robot(PROTOTYPE)
    real = nominal if true is None else sl.load_robot(true)
    if real.cable_count != nominal.cable_count:
        step = "Begin a robot file with base: article-prototype, and give the values that differ from it."
        raise sl.InvalidValueError("--true", f"a robot of {real.cable_count} cables", f"{nominal.cable_count}", step)
    output = Output(files, "", NAMES, (), TABLE)
    machine = "a twin of the prototype as planned" if true is None else f"a twin of {real.name}"
    way = "in one process, not in real time" if waits else "over four S7 connections, in real time"
    how = f"The controller drove {machine}, {way}; its model was the prototype of Table 1, with assumed anchors."
    with working("home, ten points, home") as line:

        def tell(share: float) -> None:
            line.progress(round(PARTS * share), PARTS)

        result = in_process(real, nominal, seed=seed, tell=tell) if waits else _apart_over_s7(real, nominal, seed, tell)
    place = write_experiment(result, files.folder, how)
    output.table(TABLE, lambda: _rows(result))
    if files.as_json:
        show_json({finding.key: plain(finding.numbers) for finding in experiment_chapter(result, how).findings})
        return
    _tell(result)
    show_note("", f"The report: {place.resolve()}; its numbers: {NAMES[1]}")


def _apart_over_s7(true: sl.Robot, nominal: sl.Robot, seed: int, tell: Tell) -> Experiment:
    """Run the experiment in real time with a twin of `true`, which runs in another process and is connected by S7."""
    from sagline.article.experiment import StopObserver, with_cells
    from sagline.article.experiment import experiment as driven
    from sagline.article.ten_poses import HOME
    from sagline.twin.server import machine_in_process

    with (
        machine_in_process(with_cells(true), nominal, sl.Pose(HOME), seed=seed) as (addresses, position),
        closing(sl.plc.S7Link(addresses, nominal)) as link,
    ):
        watch = StopObserver(position, tell)
        return driven(sl.control.Controller(nominal, link, pace=sl.control.Pace(), record=watch), watch)


def _rows(result: Experiment) -> list[list[object]]:
    """Heads of the columns, then number, desired position, article's distance and own distance of each point."""
    table = result.table
    heads = ["point", *(f"desired {axis} [m]" for axis in "xyz"), "distance, article [m]", "distance [m]"]
    rows = zip(table.points, table.desired.tolist(), table.distance.tolist(), result.distance.tolist(), strict=True)
    return [[*heads], *([point, *place, theirs, ours] for point, place, theirs, ours in rows)]


def _tell(result: Experiment) -> None:
    table = result.table
    places = [", ".join(number_text(x, ".2f") for x in place) for place in table.desired]
    theirs, ours = (1e3 * np.append(each, np.mean(each)) for each in (table.distance, result.distance))
    texts = [number_text(each, ".1f") for each in theirs], [number_text(each, ".3f") for each in ours]
    rows = [list(row) for row in zip((*map(str, table.points), "mean"), (*places, ""), *texts, strict=True)]
    verdict = f"Mean distance of the points {n(ours[-1], '.3f', 'mm')}; {n(theirs[-1], '.1f', 'mm')} in the article."
    TextTable(["point", "desired x, y, z [m]", "article [mm]", "ours [mm]"], rows).show(verdict)
    took = n(result.duration / 60.0, ".1f", "min")
    show_text(f"It took {took}; the fastest winch had {n(1e3 * result.winch_speed, '.0f', 'mm/s')}.")
