"""`sagline robots` and `sagline show`: a list of the presets, and all values of one robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from sagline.cli.options import JsonOption, OutOption, RobotArgument, TableOption, only_with
from sagline.cli.output import Output, TextTable, show_table
from sagline.cli.terminal import show_json, show_text
from sagline.core.numbers import n

if TYPE_CHECKING:
    from sagline.core.arrays import Array
    from sagline.robot.robot import Robot
    from sagline.robot.winch import Winch

WHOLE = {  # fields of the robot and their units
    "motion_pattern": "",
    "plane_normal": "",
    "mass": "kg",
    "center_of_mass": "m",
    "inertia": "kg m²",
    "gravity": "m/s²",
    "linear_density": "kg/m",
    "axial_stiffness": "N",
    "diameter": "m",
    "expansion": "1/K",
    "tension_min": "N",
    "tension_max": "N",
    "tension_limits_of": "",
    "platform_size": "m",
    "frame_size": "m",
    "test_box": "m",
}
ANCHORS = {"frame_anchors": "m", "platform_anchors": "m"}
MATERIAL = ("linear_density", "axial_stiffness", "diameter", "expansion")  # fields of the robot's cables
PER_CABLE = (*MATERIAL, "tension_min", "tension_max")
CABLES = "-cables.csv"


def robots(
    folder: Annotated[OutOption, only_with("--csv")] = Path("output"),
    write_table: TableOption = False,
    as_json: JsonOption = False,
) -> None:
    """List the preset robots."""
    from sagline.files.robot_file import load_robot
    from sagline.robot.catalogue import robot_names

    output = Output(folder, "robots", [".csv"] * write_table)
    robots = [load_robot(name) for name in robot_names()]
    if write_table:
        sizes = [f"{what} {axis} [m]" for what in ("frame", "platform") for axis in "xyz"]
        rows = [
            [each.name, each.cable_count, each.motion_pattern, each.mass, *_frame(each), *_platform(each), each.source]
            for each in robots
        ]
        output.table(".csv", [["robot", "cables", "motion", "mass [kg]", *sizes, "source"], *rows])
    if as_json:
        show_json([_short(robot) for robot in robots])
        return
    heads = ["robot", "cables", "motion", "mass [kg]", "frame [m]", "platform [m]"]
    rows = [
        [robot.name, str(robot.cable_count), robot.motion_pattern, f"{robot.mass:g}", _edges(frame), _edges(platform)]
        for robot in robots
        for frame, platform in [(_frame(robot), _platform(robot))]
    ]
    show_table(TextTable(heads, rows, left=frozenset({0, 2, 4, 5})), f"{len(robots)} preset robots.")
    show_text(
        "Frame: length × width × height above the floor. If the source gives no size: the box around the anchors."
    )
    show_text("")
    for robot in robots:
        show_text(robot.name, style="bold")
        show_text(robot.source, indent=4)
    output.show()


def show(
    name: RobotArgument,
    folder: Annotated[OutOption, only_with("--csv")] = Path("output"),
    write_table: TableOption = False,
    as_json: JsonOption = False,
) -> None:
    """Show every value of a robot with its unit; assumed values are marked, with the reason. --csv writes the cables.

    For example:

        sagline show ipanema-1
        sagline show own_robot.yaml --json
    """
    from sagline.files.robot_file import load_robot
    from sagline.files.writing import file_stem

    robot = load_robot(name)
    output = Output(folder, file_stem(robot.name), [CABLES] * write_table)
    if write_table:
        output.table(CABLES, _cables(robot))
    if as_json:
        show_json(_record(robot))
        return
    assumed = f"; {len(robot.assumed)} values are assumed" if robot.assumed else ""
    show_table(_values(robot), f"{robot.name}: {robot.cable_count} cables, {n(robot.mass, '.4g', 'kg')}{assumed}.")
    if robot.winches is not None:
        show_table(_winches(robot, robot.winches))
    show_table(_anchors(robot))
    if robot.tolerances:
        show_table(_deviations(robot.tolerances, "tolerance"))
    if (known := robot.calibration) is not None:
        source, note = (f" from {known.log}" * bool(known.log), f": {known.note}" * bool(known.note))
        show_text(f"Calibrated on {known.date}{source}{note}")
        show_table(_deviations(known.standard_error, "standard error"))
    for label, text in (("Source", robot.source), ("Notes", robot.notes)):
        if text:
            show_text(f"{label}:")
            show_text(text, indent=2)
    if robot.assumed:
        show_text("* assumed, not in the source:")
        for field, why in robot.assumed.items():
            show_text(f"{field}: {why}", indent=2)
    output.show()


def _cables(robot: Robot) -> list[list[object]]:
    """The heads of the columns, then anchors, material and limits of each cable; cells of unknown values are empty."""
    heads = ["cable", *(f"{field} {axis} [{unit}]" for field, unit in ANCHORS.items() for axis in "xyz")]
    known = {field: np.asarray(value) for field in PER_CABLE if (value := _value(robot, field)) is not None}
    columns = [np.broadcast_to(value, robot.cable_count).tolist() for value in known.values()]
    anchors = np.hstack([_value(robot, field) for field in ANCHORS]).tolist()
    rows = zip(anchors, *columns, strict=True)
    return [
        [*heads, *(f"{field} [{WHOLE[field]}]" for field in known)],
        *([k, *places, *values] for k, (places, *values) in enumerate(rows)),
    ]


def _short(robot: Robot) -> dict[str, Any]:
    return {
        "name": robot.name,
        "cables": robot.cable_count,
        "motion_pattern": robot.motion_pattern,
        "mass_kg": robot.mass,
        "frame_size_m": _frame(robot),
        "platform_size_m": _platform(robot),
        "source": robot.source,
    }


def _frame(robot: Robot) -> Array:
    """Edge lengths of the frame. Without a frame, those of the box around the anchors and down to the floor."""
    if robot.frame_size is not None:
        return robot.frame_size
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    floor = min(0.0, low[2]) if robot.test_box is None else min(0.0, low[2], robot.test_box.low[2])
    return np.array([*(high - low)[:2], high[2] - floor])


def _platform(robot: Robot) -> Array:
    """Edge lengths of the platform. If they are not given, edge lengths of the box that encloses its anchors."""
    extent: Array = np.ptp(robot.platform_anchors, axis=0)
    return extent if robot.platform_size is None else robot.platform_size


def _edges(size: Array) -> str:
    return " × ".join(f"{edge:.3g}" for edge in size)


def _value(robot: Robot, field: str) -> Any:
    return getattr(robot.cables if field in MATERIAL else robot, field)


def _assumption(robot: Robot, field: str) -> str | None:
    return robot.assumed.get("cables" if field in MATERIAL else field)


def _record(robot: Robot) -> dict[str, Any]:
    record: dict[str, Any] = {"name": robot.name, "source": robot.source, "notes": robot.notes}
    for field, unit in (WHOLE | ANCHORS).items():
        value = _value(robot, field)
        if field == "test_box" and value is not None:
            value = {"low": value.low, "high": value.high, "tilt_rad": value.tilt}
        record[field] = {"value": value, "unit": unit}
        if (why := _assumption(robot, field)) is not None and value is not None:
            record[field]["assumed"] = why
    record["winches"] = None if robot.winches is None else {"unit": "", "value": _parts(robot.winches)}
    if robot.winches is not None and "winches" in robot.assumed:
        record["winches"]["assumed"] = robot.assumed["winches"]
    record["tolerances"] = _parts_of(robot.tolerances) or None
    record["calibration"] = None
    if (known := robot.calibration) is not None:
        errors = _parts_of(known.standard_error)
        record["calibration"] = {"log": known.log, "date": known.date, "note": known.note, "standard_error": errors}
    return record


def _parts_of(deviations: Mapping[str, Array]) -> dict[str, Any]:
    """The robot's standard deviations, each with its unit."""
    from sagline.robot.tolerances import UNCERTAIN

    return {
        name: {"value": value, "unit": UNCERTAIN[name].unit.replace("^2", "²")} for name, value in deviations.items()
    }


