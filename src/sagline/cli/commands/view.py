"""`sagline view`: a robot in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import robot_completions
from sagline.cli.options import PayloadOption, WrenchOption


def view(
    robot: Annotated[
        str,
        typer.Argument(
            metavar="ROBOT",
            help="A preset (see sagline robots) or a robot file, robot.yaml; a log of the controller, run.mcap; or a "
            "calibration, found.nc.",
            autocompletion=robot_completions,
        ),
    ],
    run: Annotated[
        Path | None,
        typer.Argument(
            metavar="RUN",
            help="To play: a run of this robot, written by sagline track, a simulation, or a log of the controller; "
            "or a calibration to show.",
        ),
    ] = None,
    beside: Annotated[
        Path | None,
        typer.Option(metavar="RUN", help="Another run of the same robot beside it, with the same clock, as a ghost."),
    ] = None,
    live: Annotated[bool, typer.Option("--live", help="Follow a log that is still written.")] = False,
    truth: Annotated[
        Path | None,
        typer.Option(metavar="TWIN.mcap", help="Beside a log: the twin's own, where the platform truly was."),
    ] = None,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z[,A,B,C]",
            help="Where the platform is at first: position [m] and angles about z, y, x [degrees].",
        ),
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(metavar="NUMBER", help="Natural mode that moves at first: 1, 2, ...; 'massless 1'."),
    ] = None,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on; 0.0.0.0 is every one, for others to look.")
    ] = "127.0.0.1",
    port: Annotated[str, typer.Option(metavar="NUMBER", help="Port to listen on; 0 takes any that is free.")] = "8080",
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open it in a browser here.")] = True,
) -> int:
    """Look at a robot in the browser: drag its platform, and the cables follow.

    Over SSH, forward the port (`ssh -L 8080:localhost:8080 ...`) and open http://localhost:8080 at home.

    For example:

        sagline view cogiro
        sagline view cogiro --pose 0,0,2 --mode 1
        sagline view own_robot.yaml --payload "5 kg" --port 9000
        sagline track article-mixed --model empirical
        sagline view article-mixed output/article-mixed-empirical.nc
        sagline view article-mixed run_a.nc --beside run_b.nc
        sagline view found.nc
        sagline view run.mcap --live
        sagline view run.mcap --truth twin.mcap
    """
    from sagline.cli.view import view as serve

    return serve(robot, run, beside, live, truth, pose, mode, wrench, payload, host, port, browser=browser)
