"""`sagline vibrate`: natural frequencies of a pose, with cable mass and massless, and what the platform answers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from sagline.cli.ending import OUTSIDE
from sagline.cli.entries import ANSWERS, INVERSE, MODES, VIBRATION
from sagline.cli.options import (
    AirDampingOption,
    Direction,
    JsonOption,
    LossTimeOption,
    OutOption,
    PayloadOption,
    PoseOption,
    RobotArgument,
    WrenchOption,
)
from sagline.cli.results import figure_files, listed, write_figures
from sagline.cli.tables import Grid, csv_text, show_table, written
from sagline.cli.terminal import note, show, show_json, working
from sagline.core.errors import InvalidValueError
from sagline.files.writing import check_files, create_folder, write_text

if TYPE_CHECKING:
    from sagline.dynamics.vibration.mode_list import ListedMode
    from sagline.dynamics.vibration.vibration import Vibration
    from sagline.robot.equilibrium import Equilibrium

LEAST_SHARE = 0.05  # of the platform in a mode that is shown; the file has them all
LOWEST = 3  # modes that are shown whatever swings
FRAME_TIME = 0.08  # s, of a film


def vibrate(
    name: RobotArgument,
    pose: PoseOption = None,
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
    folder: OutOption = Path("output"),
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
    from sagline.cli.maps import counts_of, vibrate_all_over
    from sagline.cli.values import damping_of, loaded, middle_of, quantity
    from sagline.dynamics.vibration.mode_list import listed_modes
    from sagline.dynamics.vibration.vibration import VibrationStatus, vibration
    from sagline.files.pose_text import pose_of, wrench_of
    from sagline.files.robot_file import load_robot
    from sagline.files.writing import file_stem
    from sagline.kinematics.inverse import inverse
    from sagline.kinematics.status import PoseStatus

    limit = quantity(up_to, "--up-to", "Hz", above=0.0)
    losses = damping_of(loss_time, air_damping, damping)
    load, place = wrench_of(wrench), None if pose is None else pose_of(pose)
    counts = None if grid is None else counts_of(grid)
    robot = loaded(load_robot(name), payload)
    if counts is not None:
        _check_alone(pose=pose, film=film, wrench=wrench)
        return vibrate_all_over(robot, counts, limit, losses, folder, figures=figures, as_json=as_json)
    table, drawing = (file_stem(robot.name, what) for what in ("modes", "response"))
    reel = f"{file_stem(robot.name, f'mode-{film}')}.gif"
    check_files(folder, [f"{table}.csv", *figure_files([drawing] * figures), *[reel] * (film is not None)])
    place = middle_of(robot) if place is None else place
    with working(f"{robot.name}: modes up to {limit:g} Hz", INVERSE, VIBRATION, MODES, *[ANSWERS] * figures) as line:
        plan = inverse(robot, place, wrench=load)
        if not plan.feasible:
            note("No modes: ", PoseStatus(int(plan.status)).text, style="bold red")
            return OUTSIDE
        found = vibration(plan.state, up_to=limit, damping=losses)
        if found.status in (VibrationStatus.UNSTABLE, VibrationStatus.NO_LENGTHS):
            note("No modes: ", found.status.text, style="bold red")
            return OUTSIDE
        modes = listed_modes(found)
        _check_film(film, modes)
        create_folder(folder)
        files = [folder / f"{table}.csv"]
        write_text(files[0], csv_text(_rows(modes)))
        if figures and found.status is VibrationStatus.SOLVED and found.frequency.size:
            from sagline import plot

            line.stage("drawing the response")
            files += write_figures({drawing: plot.response(found, force.value)}, folder)
        if film is not None:
            from sagline import plot

            files.append(folder / reel)
            plot.film(found, film, files[-1], progress=line.stage(f"filming mode {film}"))
    if as_json:
        show_json({**_record(found, modes), "files": files})
    else:
        _tell(found, modes, plan.state)
        show(f"In {folder.resolve()}: {listed(files)}", whole=True)
    if found.status is VibrationStatus.FOLDED:
        slack = ", ".join(map(str, found.slack_cables))
        note(f"Cables {slack}: ", found.status.text, style="bold")
    return 0


def _check_alone(**others: object) -> None:
    for item, value in others.items():
        if value is not None:
            raise InvalidValueError(f"--{item}", "given with --map", "one of both", "A map is of the whole test box.")


def _check_film(film: int | None, modes: list[ListedMode]) -> None:
    from sagline.dynamics.vibration.mode_list import WITH_MASS

    count = sum(mode.kind == WITH_MASS for mode in modes)
    if film is not None and not 1 <= film <= count:
        raise InvalidValueError("--film", film, f"1 to {count}, modes with cable mass", "Raise --up-to for more.")


def _tell(found: Vibration, modes: list[ListedMode], state: Equilibrium) -> None:
    """The table, with each massless mode beside the one in which most of its motion is found."""
    from sagline.dynamics.vibration.mode_list import MASSLESS, WITH_MASS, mode_correlation

    swinging = [mode for mode in modes if mode.kind == WITH_MASS]
    shares = mode_correlation(found)
    beside: dict[int, list[str]] = {}
    beyond = []
    for mode in (each for each in modes if each.kind == MASSLESS):
        k = mode.number - 1
        if swinging and mode.frequency < found.up_to:
            beside.setdefault(int(shares[k].argmax()), []).append(written(mode.frequency, ".3f"))
        else:
            beyond.append(mode.frequency)
    chosen = [
        mode for k, mode in enumerate(swinging) if k < LOWEST or mode.platform_share >= LEAST_SHARE or k in beside
    ]
    if not swinging:
        proof = "by the exact count" if found.complete else "as far as is known"
        lowest = written(min(beyond, default=np.nan), ".3f")
        below = f"No mode with cable mass lies below {found.up_to:g} Hz, {proof}"
        show(f"{below}; the lowest massless one is at {lowest} Hz. Raise --up-to.")
        return
    rows = [
        [
            mode.name,
            written(mode.frequency, ".3f"),
            written(100.0 * mode.platform_share, ".0f"),
            "–" if mode.cable is None else str(mode.cable),
            written(100.0 * mode.cable_share, ".0f"),
            written(100.0 * mode.loss, ".3g"),
            ", ".join(beside.get(mode.number - 1, [])),
        ]
        for mode in chosen
    ]
    heads = [
        "mode",
        "with cable\nmass [Hz]",
        "platform\n[%]",
        "cable",
        "its share\n[%]",
        "damping\n[%]",
        "massless\n[Hz]",
    ]
    x, y, z = state.pose.position
    show_table(Grid(heads, rows, f"{state.one_robot.name} at {x:g}, {y:g}, {z:g} m", left=frozenset()))
    proof = "none is missing, by the exact count" if found.complete else "some may be missing"
    hidden = len(swinging) - len(chosen)
    text = f"{len(swinging)} modes with cable mass below {found.up_to:g} Hz: {proof}."
    if hidden:
        text += f" Not shown: {hidden} in which cables swing alone (platform below {100.0 * LEAST_SHARE:.0f} %)."
    show(text)
    if beyond:
        higher = ", ".join(written(frequency, ".3f") for frequency in beyond)
        show(f"Massless modes that are beyond it: {higher} Hz")
    elif swinging:
        show("A massless frequency stands beside the mode that has the largest part of its motion.")


def _rows(modes: list[ListedMode]) -> list[list[Any]]:
    header = ["mode", "kind", "frequency [Hz]", "platform_share", "cable", "cable_share", "damping_ratio"]
    return [
        header,
        *(
            [
                mode.number,
                mode.kind,
                mode.frequency,
                mode.platform_share,
                "" if mode.cable is None else mode.cable,
                mode.cable_share,
                mode.loss,
            ]
            for mode in modes
        ),
    ]


def _record(found: Vibration, modes: list[ListedMode]) -> dict[str, Any]:
    return {
        "robot": found.state.one_robot.name,
        "position_m": found.state.pose.position.tolist(),
        "up_to_hz": found.up_to,
        "status": found.status.name,
        "complete": found.complete,
        "modes": [
            {
                "mode": mode.number,
                "kind": mode.kind,
                "frequency_hz": mode.frequency,
                "platform_share": mode.platform_share,
                "cable": mode.cable,
                "cable_share": mode.cable_share,
                "damping_ratio": mode.loss if np.isfinite(mode.loss) else None,
            }
            for mode in modes
        ],
    }
