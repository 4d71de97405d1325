"""`sagline log`: what the controller recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.options import JsonOption


def log(
    file: Annotated[Path, typer.Argument(metavar="RUN.mcap", help="A log, also one of a process that was killed.")],
    to: Annotated[
        Path | None,
        typer.Option(
            "--to",
            metavar="FILE",
            help="Write it to this file and tell nothing else: .nc is a data set with the plan in it, .mcap a log "
            "with its end.",
            show_default=False,
        ),
    ] = None,
    plan: Annotated[
        str | None,
        typer.Option(
            metavar="NUMBER", help="Only the cycles of one of its plans, from 0. Default: all.", show_default=False
        ),
    ] = None,
    as_json: JsonOption = False,
) -> int:
    """Tell what a log of the controller holds: states, largest errors, late cycles, events.

    For example:

        sagline log run.mcap
        sagline log run.mcap --to run.nc
        sagline log killed.mcap --to mended.mcap
    """
    from sagline.cli.log import log as run

    return run(file, to, plan, as_json=as_json)
