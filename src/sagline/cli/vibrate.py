"""`sagline vibrate`: natural frequencies of a pose, with cable mass and massless, and what the platform answers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from enum import StrEnum
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.entries import ANSWERS, INVERSE, MODES, VIBRATION
from sagline.cli.options import (
    AirDampingOption,
    JsonOption,
    LossTimeOption,
    OutOption,
    PayloadOption,
    PoseOption,
    RobotArgument,
    WrenchOption,
    choice,
    figures_flag,
    option,
)
from sagline.cli.output import Grid, Output, csv_text, show_table, written
from sagline.cli.terminal import note, show, show_json, working
from sagline.core.errors import InvalidValueError
from sagline.files.writing import write_text

if TYPE_CHECKING:
    from sagline.dynamics.vibration.dynamic_stiffness import Damping
    from sagline.dynamics.vibration.frequency_map import FrequencyMap
    from sagline.dynamics.vibration.mode_list import ListedMode
    from sagline.dynamics.vibration.vibration import Vibration
    from sagline.robot.equilibrium import Equilibrium
    from sagline.robot.pose import Pose
    from sagline.robot.robot import Robot


class Direction(StrEnum):
    """Along which axis a force acts, or about which a moment."""

    X = "x"
    Y = "y"
    Z = "z"
    ABOUT_X = "about x"
    ABOUT_Y = "about y"
    ABOUT_Z = "about z"


LEAST_SHARE = 0.05  # of the platform in a mode that is shown; the file has them all
HEADER = ("mode", "kind", "frequency [Hz]", "platform_share", "cable", "cable_share", "damping_ratio")
LOWEST = 3  # modes that are shown whatever swings
POINTS = re.compile(r"([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})\s*[x×]\s*([0-9]{1,4})")
MOST_POSES = 1_000_000  # of a map
FIGURES = ("frequency", "peak")  # of a map


def vibrate(
    name: RobotArgument,
    pose: PoseOption = None,
    grid: Annotated[
        str | None,
        option(
            "NXxNYxNZ",
            "Lowest frequency and strongest answer at so many poses all over the test box, instead of one pose.",
            "--map",
        ),
    ] = None,
    up_to: Annotated[str, option("HZ", "Frequency below which all modes are found.")] = "20",
    damping: Annotated[
        str, option("RATIO", "Damping ratio of every mode, 0.01 or '1 %', besides the cables'.")
    ] = "0.01",
    loss_time: LossTimeOption = "0",
    air_damping: AirDampingOption = "0",
    force: Annotated[Direction, choice("AXIS", "Of the response figure", Direction)] = Direction.X,
    film: Annotated[int | None, option("MODE", "Film this mode, ten seconds of it, as GIF.")] = None,
    wrench: WrenchOption = None,
    payload: PayloadOption = None,
    folder: OutOption = Path("output"),
    figures: Annotated[bool, figures_flag("Draw the response, as PNG and SVG.")] = True,
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
    from sagline.cli.values import damping_of, middle_of, quantity, robot_with
    from sagline.dynamics.vibration.mode_list import listed_modes
    from sagline.dynamics.vibration.vibration import VibrationStatus, vibration
    from sagline.files.pose_text import pose_of, wrench_of
    from sagline.files.writing import file_stem
    from sagline.kinematics.inverse import inverse
    from sagline.kinematics.status import PoseStatus

    limit = quantity(up_to, "--up-to", "Hz", above=0.0)
    losses = damping_of(loss_time, air_damping, damping)
    load, place = wrench_of(wrench), None if pose is None else pose_of(pose)
    points = None if grid is None else _points_of(grid)
    robot = robot_with(name, payload)
    if points is not None:
        for item, value in (("--pose", pose), ("--film", film), ("--wrench", wrench)):
            if value is not None:
                raise InvalidValueError(item, "given with --map", "one of both", "A map is of the whole test box.")
        return _vibrate_in_box(robot, points, limit, losses, folder, figures=figures, as_json=as_json)
    table, drawing = (file_stem(robot.name, what) for what in ("modes", "response"))
    reel = f"{file_stem(robot.name, f'mode-{film}')}.gif"
    output = Output(folder, [f"{table}.csv", *[reel] * (film is not None)], [drawing] * figures)
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
        rows = [["" if value is None else value for value in _numbers(mode).values()] for mode in modes]
        write_text(output.file(f"{table}.csv"), csv_text([HEADER, *rows]))
        if figures and found.status is VibrationStatus.SOLVED and found.frequency.size:
            from sagline import plot

            line.stage("drawing the response")
            output.draw(plot.response(found, force.value))
        if film is not None:
            from sagline import plot

            plot.film(found, film, output.file(reel), progress=line.stage(f"filming mode {film}"))
    if as_json:
        show_json({**_record(found, modes), "files": output.files})
    else:
        _tell(found, modes, plan.state)
        output.show()
    if found.status is VibrationStatus.FOLDED:
        slack = ", ".join(map(str, found.slack_cables))
        note(f"Cables {slack}: ", found.status.text, style="bold")
    return 0


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


def _numbers(mode: ListedMode) -> dict[str, Any]:
    return {
        "mode": mode.number,
        "kind": mode.kind,
        "frequency_hz": mode.frequency,
        "platform_share": mode.platform_share,
        "cable": mode.cable,
        "cable_share": mode.cable_share,
        "damping_ratio": mode.loss,
    }


def _record(found: Vibration, modes: list[ListedMode]) -> dict[str, Any]:
    return {
        "robot": found.state.one_robot.name,
        "position_m": found.state.pose.position.tolist(),
        "up_to_hz": found.up_to,
        "status": found.status.name,
        "complete": found.complete,
        "modes": [_numbers(mode) for mode in modes],
    }


def _points_of(text: str) -> tuple[int, ...]:
    """Numbers of points along x, y and z, from "20x15x8"."""
    found = POINTS.fullmatch(text.strip())
    points = tuple(map(int, found.groups())) if found else (0,)
    if not 0 < prod(points) <= MOST_POSES:
        step = "Give the points along x, y and z: --map 20x15x8."
        raise InvalidValueError("--map", repr(text), f"NXxNYxNZ, 1 to {MOST_POSES:,} poses", step)
    return points


def _vibrate_in_box(
    robot: Robot, points: Sequence[int], limit: float, damping: Damping, folder: Path, *, figures: bool, as_json: bool
) -> int:
    """Compute the map over the test box, write and draw it; returns the exit code."""
    from sagline.dynamics.vibration.frequency_map import frequency_map
    from sagline.files.writing import file_stem

    poses = _grid(robot, points)
    name = file_stem(robot.name, "vibration-map")
    output = Output(folder, [f"{name}.nc"], [f"{name}-{figure}" for figure in FIGURES if figures])
    what = f"{robot.name}: modes at {len(poses):,} poses"
    with working(what, INVERSE, VIBRATION, MODES) as line:
        found = frequency_map(robot, poses, up_to=limit, damping=damping, progress=line.progress)
        found.save(output.file(f"{name}.nc"))
        if figures:
            from sagline import plot

            line.stage("drawing")
            output.draw(*(plot.frequency_map(found, figure) for figure in FIGURES))
    known = np.isfinite(found.frequency)
    if as_json:
        show_json({**_record_of_map(found), "files": output.files})
    else:
        if known.any():
            show_table(_table_of_map(found))
        show(f"{int(known.sum()):,} of {known.size:,} poses have modes below {limit:g} Hz.")
        output.show()
    if known.any():
        return 0
    note("No modes: ", "no pose of the box is held with a mode below --up-to; raise it", style="bold red")
    return OUTSIDE


def _grid(robot: Robot, points: Sequence[int]) -> Pose:
    """Level poses evenly over the test box, its middle where there is one point."""
    from sagline.robot.pose import Pose

    box = robot.test_box
    if box is None:
        raise InvalidValueError("--map", "of a robot that names no box of poses", "one with a test_box", "Add it.")
    axes = [
        np.linspace(low, high, count) if count > 1 else np.array([0.5 * (low + high)])
        for low, high, count in zip(box.low, box.high, points, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Pose.from_euler(places, 0.0, 0.0, 0.0)


def _table_of_map(found: FrequencyMap) -> Grid:
    """Least and greatest of each, and where."""
    rows = []
    for label, values, form in (
        ("lowest, with cable mass [Hz]", found.frequency, ".3f"),
        ("lowest, massless [Hz]", found.massless_frequency, ".3f"),
        ("strongest answer [mm/N]", 1e3 * found.peak, ".3g"),
    ):
        first, last = int(np.nanargmin(values)), int(np.nanargmax(values))
        rows.append([label, *(text for k in (first, last) for text in (written(values[k], form), _place(found, k)))])
    return Grid(["", "least", "at x, y, z [m]", "greatest", "at x, y, z [m]"], rows, found.robot.name)


def _place(found: FrequencyMap, k: int) -> str:
    return ", ".join(written(value, ".2f") for value in found.pose.position[k])


def _record_of_map(found: FrequencyMap) -> dict[str, object]:
    return {
        "robot": found.robot.name,
        "up_to_hz": found.up_to,
        "position_m": found.pose.position.tolist(),
        "frequency_with_cable_mass_hz": found.frequency.tolist(),
        "frequency_massless_hz": found.massless_frequency.tolist(),
        "strongest_answer_m_per_n": found.peak.tolist(),
        "strongest_answer_at_hz": found.peak_frequency.tolist(),
    }
