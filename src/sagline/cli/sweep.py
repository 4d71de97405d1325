"""`sagline sweep`: results of many robots, poses and wrenches, stored in a folder."""

from __future__ import annotations

from contextlib import suppress
from functools import partial
from pathlib import Path
from shlex import quote

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, number_text, values_of
from sagline.cli.terminal import show_json, show_note, show_text, working
from sagline.core.numbers import counted
from sagline.files.writing import create_folder

ENDS = {
    "feasible": "tensions within their limits",
    "infeasible": "proof that no tensions within the limits exist",
    "unable": "no result; the status states the reason",
    "open": "too close to the boundary for a verdict",
    "lost": "no verdict",
}


def sweep(
    file: Path = opt.argument(
        opt.NEEDED, "SWEEP.yaml", "File with robots, poses, wrenches and the quantities to compute."
    ),
    out: Path | None = opt.out(None, "SWEEP in output"),
    workers: str | None = opt.option(
        None, "COUNT", "Processes on this machine. Default: one per processor.", opt.only_without("--scheduler")
    ),
    scheduler: str | None = opt.option(
        None, "tcp://HOST:PORT", "Use the workers of this Dask scheduler. All workers need access to the folder."
    ),
    as_json: bool = opt.JSON,
) -> int:
    """Compute tensions, lengths or shortfalls of every robot at every pose under every wrench.

    Each task stores its part of the results, and the folder DIR/done records the progress. If a sweep was stopped, the
    same command continues it. Read the results with sl.sweep.load("DIR"), or as Zarr. Exit code 1 if requests have
    no verdict.

    For example:

        sagline sweep own_sweep.yaml
        sagline sweep own_sweep.yaml --workers 1 --out results/sweep
    """
    from sagline.sweep.running import MOST_WORKERS, open_matching_folder, run

    count = None if workers is None else opt.whole_of(workers, "--workers", 1, MOST_WORKERS)
    request = sl.load_sweep(file)
    folder = Path("output") / file.stem if out is None else out
    Output(opt.data_files(folder, table=False), "", ["done"])  # raises an error if the folder cannot be written
    parent = folder.absolute().parent
    made = [place for place in (parent, *parent.parents) if not place.exists()]
    create_folder(parent)
    if (folder / "done").exists():  # the folder of another sweep raises an error
        open_matching_folder(folder, request)
    again = _again(file, folder, workers, scheduler)
    what = f"{len(request):,} requests"
    try:
        with working(what) as line:
            found = run(
                request, folder, count, scheduler=scheduler, progress=line.progress, tell=partial(show_note, "")
            )
    except KeyboardInterrupt:
        show_note("", f"To continue: {again}")
        raise
    except sl.SaglineError as error:
        if (folder / "done").exists():
            error.add_note(f"The finished tasks are kept. To continue: {again}")
        with suppress(OSError):  # a folder is not removed if it contains results
            for place in made:
                place.rmdir()
        raise
    if as_json:
        show_json(_record(found))
    else:
        _show(found)
    left = found.counts.open + found.counts.lost
    if left:
        show_note(f"{left:,} of {len(request):,} requests: ", "without a verdict", style="bold red")
    return OUTSIDE if left else 0


def _again(file: Path, folder: Path, workers: str | None, scheduler: str | None) -> str:
    words = ["sagline", "sweep", str(file), "--out", str(folder)]
    words += ["--workers", workers] if workers is not None else []
    words += ["--scheduler", scheduler] if scheduler is not None else []
    return " ".join(map(quote, words))


def _show(found: sl.sweep.Sweep) -> None:
    total = len(found.request)
    counts = found.counts._asdict()
    rows = [
        [name, f"{count:,}", number_text(100.0 * count / total, ".3g"), ENDS[name]]
        for name, count in counts.items()
        if count
    ]
    verdict = f"{counts['feasible']:,} of {total:,} requests are feasible."
    TextTable(["requests", "number", "[%]", ""], rows, str(found.request)).show(verdict)
    show_text(f"{counted(found.tasks, 'task')}, {found.seconds:,.1f} s of work; variables: {', '.join(found.names)}")
    show_text(f"In {found.folder.resolve()}: read with sl.sweep.load({str(found.folder)!r})", whole=True)


def _record(found: sl.sweep.Sweep) -> dict[str, object]:
    sizes = dict(zip(("robots", "poses", "wrenches"), found.request.shape, strict=True))
    request = {"folder": found.folder, **sizes, "quantities": found.request.quantities}
    return {**request, **values_of(found, "tasks", "seconds"), **found.counts._asdict()}
