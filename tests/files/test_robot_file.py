import re
from pathlib import Path
from typing import Any

import attrs
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from syrupy.assertion import SnapshotAssertion

from sagline import Cable, FileError, InvalidValueError, PoseBox, Robot, Winch, dump_robot, load_robot, robot_names
from sagline.core.errors import printable
from sagline.files.robot_file import parse_robot
from sagline.robot.tolerances import UNCERTAIN, Provenance, value_of
from tests.files.wording import wording
from tests.refusal import refused
from tests.tiers import wide

TEXT = """
name: pendulum
frame_anchors: [[0, 0, 3000 mm], [4 m, 0, 3], [0, 4, 3]]
platform_anchors: [[0, 0, 0], [10 cm, 0, 0], [0, 0.1, 0]]
cables: {linear_density: 67 g/m, youngs_modulus: 2 GPa, section_area: 22 mm^2}
mass: 500 g
inertia: {box: [30 cm, 0.3, 0.5]}
tension_min: 20
tension_max: [1 kN, 2 kN, .inf]
assumed: {mass: a guess}
"""
KEYS_OF_WINCHES = f"keys {', '.join(field.name for field in attrs.fields(Winch))}"
LOG = {"log": "winches.csv", "date": "2026-03-01"}


def edited(**changes: Any) -> str:
    data = {**yaml.safe_load(TEXT), **changes}
    return yaml.safe_dump({key: value for key, value in data.items() if value is not ...})


def arrays_of(robot: Robot) -> dict[str, Any]:
    values = {field.name: getattr(robot, field.name) for field in attrs.fields(Robot)}
    cables, box, winches = values.pop("cables"), values.pop("test_box"), values.pop("winches")
    values |= {f"tolerances.{key}": field for key, field in values.pop("tolerances").items()}
    if (known := values.pop("calibration")) is not None:
        values |= {"calibration": (known.log, known.date, known.note)}
        values |= {f"calibration.standard_error.{key}": field for key, field in known.standard_error.items()}
    values |= {f"cables.{key}": field for key, field in cables.known().items()}
    if winches is not None:
        values |= {f"winches.{key}": field for key, field in winches.known().items()}
    return values if box is None else values | {"low": box.low, "high": box.high, "tilt": box.tilt}


def assert_same(robot: Robot, other: Robot) -> None:
    mine, yours = arrays_of(robot), arrays_of(other)
    assert mine.keys() == yours.keys()
    for name, value in mine.items():
        if isinstance(value, np.ndarray):
            assert value.shape == yours[name].shape, name
            assert value.tobytes() == yours[name].tobytes(), name
        else:
            assert value == yours[name], name


def test_units_become_si() -> None:
    robot = parse_robot(TEXT, "robot.yaml")
    np.testing.assert_array_equal(robot.frame_anchors, [[0, 0, 3], [4, 0, 3], [0, 4, 3]])
    np.testing.assert_allclose(robot.platform_anchors, [[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]], rtol=1e-15)
    np.testing.assert_allclose(robot.cables.linear_density, 0.067, rtol=1e-15)
    np.testing.assert_allclose(robot.cables.axial_stiffness, 44e3, rtol=1e-15)
    np.testing.assert_array_equal(robot.tension_max, [1000, 2000, np.inf])
    np.testing.assert_allclose(np.diag(robot.inertia), 0.5 / 12 * np.array([0.34, 0.34, 0.18]), rtol=1e-15)
    assert (robot.mass, dict(robot.assumed), robot.gravity) == (0.5, {"mass": "a guess"}, 9.81)