def _deviations(deviations: Mapping[str, Array], head: str) -> TextTable:
    """Table of the standard deviations; a field with equal values has one number."""
    from sagline.robot.tolerances import UNCERTAIN

    rows = []
    for name, value in deviations.items():
        alike = bool((value == value.flat[0]).all())
        text = f"{value.flat[0]:.4g}" if alike else "\n".join(_numbers(row, 4) for row in np.atleast_2d(value))
        rows.append([name.replace("_", " "), text, UNCERTAIN[name].unit])
    return TextTable(["", head, "unit"], rows, left=frozenset(range(3)), prose=frozenset({1}))


def _parts(winches: Winch) -> dict[str, Any]:
    """Known values of the winches, each with its unit."""
    from sagline.core.fields import units
    from sagline.robot.winch import Winch

    unit = units(Winch) | {"guides": ""}
    return {name: {"value": value, "unit": unit[name].replace("^2", "²")} for name, value in winches.known().items()}


def _marked(robot: Robot, field: str) -> str:
    mark = "" if _assumption(robot, field) is None else " *"
    return field.replace("_", " ") + mark


def _values(robot: Robot) -> TextTable:
    rows = [
        [_marked(robot, field), _text(field, value), unit]
        for field, unit in WHOLE.items()
        if (value := _value(robot, field)) is not None
    ]
    return TextTable(["", "value", "unit"], rows, robot.name, left=frozenset(range(3)), prose=frozenset({1}))


