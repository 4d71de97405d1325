"""`sagline lengths`, `encoder` and `forward`: lengths or counts of a run, and poses from lengths or counts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, file_of, number_text, write_or_show
from sagline.cli.terminal import show_json, show_note, show_text, working
from sagline.core.arrays import Array
from sagline.files.writing import file_stem

RUN = opt.argument(opt.NEEDED, "RUN.nc", "A run written by sagline track.")


def lengths(file: Path = RUN, out: Path | None = opt.STDOUT) -> int:
    """Write the planned lengths of a run as CSV, one row per sample, for `sagline forward` and controllers.

    Only feasible samples are written. If the run has other samples, their number is printed on stderr, and the exit
    code is 1.

    For example:

        sagline lengths output/cogiro-catenary.nc --out lengths.csv
    """
    out = out if out is None else file_of(out, f"{file.stem}-lengths.csv")
    plan = _plan_of(file, out)
    return _write_rows(plan, "L{} [m]", np.atleast_2d(plan.unstrained_length).tolist(), out)


def encoder(
    file: Path = RUN,
    winding: Any = opt.choice(
        "constant",
        "WINDING",
        "Tension of the cable on the drums. constant: winding_tension of the winches; remembered: the tension at the "
        "time when the path wound the cable.",
        ("constant", "remembered"),
    ),
    out: Path | None = opt.STDOUT,
) -> int:
    """Write the encoder counts of a run as CSV, one row per sample, for the drives.

    The robot needs drum_radius, groove_pitch, counts_per_turn and length_zero of its winches, and the diameter of its
    cables. Only feasible samples are written. Exit code 1 if some samples are not feasible, or if winches exceed
    their speed_limit or torque_limit.

    For example:

        sagline encoder output/my-robot-catenary.nc --out counts.csv
    """
    out = out if out is None else file_of(out, f"{file.stem}-counts.csv")
    plan = _plan_of(file, out)
    counts = np.atleast_2d(sl.encoder_counts(plan, winding))
    whole = [[int(count) if count == count else count for count in row] for row in counts.tolist()]
    code = _write_rows(plan, "C{}", whole, out)
    winches = plan.robot.winches
    if plan.path is None or winches is None or (winches.speed_limit is None and winches.torque_limit is None):
        return code
    with working(f"{file.name}: speeds and torques of the winches"):
        rates = sl.winch_rates(plan)
    for beyond, limit in ((rates.too_fast, "speed_limit"), (rates.too_strong, "torque_limit")):
        if beyond is not None and beyond.any():
            samples = beyond.any(axis=1)
            first, cables = plan.path.time[np.argmax(samples)], ", ".join(map(str, np.flatnonzero(beyond.any(axis=0))))
            many = f"{samples.sum():,} of {samples.size:,} samples, the first at {first:g} s, of cables {cables}"
            show_note(f"Beyond {limit}: ", f"{many}; winch_rates has the values", style="bold red")
    return OUTSIDE if rates.exceeding.any() else code


def _write_rows(plan: sl.Plan, name: str, rows: Sequence[Sequence[float]], out: Path | None) -> int:
    """Write `rows` of solved samples with their times. `name` formats the head of a column. Returns the exit code."""
    from sagline.core.results import csv_text

    kept = np.atleast_1d(plan.solved)
    header = [name.format(k) for k in range(len(rows[0]))]
    body = [row for row, is_kept in zip(rows, kept, strict=True) if is_kept]
    if plan.path is None:
        text = csv_text([header, *body])
    else:
        time = plan.path.time[kept].tolist()
        text = csv_text([["time [s]", *header], *([t, *row] for t, row in zip(time, body, strict=True))])
    write_or_show(text, out)
    if kept.all():
        return 0
    missing = f"{np.sum(~kept):,} of {kept.size:,} samples, which are not feasible or not stable"
    show_note("Left out: ", missing, style="bold red")
    return OUTSIDE


def _plan_of(file: Path, out: Path | None) -> sl.Plan:
    """The plan in `file`. FileError if no sample is feasible, or if `out` is the same file."""
    if out is not None and out.exists() and out.resolve() == file.resolve():
        raise sl.FileError(out, "is the run itself", "Name another file with --out.")
    plan = sl.load_plan(file)
    if not plan.solved.any():
        raise sl.FileError(file, "has no solved sample", "Plan another path, or raise the limits.")
    return plan


SHOWN = 12  # largest number of printed rows; the CSV file has all rows
COLUMNS = ("x", "y", "z", "qx", "qy", "qz", "qw", "force_residual", "moment_residual", "iterations")
Cell = float | str


def forward(
    name: str = opt.ROBOT,
    file: Path = opt.argument(
        opt.NEEDED, "CSV", "Columns length_0, length_1, ... and optionally time. Units in the heads: length_0 [mm]."
    ),
    counts: bool = opt.flag(
        False, "The columns are count_0, count_1, ..., the encoder counts of the robot's winches.", "--counts"
    ),
    model: str = opt.MODEL,
    wrench: Any = opt.WRENCH,
    payload: float | None = opt.PAYLOAD,
    files: opt.Files = opt.data_files(table=opt.csv_flag(True)),
) -> int:
    """Find the poses of the platform from measured cable lengths.

    The first sample needs no initial pose. The pose of each sample is the initial pose of the next sample. Exit code 1
    if a sample has no stable equilibrium.

    For example:

        sagline forward cogiro lengths.csv --out poses
        sagline forward my_robot.yaml counts.csv --counts
    """
    from sagline.files.table import load_readings

    robot = opt.robot_with_payload(name, payload)
    size = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    times, lengths = load_readings(file, "count" if counts else "length", robot.cable_count, size)
    if counts:
        lengths = sl.lengths_from_counts(robot, lengths)
    table = "-poses.csv"
    output = Output(files, file_stem(robot.name), (), (), table)
    with working(f"{robot.name}: finding {len(lengths):,} poses") as line:
        first = sl.forward(robot, lengths[0], model=model, wrench=wrench)
        start = first.pose if np.isfinite(first.pose.position).all() else None
        found = sl.forward(robot, lengths, start, model, wrench, progress=line.progress)
    rows = _rows(times, found)
    output.table(table, lambda: rows)
    lost = np.flatnonzero(~np.isin(found.status, (sl.ForwardStatus.SOLVED, sl.ForwardStatus.FITTED))).tolist()
    if files.as_json:
        header = [str(cell).split(" ")[0] for cell in rows[0]]
        file_of_poses = output.files[0] if output.files else None
        show_json({"poses": [dict(zip(header, row, strict=True)) for row in rows[1:]], "file": file_of_poses})
    else:
        count = len(rows) - 1
        many = f"All {count:,}" if not lost else f"{count - len(lost):,} of {count:,}"
        _grid(rows).show(f"{many} samples have a pose in stable equilibrium.")
        if count > SHOWN:
            show_text(f"The first {SHOWN} of {count:,} samples; the CSV file has all of them.")
        output.show()
    if not lost:
        return 0
    status = sl.ForwardStatus(int(found.status[lost[0]]))
    head = f"{len(lost)} of {len(found.status)} samples, the first in row {lost[0] + 1}: "
    show_note(head, status.text, style="bold red")
    return OUTSIDE


def _rows(times: Array | None, found: sl.ForwardSolution) -> list[list[Cell]]:
    """Heads of the columns, then one row per sample. The first column has `times`, if the input file has them."""
    units = {"x": "m", "y": "m", "z": "m", "force_residual": "N", "moment_residual": "N*m"}
    numbers = np.hstack((found.pose.position, found.pose.quaternion, found.wrench_residual)).tolist()
    words = [sl.ForwardStatus(int(code)).name for code in found.status]
    body = [[*row, steps, word] for row, steps, word in zip(numbers, found.iterations.tolist(), words, strict=True)]
    header = [f"{name} [{units[name]}]" if name in units else name for name in (*COLUMNS, "status")]
    if times is None:
        return [header, *body]
    return [["time [s]", *header], *([time, *row] for time, row in zip(times.tolist(), body, strict=True))]


def _grid(rows: list[list[Cell]]) -> TextTable:
    """Table of the first samples. Each row begins with the time or the number of the sample."""
    header, body = [str(name) for name in rows[0]], rows[1 : SHOWN + 1]
    texts = [[cell if isinstance(cell, str) else number_text(cell, ".6g") for cell in row] for row in body]
    if not header[0].startswith("time"):
        header, texts = ["sample", *header], [[str(k), *row] for k, row in enumerate(texts)]
    return TextTable(header, texts, left=frozenset({len(header) - 1}))
