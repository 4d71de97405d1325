"""`sagline twin`: a machine to be driven, behind the same data blocks as the real one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.options import RobotArgument


def twin(
    robot: RobotArgument,
    true: Annotated[
        str | None,
        typer.Option(
            metavar="ROBOT",
            help="The robot as it really is, where that is another one; the PLCs still know ROBOT.",
            show_default=False,
        ),
    ] = None,
    port: Annotated[
        str, typer.Option(metavar="NUMBER", help="Of the first group, the others follow; 0 takes any that are free.")
    ] = "11021",
    host: Annotated[
        str, typer.Option(metavar="ADDRESS", help="Address to listen on; 0.0.0.0 is every one of this machine.")
    ] = "127.0.0.1",
    modbus: Annotated[bool, typer.Option("--modbus", help="Speak Modbus TCP instead of S7.")] = False,
    seed: Annotated[str, typer.Option(metavar="NUMBER", help="Of the load cells' noise.")] = "0",
    faults: Annotated[
        list[str] | None,
        typer.Option(
            "--fault",
            metavar="TEXT",
            help="What goes wrong, and when: 'cell 3 sticks at 40 s', 'group 1 is silent at 20 s for 0.2 s'; "
            "parts count from 0. May be given again.",
            show_default=False,
        ),
    ] = None,
    log: Annotated[
        Path | None,
        typer.Option(metavar="FILE.mcap", help="Write where the platform truly is, until Ctrl-C.", show_default=False),
    ] = None,
) -> int:
    """Be the machine: plant, drives and PLCs of a robot, in real time, until Ctrl-C.

    Each group of two winches has a PLC, which is a server of its own with the data blocks of the real one. The first
    lines say how a controller reaches them; then comes what the PLCs do. Exit code 130, as of every Ctrl-C.

    For example:

        sagline twin article-prototype
        sagline twin article-prototype --fault "cell 3 sticks at 40 s"
        sagline twin article-prototype --true worn.yaml --log twin.mcap
        sagline twin article-prototype --modbus --port 5020
    """
    from sagline.cli.twin import Asked
    from sagline.cli.twin import twin as run

    return run(robot, true, Asked(host, port, modbus, seed, tuple(faults or ()), log))