def _winches(robot: Robot, winches: Winch) -> TextTable:
    parts = _parts(winches)
    ways = ["up" if axis[2] > 0.0 else "down" for axis in winches.swivel_axis]
    parts["swivel_axis"]["value"] = ways if len(set(ways)) > 1 else ways[0]
    rows = [[name.replace("_", " "), _spread(entry["value"], digits=9), entry["unit"]] for name, entry in parts.items()]
    title = _marked(robot, "winches")
    return TextTable(["", "value", "unit"], rows, title, left=frozenset(range(3)), prose=frozenset({1}))


def _spread(value: Any, digits: int = 5) -> str:
    """One value if it is the same for all cables, otherwise all values; counts need more digits than lengths."""
    if isinstance(value, str | list):
        return value if isinstance(value, str) else f"({', '.join(value)})"
    return f"{value[0]:.{digits}g}" if np.all(value == value[0]) else _numbers(value, digits)


def _text(field: str, value: Any) -> str:
    if field == "inertia" and not np.any(value - np.diag(np.diag(value))):
        return f"diagonal {_numbers(np.diag(value))}"
    if field == "test_box":
        return f"{_numbers(value.low)} to {_numbers(value.high)}, tilted by up to {np.degrees(value.tilt):.3g}°"
    if field.endswith("size"):
        return " × ".join(f"{edge:g}" for edge in value)
    if field in PER_CABLE:
        return _spread(value)
    if isinstance(value, np.ndarray):
        return "\n".join(_numbers(row) for row in np.atleast_2d(value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _numbers(row: Any, digits: int = 5) -> str:
    return "(" + ", ".join(f"{number:.{digits}g}" for number in row) + ")"


def _anchors(robot: Robot) -> TextTable:
    heads = ["cable", *(f"{_marked(robot, field)} [{unit}]" for field, unit in ANCHORS.items())]
    rows = [[str(k), *(_numbers(_value(robot, field)[k]) for field in ANCHORS)] for k in range(robot.cable_count)]
    return TextTable(heads, rows, left=frozenset({1, 2}))
