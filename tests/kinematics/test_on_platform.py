"""Robots with winches and pulleys on the platform, through the public functions."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.core.arrays import Array
from tests.kinematics.test_slanted import COGIRO, LEVEL, four_cables
from tests.refusal import refused

UP = np.array([0.0, 0.0, 1.0])
AXES = UP + 0.4 * np.random.default_rng(7).normal(size=(8, 3))
POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.1, -0.1, 0.2)


def aboard(radius: float = 0.08, dead: float = 0.6, where: ArrayLike = True, robot: sl.Robot = COGIRO) -> sl.Robot:
    """The robot CoGiRo with winches on the platform."""
    return robot.replace(winches=sl.Winch(radius, swivel_axis=AXES, dead_cable=dead, on_platform=where))


HEAVY = COGIRO.replace(cables=sl.Cable(0.8, COGIRO.cables.axial_stiffness), center_of_mass=[0.1, 0.05, 0.3])
ROBOTS = {
    "pulleys": aboard(),
    "heavy": aboard(0.15, 0.6, True, HEAVY),
    "some": aboard(where=[True, False] * 4),
    "eyelets": aboard(0.0),
    "nothing": aboard(0.0, 0.0),
}


@pytest.mark.parametrize("kind", ROBOTS)
def test_forward_returns_the_poses_of_the_inverse(kind: str) -> None:
    robot = ROBOTS[kind]
    place = np.random.default_rng(2).uniform((-2.0, -2.0, 1.0), (2.0, 2.0, 3.0), (30, 3))
    turns = Rotation.from_euler("xyz", np.random.default_rng(3).uniform(-0.15, 0.15, (30, 3)))
    pose = sl.Pose.from_quaternion(place, turns.as_quat())
    plan = sl.inverse(robot, pose)
    assert plan.feasible.sum() > 20
    plan = sl.inverse(robot, pose[plan.feasible])
    at = plan.state.pose
    near = sl.Pose.from_quaternion(at.position + 0.05, np.tile(LEVEL, (len(at), 1)))
    for start in (at, near):
        found = sl.forward(robot, plan.unstrained_length, start)
        np.testing.assert_allclose(found.state.pose.position, at.position, atol=1e-11)
        np.testing.assert_allclose(found.state.pose.matrix, at.matrix, atol=1e-11)
        np.testing.assert_allclose(found.state.cables.frame_end_tension, plan.state.cables.frame_end_tension, rtol=1e-8)
        np.testing.assert_allclose(found.state.exit_point, plan.exit_point, atol=1e-11)
    np.testing.assert_allclose(found.stiffness_min, plan.stiffness_min, rtol=1e-6)


NODES, SHARES = np.polynomial.legendre.leggauss(60)


def integrated(function: Callable[[float], Array], end: float) -> Array:
    """Integral of a vector function from 0 to `end`."""
    return np.asarray(0.5 * end * sum(w * function(0.5 * end * (1.0 + x)) for x, w in zip(NODES, SHARES, strict=True)))


def test_platform_and_cables_balance_as_one_body() -> None:
    # an integration along each cable, from the exit point to the frame anchor and to the drum
    robot, radius, dead = ROBOTS["heavy"], 0.15, 0.6
    state = sl.inverse(robot, POSE).state
    assert state.contact is not None
    weight, stiffness = robot.cables.linear_density[0] * robot.gravity, robot.cables.axial_stiffness[0]
    force, moment = robot.mass * robot.gravity * -UP, np.zeros(3)
    moment += np.cross(POSE.position + POSE.matrix @ robot.center_of_mass, force)
    axes = np.asarray(AXES / np.linalg.norm(AXES, axis=1)[:, None]) @ POSE.matrix.T
    for i, (anchor, end) in enumerate(zip(POSE.transform(robot.platform_anchors), robot.frame_anchors, strict=True)):
        axis, start, free = axes[i], state.exit_point[i], state.free_length[i]
        away = end - start
        level = away * [1.0, 1.0, 0.0] / np.hypot(away[0], away[1])
        pull = state.cables.horizontal_tension[i] * level - state.cables.vertical_force[i] * UP
        tension = float(np.linalg.norm(pull))
        outward = start - anchor - ((start - anchor) @ axis) * axis
        outward /= np.linalg.norm(outward)
        wrap, whole = state.contact.wrap_angle[i], tension + tension**2 / (2.0 * stiffness) - weight * start[2]

        def stretch(height: float, whole: float = whole) -> float:
            return math.sqrt(1.0 + 2.0 * (whole + weight * height) / stiffness)

        def on_pulley(angle: float, at: Array = anchor, up: Array = axis, out: Array = outward) -> Array:
            return np.asarray(at + radius * (math.sin(angle) * up + (1.0 - math.cos(angle)) * out))

        def on_pulley_share(angle: float) -> Array:
            return np.append(on_pulley(angle), 1.0) * radius / stretch(on_pulley(angle)[2])

        def dead_share(place: float, at: Array = anchor, up: Array = axis) -> Array:
            return np.append(at - place * up, 1.0) / stretch((at - place * up)[2])

        def span(length: float, pull: Array = pull) -> Array:
            there = pull + weight * length * UP
            return np.asarray((1.0 / np.linalg.norm(there) + 1.0 / stiffness) * there)

        def hanging(length: float, at: Array = start) -> Array:
            return np.append(at + integrated(span, length), 1.0)

        np.testing.assert_allclose(on_pulley(wrap), start, atol=1e-9)
        np.testing.assert_allclose(start + integrated(span, free), end, atol=1e-10)
        tangent = math.cos(wrap) * axis + math.sin(wrap) * outward
        normal = math.sin(wrap) * axis - math.cos(wrap) * outward
        assert abs(pull @ normal) < 1e-9 * tension
        assert pull @ tangent > 0.0
        wound, run, off = integrated(on_pulley_share, wrap), integrated(dead_share, dead), integrated(hanging, free)
        np.testing.assert_allclose(state.contact.wrapped_length[i], wound[3], rtol=1e-8)
        np.testing.assert_allclose(state.contact.dead_length[i], run[3], rtol=1e-12)
        about_axis = np.cross(start - anchor, pull) - weight * np.cross(wound[:3] - wound[3] * anchor, UP)
        assert abs(about_axis @ axis) < 1e-7 * tension * radius
        # the mass of the platform includes the cable that is off the drum
        away_from_drum = wound + run + off
        drum = np.append(anchor - dead * axis, 1.0) * away_from_drum[3]
        moment -= weight * np.cross((away_from_drum - drum)[:3], UP)
        reaction = pull + weight * free * UP
        force, moment = force + reaction, moment + np.cross(end, reaction)
    np.testing.assert_allclose(force, 0.0, atol=1e-9 * robot.mass * robot.gravity)
    np.testing.assert_allclose(moment, 0.0, atol=2e-9 * robot.mass * robot.gravity)


def test_cables_without_weight_have_the_least_energy_of_straight_cables_on_circles() -> None:
    robot, stiffness = aboard(0.1, 0.5, True, COGIRO.replace(cables=sl.Cable(0.05, 2e4))), 2e4
    lengths = sl.inverse(robot, POSE, model="elastic").unstrained_length
    lengths = lengths + np.linspace(-0.02, 0.03, 8)
    axes = AXES / np.linalg.norm(AXES, axis=1)[:, None]

    def energy(motion: Array) -> float:
        """Strain energy and potential energy of the platform after a motion from POSE."""
        turn = Rotation.from_rotvec(motion[3:]).as_matrix() @ POSE.matrix
        place = POSE.position + motion[:3]
        away = robot.frame_anchors - (place + robot.platform_anchors @ turn.T)
        up = (away * (axes @ turn.T)).sum(axis=1)
        # in the plane of the axis, the center of the pulley is at (0.1, 0) and the end of the cable at (across, up)
        across = np.sqrt((away**2).sum(axis=1) - up**2) - 0.1
        tangent = np.sqrt(across**2 + up**2 - 0.1**2)
        wrap = np.pi - np.arctan2(up, across) - np.arctan2(tangent, 0.1)
        stretched = np.maximum(tangent + 0.1 * wrap + 0.5 - lengths, 0.0)
        height = float((place + turn @ robot.center_of_mass)[2])
        return float((0.5 * stiffness * stretched**2 / lengths).sum() + robot.mass * robot.gravity * height) * 1e-3

    least = minimize(energy, np.zeros(6), method="BFGS", options={"gtol": 1e-10}).x
    state = sl.forward(robot, lengths, POSE, model="elastic").state
    assert np.linalg.norm(least[:3]) > 5e-3
    np.testing.assert_allclose(state.pose.position, POSE.position + least[:3], atol=1e-6)
    turned = Rotation.from_matrix(state.pose.matrix @ POSE.matrix.T).as_rotvec()
    np.testing.assert_allclose(turned, least[3:], atol=1e-6)


def centered(robot: sl.Robot, pose: sl.Pose) -> Array:
    return np.asarray(pose.position + pose.matrix @ robot.center_of_mass)


def moved(robot: sl.Robot, more: sl.ForwardSolution, less: sl.ForwardSolution) -> Array:
    """Motion of the center of mass, and rotation."""
    one, two = more.state.pose, less.state.pose
    turn = Rotation.from_matrix(one.matrix @ two.matrix.T).as_rotvec()
    return np.concatenate((centered(robot, one) - centered(robot, two), turn))


def test_stiffness_and_sensitivities_are_differences_of_the_forward_kinematics() -> None:
    robot = aboard(0.1, 0.7, [1, 1, 1, 0, 1, 1, 0, 1], HEAVY)
    state = sl.inverse(robot, POSE).state
    found, lengths, winches = sl.stiffness(state), state.unstrained_length, robot.winches
    assert winches is not None
    density, stiffness = robot.cables.linear_density, robot.cables.axial_stiffness

    def solved(of: Callable[[float], sl.Robot], step: float, more: Array | float = 0.0) -> Array:
        ends = [sl.forward(of(h), lengths + h * more, POSE) for h in (step, -step)]
        tension = ends[0].state.cables.frame_end_tension - ends[1].state.cables.frame_end_tension
        return np.append(moved(robot, *ends), tension) / (2.0 * step)

    for cable in (2, 3, 5):
        one = np.eye(8)[cable]
        axis = np.outer(one, [0.6, 0.0, 0.8])
        pairs = {
            "length": (found.length_sensitivity[:, cable], solved(lambda _: robot, 1e-4, one)),
            "radius": (
                found.pulley_radius_sensitivity[:, cable],
                solved(lambda h: robot.replace(winches=winches.replace(pulley_radius=0.1 + h * one)), 1e-4),  # noqa: B023
            ),
            "dead": (
                found.dead_cable_sensitivity[:, cable],
                solved(lambda h: robot.replace(winches=winches.replace(dead_cable=0.7 + h * one)), 1e-4),  # noqa: B023
            ),
            "density": (
                found.density_sensitivity[:, cable],
                solved(lambda h: robot.replace(cables=sl.Cable(density + h * one, stiffness)), 1e-3),  # noqa: B023
            ),
            "stiffness": (
                found.stiffness_sensitivity[:, cable],
                solved(lambda h: robot.replace(cables=sl.Cable(density, stiffness + h * one)), 100.0),  # noqa: B023
            ),
            "frame": (
                found.frame_anchor_sensitivity[:, cable] @ [0.6, 0.0, 0.8],
                solved(lambda h: robot.replace(frame_anchors=robot.frame_anchors + h * axis), 1e-4),  # noqa: B023
            ),
            "platform": (
                found.platform_anchor_sensitivity[:, cable] @ [0.6, 0.0, 0.8],
                solved(lambda h: robot.replace(platform_anchors=robot.platform_anchors + h * axis), 1e-4),  # noqa: B023
            ),
        }
        for name, (own, wanted) in pairs.items():
            np.testing.assert_allclose(own, wanted[:6], atol=3e-5 * np.abs(wanted[:6]).max(), err_msg=name)
        pulled = pairs["length"][1][6:]
        np.testing.assert_allclose(found.tension_sensitivity[:, cable], pulled, atol=3e-5 * np.abs(pulled).max())


@pytest.mark.parametrize("kind", ROBOTS)
def test_linear_models_have_the_gains_of_forward_and_the_poles_of_modes(kind: str) -> None:
    state = sl.inverse(ROBOTS[kind], POSE).state
    system, known = sl.linearized(state), sl.stiffness(state)
    gain = system.D - system.C @ np.linalg.solve(system.A, system.B)
    for cable in (1, 3, 6):

        def solved(h: float, cable: int = cable) -> Array:
            found = sl.forward(state.robot, state.unstrained_length + h * np.eye(8)[cable], POSE).state
            turn = Rotation.from_matrix(found.pose.matrix @ POSE.matrix.T).as_rotvec()
            moved = found.pose.transform(found.one_robot.center_of_mass)
            return np.concatenate((moved, turn, found.cables.frame_end_tension))

        wanted = (solved(1e-4) - solved(-1e-4)) / 2e-4
        for rows in (slice(0, 6), slice(6, 14)):
            np.testing.assert_allclose(gain[rows, cable], wanted[rows], atol=3e-5 * np.abs(wanted[rows]).max())
    # the wrench by length is from the energy, that of `stiffness` from the equations of the exit point
    size = np.abs(known.length_sensitivity).max()
    np.testing.assert_allclose(gain[:6, :8], known.length_sensitivity, atol=1e-8 * size)
    poles = np.sort(system.poles.imag)[6:]
    np.testing.assert_allclose(poles, 2.0 * np.pi * sl.modes(state).frequency, rtol=1e-11)


@pytest.mark.parametrize("kind", ["heavy", "some"])
def test_load_cells_show_every_wrench_but_a_load(kind: str) -> None:
    state = sl.inverse(ROBOTS[kind], POSE).state
    parity = sl.control.parity(state)

    def visible(axis: int) -> float:
        """Visible part of the change of all tensions that a force of 1 N causes at the same pose."""
        loaded = sl.inverse(ROBOTS[kind], POSE, wrench=np.eye(6)[axis]).state.cables.frame_end_tension
        change = loaded - state.cables.frame_end_tension
        return float(np.abs(parity @ change).max() / np.abs(change).max())

    assert visible(2) < 1e-3
    assert visible(0) > 0.1


@pytest.mark.parametrize("kind", ROBOTS)
def test_the_frame_carries_the_platform_with_all_cable_of_its_drums(kind: str) -> None:
    robot = ROBOTS[kind]
    plan = sl.inverse(robot, POSE, wrench=[20.0, -15.0, 10.0, 0.0, 0.0, 0.0])
    found = plan.frame_forces()
    aboard = robot.winches.on_platform if robot.winches is not None else np.zeros(8, dtype=np.bool_)
    of_frame = float((plan.unstrained_length * robot.cables.linear_density)[~aboard].sum())
    expected = [20.0, -15.0, 10.0 - (robot.mass + of_frame) * robot.gravity]
    np.testing.assert_allclose((found.pulley + found.winch).sum(axis=0), expected, atol=1e-9 * robot.mass)
    np.testing.assert_array_equal(found.pulley[aboard], found.exit[aboard])
    np.testing.assert_array_equal(found.winch[aboard], 0.0)
    size = np.linalg.norm(found.pulley[aboard], axis=1)
    np.testing.assert_allclose(size, plan.state.cables.frame_end_tension[aboard], rtol=1e-12)


def test_four_cables_and_planar_robots_close_along_a_path(tmp_path: Path) -> None:
    tilted = UP + np.array([[0.3, 0.0, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.0], [-0.1, 0.0, 0.0]])
    winches = sl.Winch(0.03, swivel_axis=tilted, on_platform=True)
    corners, ends = np.array([[-2.0, 0.0, 2.0], [2.0, 0.0, 2.0]]), np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
    planar = sl.Robot(
        "planar",
        corners,
        ends,
        sl.Cable(0.05, 5e4),
        mass=20.0,
        motion_pattern="2T",
        plane_normal=[0.0, 1.0, 0.0],
        winches=sl.Winch(0.05, swivel_axis=[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], on_platform=True),
    )
    four = four_cables().replace(winches=winches.replace(dead_cable=0.1))
    for robot, path in (
        (four, sl.quintic_path([(0.0, 0.0, 1.2), (0.2, 0.1, 1.4)], speed=1.0)),
        (planar, sl.quintic_path([(0.0, 0.0, 0.8), (0.2, 0.0, 1.0)], speed=1.0)),
    ):
        plan = sl.inverse(robot, path)
        found = sl.confirm(plan)
        assert plan.solved.all()
        assert found.held.all()
        assert np.abs(found.position_error).max() < 1e-9
        plan.save(tmp_path / "plan.nc")
        read = sl.load_plan(tmp_path / "plan.nc")
        np.testing.assert_array_equal(read.exit_point, plan.exit_point)
        assert read.robot.winches is not None
        assert read.robot.winches.on_platform.all()


def test_robot_files_and_show_say_where_winches_are(tmp_path: Path) -> None:
    (tmp_path / "some.yaml").write_text(sl.dump_robot(ROBOTS["some"]))
    read = sl.load_robot(tmp_path / "some.yaml").winches
    assert read is not None
    assert read.on_platform.tolist() == [True, False] * 4
    shown = CliRunner().invoke(app, ["show", str(tmp_path / "some.yaml")])
    assert re.findall("true|false", shown.stdout) == ["true", "false"] * 4


def test_wrong_winches_on_the_platform_are_refused(tmp_path: Path) -> None:
    with refused("winches: on_platform[1]", "2", "true or false", kind=sl.InvalidValueError):
        sl.Winch(0.05, on_platform=[1, 2])
    with refused("winches: dead_rise[0]", "0.5 m", "0 m on the platform", kind=sl.InvalidValueError):
        sl.Winch(0.05, dead_cable=1.0, dead_rise=[0.5, 0.5], on_platform=[True, False])
    with refused("winches: on_platform[0]", "true", "false with guides", kind=sl.InvalidValueError):
        sl.Winch(0.05, guides=[[0.0, 0.0, 1.0]], on_platform=True)
    text = sl.dump_robot(ROBOTS["some"]).replace("true", "up", 1)
    (tmp_path / "wrong.yaml").write_text(text)
    with refused("winches.on_platform", "'up'", "true or false, or a list of them", kind=sl.FileError):
        sl.load_robot(tmp_path / "wrong.yaml")
    robot = ROBOTS["pulleys"]
    with refused("model", "Parabolic", "Catenary or Elastic for such swivel axes", kind=sl.InvalidValueError):
        sl.inverse(robot, POSE, "parabolic")
    with refused("winches: on_platform[0]", kind=sl.InvalidValueError):
        sl.inverse(
            COGIRO.replace(winches=sl.Winch(0.05, pulley_friction=0.1, on_platform=True)), POSE, winding=[1.0] * 8
        )
    at = robot.frame_anchors[0] - POSE.matrix @ robot.platform_anchors[0] - 0.01
    with refused("pose, cable 0: its frame end", kind=sl.CableGeometryError):
        sl.inverse(robot, sl.Pose.from_quaternion(at, POSE.quaternion))


SOME = aboard(where=[False] * 3 + [True] * 5, robot=COGIRO).replace(
    winches=sl.Winch(0.05, dead_cable=0.5, on_platform=[False] * 3 + [True] * 5)
)
PATH = sl.quintic_path([(0.0, 0.0, 1.5), (0.5, 0.3, 1.8)], speed=0.5)
LOG = sl.WinchLog(unstrained_length=np.full((1, 8), 9.0), commanded=sl.Pose.from_quaternion([[1.0, 1.0, 2.0]], [LEVEL]))
REFUSING: dict[str, Callable[[], object]] = {
    "structure_matrix": lambda: sl.structure_matrix(SOME, POSE),
    "InverseSolver": lambda: sl.InverseSolver(SOME),
    "vibration": lambda: sl.vibration(SOME, POSE),
    "frequency_response": lambda: sl.frequency_response(SOME, POSE, frequency=[1.0]),
    "simulate": lambda: sl.simulate(SOME, POSE, duration=0.05, cable_mass="lumped"),
    "workspace of four cables": lambda: sl.workspace(
        four_cables().replace(winches=sl.Winch(0.03, on_platform=[False] * 3 + [True])), cells=4
    ),
    "fastest": lambda: sl.fastest(SOME, PATH),
    "calibrate": lambda: sl.calibrate(SOME, LOG, model=sl.Straight()),
    "home": lambda: sl.home(SOME, POSE, np.full(8, 300.0)),
    "dump_mjcf": lambda: sl.dump_mjcf(SOME, POSE),
    "export_c": lambda: sl.export_c(SOME, "a.c"),
}


@pytest.mark.parametrize("name", REFUSING)
def test_functions_without_winches_on_the_platform_refuse_them(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with refused("winches: on_platform[3]", "true", "false here", kind=sl.InvalidValueError):
        REFUSING[name]()
    assert list(tmp_path.iterdir()) == []