# equal values in SI and in another unit, for every quantity of a robot file
QUANTITIES: dict[str, tuple[Any, Any]] = {
    "frame_anchors": ([[0, 0, 3], [4, 0, 3], [0, 4, 3]], [[0, 0, "300 cm"], ["4 m", 0, 3], [0, "0.004 km", "30 dm"]]),
    "platform_anchors": ([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 0, 0], ["100 mm", 0, 0], [0, "10 cm", 0]]),
    "mass": (0.5, "500 g"),
    "center_of_mass": ([0.01, 0, -0.02], ["10 mm", 0, "-2 cm"]),
    "gravity": (1.62, "162 cm/s^2"),
    "tension_min": ([20, 30, 40], ["20000 mN", "0.03 kN", 40]),
    "tension_max": (1500, "1.5 kN"),
    "platform_size": ([0.3, 0.3, 0.5], ["300 mm", "30 cm", 0.5]),
    "frame_size": ([4, 4, 3], ["400 cm", "4000 mm", 3]),
    "cables.linear_density": (0.067, "67 g/m"),
    "cables.axial_stiffness": (44e3, "44 kN"),
    "cables.youngs_modulus": (2e9, "2 kN/mm^2"),
    "cables.section_area": (22e-6, "22 mm^2"),
    "cables.radius": (2e-3, "2 mm"),
    "cables.diameter": (4e-3, "0.4 cm"),
    "cables.expansion": ([-1.2e-5, 0.0, 1.1e-5], ["-12e-6 1/K", 0, "0.011 1/kK"]),
    "inertia.matrix": (np.diag([0.1, 0.2, 0.25]).tolist(), [["1000 kg cm^2", 0, 0], [0, 0.2, 0], [0, 0, 0.25]]),
    "inertia.diagonal": ([0.1, 0.2, 0.25], ["100 g*m^2", 0.2, "2500 kg*cm^2"]),
    "inertia.Ixx": (0.1, "1000 kg*cm^2"),
    "inertia.Ixz": (0.01, "100 kg*cm^2"),
    "inertia.box": ([0.3, 0.3, 0.5], ["30 cm", "300 mm", 0.5]),
    "inertia.cylinder_radius": (0.2, "20 cm"),
    "inertia.cylinder_height": (0.5, "500 mm"),
    "test_box.low": ([-1, -1, 1], ["-100 cm", -1, "1000 mm"]),
    "test_box.high": ([1, 1, 2], ["100 cm", 1, "2000 mm"]),
    "test_box.tilt": (0.1, "0.1 rad"),
    "winches.pulley_radius": ([0.05, 0.0, 0.04], ["50 mm", 0, "4 cm"]),
    "winches.on_platform": ([True, False, True], [True, False, True]),
    "winches.swivel_axis": ([[0, 0, 1], [0, 0, -1], [0, 0, 2]], ["up", "down", [0, 0, "1"]]),
    "winches.pulley_friction": (0.05, "0.05"),
    "winches.rolling_friction": ([0.01, 0.0, 0.02], ["0.01", 0, "2e-2"]),
    "winches.guides": ([[9.0, 0.0, 0.5], [9.0, 0.0, 3.0]], [["900 cm", 0, "500 mm"], [9, "0 mm", "0.003 km"]]),
    "winches.dead_cable": ([4, 5.5, 3], ["400 cm", "5500 mm", 3]),
    "winches.dead_rise": (-2.5, "-25 dm"),
    "winches.drum_radius": (0.06, "60 mm"),
    "winches.drum_width": (0.4, "40 cm"),
    "winches.groove_pitch": (0.006, "6 mm"),
    "winches.layers": ([1, 2, 1], [1, "2", 1]),
    "winches.drum_distance": (0.8, "800 mm"),
    "winches.drum_offset": (-0.06, "-60 mm"),
    "winches.gear": ([20, -20, 12.5], [20, "-20", 12.5]),
    "winches.counts_per_turn": (131072, "131072"),
    "winches.count_zero": (-5000, "-5e3"),
    "winches.length_zero": (7.5, "750 cm"),
    "winches.cable_length": (30, "0.03 km"),
    "winches.winding_tension": (50, "0.05 kN"),
    "winches.inertia": (2.77e-5, "0.277 kg cm^2"),
    "winches.torque_limit": (3.82, "382 N cm"),
    "winches.speed_limit": (100 * np.pi, "3000 rpm"),
    "winches.friction": (15, "0.015 kN"),
    "winches.position_gain": (20, "0.02 1/ms"),
    "winches.speed_gain": (900, "0.9 N s/mm"),
    "winches.integral_gain": (4000, "4 N/mm"),
    "winches.load_cell_range": (2000, "2 kN"),
    "winches.load_cell_deviation": (2.5, "250 cN"),
    "winches.load_cell_bias": (-1.5, "-1500 mN"),
    "winches.load_cell_gain": (1.01, "1.01"),
    "tolerances.frame_anchors": ([0.01, 0.02, 0.03], ["10 mm", "2 cm", 0.03]),
    "tolerances.platform_anchors": ([[0.01, 0.02, 0.03]] * 3, [["10 mm", "2 cm", 0.03]] * 3),
    "tolerances.length_zero": ([1, 2, 3], ["1 m", "200 cm", 3]),
    "tolerances.drum_radius": (1e-4, "0.1 mm"),
    "tolerances.linear_density": (1e-3, "1 g/m"),
    "tolerances.axial_stiffness": ([1e3, 2e3, np.inf], ["1 kN", "2 kN", "inf"]),
    "tolerances.pulley_radius": (1e-3, "1 mm"),
    "tolerances.dead_cable": (0.1, "10 cm"),
    "tolerances.load_cell_gain": (0.02, "0.02"),
    "tolerances.load_cell_bias": (20, "0.02 kN"),
    "tolerances.mass": (0.01, "10 g"),
    "tolerances.center_of_mass": (0.01, "1 cm"),
}
QUANTITIES |= {
    key.replace("tolerances", "calibration.standard_error"): QUANTITIES[key]
    for key in QUANTITIES
    if key.startswith("tol")
}
BESIDE: dict[str, dict[str, Any]] = {
    "cables.linear_density": {"axial_stiffness": 1e4},
    "cables.axial_stiffness": {"linear_density": 0.1},
    "cables.youngs_modulus": {"linear_density": 0.1, "section_area": 1e-6},
    "cables.section_area": {"linear_density": 0.1, "youngs_modulus": 1e9},
    "cables.radius": {"linear_density": 0.1, "youngs_modulus": 1e9},
    "cables.diameter": {"linear_density": 0.1, "youngs_modulus": 1e9},
    "cables.expansion": {"linear_density": 0.1, "axial_stiffness": 1e4},
    "inertia.matrix": {},
    "inertia.diagonal": {},
    "inertia.box": {},
    "inertia.Ixx": {"Iyy": 0.2, "Izz": 0.25},
    "inertia.Ixz": {"Ixx": 0.1, "Iyy": 0.2, "Izz": 0.25},
    "inertia.cylinder_radius": {"cylinder_height": 0.5},
    "inertia.cylinder_height": {"cylinder_radius": 0.2},
    "test_box.low": {"high": [1, 1, 2]},
    "test_box.high": {"low": [-1, -1, 1]},
    "test_box.tilt": {"low": [-1, -1, 1], "high": [1, 1, 2]},
    "winches.dead_rise": {"dead_cable": 3},
}


