"""`sagline experiment`: the article's ten points, driven again."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from sagline.article.experiment import PROTOTYPE, Experiment, Tell, Watch, in_process, level, with_cells
from sagline.article.experiment import experiment as driven
from sagline.article.ten_poses import HOME
from sagline.cli.entries import FORWARD, INVERSE, SIMULATION
from sagline.cli.terminal import note, show, show_json, working
from sagline.cli.values import whole_of
from sagline.control.controller import Controller
from sagline.control.pace import Pace
from sagline.core.errors import InvalidValueError, nearest
from sagline.core.numbers import n
from sagline.files.json_text import plain
from sagline.files.robot_file import load_robot
from sagline.files.whole import check_files
from sagline.report.experiment import NAMES, experiment_chapter, write_experiment
from sagline.robot.robot import Robot
from sagline.twin.machine import MOST_SEED

KNOWN: Final = ("article",)
PARTS: Final = 1000  # of the whole, as progress is told


class Asked(NamedTuple):
    """What was asked for, as the command line has it."""

    in_process: bool
    true: str | None
    seed: str
    out: Path
    as_json: bool


def experiment(name: str, asked: Asked) -> None:
    """Do it, write the page and say where it is.

    Raises:
        SaglineError: If there is no such experiment, a robot cannot be read, the folder cannot be written, or the
            experiment ends on the way; then nothing has been written.
    """
    if name not in KNOWN:
        near = nearest(name, KNOWN)
        raise InvalidValueError("experiment", repr(name), ", ".join(KNOWN), f"Did you mean {near or KNOWN[0]}?")
    seed = whole_of(asked.seed, "--seed", 0, MOST_SEED)
    nominal = load_robot(PROTOTYPE)
    true = nominal if asked.true is None else load_robot(asked.true)
    if true.cable_count != nominal.cable_count:
        step = "Begin a robot file with base: article-prototype, and say what is other."
        raise InvalidValueError("--true", f"a robot of {true.cable_count} cables", f"{nominal.cable_count}", step)
    check_files(asked.out, NAMES)
    how = _how(asked, true)
    with working("home, ten points, home", INVERSE, FORWARD, SIMULATION) as line:

        def tell(share: float) -> None:
            line.progress(round(PARTS * share), PARTS)

        result = (
            in_process(true, nominal, seed=seed, tell=tell)
            if asked.in_process
            else apart_over_s7(true, nominal, seed, tell)
        )
    place = write_experiment(result, asked.out, how)
    if asked.as_json:
        show_json({finding.key: plain(finding.numbers) for finding in experiment_chapter(result, how).findings})
        return
    _tell(result)
    note("", f"The report: {place.resolve()}; its numbers: {NAMES[1]}")


def apart_over_s7(true: Robot, nominal: Robot, seed: int, tell: Tell) -> Experiment:
    """Drive a twin in another process, over S7, in real time."""
    from sagline.plc.s7_link import S7Link
    from sagline.twin.apart import apart

    with (
        apart(with_cells(true), nominal, level(HOME), seed=seed) as twin,
        closing(S7Link(twin.addresses, nominal)) as link,
    ):
        watch = Watch(twin.position, tell)
        return driven(Controller(nominal, link, pace=Pace(), record=watch), watch)


def _how(asked: Asked, true: Robot) -> str:
    machine = "a twin of the prototype as it was planned" if asked.true is None else f"a twin of {true.name}"
    way = "in one process, on a clock that waits" if asked.in_process else "over four S7 connections, in real time"
    return f"The controller drove {machine}, {way}; it knew the prototype of Table 1, with our anchors."


def _tell(result: Experiment) -> None:
    """The table, as wide as a small terminal."""
    show("point   desired x, y, z [m]    article [mm]     ours [mm]")
    table = result.table
    for k, point in enumerate(table.points):
        place = ", ".join(f"{x:5.2f}" for x in table.desired[k])
        show(f"{point:<6}  {place:<21}  {1e3 * table.distance[k]:12.1f}  {1e3 * result.distance[k]:12.3f}")
    means = [1e3 * float(np.mean(each)) for each in (table.distance, result.distance)]
    show(f"{'mean':<6}  {'':<21}  {means[0]:12.1f}  {means[1]:12.3f}")
    took = n(result.duration / 60.0, ".1f", "min")
    show(f"It took {took}; the fastest winch had {n(1e3 * result.winch_speed, '.0f', 'mm/s')}.")
