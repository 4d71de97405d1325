"""`sagline vibrate` and `sagline simulate`: how a robot vibrates and moves."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from sagline.cli.choices import CableMass, Direction, ShaperKind, Tension
from sagline.cli.options import JsonOption, OutOption, PayloadOption, RobotArgument, WrenchOption

LossTimeOption = Annotated[
    str, typer.Option(metavar="TIME", help="Loss time [s] of the cables' stretch: EA (1 + i omega TIME).")
]
AirDampingOption = Annotated[
    str, typer.Option(metavar="NUMBER", help="Force of the air on a cable over its velocity, a meter [N s/m^2].")
]


def vibrate(
    robot: RobotArgument,
    pose: Annotated[
        str | None,
        typer.Option(
            metavar="X,Y,Z[,A,B,C]",
            help="Position [m] and angles about z, y, x [degrees]. Default: the middle of the robot's test box.",
        ),
    ] = None,
    grid: Annotated[
        str | None,
        typer.Option(
            "--map",
            metavar="NXxNYxNZ",
            help="Lowest frequency and strongest answer at so many poses all over the test box, instead of one pose.",
            show_default=False,
        ),
    ] = None,
    up_to: Annotated[str, typer.Option(metavar="HZ", help="Frequency below which all modes are found.")] = "20",
    damping: Annotated[
        str, typer.Option(metavar="RATIO", help="Damping ratio of every mode, 0.01 or '1 %', besides the cables'.")
    ] = "0.01",
    loss_time: LossTimeOption = "0",
    air_damping: AirDampingOption = "0",
    force: Annotated[
        Direction,
        typer.Option(metavar="AXIS", help=f"Of the response figure: {', '.join(each.value for each in Direction)}."),
    ] = Direction.X,
    film: Annotated[
        int | None, typer.Option(metavar="MODE", help="Film this mode, ten seconds of it, as GIF.", show_default=False)
    ] = None,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    out: OutOption = Path("output"),
    figures: Annotated[bool, typer.Option("--figures/--no-figures", help="Draw the response, as PNG and SVG.")] = True,
    as_json: JsonOption = False,
) -> int:
    """Find all natural frequencies of a pose: of the platform, and of the strings that its cables are.

    Each says how much of it is the platform's and which cable swings most; the frequencies that massless cables would
    have stand beside. DIR/ROBOT-modes.csv has them all, the response figure both robots' answer to a force. Exit code
    1 where the pose is not feasible, or no stable equilibrium.

    For example:

        sagline vibrate cogiro --pose 0,0,2 --up-to 20
        sagline vibrate article-suspended --damping "2 %" --force z --film 1
        sagline vibrate cogiro --map 8x6x4 --out maps
    """
    from sagline.cli.vibrate import Losses
    from sagline.cli.vibrate import vibrate as run

    losses = Losses(damping, loss_time, air_damping)
    return run(
        robot, pose, grid, up_to, losses, force.value, film, wrench, payload, out, figures=figures, as_json=as_json
    )


def simulate(
    robot: RobotArgument,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="PATH",
            help="Waypoints in .yaml, or time and pose in .csv. Default: at rest in the middle of the test box.",
            show_default=False,
        ),
    ] = None,
    shaper: Annotated[
        ShaperKind,
        typer.Option(metavar="SHAPER", help=f"Shapes the path: {', '.join(each.value for each in ShaperKind)}."),
    ] = ShaperKind.NONE,
    cable_mass: Annotated[
        CableMass,
        typer.Option(metavar="KIND", help=f"Mass of the cables: {', '.join(each.value for each in CableMass)}."),
    ] = CableMass.NONE,
    events: Annotated[
        list[str] | None,
        typer.Option(
            "--break", metavar="CABLE@TIME", help="A cable breaks: 3@2.5s. May be given again.", show_default=False
        ),
    ] = None,
    after: Annotated[str, typer.Option(metavar="TIME", help="How long it goes on after the path's end [s].")] = "3",
    step: Annotated[
        str | None, typer.Option(metavar="TIME", help="Of the integrator [s]. Default: as the robot needs it.")
    ] = None,
    tension: Annotated[
        Tension,
        typer.Option(
            metavar="METHOD",
            help=f"How the load is shared among redundant cables: {', '.join(each.value for each in Tension)}.",
        ),
    ] = Tension.CLOSEST,
    loss_time: LossTimeOption = "0",
    air_damping: AirDampingOption = "0",
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help="File to write. Default: ROBOT-simulation.nc in output."),
    ] = None,
    figures: Annotated[
        bool, typer.Option("--figures/--no-figures", help="Draw the balance of energy beside it, as PNG and SVG.")
    ] = True,
    as_json: JsonOption = False,
) -> int:
    """Move a robot in time along a path, vibrating as it does, with cables that may break.

    Lengths are planned as `sagline track` plans them. What is told: the largest tension, how far the platform still
    swings at the end, the balance of energy, and what happened. Play the file with `sagline view ROBOT FILE`.

    For example:

        sagline simulate article-suspended own_path.yaml --shaper zvd
        sagline simulate cogiro --break 3@0.5s --loss-time 0.001 --out sim.nc
    """
    from sagline.cli.simulate import Asked
    from sagline.cli.simulate import simulate as run

    asked = Asked(shaper, cable_mass, tuple(events or ()), after, step, tension, loss_time, air_damping)
    return run(robot, path, asked, wrench, payload, out, figures=figures, as_json=as_json)
