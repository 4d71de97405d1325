"""`sagline show`: every value with its unit."""

import json

import numpy as np
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app

UNITS = {
    **dict.fromkeys(("frame_anchors", "platform_anchors", "center_of_mass", "platform_size", "frame_size"), "m"),
    **dict.fromkeys(("axial_stiffness", "tension_min", "tension_max"), "N"),
    **dict.fromkeys(("motion_pattern", "plane_normal", "tension_limits_of"), ""),
    "test_box": "m",
    "mass": "kg",
    "inertia": "kg m²",
    "gravity": "m/s²",
    "linear_density": "kg/m",
}


def shown(*words: str) -> str:
    done = CliRunner().invoke(app, ["show", *words])
    assert done.exit_code == 0, done.output
    return str(done.stdout)


def test_every_value_stands_beside_its_unit() -> None:
    robot = sl.load_robot("cogiro")
    record = json.loads(shown("cogiro", "--json"))
    assert {name: entry["unit"] for name, entry in record.items() if isinstance(entry, dict)} == UNITS
    for name in ("frame_anchors", "inertia", "mass", "tension_max"):
        np.testing.assert_array_equal(record[name]["value"], getattr(robot, name))
    np.testing.assert_array_equal(record["axial_stiffness"]["value"], robot.cables.axial_stiffness)
    text = shown("cogiro")
    for name, unit in (("mass", "kg"), ("gravity", "m/s²"), ("axial stiffness", "N"), ("tension max", "N")):
        (line,) = (line for line in text.splitlines() if line.strip().removesuffix("│").lstrip("│ ").startswith(name))
        assert line.rstrip(" │").split()[-1] == unit, line


def test_a_tilt_is_shown_in_degrees() -> None:
    robot = sl.load_robot("cogiro")
    assert robot.test_box is not None
    assert robot.test_box.tilt > 0.0
    assert f" {180.0 / np.pi * robot.test_box.tilt:.3g}°" in " ".join(shown("cogiro").split())
