import re

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

from sagline import InvalidValueError, Pose, Robot, dump_robot, forward, inverse, load_robot, robot_names
from sagline.core.arrays import Array
from sagline.robot.catalogue import preset_text
from tests.refusal import refused
from tests.tiers import extended, wide

PUBLISHED = {
    # name: mass, density, stiffness, tension limits, a frame anchor, a platform anchor, the assumed fields
    "caroca": (150.0, 0.14, 1.5e6, (50, 10000), (7, [3.5, 2, 3.5]), (7, [-0.6, 0.3, -0.2])),
    "cogiro": (91.058, 0.065, 7e5, (100, 5000), (4, [7.2398, 5.3759, 5.4093]), (6, [0.5021, 0.275, -0.0007])),
    "cogiro-2014": (91.058, 0.065, 7e5, (100, 5000), (7, [7.161, -5.27, 5.497]), (1, [-0.51, 0.351, 0.998])),
    "copacabana": (
        15.0,
        0.0035,
        1e5,
        (5, 720),
        (5, [0.741559, 2.575853, -0.498823]),
        (0, [-0.177276, 0.197409, -0.500304]),
    ),
    "expo2015-lucia": (
        130.0,
        0.198,
        272470.3308,  # 1.77 GPa times a section with a radius of 7 mm; the source has 272 kN
        (50, 5000),
        (0, [2.026688, -6.930677, 7.081188]),
        (7, [0.682028, 0.439835, 0.272427]),
    ),
    "falcon-7": (0.3, 0.0005, 2e4, (2, 200), (1, [0.725, 0, 1.25]), (6, [0, -0.05, 0])),
    "fast": (30091.8, 8.0, 1.7e8, (120000, 1200000), (0, [259.8076, 150, 270]), (5, [3.25, -5.6292, 0])),
    "ipanema-1": (10.0, 0.0035, 1e5, (5, 720), (6, [2, -1.5, 0]), (2, [0.06, -0.06, 0])),
    "ipanema-2": (60.0, 0.0225, 5e5, (50, 3000), (3, [-3.993982, -2.914584, 4.718823]), (4, [-0.848, 0.1, 0.45])),
    "ipanema-3": (30.0, 0.0225, 5e5, (100, 3000), (2, [8.224, -5.492, 3.25]), (6, [0.095, -0.745, 0.26])),
}
PULLEYS = {"expo2015-lucia": 0.01, "ipanema-2": 0.25, "ipanema-3": 0.1}  # radius [m], as the sources give it
ARTICLE = {
    # name: frame, density, E A from Table 1
    "article-mixed": ([15, 11, 6], 0.067, 2e9 * 22e-6),
    "article-prototype": ([3, 6, 3], 0.09, 3.5e9 * 4e-6),
    "article-suspended": ([15, 11, 6], 0.067, 2e9 * 22e-6),
}


def test_sixteen_presets() -> None:
    assert list(robot_names()) == sorted([*PUBLISHED, *ARTICLE, *(f"{name}-pulleys" for name in PULLEYS)])


@pytest.mark.parametrize("name", PULLEYS)
def test_the_same_robot_with_its_pulleys(name: str) -> None:
    points, wheels = load_robot(name), load_robot(f"{name}-pulleys")
    assert wheels.winches is not None
    np.testing.assert_array_equal(wheels.winches.pulley_radius, np.full(8, PULLEYS[name]))
    np.testing.assert_array_equal(wheels.winches.swivel_axis, [[0.0, 0.0, 1.0]] * 8)
    np.testing.assert_array_equal(wheels.winches.dead_cable, np.zeros(8))
    assert "winches" in wheels.assumed
    bare = wheels.replace(winches=None, name=name, notes=points.notes, assumed=points.assumed)
    assert dump_robot(bare) == dump_robot(points)
    assert points.winches is None
    assert f"{PULLEYS[name]:g} m" in points.notes