def with_quantity(key: str, value: Any) -> Robot:
    if key.startswith("calibration"):
        return parse_robot(edited(calibration={**LOG, "standard_error": {key.split(".")[2]: value}}), "robot.yaml")
    outer, _, inner = key.partition(".")
    return parse_robot(edited(**{outer: {**BESIDE.get(key, {}), inner: value} if inner else value}), "robot.yaml")


@pytest.mark.parametrize("key", wide(QUANTITIES, first=56))
def test_every_quantity_is_read_in_its_unit(key: str) -> None:
    plain, other = (arrays_of(with_quantity(key, value)) for value in QUANTITIES[key])
    for name, value in plain.items():
        if isinstance(value, np.ndarray | float):
            np.testing.assert_allclose(other[name], value, rtol=1e-14, err_msg=name)


def test_a_tilt_in_degrees() -> None:
    box = with_quantity("test_box.tilt", "30 deg").test_box
    assert box is not None
    assert box.tilt == pytest.approx(np.pi / 6, rel=1e-15)


def test_the_block_has_every_field_of_the_winch() -> None:
    assert {f"winches.{field.name}" for field in attrs.fields(Winch)} == {
        key for key in QUANTITIES if key.startswith("winches")
    }


@pytest.mark.parametrize(
    ("section", "diameter"),
    [
        ({"axial_stiffness": 1e4}, None),
        ({"axial_stiffness": 1e4, "diameter": "4 mm"}, 4e-3),
        ({"youngs_modulus": 1e9, "section_area": 3e-6, "diameter": [0.003, 0.004, 0.005]}, [3e-3, 4e-3, 5e-3]),
        ({"youngs_modulus": 1e9, "radius": "2 mm"}, 4e-3),
        ({"youngs_modulus": 1e9, "diameter": "4 mm"}, 4e-3),
    ],
)
def test_the_diameter_is_read_if_given(section: dict[str, object], diameter: object) -> None:
    found = parse_robot(edited(cables={"linear_density": 0.1, **section}), "robot.yaml").cables.diameter
    if diameter is None:
        assert found is None
    else:
        assert found is not None
        np.testing.assert_allclose(found, np.broadcast_to(np.array(diameter), 3), rtol=1e-15)


