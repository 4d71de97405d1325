"""`sagline forward`: from measured lengths to the poses in which the platform rests."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
from rich.table import Table

from sagline.cli.choices import Model
from sagline.cli.entries import FIT, FORWARD
from sagline.cli.tables import plain_table
from sagline.cli.terminal import OUTSIDE, note, show, show_json, working
from sagline.files.lengths_file import Lengths, load_lengths
from sagline.files.names import file_stem
from sagline.files.robot_file import load_robot
from sagline.files.whole import check_files, made_folder, written_whole
from sagline.kinematics.forward import forward as solve
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.kinematics.forward_status import ForwardStatus

SHOWN = 12  # rows of the table on the terminal; the file has them all
FINE = (ForwardStatus.SOLVED, ForwardStatus.FITTED)
COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw", "force_residual", "moment_residual", "iterations")

Cell = float | str


def forward(name: str, file: Path, model: Model, folder: Path, *, as_json: bool) -> int:
    """Find the poses, tell, and write them; returns the exit code.

    The first sample is searched for without a start; each other begins where the last one ended.

    Raises:
        SaglineError: If an input is wrong or the folder cannot be written.
    """
    robot = load_robot(name)
    size = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    lengths = load_lengths(file, robot.cable_count, size)
    target = folder / f"{file_stem(robot.name, 'poses')}.csv"
    check_files(folder, [target.name])
    entry = FIT if model is Model.STRAIGHT else FORWARD
    with working(f"{robot.name}: finding {len(lengths.unstrained_length):,} poses", entry) as line:
        first = solve(robot, lengths.unstrained_length[0], model=model.build())
        start = first.pose if np.isfinite(first.pose.position).all() else None
        found = solve(robot, lengths.unstrained_length, start=start, model=model.build(), progress=line.progress)
    made_folder(folder)
    rows = _rows(lengths, found)
    with written_whole(target) as partial, partial.open("w", newline="", encoding="utf-8") as stream:
        csv.writer(stream).writerows(rows)
    lost = [k for k, status in enumerate(found.status) if status not in FINE]
    if as_json:
        header = [str(cell).split(" ")[0] for cell in rows[0]]
        show_json({"poses": [dict(zip(header, row, strict=True)) for row in rows[1:]], "file": target})
    else:
        show(_table(rows))
        show(f"In {folder.resolve()}: {target.name}")
    if not lost:
        return 0
    status = ForwardStatus(int(found.status[lost[0]]))
    note(f"{len(lost)} of {len(found.status)} samples, the first in row {lost[0] + 1}: ", status.text, style="bold red")
    return OUTSIDE


def _rows(lengths: Lengths, found: ForwardSolution) -> list[list[Cell]]:
    """Header and one row a sample; the time if it was given."""
    units = {"x": "m", "y": "m", "z": "m", "force_residual": "N", "moment_residual": "N*m"}
    numbers = np.hstack((found.pose.position, found.pose.quaternion, found.wrench_residual)).tolist()
    words = [ForwardStatus(int(code)).name for code in found.status]
    body = [[*row, steps, word] for row, steps, word in zip(numbers, found.iterations.tolist(), words, strict=True)]
    header = [f"{name} [{units[name]}]" if name in units else name for name in (*COLUMNS, "status")]
    if lengths.time is None:
        return [header, *body]
    return [["time [s]", *header], *([time, *row] for time, row in zip(lengths.time.tolist(), body, strict=True))]


def _table(rows: list[list[Cell]]) -> Table:
    header, *body = rows
    table = plain_table()
    for name in header:
        table.add_column(str(name), justify="right")
    for row in body[:SHOWN]:
        table.add_row(*(cell if isinstance(cell, str) else f"{cell:.6g}" for cell in row))
    if len(body) > SHOWN:
        table.add_row("...", *[""] * (len(header) - 1))
    return table
