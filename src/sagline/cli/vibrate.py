"""`sagline vibrate`: natural frequencies with and without cable mass, and the frequency response of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.tension import reason
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.numbers import counted
from sagline.files.writing import file_stem

if TYPE_CHECKING:
    from sagline.dynamics.vibration.vibration import ListedMode


class _Direction(StrEnum):
    """Axes along which a force or about which a moment acts."""

    X = "x"
    Y = "y"
    Z = "z"
    ABOUT_X = "about x"
    ABOUT_Y = "about y"
    ABOUT_Z = "about z"


LEAST_SHARE = 0.05  # modes with a smaller share of the platform are not printed; the file has all modes
COLUMNS = ("mode", "kind", "frequency_hz", "platform_share", "cable", "cable_share", "damping_ratio")
HEADS = "mode", "with cable\nmass [Hz]", "platform\n[%]", "cable", "its share\n[%]", "damping\n[%]", "massless\n[Hz]"
LOWEST = 3  # number of the lowest modes, which are always printed
FIGURES = ("frequency", "peak")  # figures of a map
TABLE, MAP = "-modes.csv", "-vibration-map.nc"


_PointsOption = Annotated[
    Any,
    opt.converted(
        "NXxNYxNZ",
        "Map the lowest frequency and the largest response over the test box, at NXxNYxNZ poses.",
        "points_of",
        "--map",
    ),
]
_DampingOption = Annotated[
    float,
    opt.converted(
        "RATIO", "Damping ratio of every mode, 0.01 or '1 %', in addition to the damping of the cables.", "ratio"
    ),
]
_AxisOption = Annotated[
    _Direction,
    opt.choice("AXIS", "Axis of the force or moment in the figure of the response", _Direction),
    opt.only_with("--figures"),
    opt.only_without("--map"),
]


def vibrate(
    name: opt.RobotArgument,
    pose: Annotated[opt.PoseOption, opt.only_without("--map")] = None,
    points: _PointsOption = None,
    up_to: Annotated[float, opt.quantity("HZ", "Find all modes below this frequency.", "Hz", above=0.0)] = 20,
    damping: _DampingOption = 0.01,
    loss_time: opt.LossTimeOption = None,
    air_damping: opt.AirDampingOption = 0,
    axis: _AxisOption = _Direction.X,
    film: Annotated[
        int | None,
        opt.option("MODE", "Write an animation of this mode, ten seconds, as GIF."),
        opt.only_without("--map"),
    ] = None,
    tension: opt.TensionOption = opt.Tension.CLOSEST,
    wrench: Annotated[opt.WrenchOption, opt.only_without("--map")] = None,
    payload: opt.PayloadOption = None,
    folder: opt.OutOption = Path("output"),
    figures: opt.FiguresOption = True,
    formats: opt.FormatsOption = opt.USUAL_FORMATS,
    style: opt.StyleOption = opt.FigureStyle.PLAIN,
    write_table: Annotated[opt.TableOption, opt.only_without("--map")] = True,
    as_json: opt.JsonOption = False,
) -> int:
    """Find all natural frequencies at a pose: the platform's, and those of the cables, which vibrate as strings.

    The table shows, for each mode, the platform's share and the cable with the largest share, and the frequencies with
    massless cables. DIR/ROBOT-modes.csv has all modes. The figure shows the response to a force, with and without
    cable mass. Exit code 1 if the pose is not feasible or is not a stable equilibrium.

    For example:

        sagline vibrate cogiro --pose 0,0,2 --up-to 20
        sagline vibrate article-suspended --damping "2 %" --force z --film 1
        sagline vibrate cogiro --map 8x6x4 --out maps
    """
    from sagline.dynamics.vibration.vibration import listed_modes

    losses, method = sl.Damping(loss_time or 0.0, air_damping, damping), tension.build(opt.TensionVariable.CHORD)
    robot = opt.robot_with_payload(name, payload)
    if points is not None:
        drawn = [f"-vibration-map-{figure}" for figure in FIGURES if figures]
        output = Output(folder, file_stem(robot.name), [MAP], drawn, formats, style)
        return _vibrate_in_box(robot, points, up_to, losses, method, output, as_json=as_json)
    reel = f"-mode-{film}.gif"
    parts = [*[TABLE] * write_table, *[reel] * (film is not None)]
    output = Output(folder, file_stem(robot.name), parts, ["-response"] * figures, formats, style)
    place = opt.middle_pose(robot) if pose is None else pose
    with working(f"{robot.name}: modes up to {up_to:g} Hz") as line:
        plan = sl.inverse(robot, place, tension=method, wrench=wrench)
        if not plan.feasible:
            show_note("No modes: ", reason(robot, place, plan), style="bold red")
            return OUTSIDE
        found = sl.vibration(plan.state, up_to=up_to, damping=losses)
        if found.status in (sl.VibrationStatus.UNSTABLE, sl.VibrationStatus.NO_LENGTHS):
            show_note("No modes: ", found.status.text, style="bold red")
            return OUTSIDE
        modes = listed_modes(found)
        _check_film(film, modes)
        if write_table:
            output.table(TABLE, [[column.replace("_hz", " [Hz]") for column in COLUMNS], *map(_numbers, modes)])
        if figures and found.status is sl.VibrationStatus.SOLVED and found.frequency.size:
            line.stage("drawing the response")
            output.draw(lambda: sl.plot.response(found, axis.value))
        if film is not None:
            sl.plot.film(found, film, output.file(reel), progress=line.stage(f"filming mode {film}"))
    tell = partial(_tell, found, modes, plan.state)
    output.report(partial(_record, found, modes), _verdict(found, modes), tell, as_json=as_json)
    if found.status is sl.VibrationStatus.FOLDED:
        slack = ", ".join(map(str, found.slack_cables))
        show_note(f"Cables {slack}: ", found.status.text, style="bold")
    return 0


def _check_film(film: int | None, modes: list[ListedMode]) -> None:
    from sagline.dynamics.vibration.vibration import WITH_MASS

    count = sum(mode.kind == WITH_MASS for mode in modes)
    if film is not None and not 1 <= film <= count:
        raise sl.InvalidValueError("--film", film, f"1 to {count}, modes with cable mass", "Raise --up-to for more.")


def _verdict(found: sl.Vibration, modes: list[ListedMode]) -> str:
    """Number of modes with cable mass, and the lowest one."""
    from sagline.dynamics.vibration.vibration import WITH_MASS

    frequency = [mode.frequency for mode in modes if mode.kind == WITH_MASS]
    lowest = f", the lowest at {min(frequency):.3f} Hz" if frequency else ""
    proof = "the list is complete, because an exact count agrees" if found.complete else "some may be missing"
    return f"{counted(len(frequency), 'mode')} with cable mass below {found.up_to:g} Hz{lowest}; {proof}."


def _tell(found: sl.Vibration, modes: list[ListedMode], state: sl.Equilibrium) -> None:
    """Print the table; a massless mode is in the row of the mode that is most similar to it."""
    from sagline.dynamics.vibration.vibration import MASSLESS, WITH_MASS, mode_correlation

    swinging = [mode for mode in modes if mode.kind == WITH_MASS]
    shares = mode_correlation(found)
    beside: dict[int, list[str]] = {}
    beyond = []
    for mode in (each for each in modes if each.kind == MASSLESS):
        k = mode.number - 1
        if swinging and mode.frequency < found.up_to:
            beside.setdefault(int(shares[k].argmax()), []).append(number_text(mode.frequency, ".3f"))
        else:
            beyond.append(mode.frequency)
    chosen = [
        mode for k, mode in enumerate(swinging) if k < LOWEST or mode.platform_share >= LEAST_SHARE or k in beside
    ]
    if not swinging:
        lowest = number_text(min(beyond, default=np.nan), ".3f")
        show_text(f"The lowest massless mode is at {lowest} Hz. Raise --up-to.")
        return
    rows = [
        [
            mode.name,
            number_text(mode.frequency, ".3f"),
            number_text(100.0 * mode.platform_share, ".0f"),
            "–" if mode.cable is None else str(mode.cable),
            number_text(100.0 * mode.cable_share, ".0f"),
            number_text(100.0 * mode.loss, ".3g"),
            ", ".join(beside.get(mode.number - 1, [])),
        ]
        for mode in chosen
    ]
    x, y, z = state.pose.position
    show_table(TextTable(HEADS, rows, f"{state.one_robot.name} at {x:g}, {y:g}, {z:g} m", left=frozenset()))
    if hidden := len(swinging) - len(chosen):
        show_text(f"Not shown: {hidden} modes of the cables alone (platform below {100.0 * LEAST_SHARE:.0f} %).")
    if beyond:
        higher = ", ".join(number_text(frequency, ".3f") for frequency in beyond)
        show_text(f"Massless modes above this frequency: {higher} Hz")
    else:
        show_text("A massless frequency is in the row of the mode whose motion is most similar.")


def _numbers(mode: ListedMode) -> tuple[Any, ...]:
    """Values of a mode in the order of COLUMNS."""
    shares = mode.platform_share, mode.cable, mode.cable_share
    return (mode.number, mode.kind, mode.frequency, *shares, mode.loss)


def _record(found: sl.Vibration, modes: list[ListedMode]) -> dict[str, Any]:
    return {
        "robot": found.state.one_robot.name,
        "position_m": found.state.pose.position,
        "up_to_hz": found.up_to,
        "status": found.status.name,
        "complete": found.complete,
        "modes": [dict(zip(COLUMNS, _numbers(mode), strict=True)) for mode in modes],
    }


def _vibrate_in_box(
    robot: sl.Robot,
    points: Sequence[int],
    limit: float,
    damping: sl.Damping,
    method: sl.TensionMethod,
    output: Output,
    *,
    as_json: bool,
) -> int:
    """Compute, write and draw the maps over the test box; returns the exit code."""
    if robot.test_box is None:
        raise sl.InvalidValueError("--map", "of a robot without a test box", "one with a test_box", "Add it.")
    poses = opt.level_grid(robot.test_box, points)
    what = f"{robot.name}: modes at {len(poses):,} poses"
    with working(what) as line:
        found = sl.frequency_map(robot, poses, up_to=limit, damping=damping, tension=method, progress=line.progress)
        found.save(output.file(MAP))
        if output.draws:
            line.stage("drawing")
            output.draw(*(partial(sl.plot.frequency_map, found, figure) for figure in FIGURES))
    known = np.isfinite(found.frequency)

    tell = partial(_tell_map, found) if known.any() else lambda: None
    verdict = f"{int(known.sum()):,} of {known.size:,} poses have modes below {limit:g} Hz."
    output.report(lambda: _record_of_map(found), verdict, tell, as_json=as_json)
    if known.any():
        return 0
    show_note("No modes: ", "no feasible pose of the box has a mode below --up-to; raise it", style="bold red")
    return OUTSIDE


def _tell_map(found: sl.FrequencyMap) -> None:
    """Print the minimum and maximum of each quantity, each with its position."""
    rows = []
    for label, values, form in (
        ("lowest, with cable mass [Hz]", found.frequency, ".3f"),
        ("lowest, massless [Hz]", found.massless_frequency, ".3f"),
        ("largest response [mm/N]", 1e3 * found.peak, ".3g"),
    ):
        first, last = int(np.nanargmin(values)), int(np.nanargmax(values))
        rows.append(
            [label, *(text for k in (first, last) for text in (number_text(values[k], form), _place(found, k)))]
        )
    heads = ["", "minimum", "at x, y, z [m]", "maximum", "at x, y, z [m]"]
    show_table(TextTable(heads, rows, found.robot.name))


def _place(found: sl.FrequencyMap, k: int) -> str:
    return ", ".join(number_text(value, ".2f") for value in found.pose.position[k])


def _record_of_map(found: sl.FrequencyMap) -> dict[str, object]:
    return {
        "robot": found.robot.name,
        "up_to_hz": found.up_to,
        "position_m": found.pose.position,
        "frequency_with_cable_mass_hz": found.frequency,
        "frequency_massless_hz": found.massless_frequency,
        "strongest_answer_m_per_n": found.peak,
        "strongest_answer_at_hz": found.peak_frequency,
    }