def test_one_block_is_for_all_cables() -> None:
    block = {"pulley_radius": "50 mm", "dead_cable": [4, 5, 6], "swivel_axis": "down", "gear": -20}
    winches = parse_robot(edited(winches=block), "robot.yaml").winches
    assert winches is not None
    np.testing.assert_allclose(winches.pulley_radius, [0.05, 0.05, 0.05], rtol=1e-15)
    np.testing.assert_array_equal(winches.dead_cable, [4, 5, 6])
    np.testing.assert_array_equal(winches.swivel_axis, [[0, 0, -1]] * 3)
    np.testing.assert_array_equal(winches.gear, [-20, -20, -20])
    assert winches.drum_radius is None


@pytest.mark.parametrize(
    ("section", "area"),
    [({"section_area": 3e-6}, 3e-6), ({"radius": "2 mm"}, 4e-6 * np.pi), ({"diameter": "2 mm"}, 1e-6 * np.pi)],
)
def test_notations_of_the_stiffness(section: dict[str, object], area: float) -> None:
    cables = {"linear_density": [0.1, 0.2, 0.3], "youngs_modulus": "1 GPa", **section}
    robot = parse_robot(edited(cables=cables), "robot.yaml")
    np.testing.assert_array_equal(robot.cables.linear_density, [0.1, 0.2, 0.3])
    np.testing.assert_allclose(robot.cables.axial_stiffness, 1e9 * area, rtol=1e-15)


@pytest.mark.parametrize(
    ("inertia", "expected"),
    [
        ([1, 2, "2.5 kg m^2"], np.diag([1, 2, 2.5])),
        ([[1, 0.1, 0], [0.1, 2, 0], [0, 0, 2.5]], [[1, 0.1, 0], [0.1, 2, 0], [0, 0, 2.5]]),
        ({"Ixx": 1, "Iyy": 2, "Izz": 2.5, "Ixy": 0.1, "Iyz": -0.2}, [[1, 0.1, 0], [0.1, 2, -0.2], [0, -0.2, 2.5]]),
        ({"cylinder_radius": "2 m", "cylinder_height": 6}, np.diag([2.0, 2.0, 1.0])),  # of 0.5 kg
    ],
)
def test_notations_of_the_inertia(inertia: object, expected: object) -> None:
    np.testing.assert_allclose(
        parse_robot(edited(inertia=inertia), "robot.yaml").inertia, np.array(expected), rtol=1e-15
    )


