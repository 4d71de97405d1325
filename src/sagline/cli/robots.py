"""`sagline robots` and `sagline show`: what there is, and what is in it."""

from __future__ import annotations

from typing import Any

import numpy as np
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from sagline.arrays import Array
from sagline.cli.tables import plain_table
from sagline.cli.terminal import show, show_json
from sagline.files.robot_file import load_robot
from sagline.robot.catalogue import robot_names
from sagline.robot.robot import Robot

WHOLE = {  # fields and their units; one value, or one that holds for all cables
    "motion_pattern": "",
    "plane_normal": "",
    "mass": "kg",
    "center_of_mass": "m",
    "inertia": "kg m²",
    "gravity": "m/s²",
    "linear_density": "kg/m",
    "axial_stiffness": "N",
    "tension_min": "N",
    "tension_max": "N",
    "tension_limits_of": "",
    "platform_size": "m",
    "frame_size": "m",
    "test_box": "m",
}
ANCHORS = {"frame_anchors": "m", "platform_anchors": "m"}
MATERIAL = ("linear_density", "axial_stiffness")  # fields of the robot's cables
PER_CABLE = (*MATERIAL, "tension_min", "tension_max")


def list_robots(*, as_json: bool) -> None:
    """Print the presets."""
    robots = [load_robot(name) for name in robot_names()]
    if as_json:
        show_json([_short(robot) for robot in robots])
        return
    for robot in robots:
        size = " × ".join(f"{edge:.3g}" for edge in _size(robot))
        line = f"{robot.name:18} {robot.cable_count:2} cables, {robot.motion_pattern} {robot.mass:10g} kg   {size} m"
        show(Text(line, style="bold"))
        show(Padding(Text(robot.source), (0, 0, 0, 4), expand=False))


def show_robot(name: str, *, as_json: bool) -> None:
    """Print all values of a robot.

    Raises:
        SaglineError: If there is no such robot, or its file is wrong.
    """
    robot = load_robot(name)
    if as_json:
        show_json(_record(robot))
        return
    show(_whole_table(robot))
    show(_anchor_table(robot))
    for label, text in (("Source", robot.source), ("Notes", robot.notes)):
        if text:
            show(Text(f"{label}: {text}"))
    if robot.assumed:
        show("\n* assumed, not in the source:")
        for field, why in robot.assumed.items():
            show(Padding(Text(f"{field}: {why}"), (0, 0, 0, 2), expand=False))


def _short(robot: Robot) -> dict[str, Any]:
    return {
        "name": robot.name,
        "cables": robot.cable_count,
        "motion_pattern": robot.motion_pattern,
        "mass_kg": robot.mass,
        "size_m": _size(robot),
        "source": robot.source,
    }


def _size(robot: Robot) -> Array:
    """Edges of the frame, or of the box around its anchors."""
    extent: Array = np.ptp(robot.frame_anchors, axis=0)
    return extent if robot.frame_size is None else robot.frame_size


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
        if (why := _assumption(robot, field)) is not None:
            record[field]["assumed"] = why
    return record


def _marked(robot: Robot, field: str) -> str:
    mark = "" if _assumption(robot, field) is None else " *"
    return field.replace("_", " ") + mark


def _whole_table(robot: Robot) -> Table:
    table = plain_table(robot.name)
    table.add_column("")
    table.add_column("value")
    table.add_column("unit")
    for field, unit in WHOLE.items():
        if (value := _value(robot, field)) is not None:
            table.add_row(_marked(robot, field), _text(field, value), unit)
    return table


def _text(field: str, value: Any) -> str:
    if field == "inertia" and not np.any(value - np.diag(np.diag(value))):
        return f"diagonal {_numbers(np.diag(value))}"
    if field == "test_box":
        return f"{_numbers(value.low)} to {_numbers(value.high)}, tilted by up to {np.degrees(value.tilt):.3g}°"
    if field.endswith("size"):
        return " × ".join(f"{edge:g}" for edge in value)
    if field in PER_CABLE:
        return f"{value[0]:.5g}" if np.all(value == value[0]) else _numbers(value)
    if isinstance(value, np.ndarray):
        return "\n".join(_numbers(row) for row in np.atleast_2d(value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _numbers(row: Any) -> str:
    return "(" + ", ".join(f"{number:.5g}" for number in row) + ")"


def _anchor_table(robot: Robot) -> Table:
    table = plain_table()
    table.add_column("cable", justify="right")
    for field, unit in ANCHORS.items():
        table.add_column(Text(f"{_marked(robot, field)} [{unit}]"), no_wrap=True)
    for i in range(robot.cable_count):
        table.add_row(str(i), *(_numbers(_value(robot, field)[i]) for field in ANCHORS))
    return table
