"""`sagline log`: a log of the controller, printed or converted."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import Output, TextTable
from sagline.cli.terminal import show_json, show_text, working
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.files.writing import check_file

TABLE: Final = "-cycles.csv"
MOST_EVENTS: Final = 20  # largest number of listed events
MOST_PLANS: Final = 100_000
# limits between the bars of the histogram of delays [s]
LATE: Final = (0.0, 1e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 1e-1, np.inf)
EXTREME: Final = ("name", "value", "unit", "time", "cable")
BAR: Final = 30  # length of the longest bar of the histogram, in characters


def log(
    file: Path = opt.argument(opt.NEEDED, "RUN.mcap", "A log of the controller, also of a controller that was killed."),
    to: Path | None = opt.option(
        None,
        "FILE",
        "Write a file instead of printing: .nc is a data set with the plan; .mcap is a complete log.",
        "--to",
    ),
    plan: str | None = opt.option(
        None, "NUMBER", "Only the cycles of this plan; numbers start at 0. Default: all cycles.", "--plan-number"
    ),
    files: opt.Files = opt.TABLE_FILES,
) -> int:
    """Print a log of the controller: states, largest errors, late cycles and events.

    For example:

        sagline log run.mcap
        sagline log run.mcap --to run.nc
        sagline log killed.mcap --to corrected.mcap
    """
    from sagline.files.execution_file import save

    which = None if plan is None else opt.whole_of(plan, "--plan-number", 0, MOST_PLANS)
    if to is not None:
        check_file(to)
    output = Output(files, file.stem, (), (), TABLE)
    with working(f"reading {file.name}"):
        done = sl.load_execution(file, which)
    if to is not None:
        with working(f"writing {to.name}"):
            save(done, to)
    output.table(TABLE, done.table)
    if files.as_json:
        show_json(_record(done, to))
    elif to is not None:
        show_text(f"{to}: {len(done):,} cycles of {done.robot.name}", whole=True)
    else:
        _tell(done)
    if not files.as_json:
        output.show()
    return 0


def _tell(done: sl.control.Execution) -> None:
    duration = _since(done, done.time[-1]) if len(done) else 0.0
    silent = int(np.count_nonzero(~done.answered))
    show_text(f"{done.robot.name}: {len(done):,} cycles in {n(duration, '.4g', 's')}, {silent:,} without a response.")
    show_text(f"{done.status.name}: {done.reason or done.status.text}")
    TextTable(["state", "time [s]", "cycles"], _states(done)).show()
    largest = [
        [name, n(value, ".3g", unit), "–" if cable is None else str(cable), f"{time:.2f}"]
        for name, value, unit, time, cable in _extremes(done)
    ]
    TextTable(["largest", "value", "cable", "at [s]"], largest).show()
    TextTable(["cycles by their delay", "cycles", ""], _histogram(done), left=frozenset({0, 2})).show()
    if done.events:
        events = done.events[:MOST_EVENTS]
        rows = [[f"{_since(done, each.time):.2f}", f"{each.kind} {each.name}", each.text] for each in events]
        TextTable(["at [s]", "event", "text"], rows, left=frozenset({1, 2}), prose=frozenset({2})).show()
    if len(done.events) > MOST_EVENTS:
        show_text(f"… and {len(done.events) - MOST_EVENTS:,} more events: --to FILE.nc has all of them.")


def _since(done: sl.control.Execution, time: float) -> float:
    return float(time - done.time[0])


def _states(done: sl.control.Execution) -> list[list[str]]:
    """Time and number of cycles in each state of the controller."""
    codes, counts = np.unique(done.state, return_counts=True)
    return [
        [sl.control.State(code).name, f"{count * done.period:.2f}", f"{count:,}"]
        for code, count in zip(codes.tolist(), counts.tolist(), strict=True)
    ]


def _extremes(done: sl.control.Execution) -> list[tuple[str, float, str, float, int | None]]:
    """Name, value, unit, time [s] and cable of each largest error. The cable is None for errors of the platform."""
    errors: list[tuple[str, Array, str]] = [
        ("tension error", done.tension - done.planned_tension, "N"),
        ("tension", done.tension, "N"),
        ("length error", 1e3 * (done.set_length - done.length), "mm"),
        ("correction of a length", 1e3 * done.correction, "mm"),
        ("distance from the plan, estimated", 1e3 * np.linalg.norm(sl.control.position_error(done), axis=1), "mm"),
        ("age of a sample", 1e3 * done.samples.age, "ms"),
        ("delay of a cycle", 1e3 * done.late, "ms"),
    ]
    found = []
    for name, values, unit in errors:
        size = np.abs(values)
        if not np.isfinite(size).any():
            continue
        place = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(size), size, -1.0))), size.shape)
        cable = int(place[1]) if size.ndim == 2 and size.shape[1] == done.robot.cable_count else None
        found.append((name, float(size[place]), unit, _since(done, done.time[place[0]]), cable))
    return found


def _histogram(done: sl.control.Execution) -> list[list[str]]:
    """Histogram of the cycles' delays, without the empty bars at its end."""
    counts = [int(np.count_nonzero(done.late <= 0.0))]
    counts += [int(np.count_nonzero((done.late > low) & (done.late <= high))) for low, high in pairwise(LATE)]
    names = ["not at all", *(f"up to {n(high, '.3g', 's')}" for high in LATE[1:-1])]
    names.append(f"more than {n(LATE[-2], '.3g', 's')}")
    last = max((k for k, count in enumerate(counts) if count), default=0)
    most = max(*counts, 1)
    return [
        [name, f"{count:,}", "█" * round(BAR * count / most) or "▏" * bool(count)]
        for name, count in zip(names[: last + 1], counts, strict=False)
    ]


def _record(done: sl.control.Execution, to: Path | None) -> dict[str, Any]:
    counts = {row[0]: float(row[1]) for row in _states(done)}
    return {
        "robot": done.robot.name,
        "cycles": len(done),
        "cycles_without_answer": int(np.count_nonzero(~done.answered)),
        "duration_s": _since(done, done.time[-1]) if len(done) else 0.0,
        "status": done.status.name,
        "reason": done.reason,
        "states_s": counts,
        "largest": [dict(zip(EXTREME, one, strict=True)) for one in _extremes(done)],
        "late_s": {"p50": _quantile(done, 0.5), "p99.9": _quantile(done, 0.999)},
        "events": [{**event._asdict(), "state": event.state.name} for event in done.events],
        "file": to,
    }


def _quantile(done: sl.control.Execution, share: float) -> float | None:
    return float(np.quantile(done.late, share)) if len(done) else None