@pytest.mark.parametrize(
    ("changes", "parts"),
    [
        (
            {"frame_anchor": [[0, 0, 0]], "frame_anchors": ...},
            ("frame_anchor", "an unknown key", None, "Did you mean frame_anchors?"),
        ),
        (
            {"cables": {"linear_densty": 1}},
            ("cables.linear_densty", "an unknown key", None, "Did you mean linear_density?"),
        ),
        ({"mass": ...}, ("mass", "missing")),
        (
            {"mass": "3 m"},
            ("mass", "'3 m'", 'a number in kg, or text with a unit that converts to it, such as "1.5 kg"'),
        ),
        ({"mass": "-3 kg"}, ("mass", "-3 kg", "> 0 kg, finite")),
        ({"mass": float("nan")}, ("mass", "nan")),
        ({"mass": [1, 2]}, ("mass", "of shape (2,)")),
        ({"frame_anchors": [[0, 0, "3 kg"], [4, 0, 3], [0, 4, 3]]}, ("frame_anchors[0][2]", "'3 kg'")),
        ({"frame_anchors": [[0, 0, 3], [4, 0, 3]]}, ("platform_anchors", "3 points")),
        ({"frame_anchors": [[0, 0], [4, 0, 3]]}, ("frame_anchors", "[[0.0, 0.0], [4.0, 0.0, 3.0]]")),
        (
            {"frame_anchors": [[0, 0, 3]] * 3, "platform_anchors": [[0, 0, 0]] * 3},
            ("cable 1", "between the same two points as cable 0"),
        ),
        (
            {"cables": 5},
            (
                "cables",
                "5",
                "keys linear_density, axial_stiffness, youngs_modulus, section_area, radius, diameter, expansion",
            ),
        ),
        ({"cables": {"linear_density": 0, "axial_stiffness": 1}}, ("cables: linear_density[0]", "0 kg/m", "> 0 kg/m")),
        ({"cables": {"linear_density": -1, "axial_stiffness": 1}}, ("linear_density", "-1 kg/m")),
        ({"cables": {"linear_density": 1, "axial_stiffness": 0}}, ("axial_stiffness", "0 N", "> 0 N, finite")),
        ({"cables": {"linear_density": 1, "axial_stiffness": "5 Pa"}}, ("cables.axial_stiffness", "'5 Pa'")),
        (
            {"cables": {"linear_density": 1}},
            (
                "cables: stiffness",
                "given by nothing",
                (
                    "axial_stiffness; or youngs_modulus and section_area; or youngs_modulus "
                    "and radius; or youngs_modulus and diameter"
                ),
            ),
        ),
        ({"cables": {"linear_density": 1, "youngs_modulus": 1, "radius": -1}}, ("cables.radius", "-1 m")),
        (
            {"cables": {"linear_density": 1, "youngs_modulus": 1, "radius": 1, "diameter": 2}},
            ("cables: stiffness", "given by diameter and radius and youngs_modulus"),
        ),
        ({"cables": {"linear_density": 1, "axial_stiffness": 1, "diameter": "4 kg"}}, ("cables.diameter", "'4 kg'")),
        ({"cables": {"linear_density": 1, "axial_stiffness": 1, "diameter": 0}}, ("diameter", "0 m", "> 0 m, finite")),
        (
            {"cables": {"linear_density": [1, 1, 1], "axial_stiffness": 1, "expansion": [0, 0]}},
            ("linear_density and axial_stiffness and expansion", "not of one shape, but (3,) and () and (2,)"),
        ),
        (
            {"cables": {"linear_density": 1, "axial_stiffness": 1, "expansion": "1e-5"}, "mass": ...},
            ("mass", "missing"),
        ),
        (
            {"winches": {"pulley_radius": "50 mm", "dead_cable": [1, 2]}},
            ("winches: dead_cable", "2 values", "one value, or 3, one per cable"),
        ),
        (
            {"winches": {"pulley_radius": [0.05, 0.05, 0.05], "dead_cable": [1, 2]}},
            ("winches: dead_cable", "2 values", "one value, or 3, as pulley_radius has"),
        ),
        ({"winches": {"drum_radiu": 1}}, ("winches.drum_radiu", "an unknown key", None, "Did you mean drum_radius?")),
        (
            {"winches": {"pulley_radius": "50 kg"}},
            (
                "winches.pulley_radius",
                "'50 kg'",
                'a number in m, or text with a unit that converts to it, such as "1.5 m"',
            ),
        ),
        ({"winches": {"inertia": "3 kg m"}}, ("winches.inertia", "'3 kg m'")),
        (
            {"winches": {"gear": [20, 0, 20]}},
            (
                "winches: gear[1]",
                "0",
                "not 0",
                "Give the encoder turns per drum turn; negative if counts decrease when cable is paid out.",
            ),
        ),
        ({"winches": {"counts_per_turn": 0}}, ("winches: counts_per_turn", "0", "> 0, finite")),
        ({"winches": {"layers": [1, 1, 2.5]}}, ("winches: layers[2]", "2.5", "whole numbers")),
        ({"winches": {"drum_radius": None}}, ("winches.drum_radius", "None")),
        (
            {"winches": {"swivel_axis": "sideways"}},
            ("winches.swivel_axis", "'sideways'", "up, down, or a vector of three numbers"),
        ),
        (
            {"winches": {"on_platform": [True, "up"]}},
            ("winches.on_platform", "'up'", "true or false, or a list of them"),
        ),
        ({"winches": {"swivel_axis": [0, 0, 0]}}, ("winches: swivel_axis", "the zero vector")),
        ({"winches": {"swivel_axis": ["up", "down"]}}, ("winches: swivel_axis", "2 values")),
        (
            {"winches": {"dead_cable": 2, "dead_rise": [1, -3, 1]}},
            ("winches: dead_rise[1]", "-3 m", "within +-2 m, its dead_cable"),
        ),
        ({"winches": 3}, ("winches", "3", KEYS_OF_WINCHES)),
        ({"winches": []}, ("winches", "[]", KEYS_OF_WINCHES)),
        (
            {"inertia": {"box": [1, 1, 1], "Ixx": 1}},
            (
                "inertia",
                "given by Ixx and box",
                "matrix; or diagonal; or Ixx and Iyy and Izz; or box; or cylinder_radius and cylinder_height",
            ),
        ),
        ({"inertia": {"box": [1, 0, 1]}}, ("inertia.box[1]", "0 m")),
        ({"inertia": ...}, ("inertia", "missing")),
        ({"tension_min": "2 kN"}, ("tension_min[0]", "2000 N", "<= tension_max[0], 1000 N")),
        ({"motion_pattern": 3}, ("motion_pattern", "3", "text", 'Put it in quotes: motion_pattern: "..."')),
        ({"name": ""}, ("name", "empty", "a non-empty text")),
        ({"name": 12}, ("name", "12", "text", 'Put it in quotes: name: "..."')),
        ({"assumed": {"masss": "x"}}, ("assumed: field", "'masss'")),
        ({"test_box": {"low": [0, 0, 0], "high": [1, 1, "1 kg"]}}, ("test_box.high[2]", "'1 kg'")),
        ({"tolerances": {"masss": 1}}, ("tolerances.masss", "an unknown key", None, "Did you mean mass?")),
        ({"tolerances": 3}, ("tolerances", "3", f"keys {', '.join(UNCERTAIN)}")),
        ({"tolerances": {"mass": 0}}, ("tolerances: mass", "0 kg", "> 0 kg")),
        ({"tolerances": {"mass": "-1 %"}}, ("tolerances: mass", "-0.005 kg", "> 0 kg")),
        (
            {"tolerances": {"mass": "1 m"}},
            ("tolerances.mass", "'1 m'", 'a number in kg, or text with a unit that converts to it, such as "1.5 kg"'),
        ),
        ({"tolerances": {"mass": "x %"}}, ("tolerances.mass", "'x %'", 'a share, such as "5 %"')),
        (
            {"tolerances": {"frame_anchors": "1 %"}},
            (
                "tolerances.frame_anchors",
                "'1 %'",
                'a number in m, or text with a unit that converts to it, such as "1.5 m"',
            ),
        ),
        ({"tolerances": {"drum_radius": "1 %"}}, ("tolerances: drum_radius", "in percent", "a field that is given")),
        (
            {"tolerances": {"axial_stiffness": ["1 %", 5e3, "1 %"]}},
            ("tolerances.axial_stiffness[1]", "5000.0", 'a share, such as "5 %"'),
        ),
        ({"tolerances": {"axial_stiffness": ["1 %", "2 %"]}}, ("tolerances: axial_stiffness", "of shape (2,)")),
        (
            {"tolerances": {"frame_anchors": [[1, 1, 1]] * 2}},
            ("tolerances: frame_anchors", "of shape (2, 3)", "shape () or (3,) or (3, 3)"),
        ),
        ({"calibration": {"date": "2026-01-01"}}, ("calibration.log", "missing")),
        ({"calibration": {"log": "a.csv", "date": "soon"}}, ("calibration: date", "'soon'", "a date in ISO 8601")),
        (
            {"calibration": {**LOG, "standard_error": {"target": 1}}},
            ("calibration.standard_error.target", "an unknown key"),
        ),
        ({"calibration": {**LOG, "standard_error": {"mass": -1}}}, ("calibration: standard_error: mass", "-1 kg")),
        (
            {"calibration": {**LOG, "standard_error": {"length_zero": [0.1] * 4}}},
            ("calibration: standard_error: length_zero", "of shape (4,)", "shape () or (3,)"),
        ),
    ],
)
def test_a_wrong_value_is_named_with_its_file(changes: dict[str, Any], parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError, file="robot.yaml"):
        parse_robot(edited(**changes), "robot.yaml")


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"name: x\nframe_anchors: [[0, 0, 3], [0,",
        b"name: a\nname: b\n",
        b"- 1\n- 2\n",
        b"\x89HDF\r\n\x1a\n\xff\xfe",
        b"name: a\0b\n",
        b"name: \x01\n",
        b"[" * 1000,
        b"name: 2020-99-99\n",  # a word instead of a date
        TEXT[: TEXT.index("mass: 500")].encode(),
    ],
    ids=range(10),
)
def test_a_broken_file_gets_one_clear_message(tmp_path: Path, content: bytes, snapshot: SnapshotAssertion) -> None:
    path = tmp_path / "robot.yaml"
    path.write_bytes(content)
    with refused(kind=FileError, file=path) as caught:
        load_robot(path)
    assert wording(caught.value, tmp_path) == snapshot


