"""`sagline experiment`: repetition of the article's experiment at ten points."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import numpy as np

from sagline.cli.options import (
    JsonOption,
    OutOption,
    SeedOption,
    TableOption,
    TrueOption,
    argument,
    flag,
)
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.terminal import show_json, show_note, show_text, working
from sagline.core.errors import InvalidValueError, nearest
from sagline.core.numbers import n

if TYPE_CHECKING:
    from sagline.article.experiment import Experiment, Tell
    from sagline.robot.robot import Robot

KNOWN: Final = ("article",)
TABLE: Final = "experiment.csv"
PARTS: Final = 1000  # steps of the progress bar


def experiment(
    name: Annotated[str, argument("NAME", "article: ten points, Table 2 and figures 25-27.")],
    waits: Annotated[
        bool, flag("Run without real time and network, in half a minute instead of 14 minutes.", "--in-process")
    ] = False,
    true: TrueOption = None,
    seed: SeedOption = 1,
    folder: OutOption = Path("output"),
    write_table: TableOption = False,
    as_json: JsonOption = False,
) -> None:
    """Repeat the article's experiment (home, the ten points of Table 2, home) as one page that compares the numbers.

    The controller drives a twin of the prototype in another process, over S7 and in real time; this takes 14 minutes.
    The page is DIR/experiment.html and needs no other file. The numbers are in DIR/experiment.json.

    For example:

        sagline experiment article --in-process
        sagline experiment article
        sagline experiment article --in-process --true worn.yaml --out worn
    """
    from sagline.article.experiment import PROTOTYPE, in_process
    from sagline.article.experiment_page import NAMES, experiment_chapter, write_experiment
    from sagline.files.robot_file import load_robot
    from sagline.files.writing import plain

    if name not in KNOWN:
        near = nearest(name, KNOWN)
        raise InvalidValueError("experiment", repr(name), ", ".join(KNOWN), f"Did you mean {near or KNOWN[0]}?")
    nominal = load_robot(PROTOTYPE)
    real = nominal if true is None else load_robot(true)
    if real.cable_count != nominal.cable_count:
        step = "Begin a robot file with base: article-prototype, and give the values that differ from it."
        raise InvalidValueError("--true", f"a robot of {real.cable_count} cables", f"{nominal.cable_count}", step)
    output = Output(folder, "", [*NAMES, *[TABLE] * write_table])
    how = _how(None if true is None else real.name, waits)
    with working("home, ten points, home") as line:

        def tell(share: float) -> None:
            line.progress(round(PARTS * share), PARTS)

        result = in_process(real, nominal, seed=seed, tell=tell) if waits else apart_over_s7(real, nominal, seed, tell)
    place = write_experiment(result, folder, how)
    if write_table:
        output.table(TABLE, _rows(result))
    if as_json:
        show_json({finding.key: plain(finding.numbers) for finding in experiment_chapter(result, how).findings})
        return
    _tell(result)
    show_note("", f"The report: {place.resolve()}; its numbers: {NAMES[1]}")


def apart_over_s7(true: Robot, nominal: Robot, seed: int, tell: Tell) -> Experiment:
    """Drive a twin in another process, over S7, in real time."""
    from sagline.article.experiment import StopObserver, level_poses, with_cells
    from sagline.article.experiment import experiment as driven
    from sagline.article.ten_poses import HOME
    from sagline.control.controller import Controller
    from sagline.control.real_time import Pace
    from sagline.plc.s7_link import S7Link
    from sagline.twin.server import machine_in_process

    with (
        machine_in_process(with_cells(true), nominal, level_poses(HOME), seed=seed) as twin,
        closing(S7Link(twin.addresses, nominal)) as link,
    ):
        watch = StopObserver(twin.position, tell)
        return driven(Controller(nominal, link, pace=Pace(), record=watch), watch)


def _how(true: str | None, waits: bool) -> str:
    machine = "a twin of the prototype as planned" if true is None else f"a twin of {true}"
    way = "in one process, not in real time" if waits else "over four S7 connections, in real time"
    return f"The controller drove {machine}, {way}; its model was the prototype of Table 1, with assumed anchors."


def _rows(result: Experiment) -> list[list[object]]:
    """The heads of the columns, then one row per point: number, desired position and both distances."""
    table = result.table
    heads = ["point", *(f"desired {axis} [m]" for axis in "xyz"), "distance, article [m]", "distance [m]"]
    rows = zip(table.points, table.desired.tolist(), table.distance.tolist(), result.distance.tolist(), strict=True)
    return [[*heads], *([point, *place, theirs, ours] for point, place, theirs, ours in rows)]


def _tell(result: Experiment) -> None:
    table = result.table
    places = [", ".join(number_text(x, ".2f") for x in place) for place in table.desired]
    distances = zip(
        (*table.distance, np.mean(table.distance)), (*result.distance, np.mean(result.distance)), strict=True
    )
    rows = [
        [str(point), place, number_text(1e3 * theirs, ".1f"), number_text(1e3 * ours, ".3f")]
        for point, place, (theirs, ours) in zip((*table.points, "mean"), (*places, ""), distances, strict=True)
    ]
    verdict = f"Mean distance of the points {n(1e3 * np.mean(result.distance), '.3f', 'mm')}"
    verdict += f"; {n(1e3 * np.mean(table.distance), '.1f', 'mm')} in the article."
    show_table(TextTable(["point", "desired x, y, z [m]", "article [mm]", "ours [mm]"], rows), verdict)
    took = n(result.duration / 60.0, ".1f", "min")
    show_text(f"It took {took}; the fastest winch had {n(1e3 * result.winch_speed, '.0f', 'mm/s')}.")
