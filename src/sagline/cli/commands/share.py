"""`sagline share`: a robot, or a run of it, as one page to give away."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import robot_completions


def share(
    what: Annotated[
        str,
        typer.Argument(
            metavar="WHAT",
            help="A run, a simulation, run.nc, or a log of the controller, run.mcap: it plays. A preset (see sagline "
            "robots) or a robot file, robot.yaml: its platform can be dragged.",
            autocompletion=robot_completions,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE.html", help="Default: its name, here: run.html.", show_default=False),
    ] = None,
) -> None:
    """Make one page of a robot or a run, that needs no server and no network: for a phone, a mail, a lecture.

    A run plays, a robot can be dragged; the page itself computes how the cables hang. The picture turns by mouse, touch
    and keys. The file is of some 80 kB, and 150 kB more for a minute of run.

    For example:

        sagline share cogiro
        sagline share own_robot.yaml --out hall.html
        sagline track cogiro own_path.yaml
        sagline share output/cogiro-catenary.nc
        sagline share run.mcap
    """
    from sagline.cli.share import share as write

    write(what, out)