def test_paths_that_are_not_files(tmp_path: Path, snapshot: SnapshotAssertion) -> None:
    with refused(kind=FileError, file=tmp_path / "missing.yaml") as missing:
        load_robot(tmp_path / "missing.yaml")
    with refused(kind=FileError, file=tmp_path) as folder:
        load_robot(tmp_path)
    assert [missing.value.reason, folder.value.reason] == snapshot
    with refused("robot", "'article-mixd'", kind=InvalidValueError) as preset:
        load_robot("article-mixd")
    assert "article-mixed?" in preset.value.next_step


def test_a_file_in_the_current_folder_is_found_by_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pendulum").write_text(TEXT, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert load_robot("pendulum").mass == 0.5
    assert load_robot("./pendulum").mass == 0.5


@pytest.mark.parametrize("name", wide(robot_names(), first=4))
def test_presets_are_saved_exactly(name: str) -> None:
    robot = load_robot(name)
    assert_same(parse_robot(dump_robot(robot), "dump"), robot)


def test_a_file_may_begin_with_a_preset() -> None:
    cogiro = load_robot("cogiro")
    text = "name: mine\nbase: cogiro\ncables: {linear_density: 0.07, axial_stiffness: 800 kN}\nassumed: {mass: a guess}"
    robot = parse_robot(text, "robot.yaml")
    np.testing.assert_allclose(robot.cables.axial_stiffness, np.full(8, 8e5), rtol=1e-15)
    assert "cables" in cogiro.assumed
    # a given value is no longer assumed
    assert dict(robot.assumed) == {key: why for key, why in cogiro.assumed.items() if key != "cables"} | {
        "mass": "a guess"
    }
    assert_same(robot.replace(cables=cogiro.cables, name="cogiro", assumed=cogiro.assumed), cogiro)


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("base: cogiro", ("name", "missing")),
        ("base: cogero\nname: x", ("base", "'cogero'", ", ".join(robot_names()), "Did you mean cogiro?")),
        (
            "base: [cogiro]\nname: x",
            ("base", "['cogiro']", ", ".join(robot_names()), "Name one of them, or leave base out."),
        ),
        ("base:\nname: x", ("base", "None")),
        ("base: 3\nname: x", ("base", "3")),
        ("base: ../cogiro\nname: x", ("base", "'../cogiro'")),
        ("base: cogiro\nname: x\nmas: 3", ("mas", "an unknown key", None, "Did you mean mass?")),
        ("base: cogiro\nname: x\nassumed: 3", ("assumed", "3")),
        ("base: cogiro\nname: x\nframe_anchors: [[0, 0, 3]]", ("platform_anchors", "8 points")),
    ],
)
def test_an_invalid_base_is_refused(text: str, parts: tuple[str, ...]) -> None:
    with refused(*parts, kind=FileError, file="robot.yaml"):
        parse_robot(text, "robot.yaml")


