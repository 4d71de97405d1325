"""`sagline lengths` and `sagline encoder`: lengths and encoder counts of a run."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.options import FileOption, argument, option
from sagline.cli.output import file_of
from sagline.cli.terminal import show_data, show_note, working
from sagline.core.errors import FileError
from sagline.files.writing import create_folder, write_text

if TYPE_CHECKING:
    from sagline.kinematics.plan import Plan


class _Winding(StrEnum):
    """Assumptions about the tension of the cable on the drums."""

    CONSTANT = "constant"
    REMEMBERED = "remembered"


RunArgument = Annotated[Path, argument("RUN.nc", "A run written by sagline track.")]


def lengths(
    file: RunArgument,
    out: FileOption = None,
) -> int:
    """Write the planned lengths of a run as CSV, one row per sample; `sagline forward` and controllers read the file.

    Only feasible samples are written. If others exist, their number is printed on stderr, and the exit code is 1.

    For example:

        sagline lengths output/cogiro-catenary.nc --out lengths.csv
    """
    out = out if out is None else file_of(out, f"{file.stem}-lengths.csv")
    plan = _plan_of(file, out)
    return write_rows(plan, "L{} [m]", np.atleast_2d(plan.unstrained_length).tolist(), out)


def encoder(
    file: RunArgument,
    winding: Annotated[
        _Winding,
        option(
            "WINDING",
            "Tension of the cable on the drums. constant: winding_tension of the winches; remembered: the "
            "tension at the time when the path wound the cable.",
        ),
    ] = _Winding.CONSTANT,
    out: FileOption = None,
) -> int:
    """Write the encoder counts of a run as CSV, one row per sample, for the drives.

    The robot needs drum_radius, groove_pitch, counts_per_turn and length_zero of its winches, and the diameter of its
    cables. Only feasible samples are written. Exit code 1 if some samples are not feasible, or if winches exceed
    their speed_limit or torque_limit.

    For example:

        sagline encoder output/my-robot-catenary.nc --out counts.csv
    """
    from sagline.kinematics.winches import encoder_counts, winch_rates

    out = out if out is None else file_of(out, f"{file.stem}-counts.csv")
    plan = _plan_of(file, out)
    counts = np.atleast_2d(encoder_counts(plan, winding.value))
    whole = [[int(count) if count == count else count for count in row] for row in counts.tolist()]
    code = write_rows(plan, "C{}", whole, out)
    winches = plan.state.one_robot.winches
    if plan.path is None or winches is None or (winches.speed_limit is None and winches.torque_limit is None):
        return code
    with working(f"{file.name}: speeds and torques of the winches"):
        rates = winch_rates(plan)
    for beyond, limit in ((rates.too_fast, "speed_limit"), (rates.too_strong, "torque_limit")):
        if beyond is not None and beyond.any():
            samples = beyond.any(axis=1)
            first, cables = plan.path.time[np.argmax(samples)], ", ".join(map(str, np.flatnonzero(beyond.any(axis=0))))
            many = f"{samples.sum():,} of {samples.size:,} samples, the first at {first:g} s, of cables {cables}"
            show_note(f"Beyond {limit}: ", f"{many}; winch_rates has the values", style="bold red")
    return OUTSIDE if rates.exceeding.any() else code


def write_rows(plan: Plan, name: str, rows: Sequence[Sequence[float]], out: Path | None) -> int:
    """Write `rows` of solved samples, each with its time; returns the exit code. `name` formats a column's head."""
    from sagline.core.table import csv_text

    kept = np.atleast_1d(plan.solved)
    header = [name.format(k) for k in range(len(rows[0]))]
    body = [row for row, is_kept in zip(rows, kept, strict=True) if is_kept]
    if plan.path is None:
        text = csv_text([header, *body])
    else:
        time = plan.path.time[kept].tolist()
        text = csv_text([["time [s]", *header], *([t, *row] for t, row in zip(time, body, strict=True))])
    if out is None:
        show_data(text)
    else:
        create_folder(out.parent)
        write_text(out, text)
    if kept.all():
        return 0
    show_note(
        "Left out: ",
        f"{np.sum(~kept):,} of {kept.size:,} samples, which are not feasible or not stable",
        style="bold red",
    )
    return OUTSIDE


def _plan_of(file: Path, out: Path | None) -> Plan:
    """The plan in the file of a run. FileError if no sample is feasible, or if the output would replace this file."""
    from sagline.files.plan_file import load_plan

    if out is not None and out.exists() and out.resolve() == file.resolve():
        raise FileError(out, "is the run itself", "Name another file with --out.")
    plan = load_plan(file)
    if not plan.solved.any():
        raise FileError(file, "has no solved sample", "Plan another path, or raise the limits.")
    return plan
