"""`sagline show`: every value with its unit."""

import json
from pathlib import Path

import numpy as np
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.robot.tolerances import Provenance

UNITS = {
    **dict.fromkeys(("frame_anchors", "platform_anchors", "center_of_mass", "platform_size", "frame_size"), "m"),
    **dict.fromkeys(("axial_stiffness", "tension_min", "tension_max"), "N"),
    **dict.fromkeys(("motion_pattern", "plane_normal", "tension_limits_of"), ""),
    "test_box": "m",
    "mass": "kg",
    "inertia": "kg m²",
    "gravity": "m/s²",
    "linear_density": "kg/m",
    "diameter": "m",
    "expansion": "1/K",
}


def shown(*words: str) -> str:
    done = CliRunner().invoke(app, ["show", *words])
    assert done.exit_code == 0, done.output
    return str(done.stdout)


def test_every_value_has_its_unit() -> None:
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


def test_winches_are_shown_with_their_units(tmp_path: Path) -> None:
    winches = sl.Winch([0.05] * 7 + [0.04], swivel_axis=[0, 0, -1], inertia=2.77e-5, gear=-20, counts_per_turn=2**17)
    thick = sl.Cable(0.065, 7e5, diameter=0.004)
    robot = sl.load_robot("cogiro").replace(winches=winches, cables=thick, assumed={"winches": "a guess"})
    (tmp_path / "wound.yaml").write_text(sl.dump_robot(robot))
    record = json.loads(shown(str(tmp_path / "wound.yaml"), "--json"))
    assert record["winches"]["assumed"] == "a guess"
    assert record["winches"]["value"]["inertia"] == {"value": [2.77e-5] * 8, "unit": "kg m²"}
    assert record["winches"]["value"]["swivel_axis"]["value"] == [[0.0, 0.0, -1.0]] * 8
    assert "drum_radius" not in record["winches"]["value"]
    assert record["diameter"] == {"value": [0.004] * 8, "unit": "m"}
    assert json.loads(shown("cogiro", "--json"))["winches"] is None
    text = " ".join(shown(str(tmp_path / "wound.yaml")).split())
    for line in (
        "winches *",
        "pulley radius (0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05, 0.04) m",
        "swivel axis down",
        "inertia 2.77e-05 kg m²",
        "gear -20",
        "counts per turn 131072",
        "diameter 0.004 m",
    ):
        assert line in text


def test_a_tilt_is_shown_in_degrees() -> None:
    robot = sl.load_robot("cogiro")
    assert robot.test_box is not None
    assert robot.test_box.tilt > 0.0
    assert f" {180.0 / np.pi * robot.test_box.tilt:.3g}°" in " ".join(shown("cogiro").split())


def test_tolerances_and_calibrated_values_are_shown(tmp_path: Path) -> None:
    made = Provenance(
        "winches.csv", "2026-03-01", {"mass": 0.08, "frame_anchors": np.arange(24.0).reshape(8, 3)}, "wet"
    )
    robot = sl.load_robot("cogiro").replace(
        tolerances={"mass": 0.5, "center_of_mass": [0.01, 0.02, 0.03]}, calibration=made
    )
    (tmp_path / "found.yaml").write_text(sl.dump_robot(robot))
    record = json.loads(shown(str(tmp_path / "found.yaml"), "--json"))
    assert record["tolerances"]["mass"] == {"value": 0.5, "unit": "kg"}
    assert record["tolerances"]["center_of_mass"] == {"value": [0.01, 0.02, 0.03], "unit": "m"}
    assert {name: record["calibration"][name] for name in ("log", "date", "note")} == {
        "log": "winches.csv",
        "date": "2026-03-01",
        "note": "wet",
    }
    assert record["calibration"]["standard_error"]["frame_anchors"]["value"][7] == [21.0, 22.0, 23.0]
    text = " ".join(shown(str(tmp_path / "found.yaml")).split())
    for line in (
        "mass 0.5 kg",
        "(0.01, 0.02, 0.03) m",
        "Calibrated on 2026-03-01 from winches.csv: wet",
        "mass 0.08 kg",
    ):
        assert line in text, line
    assert "(21, 22, 23)" in text