WINCH_KEYS = [key.partition(".")[2] for key in QUANTITIES if key.startswith("winches.")]


@pytest.mark.parametrize("key", wide(WINCH_KEYS, first=3))
def test_missing_rows_and_wrong_units_of_winches_are_named(key: str) -> None:
    good, _ = QUANTITIES[f"winches.{key}"]
    vector = key == "swivel_axis"
    row = good[0] if vector else np.ravel(good)[0].item()
    for count in (2, 4, 0):
        with refused(kind=FileError) as caught:
            parse_robot(edited(winches={"dead_cable": 30, key: [row] * count}), "robot.yaml")
        assert caught.value.item in ("winches", f"winches: {key}")
        assert re.match(f"{count} values|of shape", caught.value.value)
    wrong: Any
    for wrong in ("5 parsec^2", "fast", True, None, {}, [None] * 3, float("nan")):
        if wrong is True and key == "on_platform":
            continue
        with refused(kind=FileError) as caught:
            parse_robot(edited(winches={key: wrong}), "robot.yaml")
        assert caught.value.item in (f"winches.{key}", f"winches.{key}[0]")
        assert caught.value.allowed


def test_the_blocks_have_all_parameters_of_a_calibration() -> None:
    for block in ("tolerances", "calibration.standard_error"):
        keys = [key.removeprefix(f"{block}.") for key in QUANTITIES if key.startswith(block)]
        assert keys == list(UNCERTAIN), block