def test_the_servos_of_the_prototype() -> None:
    """The 400 W of the article; 3.82 N m, 3000 rev/min and 0.277 kg cm^2 are typical of this class of motors.

    With gear and drum the inertia is 1.15 times as large, and a tenth of the torque is lost in the gear.
    """
    winches = load_robot("article-prototype").winches
    assert winches is not None
    speed = 3000.0 * 2.0 * np.pi / 60.0
    expected = {"torque_limit": 3.44, "speed_limit": speed, "inertia": 3.19e-5, "gear": 20.0, "drum_radius": 0.03}
    expected |= {"position_gain": 20.0, "speed_gain": 4000.0, "integral_gain": 8e3}
    expected |= {"counts_per_turn": 2.0**17, "friction": 15.0, "pulley_radius": 0.0, "dead_cable": 0.0}
    for field, value in expected.items():
        np.testing.assert_allclose(getattr(winches, field), np.full(8, value), rtol=1e-15, err_msg=field)
    assert "400 W" in load_robot("article-prototype").assumed["winches"]


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_numbers(name: str) -> None:
    mass, density, stiffness, limits, (i, frame), (j, platform) = PUBLISHED[name]
    robot = load_robot(name)
    assert (robot.name, robot.mass) == (name, mass)
    np.testing.assert_array_equal(robot.cables.linear_density, density)
    np.testing.assert_allclose(robot.cables.axial_stiffness, stiffness, rtol=1e-7)
    np.testing.assert_array_equal(robot.tension_min, limits[0])
    np.testing.assert_array_equal(robot.tension_max, limits[1])
    np.testing.assert_array_equal(robot.frame_anchors[i], frame)
    np.testing.assert_array_equal(robot.platform_anchors[j], platform)
    assert robot.source


def test_inertia_of_the_measured_robots() -> None:
    cogiro = [[36.598, -0.453, 3.012], [-0.453, 35.982, -1.539], [3.012, -1.539, 25.439]]
    np.testing.assert_array_equal(load_robot("cogiro").inertia, cogiro)
    np.testing.assert_array_equal(load_robot("cogiro").center_of_mass, [-0.034, -0.013, 0.264])
    np.testing.assert_array_equal(load_robot("ipanema-3").inertia, np.diag([5.226154, 0.637352, 4.723802]))
    # m/12 (b^2 + c^2) of 60 kg, 1.5 x 0.25 x 0.5 m
    np.testing.assert_allclose(np.diag(load_robot("ipanema-2").inertia), [1.5625, 12.5, 11.5625], rtol=1e-15)


@pytest.mark.parametrize("name", ARTICLE)
def test_article_robots_have_the_data_of_table_1(name: str) -> None:
    frame, density, stiffness = ARTICLE[name]
    robot = load_robot(name)
    assert robot.mass == 50.0
    np.testing.assert_array_equal(robot.cables.linear_density, density)
    np.testing.assert_allclose(robot.cables.axial_stiffness, stiffness, rtol=1e-15)
    np.testing.assert_array_equal(np.ptp(robot.frame_anchors, axis=0)[:2], frame[:2])
    np.testing.assert_array_equal(robot.frame_size, frame)
    np.testing.assert_array_equal(np.ptp(robot.platform_anchors, axis=0), [0.3, 0.3, 0.5])
    np.testing.assert_allclose(np.diag(robot.inertia), 50 / 12 * np.array([0.34, 0.34, 0.18]), rtol=1e-15)
    assert {"frame_anchors", "platform_anchors", "inertia", "tension_min", "tension_max"} <= set(robot.assumed)
    assert not {"mass", "cables", "platform_size", "frame_size"} & set(robot.assumed)


def test_suspended_cables_cross_to_the_neighboring_corners() -> None:
    robot = load_robot("article-suspended")
    np.testing.assert_array_equal(robot.frame_anchors[:, 2], 6.0)
    for frame, platform in zip(robot.frame_anchors, robot.platform_anchors, strict=True):
        turn = frame[0] * platform[1] - frame[1] * platform[0]  # > 0: the platform corner is counter-clockwise
        assert np.sign(turn) == np.sign(platform[2])


