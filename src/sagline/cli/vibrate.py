"""`sagline vibrate`: natural frequencies with and without cable mass, and the frequency response of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sagline.cli.ending import OUTSIDE
from sagline.cli.options import (
    USUAL_FORMATS,
    AirDampingOption,
    FiguresOption,
    FigureStyle,
    FormatsOption,
    JsonOption,
    LossTimeOption,
    OutOption,
    PayloadOption,
    PoseOption,
    RobotArgument,
    StyleOption,
    TableOption,
    Tension,
    TensionOption,
    TensionVariable,
    WrenchOption,
    choice_option,
    converted_option,
    only_with,
    only_without,
    option,
    quantity_option,
)
from sagline.cli.output import Output, TextTable, number_text, show_table
from sagline.cli.tension import reason
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted

if TYPE_CHECKING:
    from sagline.dynamics.vibration.dynamic_stiffness import Damping
    from sagline.dynamics.vibration.frequency_map import FrequencyMap
    from sagline.dynamics.vibration.vibration import ListedMode, Vibration
    from sagline.robot.equilibrium import Equilibrium
    from sagline.robot.pose import Pose
    from sagline.robot.robot import Robot
    from sagline.tension.method import TensionMethod


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
LOWEST = 3  # number of the lowest modes, which are always printed
FIGURES = ("frequency", "peak")  # figures of a map
TABLE, MAP = "-modes.csv", "-vibration-map.nc"


_PointsOption = Annotated[
    Any,
    converted_option(
        "NXxNYxNZ",
        "Map the lowest frequency and the largest response over the test box, at NXxNYxNZ poses.",
        "points_of",
        "--map",
    ),
]
_DampingOption = Annotated[
    float,
    converted_option(
        "RATIO", "Damping ratio of every mode, 0.01 or '1 %', in addition to the damping of the cables.", "ratio"
    ),
]
_AxisOption = Annotated[
    _Direction,
    choice_option("AXIS", "Axis of the force or moment in the figure of the response", _Direction),
    only_with("--figures"),
    only_without("--map"),
]


def vibrate(
    name: RobotArgument,
    pose: Annotated[PoseOption, only_without("--map")] = None,
    points: _PointsOption = None,
    up_to: Annotated[float, quantity_option("HZ", "Find all modes below this frequency.", "Hz", above=0.0)] = 20,
    damping: _DampingOption = 0.01,
    loss_time: LossTimeOption = None,
    air_damping: AirDampingOption = 0,
    axis: _AxisOption = _Direction.X,
    film: Annotated[
        int | None, option("MODE", "Write an animation of this mode, ten seconds, as GIF."), only_without("--map")
    ] = None,
    tension: TensionOption = Tension.CLOSEST,
    wrench: Annotated[WrenchOption, only_without("--map")] = None,
    payload: PayloadOption = None,
    folder: OutOption = Path("output"),
    figures: FiguresOption = True,
    formats: FormatsOption = USUAL_FORMATS,
    style: StyleOption = FigureStyle.PLAIN,
    write_table: Annotated[TableOption, only_without("--map")] = True,
    as_json: JsonOption = False,
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
    from sagline.cli.values import middle_pose, robot_with_payload
    from sagline.dynamics.vibration.dynamic_stiffness import Damping
    from sagline.dynamics.vibration.vibration import VibrationStatus, listed_modes, vibration
    from sagline.files.writing import file_stem
    from sagline.kinematics.inverse import inverse

    losses, method = Damping(loss_time or 0.0, air_damping, damping), tension.build(TensionVariable.CHORD)
    robot = robot_with_payload(name, payload)
    if points is not None:
        drawn = [f"-vibration-map-{figure}" for figure in FIGURES if figures]
        output = Output(folder, file_stem(robot.name), [MAP], drawn, formats, style)
        return _vibrate_in_box(robot, points, up_to, losses, method, output, as_json=as_json)
    reel = f"-mode-{film}.gif"
    parts = [*[TABLE] * write_table, *[reel] * (film is not None)]
    output = Output(folder, file_stem(robot.name), parts, ["-response"] * figures, formats, style)
    place = middle_pose(robot) if pose is None else pose
    with working(f"{robot.name}: modes up to {up_to:g} Hz") as line:
        plan = inverse(robot, place, tension=method, wrench=wrench)
        if not plan.feasible:
            show_note("No modes: ", reason(robot, place, plan), style="bold red")
            return OUTSIDE
        found = vibration(plan.state, up_to=up_to, damping=losses)
        if found.status in (VibrationStatus.UNSTABLE, VibrationStatus.NO_LENGTHS):
            show_note("No modes: ", found.status.text, style="bold red")
            return OUTSIDE
        modes = listed_modes(found)
        _check_film(film, modes)
        if write_table:
            output.table(TABLE, _rows(modes))
        if figures and found.status is VibrationStatus.SOLVED and found.frequency.size:
            from sagline import plot

            line.stage("drawing the response")
            output.draw(lambda: plot.response(found, axis.value))
        if film is not None:
            from sagline import plot

            plot.film(found, film, output.file(reel), progress=line.stage(f"filming mode {film}"))
    tell = partial(_tell, found, modes, plan.state)
    output.report(partial(_record, found, modes), _verdict(found, modes), tell, as_json=as_json)
    if found.status is VibrationStatus.FOLDED:
        slack = ", ".join(map(str, found.slack_cables))
        show_note(f"Cables {slack}: ", found.status.text, style="bold")
    return 0


def _rows(modes: list[ListedMode]) -> list[list[object]]:
    """Rows of the table of all modes; the first row has the names of the columns."""
    rows = [["" if value is None else value for value in _numbers(mode)] for mode in modes]
    return [[column.replace("_hz", " [Hz]") for column in COLUMNS], *rows]


def _check_film(film: int | None, modes: list[ListedMode]) -> None:
    from sagline.dynamics.vibration.vibration import WITH_MASS

    count = sum(mode.kind == WITH_MASS for mode in modes)
    if film is not None and not 1 <= film <= count:
        raise InvalidValueError("--film", film, f"1 to {count}, modes with cable mass", "Raise --up-to for more.")


def _verdict(found: Vibration, modes: list[ListedMode]) -> str:
    """Number of modes with cable mass, and the lowest one."""
    from sagline.dynamics.vibration.vibration import WITH_MASS

    frequency = [mode.frequency for mode in modes if mode.kind == WITH_MASS]
    lowest = f", the lowest at {min(frequency):.3f} Hz" if frequency else ""
    proof = "the list is complete, because an exact count agrees" if found.complete else "some may be missing"
    return f"{counted(len(frequency), 'mode')} with cable mass below {found.up_to:g} Hz{lowest}; {proof}."


def _tell(found: Vibration, modes: list[ListedMode], state: Equilibrium) -> None:
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
    show_table(TextTable(heads, rows, f"{state.one_robot.name} at {x:g}, {y:g}, {z:g} m", left=frozenset()))
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


def _record(found: Vibration, modes: list[ListedMode]) -> dict[str, Any]:
    return {
        "robot": found.state.one_robot.name,
        "position_m": found.state.pose.position.tolist(),
        "up_to_hz": found.up_to,
        "status": found.status.name,
        "complete": found.complete,
        "modes": [dict(zip(COLUMNS, _numbers(mode), strict=True)) for mode in modes],
    }


def _vibrate_in_box(
    robot: Robot,
    points: Sequence[int],
    limit: float,
    damping: Damping,
    method: TensionMethod,
    output: Output,
    *,
    as_json: bool,
) -> int:
    """Compute, write and draw the maps over the test box; returns the exit code."""
    from sagline.dynamics.vibration.frequency_map import frequency_map

    poses = _grid(robot, points)
    what = f"{robot.name}: modes at {len(poses):,} poses"
    with working(what) as line:
        found = frequency_map(robot, poses, up_to=limit, damping=damping, tension=method, progress=line.progress)
        found.save(output.file(MAP))
        if output.draws:
            from sagline import plot

            line.stage("drawing")
            output.draw(*(partial(plot.frequency_map, found, figure) for figure in FIGURES))
    known = np.isfinite(found.frequency)

    def tell() -> None:
        if known.any():
            show_table(_table_of_map(found))

    verdict = f"{int(known.sum()):,} of {known.size:,} poses have modes below {limit:g} Hz."
    output.report(lambda: _record_of_map(found), verdict, tell, as_json=as_json)
    if known.any():
        return 0
    show_note("No modes: ", "no feasible pose of the box has a mode below --up-to; raise it", style="bold red")
    return OUTSIDE


def _grid(robot: Robot, points: Sequence[int]) -> Pose:
    """Level poses on an even grid over the test box; an axis with a single point has it in the middle."""
    from sagline.robot.pose import Pose

    box = robot.test_box
    if box is None:
        raise InvalidValueError("--map", "of a robot without a test box", "one with a test_box", "Add it.")
    axes = [
        np.linspace(low, high, count) if count > 1 else np.array([0.5 * (low + high)])
        for low, high, count in zip(box.low, box.high, points, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Pose.from_euler(places, 0.0, 0.0, 0.0)


def _table_of_map(found: FrequencyMap) -> TextTable:
    """Minimum and maximum of each quantity, each with its position."""
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
    return TextTable(["", "minimum", "at x, y, z [m]", "maximum", "at x, y, z [m]"], rows, found.robot.name)


def _place(found: FrequencyMap, k: int) -> str:
    return ", ".join(number_text(value, ".2f") for value in found.pose.position[k])


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