@pytest.mark.parametrize("name", [name for name, what in UNCERTAIN.items() if what.share])
def test_relative_tolerances_refer_to_the_value_of_the_robot(name: str) -> None:
    winches = {"drum_radius": ["60 mm", 0.07, 0.08], "load_cell_gain": [1.0, 1.1, 0.9]}
    for percent in ("5 %", "5%", " 5.0 %"):
        robot = parse_robot(edited(winches=winches, tolerances={name: percent}), "robot.yaml")
        value = value_of(robot, name)
        assert value is not None
        np.testing.assert_allclose(robot.tolerances[name], 0.05 * value, rtol=1e-15)
    if name != "mass":
        robot = parse_robot(edited(winches=winches, tolerances={name: ["1 %", "2 %", "3 %"]}), "robot.yaml")
        np.testing.assert_allclose(robot.tolerances[name], np.array([0.01, 0.02, 0.03]) * np.asarray(value), rtol=1e-15)


NUMBER = st.floats(-1e9, 1e9)
POSITIVE = st.floats(1e-12, 1e12)


@settings(max_examples=40)
@given(
    st.lists(NUMBER, min_size=12, max_size=12, unique=True),
    st.lists(POSITIVE, min_size=6, max_size=6),
    st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Cn")), max_size=100).filter(
        lambda text: text == printable(text) and text.strip() != ""
    ),
    st.booleans(),
    st.booleans(),
)
def test_any_robot_is_saved_exactly(
    points: list[float], positive: list[float], text: str, planar: bool, wound: bool
) -> None:
    drum: dict[str, Any] = (
        {"drum_radius": positive[:2], "gear": -positive[2], "count_zero": points[:2], "layers": [1, 3]} if wound else {}
    )
    radius = np.minimum(positive[4:], 10.0)  # the largest pulley
    winches = Winch(radius, dead_rise=-0.0, swivel_axis=[[0, 0, 1], [0, 0, -1]], inertia=positive[0], **drum)
    robot = Robot(
        text,
        np.reshape(points[:6], (2, 3)),
        np.reshape(points[6:], (2, 3)),
        Cable(positive[:2], positive[2:4], diameter=positive[1:3] if wound else None, expansion=points[:2]),
        positive[4],
        winches=winches if planar or wound else None,
        motion_pattern="2T" if planar else "3T",
        plane_normal=[1.0, *points[:2]] if planar else None,  # a nearly zero vector has no direction
        center_of_mass=points[3:6],
        gravity=positive[5],
        tension_max=[np.inf, positive[5]],
        tension_limits_of="frame_end",
        platform_size=positive[:3],
        test_box=PoseBox(
            np.minimum(points[:3], points[3:6]), np.maximum(points[:3], points[3:6]), min(positive[0], 3.0)
        ),
        source=text,
        notes=text,
        assumed={"mass": text},
        tolerances={"frame_anchors": np.reshape(positive, (2, 3)), "axial_stiffness": positive[:2], "mass": np.inf},
        calibration=Provenance(text, "2026-03-01", {"platform_anchors": positive[3:], "mass": positive[0]}, text)
        if wound
        else None,
    )
    assert_same(parse_robot(dump_robot(robot), "dump"), robot)
