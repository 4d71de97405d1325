"""`sagline forward`: poses of the platform from measured lengths or encoder counts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.options import (
    JsonOption,
    ModelName,
    ModelOption,
    OutOption,
    PayloadOption,
    RobotArgument,
    TableOption,
    WrenchOption,
    argument,
    flag,
)
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.terminal import show_json, show_note, show_text, working

if TYPE_CHECKING:
    from sagline.core.arrays import Array
    from sagline.kinematics.forward_rows import ForwardSolution

SHOWN = 12  # largest number of printed rows; the file has all rows
COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw", "force_residual", "moment_residual", "iterations")
Cell = float | str


def forward(
    name: RobotArgument,
    file: Annotated[
        Path,
        argument("CSV", "Columns length_0, length_1, ... and optionally time. Units in the heads: length_0 [mm]."),
    ],
    counts: Annotated[
        bool, flag("The columns are count_0, count_1, ..., the encoder counts of the robot's winches.", "--counts")
    ] = False,
    model: ModelOption = ModelName.CATENARY,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    folder: OutOption = Path("output"),
    write_table: TableOption = True,
    as_json: JsonOption = False,
) -> int:
    """Find the poses of the platform from measured cable lengths.

    The first sample needs no initial pose. The pose of each sample is the initial pose of the next sample. Exit code 1
    if a sample has no stable equilibrium.

    For example:

        sagline forward cogiro lengths.csv --out poses
        sagline forward my_robot.yaml counts.csv --counts
    """
    from sagline.cli.values import robot_with_payload
    from sagline.files.table import load_readings
    from sagline.files.writing import file_stem
    from sagline.kinematics.forward import forward as solve
    from sagline.kinematics.status import ForwardStatus
    from sagline.kinematics.winches import lengths_from_counts

    robot = robot_with_payload(name, payload)
    size = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    times, lengths = load_readings(file, "count" if counts else "length", robot.cable_count, size)
    if counts:
        lengths = lengths_from_counts(robot, lengths)
    table = "-poses.csv"
    output = Output(folder, file_stem(robot.name), [table] * write_table)
    with working(f"{robot.name}: finding {len(lengths):,} poses") as line:
        first = solve(robot, lengths[0], model=model.build(), wrench=wrench)
        start = first.pose if np.isfinite(first.pose.position).all() else None
        found = solve(robot, lengths, start, model.build(), wrench, progress=line.progress)
    rows = _rows(times, found)
    if write_table:
        output.table(table, rows)
    lost = [k for k, status in enumerate(found.status) if status not in (ForwardStatus.SOLVED, ForwardStatus.FITTED)]
    if as_json:
        header = [str(cell).split(" ")[0] for cell in rows[0]]
        file_of_poses = output.files[0] if output.files else None
        show_json({"poses": [dict(zip(header, row, strict=True)) for row in rows[1:]], "file": file_of_poses})
    else:
        count = len(rows) - 1
        many = f"All {count:,}" if not lost else f"{count - len(lost):,} of {count:,}"
        show_table(_grid(rows), f"{many} samples have a pose in stable equilibrium.")
        if count > SHOWN:
            show_text(f"The first {SHOWN} of {count:,} samples; the CSV file has all of them.")
        output.show()
    if not lost:
        return 0
    status = ForwardStatus(int(found.status[lost[0]]))
    show_note(
        f"{len(lost)} of {len(found.status)} samples, the first in row {lost[0] + 1}: ", status.text, style="bold red"
    )
    return OUTSIDE


def _rows(times: Array | None, found: ForwardSolution) -> list[list[Cell]]:
    """The header, then one row per sample; rows have the time if the input file has it."""
    from sagline.kinematics.status import ForwardStatus

    units = {"x": "m", "y": "m", "z": "m", "force_residual": "N", "moment_residual": "N*m"}
    numbers = np.hstack((found.pose.position, found.pose.quaternion, found.wrench_residual)).tolist()
    words = [ForwardStatus(int(code)).name for code in found.status]
    body = [[*row, steps, word] for row, steps, word in zip(numbers, found.iterations.tolist(), words, strict=True)]
    header = [f"{name} [{units[name]}]" if name in units else name for name in (*COLUMNS, "status")]
    if times is None:
        return [header, *body]
    return [["time [s]", *header], *([time, *row] for time, row in zip(times.tolist(), body, strict=True))]


def _grid(rows: list[list[Cell]]) -> TextTable:
    """The first samples; each row begins with its time or number."""
    header, body = [str(name) for name in rows[0]], rows[1 : SHOWN + 1]
    texts = [[cell if isinstance(cell, str) else number_text(cell, ".6g") for cell in row] for row in body]
    if not header[0].startswith("time"):
        header, texts = ["sample", *header], [[str(k), *row] for k, row in enumerate(texts)]
    return TextTable(header, texts, left=frozenset({len(header) - 1}))
