"""`sagline control`: drive a machine, real or a twin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.options import RobotArgument


def control(
    robot: RobotArgument,
    plc: Annotated[
        str, typer.Option("--plc", metavar="ADDRESS,...", help="host or host:port of each group's PLC, in order.")
    ],
    modbus: Annotated[bool, typer.Option("--modbus", help="Speak Modbus TCP instead of S7.")] = False,
    shadow: Annotated[bool, typer.Option("--shadow", help="Read and log only: nothing is ever sent.")] = False,
    log: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write everything to an MCAP file, run.mcap.", show_default=False),
    ] = None,
) -> int:
    """Be the controller: connect, home, follow paths, until quit.

    It asks what to do, line by line: home, goto 0.2,-0.4,1.4, run path.yaml, jog 3 +5mm, pause, resume, stop, state,
    ack, off, help. Lines from a pipe are done one after the other; the first that is refused ends it. Ctrl-C leads all
    rates to zero and gives the machine back, exit code 130. Software is no safety function: have an emergency stop
    wired in hardware.

    For example:

        sagline control article-prototype --plc 127.0.0.1:11021,127.0.0.1:11022,127.0.0.1:11023,127.0.0.1:11024
        echo "home; goto 0.2,-0.4,1.4" | sagline control article-prototype --plc ... --log run.mcap
        sagline control article-prototype --plc ... --shadow --log run.mcap
    """
    from sagline.cli.control import Asked
    from sagline.cli.control import control as run

    return run(robot, Asked(plc, modbus, shadow, log))
