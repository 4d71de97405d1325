"""`sagline sweep`: robots x poses x wrenches."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.options import JsonOption


def sweep(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="SWEEP.yaml", help="Robots, poses, wrenches and what is asked of each.", show_default=False
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Folder of the sweep; one that holds a part of it is taken up. Default: SWEEP in output.",
            show_default=False,
        ),
    ] = None,
    workers: Annotated[
        str | None,
        typer.Option(metavar="COUNT", help="Processes of this machine. Default: one a processor.", show_default=False),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="tcp://HOST:PORT",
            help="Use the workers of this Dask scheduler instead. All of them must see the folder.",
            show_default=False,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Ask tensions, lengths or shortfalls of every robot at every pose under every wrench.

    Results are on the disk from the first minute, a chunk for each task, and DIR/done says how far it is. What was
    stopped goes on with the same command. Read the numbers with sl.sweep.load("DIR"), or as Zarr. Exit code 1 where
    requests were left without a verdict.

    For example:

        sagline sweep own_sweep.yaml
        sagline sweep own_sweep.yaml --workers 1 --out results/sweep
    """
    from sagline.cli.sweep import sweep as run

    return run(file, out, workers, scheduler, as_json=as_json)
