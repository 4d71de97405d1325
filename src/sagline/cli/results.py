"""What a run leaves behind: files in a folder, numbers on the terminal, an exit code."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from sagline.cli.ending import OUTSIDE
from sagline.cli.study import Run, gap_text, summary
from sagline.cli.summary import summary_grid
from sagline.cli.tables import show_table
from sagline.cli.terminal import note, show, show_json
from sagline.files.whole import made_folder
from sagline.kinematics.status import PoseStatus

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMS = ("png", "svg")  # of a figure
MOST_GAPS = 5  # told in full
WIDEN = " Move the path, or widen the tension limits."


def write_plans(runs: Sequence[Run], folder: Path) -> list[Path]:
    """Save the plan of each run; returns the files."""
    made_folder(folder)
    files = [folder / f"{run.name}.nc" for run in runs]
    for run, file in zip(runs, files, strict=True):
        run.plan.save(file)
    return files


def figure_files(names: Iterable[str]) -> list[str]:
    """Names of the files of figures of these names."""
    return [f"{name}.{suffix}" for name in names for suffix in FORMS]


def write_figures(figures: Mapping[str, Figure | Axes], folder: Path) -> list[Path]:
    """Save each figure as PNG and SVG under its name; returns the files."""
    from sagline.plot import save

    files = []
    for name, figure in figures.items():
        for file in figure_files([name]):
            files.append(folder / file)
            save(figure, files[-1])
    return files


def tell(runs: Sequence[Run], files: Sequence[Path], folder: Path, *, as_json: bool) -> int:
    """Print the numbers and what went wrong; returns the exit code."""
    if as_json:
        show_json({"runs": [_record(run) for run in runs], "files": list(files)})
    else:
        show_table(summary_grid(runs))
        show(f"In {folder.resolve()}: {listed(files)}", whole=True)
    return max((_complaints(run) for run in runs), default=0)


def listed(files: Sequence[Path]) -> str:
    """Names, those of a figure's two forms as one."""
    suffixes: dict[str, list[str]] = {}
    for file in files:
        suffixes.setdefault(file.stem, []).append(file.suffix)
    return ", ".join(f"{stem}{'/'.join(found)}" for stem, found in suffixes.items())


def _complaints(run: Run) -> int:
    """Say where the path cannot be followed; the exit code of this run."""
    name, gaps, plan = run.plan.state.one_robot.name, run.plan.gaps, run.plan
    for gap in gaps[:MOST_GAPS]:
        note(f"{name}: ", f"the path leaves the feasible region {gap_text(gap, plan)}", style="bold red")
    if len(gaps) > MOST_GAPS:
        note(f"{name}: ", f"and {len(gaps) - MOST_GAPS} times more", style="bold red")
    if gaps:
        limits = all(gap.status is PoseStatus.INFEASIBLE for gap in gaps)
        note("", "The file keeps the feasible part and marks the rest." + WIDEN * limits)
    if run.lost:
        what = f"{run.lost} of the planned poses are no stable equilibria: there the platform would leave its path"
        note(f"{name}: ", f"{what}; move it, or raise the tensions", style="bold red")
    return OUTSIDE if gaps or run.lost else 0


def _record(run: Run) -> dict[str, Any]:
    plan = run.plan
    clock = plan.path.time if plan.path is not None else None
    return {
        "robot": plan.state.one_robot.name,
        "model": type(plan.state.cables.model).__name__,
        "tension": type(plan.tension).__name__,
        "tension_variable": plan.tension.variable,
        "poses": plan.status.size,
        **summary(run)._asdict(),
        "poses_not_stable": run.lost,
        "gaps": [
            {
                "from_s": None if clock is None else clock[gap.first],
                "to_s": None if clock is None else clock[gap.last],
                "shortfall_n": gap.shortfall,
                "cables": list(gap.cables),
                "reason": gap.status.text,
            }
            for gap in plan.gaps
        ],
    }
