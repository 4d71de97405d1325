"""`sagline vibrate`: natural frequencies with and without cable mass, and the frequency response of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.ending import OUTSIDE
from sagline.cli.output import Output, TextTable, number_text
from sagline.cli.tension import reason
from sagline.cli.terminal import show_note, show_text, working
from sagline.core.numbers import counted
from sagline.files.writing import file_stem

if TYPE_CHECKING:
    from sagline.cli.terminal import ProgressLine
    from sagline.dynamics.vibration.vibration import ListedMode


LEAST_SHARE = 0.05  # smallest share of the platform in a printed mode; the file has all modes
COLUMNS = ("mode", "kind", "frequency_hz", "platform_share", "cable", "cable_share", "damping_ratio")
HEADS = "mode", "with cable\nmass [Hz]", "platform\n[%]", "cable", "its share\n[%]", "damping\n[%]", "massless\n[Hz]"
LOWEST = 3  # number of the lowest modes, which are always printed
FIGURES = ("frequency", "peak")  # figures of a map
WITHOUT_MAP = opt.only_without("--map")
TABLE, MAP = "-modes.csv", "-vibration-map.nc"


def vibrate(
    name: str = opt.ROBOT,
    pose: Any = opt.if_only(opt.POSE, WITHOUT_MAP),
    points: Any = opt.converted(
        None,
        "NXxNYxNZ",
        "Map the lowest frequency and the largest response over the test box, at NXxNYxNZ poses.",
        "points_of",
        "--map",
    ),
    up_to: float = opt.quantity(20, "HZ", "Find all modes below this frequency.", "Hz", above=0.0),
    damping: float = opt.converted(
        0.01, "RATIO", "Damping ratio of every mode, 0.01 or '1 %', in addition to the damping of the cables.", "ratio"
    ),
    loss_time: float | None = opt.LOSS_TIME,
    air_damping: float = opt.AIR_DAMPING,
    axis: str = opt.choice(
        "x",
        "AXIS",
        "Axis of the force or moment in the figure of the response",
        ("x", "y", "z", "about x", "about y", "about z"),
        opt.only_with("--figures"),
        WITHOUT_MAP,
    ),
    film: int | None = opt.option(None, "MODE", "Write an animation of this mode, ten seconds, as GIF.", WITHOUT_MAP),
    tension: str = opt.TENSION,
    wrench: Any = opt.if_only(opt.WRENCH, WITHOUT_MAP),
    payload: float | None = opt.PAYLOAD,
    files: opt.Files = opt.Files(table=opt.csv_flag(True, WITHOUT_MAP)),
) -> int:
    """Find all natural frequencies at a pose: those of the platform, and those of the cables, which vibrate as strings.

    For each mode, the table shows the share of the platform, the cable with the largest share, and the frequency with
    massless cables. DIR/ROBOT-modes.csv has all modes. The figure shows the response to a force, with and without
    cable mass. Exit code 1 if the pose is not feasible or is not a stable equilibrium.

    For example:

        sagline vibrate cogiro --pose 0,0,2 --up-to 20
        sagline vibrate article-suspended --damping "2 %" --force z --film 1
        sagline vibrate cogiro --map 8x6x4 --out maps
    """
    from sagline.dynamics.vibration.vibration import listed_modes

    losses, method = sl.Damping(loss_time or 0.0, air_damping, damping), opt.tension_named(tension)
    robot = opt.robot_with_payload(name, payload)
    if points is not None:
        drawn = [f"-vibration-map-{figure}" for figure in FIGURES]
        output = Output(files, file_stem(robot.name), [MAP], drawn)
        return _vibrate_in_box(robot, points, up_to, losses, method, output)
    # --out may give the name of the first file, which is the table
    parts = [*[TABLE] * files.table, *[f"-mode-{film}.gif"] * (film is not None)]
    output = Output(files, file_stem(robot.name), parts, ["-response"])
    place = opt.middle_pose(robot) if pose is None else pose
    with working(f"{robot.name}: modes up to {up_to:g} Hz") as line:
        plan = sl.inverse(robot, place, tension=method, wrench=wrench)
        found = sl.vibration(plan.state, up_to=up_to, damping=losses) if plan.feasible else None
        if found is None or found.status in (sl.VibrationStatus.UNSTABLE, sl.VibrationStatus.NO_LENGTHS):
            why = reason(robot, place, plan) if found is None else found.status.text
            show_note("No modes: ", why, style="bold red")
            return OUTSIDE
        modes = listed_modes(found)
        _check_film(film, modes)
        output.table(TABLE, lambda: [[column.replace("_hz", " [Hz]") for column in COLUMNS], *map(_numbers, modes)])
        _draw(found, axis, film, output, line)
    output.report(partial(_record, found, modes), _verdict(found, modes), partial(_tell, found, modes, plan.state))
    if found.status is sl.VibrationStatus.FOLDED:
        slack = ", ".join(map(str, found.slack_cables))
        show_note(f"Cables {slack}: ", found.status.text, style="bold")
    return 0


def _draw(found: sl.Vibration, axis: str, film: int | None, output: Output, line: ProgressLine) -> None:
    if found.status is sl.VibrationStatus.SOLVED and found.frequency.size:
        line.stage("drawing the response")
        output.draw(lambda: sl.plot.response(found, axis))
    if film is not None:
        sl.plot.film(found, film, output.file(f"-mode-{film}.gif"), progress=line.stage(f"filming mode {film}"))


def _check_film(film: int | None, modes: list[ListedMode]) -> None:
    from sagline.dynamics.vibration.vibration import WITH_MASS

    count = sum(mode.kind == WITH_MASS for mode in modes)
    if film is not None and not 1 <= film <= count:
        raise sl.InvalidValueError("--film", film, f"1 to {count}, modes with cable mass", "Raise --up-to for more.")


def _verdict(found: sl.Vibration, modes: list[ListedMode]) -> str:
    from sagline.dynamics.vibration.vibration import WITH_MASS

    frequency = [mode.frequency for mode in modes if mode.kind == WITH_MASS]
    lowest = f", the lowest at {min(frequency):.3f} Hz" if frequency else ""
    proof = "the list is complete, because an exact count agrees" if found.complete else "some may be missing"
    return f"{counted(len(frequency), 'mode')} with cable mass below {found.up_to:g} Hz{lowest}; {proof}."


def _tell(found: sl.Vibration, modes: list[ListedMode], state: sl.Equilibrium) -> None:
    """Print the table. The frequency of a massless mode is in the row of the most similar mode with cable mass."""
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
    TextTable(HEADS, rows, f"{state.one_robot.name} at {x:g}, {y:g}, {z:g} m", left=frozenset()).show()
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
    robot: sl.Robot, points: Sequence[int], limit: float, damping: sl.Damping, method: sl.TensionMethod, output: Output
) -> int:
    from sagline.robot.pose import level_grid

    if robot.test_box is None:
        raise sl.InvalidValueError("--map", "of a robot without a test box", "one with a test_box", "Add it.")
    poses = level_grid(robot.test_box, points)
    what = f"{robot.name}: modes at {len(poses):,} poses"
    with working(what) as line:
        found = sl.frequency_map(robot, poses, up_to=limit, damping=damping, tension=method, progress=line.progress)
        found.save(output.file(MAP))
        line.stage("drawing")
        output.draw(*(partial(sl.plot.frequency_map, found, figure) for figure in FIGURES))
    known = np.isfinite(found.frequency)

    tell = partial(_tell_map, found) if known.any() else lambda: None
    verdict = f"{int(known.sum()):,} of {known.size:,} poses have modes below {limit:g} Hz."
    output.report(lambda: _record_of_map(found), verdict, tell)
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
    TextTable(heads, rows, found.robot.name).show()


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