def test_mixed_cables_run_straight_down_and_up() -> None:
    robot = load_robot("article-mixed")
    np.testing.assert_array_equal(np.sign(robot.frame_anchors[:, :2]), np.sign(robot.platform_anchors[:, :2]))
    np.testing.assert_array_equal(robot.platform_anchors[:, 2], np.where(robot.frame_anchors[:, 2] == 6, -0.25, 0.25))


def wrench_feasible(robot: Robot, position: Array, rotation: Array) -> bool:
    """A linear program for chord tensions, with half of the weight of each cable on the platform."""
    arm = (robot.platform_anchors - robot.center_of_mass) @ rotation.T
    chord = position + robot.platform_anchors @ rotation.T - robot.frame_anchors
    length = np.linalg.norm(chord, axis=1)
    pull = -chord / length[:, None]
    hung = np.zeros_like(chord)
    hung[:, 2] = robot.gravity * robot.cables.linear_density * length / 2
    needed = np.concatenate([hung.sum(axis=0), np.cross(arm, hung).sum(axis=0)])
    needed[2] += robot.mass * robot.gravity
    scale = robot.mass * robot.gravity
    found = linprog(
        np.zeros(robot.cable_count),
        A_eq=np.vstack([pull.T, np.cross(arm, pull).T]),
        b_eq=needed / scale,
        bounds=np.column_stack([robot.tension_min, robot.tension_max]) / scale,
    )
    assert found.status in (0, 2)
    return bool(found.status == 0)


@pytest.mark.parametrize("name", wide(["article-suspended", *sorted({*PUBLISHED, *ARTICLE} - {"article-suspended"})]))
def test_box_is_feasible(name: str) -> None:
    robot, rng = load_robot(name), np.random.default_rng(11)
    box = robot.test_box
    assert box is not None
    count = 60
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    angles = rng.uniform(0, box.tilt, size=(count, 1))
    turns = Rotation.from_rotvec(axes * angles).as_matrix()
    positions = rng.uniform(box.low, box.high, size=(count, 3))
    feasible = [wrench_feasible(robot, *pose) for pose in zip(positions, turns, strict=True)]
    assert np.mean(feasible) >= 0.9  # 95 % of all poses; at least 90 % of 60


@pytest.mark.parametrize("name", ["article-mixed", "article-suspended"])
@pytest.mark.parametrize("x", [-5.0, 0.0, 5.0])
@pytest.mark.parametrize("y", [-3.5, 0.0, 3.5])
def test_the_articles_path_is_feasible(name: str, x: float, y: float) -> None:
    assert wrench_feasible(load_robot(name), np.array([x, y, 1.5]), np.eye(3))


def test_an_unknown_preset_suggests_the_nearest() -> None:
    with refused("robot", "'cogirro'", ", ".join(robot_names()), kind=InvalidValueError) as caught:
        preset_text("cogirro")
    assert re.search(r"\bcogiro\b", caught.value.next_step)


@extended
@pytest.mark.parametrize("name", PULLEYS)
def test_lengths_over_pulleys_give_the_pose(name: str) -> None:
    robot, rng = load_robot(f"{name}-pulleys"), np.random.default_rng(12)
    box = robot.test_box
    assert box is not None
    positions = rng.uniform(box.low, box.high, size=(20, 3))
    plan = inverse(robot, Pose.from_euler(positions, 0.0, 0.0, 0.0))
    assert plan.feasible.mean() >= 0.9
    away = Pose.from_euler(positions[plan.feasible] + 0.05, 0.02, 0.0, 0.0)
    found = forward(robot, plan.unstrained_length[plan.feasible], start=away)
    assert found.solved.all()
    np.testing.assert_allclose(found.pose.position, positions[plan.feasible], rtol=0, atol=1e-9)
    # the cable on the pulley is longer than from the anchor, by less than half the circumference of the pulley
    points = inverse(load_robot(name), Pose.from_euler(positions, 0.0, 0.0, 0.0), tension=plan.tension)
    longer = (plan.unstrained_length - points.unstrained_length)[plan.feasible & points.feasible]
    assert (np.abs(longer) < np.pi * PULLEYS[name]).all()
    assert np.abs(longer).max() > 0.2 * PULLEYS[name]
