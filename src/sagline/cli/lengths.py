"""`sagline lengths`: the planned lengths of a run, as `sagline forward` and controllers read them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sagline.arrays import Array
from sagline.cli.csv_text import csv_text
from sagline.cli.ending import OUTSIDE
from sagline.cli.terminal import note, show_data
from sagline.errors import FileError
from sagline.files.plan_file import load_plan
from sagline.files.whole import write_text
from sagline.kinematics.status import PoseStatus

if TYPE_CHECKING:
    from sagline.kinematics.plan import Plan


def write_lengths(file: Path, out: Path | None) -> int:
    """Write times and lengths of the feasible samples to a file or to stdout; returns the exit code.

    Raises:
        SaglineError: If the run cannot be read, none of it is feasible, or the file cannot be written.
    """
    if out is not None and out.exists() and out.resolve() == file.resolve():
        raise FileError(out, "is the run itself", "Name another file with --out.")
    plan = load_plan(file)
    kept = np.atleast_1d(plan.feasible)
    if not kept.any():
        raise FileError(file, "has no feasible sample, and so no lengths", "Plan another path, or raise the limits.")
    lengths = np.atleast_2d(plan.unstrained_length)
    names = [f"L{k} [m]" for k in range(lengths.shape[-1])]
    if plan.path is None:
        text = csv_text([names, *lengths[kept].tolist()])
    else:
        text = csv_text([["time [s]", *names], *np.column_stack((plan.path.time, lengths))[kept].tolist()])
    if out is None:
        show_data(text)
    else:
        write_text(out, text)
    if kept.all():
        return 0
    note("Left out: ", f"{np.sum(~kept):,} of {kept.size:,} samples, which are not feasible", style="bold red")
    return OUTSIDE


def plan_text(plan: Plan) -> str:
    """A whole plan as CSV: time, pose, lengths, tensions and how each sample ended; empty where it has no answer."""
    pose, lengths, tensions = plan.state.pose, plan.unstrained_length, plan.chord_tension
    columns: dict[str, Array] = {}
    if plan.path is not None:
        columns["time [s]"] = plan.path.time
    columns |= {f"{axis} [m]": pose.position[..., k] for k, axis in enumerate("xyz")}
    columns |= {f"q{axis}": pose.quaternion[..., k] for k, axis in enumerate("xyzw")}
    columns |= {f"L{k} [m]": lengths[..., k] for k in range(lengths.shape[-1])}
    columns |= {f"T{k} [N]": tensions[..., k] for k in range(tensions.shape[-1])}
    numbers = np.column_stack([np.atleast_1d(column) for column in columns.values()]).tolist()
    words = [PoseStatus(int(code)).name for code in np.atleast_1d(plan.status)]
    body = ([*("" if x != x else x for x in row), word] for row, word in zip(numbers, words, strict=True))
    return csv_text([[*columns, "status"], *body])
