"""`sagline robots` and `sagline show`: a list of the presets, and all values of one robot."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

import sagline as sl
from sagline.cli import options as opt
from sagline.cli.output import Output, TextTable, values_of
from sagline.cli.terminal import show_json, show_text
from sagline.core.arrays import Array
from sagline.core.numbers import n
from sagline.files.writing import file_stem

MATERIAL = ("linear_density", "axial_stiffness", "diameter", "expansion")  # fields of the robot's cables
PER_CABLE = (*MATERIAL, "tension_min", "tension_max")
ANCHORS = ("frame_anchors", "platform_anchors")
WHOLE = (  # the other fields of the robot, in the order of the list
    *("motion_pattern", "plane_normal", "mass", "center_of_mass", "inertia", "gravity", *PER_CABLE),
    *("tension_limits_of", "platform_size", "frame_size", "test_box"),
)
CABLES = "-cables.csv"


def robots(files: opt.Files = opt.TABLE_FILES) -> None:
    """List the preset robots."""
    output = Output(files, "robots", (), (), ".csv")
    robots = [sl.load_robot(name) for name in sl.robot_names()]
    output.table(".csv", lambda: _sizes(robots))
    if files.as_json:
        show_json([_short(robot) for robot in robots])
        return
    heads = ["robot", "cables", "motion", "mass [kg]", "frame [m]", "platform [m]"]
    rows = [
        [robot.name, str(robot.cable_count), robot.motion_pattern, f"{robot.mass:g}", _edges(frame), _edges(platform)]
        for robot in robots
        for frame, platform in [(_frame(robot), _platform(robot))]
    ]
    TextTable(heads, rows, left=frozenset({0, 2, 4, 5})).show(f"{len(robots)} preset robots.")
    frame = "length × width × height above the floor. If the source gives no size: the box around the anchors."
    show_text(f"Frame: {frame}")
    show_text("")
    for robot in robots:
        show_text(robot.name, style="bold")
        show_text(robot.source, indent=4)
    output.show()


def show(name: str = opt.ROBOT, files: opt.Files = opt.TABLE_FILES) -> None:
    """Show every value of a robot with its unit. Assumed values have a mark and a reason. --csv writes the cables.

    For example:

        sagline show ipanema-1
        sagline show own_robot.yaml --json
    """
    robot = sl.load_robot(name)
    output = Output(files, file_stem(robot.name), (), (), CABLES)
    output.table(CABLES, lambda: _cables(robot))
    record = _record(robot)
    if files.as_json:
        show_json(record)
        return
    assumed = f"; {len(robot.assumed)} values are assumed" if robot.assumed else ""
    values = _listing({field: record[field] for field in WHOLE}, _text, robot.name)
    values.show(f"{robot.name}: {robot.cable_count} cables, {n(robot.mass, '.4g', 'kg')}{assumed}.")
    if (winches := record["winches"]) is not None:
        _listing(winches["value"], _winch_text, _marked("winches", winches)).show()
    _anchors(record).show()
    if record["tolerances"]:
        _listing(record["tolerances"], _deviation_text, "", "tolerance").show()
    if (known := robot.calibration) is not None:
        source, note = (f" from {known.log}" * bool(known.log), f": {known.note}" * bool(known.note))
        show_text(f"Calibrated on {known.date}{source}{note}")
        _listing(record["calibration"]["standard_error"], _deviation_text, "", "standard error").show()
    for label, text in (("Source", robot.source), ("Notes", robot.notes)):
        if text:
            show_text(f"{label}:")
            show_text(text, indent=2)
    if robot.assumed:
        show_text("* assumed, not in the source:")
        for field, why in robot.assumed.items():
            show_text(f"{field}: {why}", indent=2)
    output.show()


def _sizes(robots: Sequence[sl.Robot]) -> list[list[object]]:
    """Heads of the columns, then one row per robot."""
    sizes = [f"{what} {axis} [m]" for what in ("frame", "platform") for axis in "xyz"]
    return [
        ["robot", "cables", "motion", "mass [kg]", *sizes, "source"],
        *(
            [each.name, each.cable_count, each.motion_pattern, each.mass, *_frame(each), *_platform(each), each.source]
            for each in robots
        ),
    ]


def _cables(robot: sl.Robot) -> list[list[object]]:
    """Heads of the columns, then anchors, material and limits of each cable. Unknown values are empty cells."""
    unit = _units()
    heads = ["cable", *(f"{field} {axis} [{unit[field]}]" for field in ANCHORS for axis in "xyz")]
    known = {field: np.asarray(value) for field in PER_CABLE if (value := _value(robot, field)) is not None}
    columns = [np.broadcast_to(value, robot.cable_count).tolist() for value in known.values()]
    anchors = np.hstack([_value(robot, field) for field in ANCHORS]).tolist()
    rows = zip(anchors, *columns, strict=True)
    return [
        [*heads, *(f"{field} [{unit[field]}]" for field in known)],
        *([k, *places, *values] for k, (places, *values) in enumerate(rows)),
    ]


def _short(robot: sl.Robot) -> dict[str, Any]:
    return {
        "name": robot.name,
        "cables": robot.cable_count,
        "motion_pattern": robot.motion_pattern,
        "mass_kg": robot.mass,
        "frame_size_m": _frame(robot),
        "platform_size_m": _platform(robot),
        "source": robot.source,
    }


def _frame(robot: sl.Robot) -> Array:
    """Edge lengths of the frame. If unknown, those of the box that encloses the anchors and reaches to the floor."""
    if robot.frame_size is not None:
        return robot.frame_size
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    floor = min(0.0, low[2]) if robot.test_box is None else min(0.0, low[2], robot.test_box.low[2])
    return np.array([*(high - low)[:2], high[2] - floor])


def _platform(robot: sl.Robot) -> Array:
    """Edge lengths of the platform. If unknown, those of the box that encloses its anchors."""
    extent: Array = np.ptp(robot.platform_anchors, axis=0)
    return extent if robot.platform_size is None else robot.platform_size


def _edges(size: Array) -> str:
    return " × ".join(f"{edge:.3g}" for edge in size)


def _value(robot: sl.Robot, field: str) -> Any:
    return getattr(robot.cables if field in MATERIAL else robot, field)


def _units() -> dict[str, str]:
    """Units of the fields of a robot; "" for a field without a unit."""
    from sagline.core.fields import units

    declared = units(sl.Robot) | units(sl.Cable) | {"inertia": "kg m^2", "test_box": "m"}
    return {name: declared.get(name, "").replace("^2", "²") for name in (*WHOLE, *ANCHORS)}


def _record(robot: sl.Robot) -> dict[str, Any]:
    from sagline.core.fields import units
    from sagline.robot.tolerances import UNCERTAIN

    record: dict[str, Any] = {"name": robot.name, "source": robot.source, "notes": robot.notes}
    for field, unit in _units().items():
        value = _value(robot, field)
        if field == "test_box" and value is not None:
            value = {"low": value.low, "high": value.high, "tilt_rad": value.tilt}
        record[field] = {"value": value, "unit": unit}
        why = robot.assumed.get("cables" if field in MATERIAL else field)
        if why is not None and value is not None:
            record[field]["assumed"] = why
    record["winches"] = None
    if robot.winches is not None:
        record["winches"] = {"unit": "", "value": _with_units(robot.winches.known(), units(sl.Winch) | {"guides": ""})}
        if "winches" in robot.assumed:
            record["winches"]["assumed"] = robot.assumed["winches"]
    uncertain = {name: each.unit for name, each in UNCERTAIN.items()}
    record["tolerances"] = _with_units(robot.tolerances, uncertain) or None
    record["calibration"] = None
    if (known := robot.calibration) is not None:
        errors = _with_units(known.standard_error, uncertain)
        record["calibration"] = {**values_of(known, "log", "date", "note"), "standard_error": errors}
    return record


def _with_units(values: Mapping[str, Any], unit: Mapping[str, str]) -> dict[str, Any]:
    return {name: {"value": value, "unit": unit[name].replace("^2", "²")} for name, value in values.items()}


def _listing(entries: Mapping[str, Any], text: Callable[[str, Any], str], title: str, head: str = "value") -> TextTable:
    """Table of the known values in `entries`. Assumed values have a mark."""
    rows = [
        [_marked(name, entry), text(name, entry["value"]), entry["unit"]]
        for name, entry in entries.items()
        if entry["value"] is not None
    ]
    return TextTable(["", head, "unit"], rows, title, left=frozenset(range(3)), prose=frozenset({1}))


def _marked(name: str, entry: Mapping[str, Any]) -> str:
    return name.replace("_", " ") + " *" * ("assumed" in entry)


def _deviation_text(_: str, value: Array) -> str:
    return _spread(value, digits=4)


def _winch_text(field: str, value: Any) -> str:
    if field in ("swivel_axis", "on_platform"):
        words = {1.0: "up", -1.0: "down"}
        ways = [str(one).lower() for one in value]
        if field == "swivel_axis":
            ways = [words.get(axis[2], f"[{', '.join(f'{x:.4g}' for x in axis)}]") for axis in value]
        return f"({', '.join(ways)})" if len(set(ways)) > 1 else ways[0]
    return value if isinstance(value, str) else _spread(value, digits=9)  # counts need more digits than lengths


def _spread(value: Array, digits: int = 5) -> str:
    """Values as text, with one number if all are equal."""
    if np.all(value == value.flat[0]):
        return f"{value.flat[0]:.{digits}g}"
    return "\n".join(_numbers(row, digits) for row in np.atleast_2d(value))


def _text(field: str, value: Any) -> str:
    if field == "inertia" and not np.any(value - np.diag(np.diag(value))):
        return f"diagonal {_numbers(np.diag(value))}"
    if field == "test_box":
        tilt = np.degrees(value["tilt_rad"])
        return f"{_numbers(value['low'])} to {_numbers(value['high'])}, tilted by up to {tilt:.3g}°"
    if field.endswith("size"):
        return " × ".join(f"{edge:g}" for edge in value)
    if field in PER_CABLE:
        return _spread(value)
    if isinstance(value, np.ndarray):
        return "\n".join(_numbers(row) for row in np.atleast_2d(value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _numbers(row: Any, digits: int = 5) -> str:
    return "(" + ", ".join(f"{number:.{digits}g}" for number in row) + ")"


def _anchors(record: Mapping[str, Any]) -> TextTable:
    heads = ["cable", *(f"{_marked(field, record[field])} [{record[field]['unit']}]" for field in ANCHORS)]
    ends = zip(*(record[field]["value"] for field in ANCHORS), strict=True)
    rows = [[str(k), *map(_numbers, both)] for k, both in enumerate(ends)]
    return TextTable(heads, rows, left=frozenset({1, 2}))
