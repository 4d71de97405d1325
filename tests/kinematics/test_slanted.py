"""Robots whose pulleys swivel about axes of any direction, through the public functions."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike
from typer.testing import CliRunner

import sagline as sl
from sagline.cli.main import app
from sagline.core.arrays import Array
from tests.refusal import refused

COGIRO = sl.load_robot("cogiro")
LEVEL = (0.0, 0.0, 0.0, 1.0)


def with_axes(axes: ArrayLike, radius: float = 0.05) -> sl.Robot:
    """The robot CoGiRo with pulleys and dead lengths, some of them without a rise."""
    rise = [1.0, 0.0, -2.0, 3.0] * 2
    return COGIRO.replace(winches=sl.Winch(radius, swivel_axis=axes, dead_cable=3.0, dead_rise=rise))


def tangential() -> Array:
    """Horizontal axes normal to the direction to the middle."""
    axes = np.cross(COGIRO.frame_anchors * [1.0, 1.0, 0.0], [0.0, 0.0, 1.0])
    return np.asarray(axes / np.linalg.norm(axes, axis=1)[:, None])


def four_cables() -> sl.Robot:
    """A small platform on four cables over pulleys that swivel about horizontal axes."""
    corners = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    return sl.Robot(
        "four cables",
        corners * [1.0, 0.8, 0.0] + [0.0, 0.0, 2.5],
        corners * [0.15, 0.1, 0.0] + [0.0, 0.0, 0.1],
        sl.Cable(0.01, 20e3),
        mass=13.0,
        inertia=np.diag([0.2, 0.3, 0.25]),
        tension_min=1.0,
        tension_max=500.0,
        winches=sl.Winch(0.03, swivel_axis=[[1, 0, 0], [-1, 0, 0], [-1, 0, 0], [1, 0, 0]], dead_cable=1.5),
    )


AXES = {
    "any": np.array([0.0, 0.0, 1.0]) + 0.4 * np.random.default_rng(1).normal(size=(8, 3)),
    "tangential": tangential(),
    "mixed": np.where(np.arange(8)[:, None] < 4, tangential(), [0.0, 0.0, -1.0]),
}


@pytest.mark.parametrize("kind", AXES)
def test_forward_returns_the_poses_of_the_inverse(kind: str) -> None:
    robot = with_axes(AXES[kind])
    place = np.random.default_rng(2).uniform((-2.0, -2.0, 1.0), (2.0, 2.0, 3.0), (40, 3))
    pose = sl.Pose.from_quaternion(place, np.tile(LEVEL, (40, 1)))
    plan = sl.inverse(robot, pose)
    assert plan.feasible.all()
    assert plan.wrench_residual.max() < 1e-9
    near = sl.Pose.from_quaternion(place + 0.05, np.tile(LEVEL, (40, 1)))
    for start in (pose, near):
        found = sl.forward(robot, plan.unstrained_length, start)
        np.testing.assert_allclose(found.state.pose.position, place, atol=1e-11)
        np.testing.assert_allclose(found.state.chord_tension, plan.chord_tension, rtol=1e-8)
        np.testing.assert_allclose(found.state.exit_point, plan.exit_point, atol=1e-11)
    np.testing.assert_allclose(found.stiffness_min, plan.stiffness_min, rtol=1e-6)
    vertical = sl.inverse(with_axes([0.0, 0.0, 1.0]), pose)
    assert np.abs(plan.unstrained_length - vertical.unstrained_length).max() > 1e-3


def test_cables_leave_their_pulleys_at_the_radius_and_along_their_forces() -> None:
    robot = with_axes(AXES["any"], radius=0.2)
    state = sl.inverse(robot, sl.Pose.from_euler([1.0, 1.0, 2.0], 0.1, 0.0, 0.2)).state
    assert robot.winches is not None
    axis, exit_point = robot.winches.swivel_axis, state.exit_point - robot.frame_anchors
    slopes = sl.stiffness(state)
    force = state.pose.transform(robot.platform_anchors) - state.exit_point
    force[:, 2] = 0.0
    force *= (state.cables.horizontal_tension / np.linalg.norm(force, axis=1))[:, None]
    force[:, 2] = state.cables.vertical_force - state.cables.cable_weight
    along = (exit_point * axis).sum(axis=1)
    outward = exit_point - along[:, None] * axis
    away = np.linalg.norm(outward, axis=1)
    np.testing.assert_allclose(np.hypot(away - 0.2, along), 0.2, rtol=1e-12)
    radial = along[:, None] * axis + (1.0 - 0.2 / away)[:, None] * outward
    unit = force / np.linalg.norm(force, axis=1)[:, None]
    np.testing.assert_allclose((unit * radial).sum(axis=1), 0.0, atol=1e-12)
    side = np.abs((unit * np.cross(axis, outward / away[:, None])).sum(axis=1))
    assert 0.0 < side.max() < 1e-3  # the weight on the pulley turns it by this angle
    assert slopes.matrix.shape == (6, 6)


def test_four_cables_over_horizontal_axes_close_along_a_path(tmp_path: Path) -> None:
    robot = four_cables()
    plan = sl.inverse(robot, sl.quintic_path([(0.0, 0.0, 1.2), (0.2, 0.1, 1.4)], speed=1.0))
    assert plan.solved.all()
    assert sl.confirm(plan).held.all()
    plan.save(tmp_path / "plan.nc")
    np.testing.assert_array_equal(sl.load_plan(tmp_path / "plan.nc").exit_point, plan.exit_point)
    rate = plan.length_rate
    assert rate is not None
    assert plan.path is not None
    moved = np.trapezoid(rate, plan.path.time, axis=0)
    np.testing.assert_allclose(moved, plan.unstrained_length[-1] - plan.unstrained_length[0], atol=1e-4)


@pytest.mark.parametrize("share", [1e-3, 1e-5, 1e-7])
def test_limits_are_met_at_the_exit_points_of_the_tensions_within_them(share: float) -> None:
    winches = sl.Winch(0.15, swivel_axis=[[1, 0, 0], [-1, 0, 0], [-1, 0, 0], [1, 0, 0]])
    robot = four_cables().replace(cables=sl.Cable(0.2, 20e3), winches=winches, mass=4.0)
    pose = sl.Pose.from_euler([0.2, 0.1, 1.5], 0.0, 0.0, 0.0)
    tension = sl.inverse(robot, pose).chord_tension
    for name, limit, wider in (("tension_min", tension.min(), -share), ("tension_max", tension.max(), share)):
        assert sl.inverse(robot.replace(**{name: limit * (1.0 + wider)}), pose).solved
        assert sl.inverse(robot.replace(**{name: limit * (1.0 - wider)}), pose).status == sl.PoseStatus.INFEASIBLE


def test_limits_of_redundant_cables_are_met_in_a_batch_beside_hopeless_poses() -> None:
    robot = with_axes(tangential(), 0.15).replace(tension_min=1.0, tension_max=1e5)
    pose = sl.Pose.from_quaternion([[1.0, 1.0, 2.0], [7.0, 5.0, 0.5], [0.5, 0.0, 2.0]], np.tile(LEVEL, (3, 1)))
    tension = sl.inverse(robot, pose[0]).chord_tension
    done: list[int] = []
    for share in (1e-4, 1e-7):
        close = robot.replace(tension_min=tension * (1.0 - share), tension_max=tension * (1.0 + share))
        plan = sl.inverse(close, pose, progress=lambda finished, _: done.append(finished))
        assert plan.status.tolist() == [sl.PoseStatus.SOLVED, sl.PoseStatus.INFEASIBLE, sl.PoseStatus.INFEASIBLE]
        np.testing.assert_allclose(plan.chord_tension[0], tension, rtol=2.0 * share)
        assert done == sorted(done)
        done.clear()


def test_stiffness_and_sensitivities_are_differences_of_the_forward_kinematics() -> None:
    robot = with_axes(AXES["any"], radius=0.1)
    state = sl.inverse(robot, sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)).state
    found, known = sl.stiffness(state), state.unstrained_length
    step = 1e-5
    for cable in (0, 5):
        lengths = known + np.array([[step], [-step]]) * np.eye(8)[cable]
        pair = sl.forward(robot, lengths, state.pose).state
        centers = pair.pose.transform(robot.center_of_mass[None])[:, 0]
        moved = (centers[0] - centers[1]) / (2.0 * step)
        np.testing.assert_allclose(found.length_sensitivity[:3, cable], moved, rtol=1e-5, atol=1e-6)
        pulled = (pair.cables.frame_end_tension[0] - pair.cables.frame_end_tension[1]) / (2.0 * step)
        size = np.abs(pulled).max()
        np.testing.assert_allclose(found.tension_sensitivity[:, cable], pulled, atol=1e-5 * size)
    assert robot.winches is not None
    radius = robot.winches.pulley_radius
    for cable in (1, 6):
        ends = [
            sl.forward(robot.replace(winches=robot.winches.replace(pulley_radius=radius + part)), known, state.pose)
            for part in (1e-4 * np.eye(8)[cable], -1e-4 * np.eye(8)[cable])
        ]
        more, less = (end.state.pose.transform(robot.center_of_mass[None])[0] for end in ends)
        moved = (more - less) / 2e-4
        np.testing.assert_allclose(found.pulley_radius_sensitivity[:3, cable], moved, rtol=1e-4, atol=1e-6)


def test_an_axis_close_to_the_vertical_gives_almost_the_vertical_numbers() -> None:
    pose = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
    tilted, vertical = (sl.inverse(with_axes([tilt, 0.0, 1.0]), pose) for tilt in (1e-8, 0.0))
    np.testing.assert_allclose(tilted.unstrained_length, vertical.unstrained_length, atol=1e-8)
    assert (tilted.unstrained_length != vertical.unstrained_length).any()


def test_an_eyelet_has_no_swivel_axis() -> None:
    pose = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
    slanted, upright = (sl.inverse(with_axes(axis, 0.0), pose) for axis in ([1.0, 0.0, 1.0], [0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(slanted.unstrained_length, upright.unstrained_length)
    sl.structure_matrix(with_axes([1.0, 0.0, 1.0], 0.0), pose)


SOME_SLANTED = with_axes([[0.0, 0.0, 1.0]] * 3 + [[1.0, 0.0, 0.0]] * 5)
POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
REFUSING: dict[str, Callable[[], object]] = {
    "structure_matrix": lambda: sl.structure_matrix(SOME_SLANTED, POSE),
    "tension_polygon": lambda: sl.tension_polygon(SOME_SLANTED, POSE),
    "InverseSolver": lambda: sl.InverseSolver(SOME_SLANTED),
    "vibration": lambda: sl.vibration(SOME_SLANTED, POSE),
    "fastest": lambda: sl.fastest(SOME_SLANTED, sl.quintic_path([(0.0, 0.0, 1.5), (0.5, 0.3, 1.8)], speed=0.5)),
    "design": lambda: sl.design(
        SOME_SLANTED,
        [sl.FreeAnchors("frame", -0.1, 0.1, along=[0, 0, 1], symmetry="together")],
        [sl.Goal("least_margin")],
        poses=POSE,
        evaluations=2,
    ),
    "sweep": lambda: sl.sweep.run(sl.sweep.Request(robots=(SOME_SLANTED,), poses=POSE), "sweep"),
    "dump_mjcf": lambda: sl.dump_mjcf(SOME_SLANTED, POSE),
    "export_c": lambda: sl.export_c(SOME_SLANTED, "a.c"),
    "home": lambda: sl.home(SOME_SLANTED, POSE, np.full(8, 300.0)),
}


@pytest.mark.parametrize("name", REFUSING)
def test_functions_for_vertical_axes_refuse_other_axes(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with refused("winches: swivel_axis[3]", "(1, 0, 0)", "up or down here", kind=sl.InvalidValueError):
        REFUSING[name]()
    assert list(tmp_path.iterdir()) == []


def test_export_c_refuses_other_axes_before_it_begins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "four.yaml").write_text(sl.dump_robot(SOME_SLANTED))
    result = CliRunner().invoke(app, ["export-c", "four.yaml", "--out", "new/a.c"])
    assert result.exit_code == 2
    assert result.stdout == ""
    assert "swivel_axis[3] is (1, 0, 0)" in result.stderr
    assert [file.name for file in tmp_path.iterdir()] == ["four.yaml"]


def test_other_models_friction_and_points_inside_a_pulley_are_refused() -> None:
    robot, pose = with_axes(tangential()), sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)
    with refused("model", "Parabolic", "Catenary or Elastic for such swivel axes", kind=sl.InvalidValueError):
        sl.inverse(robot, pose, "parabolic")
    with refused("model", "Straight", "Catenary or Elastic for such swivel axes", kind=sl.InvalidValueError):
        sl.forward(robot, np.full(8, 9.0), pose, model="straight")
    assert robot.winches is not None
    rough = robot.replace(winches=robot.winches.replace(pulley_friction=0.1))
    with refused("winches: swivel_axis[0]", kind=sl.InvalidValueError):
        sl.inverse(rough, pose, winding=np.ones(8))
    inside = robot.frame_anchors[0] - robot.platform_anchors[0] + 0.01
    with refused("pose, cable 0: its platform end", kind=sl.CableGeometryError):
        sl.inverse(robot, sl.Pose.from_quaternion(inside, LEVEL))


def test_a_pulley_without_swivel_keeps_the_plane_of_a_planar_robot() -> None:
    corners, ends = np.array([[-2.0, 0.0, 2.0], [2.0, 0.0, 2.0]]), np.array([[-0.1, 0.0, 0.0], [0.1, 0.0, 0.0]])
    radius, stiffness = 0.1, 5e4
    winches = sl.Winch(radius, swivel_axis=[[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]])
    robot = sl.Robot(
        "planar",
        corners,
        ends,
        sl.Cable(1e-9, stiffness),
        mass=20.0,
        motion_pattern="2T",
        plane_normal=[0.0, 1.0, 0.0],
        winches=winches,
    )
    place, near = np.array([0.3, 0.0, 0.8]), np.array([0.4, 0.0, 0.9])
    plan = sl.inverse(robot, sl.Pose.from_quaternion(place, LEVEL))
    # the center of a fixed pulley is below the horizontal entry; the cable wraps the upper side of the pulley
    away = np.abs(place + ends - corners)[:, [0, 2]] - [0.0, radius]
    distance = np.linalg.norm(away, axis=1)
    tangent = np.sqrt(distance**2 - radius**2)
    wrap = np.arctan2(away[:, 1], away[:, 0]) + np.arctan2(radius, tangent)
    length = (tangent + radius * wrap) / (1.0 + plan.chord_tension / stiffness)
    np.testing.assert_allclose(plan.unstrained_length, length, rtol=1e-9)
    found = sl.forward(robot, plan.unstrained_length, sl.Pose.from_quaternion(near, LEVEL))
    np.testing.assert_allclose(found.state.pose.position, place, atol=1e-9)


def test_robot_files_keep_axes(tmp_path: Path) -> None:
    robot = four_cables()
    (tmp_path / "four.yaml").write_text(sl.dump_robot(robot))
    read = sl.load_robot(tmp_path / "four.yaml").winches
    assert robot.winches is not None
    assert read is not None
    np.testing.assert_array_equal(read.swivel_axis, robot.winches.swivel_axis)
