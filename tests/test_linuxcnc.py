"""Kinematics modules for LinuxCNC: equal to sagline, with pins, statuses and settings; refusals."""

from __future__ import annotations

import configparser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.files.test_c_source import planar
from tests.linuxcnc import Module, World
from tests.refusal import refused
from tests.tiers import wide

PUSH = np.array([60.0, -30.0, 20.0, 2.0, -1.0, 3.0])
TURN = np.array([0.03, -0.04, 0.05])  # A, B, C


def near_the_middle(robot: sl.Robot, count: int) -> Array:
    """Positions in the inner half of the test box (count, 3) [m]."""
    assert robot.test_box is not None
    low, high = robot.test_box.low, robot.test_box.high
    return np.random.default_rng(5).uniform(0.75 * low + 0.25 * high, 0.25 * low + 0.75 * high, (count, 3))


@pytest.mark.parametrize(
    ("name", "unit"), wide([("article-prototype", "inch"), ("ipanema-3-pulleys", "mm"), ("fast", "m")])
)
def test_forward_and_inverse_are_equal_to_sagline(name: str, unit: str, tmp_path: Path) -> None:
    robot = sl.load_robot(name)
    turn = TURN if robot.degrees_of_freedom == 6 else np.zeros(3)
    push = PUSH if robot.degrees_of_freedom == 6 else np.zeros(6)
    module = Module(robot, tmp_path, unit=unit)
    assert module.started == 0
    module.push(push)
    world, solved = World(), 0
    for position in near_the_middle(robot, 12):
        pose = sl.Pose.from_euler(position, turn[2], turn[1], turn[0])
        plan = sl.inverse(robot, pose, wrench=push)
        code, lengths, tensions = module.inverse(position, turn)
        assert code == (0 if plan.feasible else -1)
        assert module.status == (0 if plan.feasible else int(plan.status))
        if not plan.feasible:
            continue
        np.testing.assert_allclose(lengths, plan.unstrained_length, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(tensions, plan.chord_tension, rtol=1e-10)
        code, found, angles = module.forward(plan.unstrained_length, world)
        assert (code, module.status) == (0, 0)
        expected = sl.forward(robot, plan.unstrained_length, pose, wrench=push).pose
        np.testing.assert_allclose(found, expected.position, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(np.deg2rad(angles), turn, rtol=0.0, atol=1e-12)
        solved += 1
    assert solved >= 5


@pytest.fixture(scope="module")
def module(tmp_path_factory: pytest.TempPathFactory) -> Module:
    return Module(sl.load_robot("article-prototype"), tmp_path_factory.mktemp("module"), name="kins2")


def test_a_whole_turn_is_kept_and_a_bad_start_is_not(module: Module) -> None:
    robot = sl.load_robot("article-prototype")
    module.push(np.zeros(6))
    position = np.array([0.2, -0.4, 1.4])
    lengths = sl.inverse(robot, sl.Pose.from_euler(position, 0.1, 0.0, 0.0)).unstrained_length
    for start, c in ((World(), 0.0), (World(c=358.0, z=1500.0), 360.0), (World(x=np.nan), 0.0)):
        code, found, angles = module.forward(lengths, start)
        assert code == 0
        np.testing.assert_allclose(found, position, atol=1e-9)
        assert angles[2] == pytest.approx(c + np.rad2deg(0.1), abs=1e-6)


def test_infeasible_poses_and_bad_numbers_keep_the_joints(module: Module) -> None:
    module.push(np.zeros(6))
    for position in ([9.0, 0.0, 1.0], [np.nan, 0.0, 1.0]):
        code, lengths, _ = module.inverse(np.array(position), np.zeros(3))
        assert code == -1
        assert module.status != 0
        assert np.isnan(lengths).all()
    module.push(np.array([np.inf, 0, 0, 0, 0, 0]))
    assert module.inverse(np.array([0.2, -0.4, 1.4]), np.zeros(3))[0] == -1
    world = World(x=1.0, y=2.0, z=3.0)
    assert module.forward(np.full(8, 2.0), world)[0] == -1
    assert (world.x, world.y, world.z) == (1.0, 2.0, 3.0)


@pytest.mark.parametrize(("unit", "text"), [("mm", "mm"), ("inch", "inch"), ("m", "0.001")])
def test_the_unit_in_the_settings_is_a_word_or_a_number_per_millimeter(tmp_path: Path, unit: Any, text: str) -> None:
    _, settings = sl.export_linuxcnc(sl.load_robot("cogiro"), tmp_path, unit=unit)
    assert f"LINEAR_UNITS = {text}\n" in settings.read_text()


def test_settings_have_the_lengths_at_home(module: Module) -> None:
    robot = sl.load_robot("article-prototype")
    settings = configparser.ConfigParser(interpolation=None)
    settings.read(module.settings)
    assert settings["KINS"]["KINEMATICS"] == "kins2"
    assert settings["TRAJ"]["COORDINATES"] == "X Y Z A B C"
    assert robot.test_box is not None
    middle = 0.5 * (robot.test_box.low + robot.test_box.high)
    lengths = sl.inverse(robot, sl.Pose(middle, np.eye(3))).unstrained_length
    home = [float(settings[f"JOINT_{i}"]["HOME"]) for i in range(int(settings["KINS"]["JOINTS"]))]
    np.testing.assert_allclose(home, 1e3 * lengths, atol=1e-6)


@pytest.mark.parametrize("place", [0, 3, 10])
def test_a_pin_that_hal_refuses_ends_the_component(place: int, tmp_path: Path) -> None:
    refusing = Module(planar(), tmp_path, refuse=place)
    assert refusing.started == -12
    assert refusing.library.was_left() == 7


def test_wrong_names_units_and_robots_are_refused(tmp_path: Path) -> None:
    robot = sl.load_robot("article-prototype")
    for name in ("Kins", "a b", "", "1a", "a" * 41, "a\n"):
        with refused("name", kind=sl.InvalidValueError):
            sl.export_linuxcnc(robot, tmp_path, name=name)
    with refused("unit", "'cm'", kind=sl.InvalidValueError):
        sl.export_linuxcnc(robot, tmp_path, unit="cm")  # type: ignore[arg-type]
    with refused("pose", kind=sl.InvalidValueError):
        sl.export_linuxcnc(robot, tmp_path, home=[9.0, 0.0, 1.0])
    frame, platform = (
        np.vstack([ends, 1.1 * ends, 1.2 * ends]) for ends in (robot.frame_anchors, robot.platform_anchors)
    )
    bigger = sl.Robot(
        name="many", frame_anchors=frame, platform_anchors=platform, mass=50.0, inertia=robot.inertia,
        cables=sl.Cable(0.09, 14e3), tension_min=1.0, tension_max=2e3,
    )  # fmt: skip
    with refused("cables", "24", kind=sl.InvalidValueError):
        sl.export_linuxcnc(bigger, tmp_path)
    assert list(tmp_path.iterdir()) == []
