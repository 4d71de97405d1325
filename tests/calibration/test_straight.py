"""Calibration with straight cables: lengths and poses without a force balance."""

import json
import re
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import sagline as sl
from sagline.calibration.least_squares import evaluate_step
from sagline.calibration.observations import Readings
from sagline.calibration.parameters import KINDS, OF_FORCES, parameters_of
from sagline.calibration.problem import FitProblem, SearchState
from sagline.calibration.straight import lines_at
from sagline.cli.main import app
from sagline.core.arrays import Array
from tests.calibration.machines import robots
from tests.calibration.reference import pose_rows
from tests.calibration.test_calibrate import PLANAR, planar_robot
from tests.kinematics.feasible import box_poses
from tests.refusal import refused
from tests.tiers import extended

LENGTH, POSITION = 2.3e-3, 1e-3  # m
STRAIGHT = sl.Straight()


def planar_log(seed: int, count: int = 62, **changes: float) -> tuple[sl.Robot, Array, sl.WinchLog]:
    """A planar robot with stiff cables, its positions, and a log without load cells."""
    rng = np.random.default_rng(seed)
    truth = planar_robot(PLANAR + rng.normal(0.0, 0.03, (4, 3)) * [1.0, 0.0, 1.0])
    stiff = truth.replace(cables=truth.cables.replace(axial_stiffness=1e5))
    places = rng.uniform((0.6, 0.0, 0.5), (2.3, 0.0, 1.8), (count, 3))
    lengths = sl.inverse(stiff, sl.Pose(places, np.eye(3))).unstrained_length - rng.normal(0.0, 0.1, 4)
    log = sl.WinchLog(
        unstrained_length=lengths + rng.normal(0.0, LENGTH, lengths.shape),
        position=places + rng.normal(0.0, POSITION, places.shape),
        sensors=sl.Sensors(length_deviation=LENGTH, position_deviation=POSITION),
    )
    return truth, places, log


def cables_log(seed: int, count: int, *, position: float | None = None) -> tuple[sl.Robot, sl.Pose, sl.WinchLog]:
    """A robot with eight straight cables, its true poses, and a log with commanded poses."""
    rng = np.random.default_rng(seed)
    nominal = sl.load_robot("cogiro")
    truth = nominal.replace(frame_anchors=nominal.frame_anchors + rng.normal(0.0, 0.03, (8, 3)))
    pose = box_poses(truth, count, seed)
    lengths = sl.inverse(truth, pose, STRAIGHT).unstrained_length
    off = Rotation.from_rotvec(rng.normal(0.0, 0.01, (count, 3))) * pose.rotation
    log = sl.WinchLog(
        unstrained_length=lengths + rng.normal(0.0, 5e-4, lengths.shape),
        position=None if position is None else pose.position + rng.normal(0.0, position, (count, 3)),
        commanded=sl.Pose(pose.position + rng.normal(0.0, 0.03, (count, 3)), off),
        sensors=sl.Sensors(length_deviation=5e-4, position_deviation=position),
    )
    return truth, pose, log


def tangent_lengths(robot: sl.Robot, pose: sl.Pose) -> Array:
    """Lengths (N, m) [m] of straight cables that touch pulleys with axes of any direction; the tangent by bisection."""
    winches = robot.winches
    assert winches is not None
    reach = pose.transform(robot.platform_anchors) - robot.frame_anchors
    along = np.sum(reach * winches.swivel_axis, axis=-1)
    across = np.linalg.norm(reach - along[..., None] * winches.swivel_axis, axis=-1)
    low, high = np.zeros(along.shape), np.full(along.shape, np.pi)
    for _ in range(60):
        turn = 0.5 * (low + high)
        rest = across - winches.pulley_radius * (1.0 - np.cos(turn)), along - winches.pulley_radius * np.sin(turn)
        beyond = rest[0] * np.cos(turn) < rest[1] * np.sin(turn)
        low, high = np.where(beyond, low, turn), np.where(beyond, turn, high)
    return np.asarray(np.hypot(*rest) + winches.pulley_radius * turn + winches.dead_cable)


@pytest.mark.parametrize("yaw", [2e-3, pytest.param(np.inf, id="inclinometer")])
@pytest.mark.parametrize("name", ["pulleys", "slanted", pytest.param("cogiro", marks=extended)])
def test_slopes_agree_with_differences_of_the_sum_of_squares(name: str, yaw: float) -> None:
    robot, rng = robots()[name], np.random.default_rng(5)
    frame = sl.Pose((0.3, -0.2, 0.1), Rotation.from_rotvec((0.1, -0.2, 0.3)))
    sensors = sl.Sensors(2e-3, None, 1e-3, (2e-3, 2e-3, yaw), frame=frame, target=(0.1, 0.2, -0.1))
    pose = box_poses(robot, 4, 2)
    lengths = tangent_lengths(robot, pose) if name == "slanted" else sl.inverse(robot, pose, STRAIGHT).unstrained_length
    turned = pose.rotation * Rotation.from_rotvec(rng.normal(0.0, 2e-3, (4, 3)))
    turned = Rotation.from_rotvec((0.0, 0.0, 0.7)) * turned if np.isinf(yaw) else frame.rotation.inv() * turned
    place = (pose.transform(sensors.target[None])[:, 0] - frame.position) @ frame.matrix
    log = sl.WinchLog(
        unstrained_length=lengths + rng.normal(0.0, 2e-3, lengths.shape),
        position=place + rng.normal(0.0, 1e-3, place.shape),
        rotation=turned.as_quat(),
        sensors=sensors,
    )
    unknowns = [
        sl.Unknown(one, False, 1.0) for one in KINDS if one not in (*OF_FORCES, "drum_radius", "load_cell_gain")
    ]
    unknowns = [one for one in unknowns if robot.winches is not None or KINDS[one.name].owner != "winches"]
    parameters = parameters_of(robot, unknowns, sensors, counted=False)
    problem = FitProblem(robot, STRAIGHT, sensors, parameters, Readings.of(log))
    machine = problem.machine_at(problem.prior)
    rows = pose_rows(pose)
    exact = lines_at(machine, problem.readings(lengths, slice(None)), rows).lengths
    np.testing.assert_allclose(exact, lengths, atol=1e-12)
    kept = np.ones(4, dtype=np.bool_)
    state = SearchState(problem.prior, machine, exact, np.array(rows))
    state, normal = evaluate_step(problem, state, np.zeros(len(problem.prior)), kept)
    assert np.all(normal.readings == (7 if np.isinf(yaw) else 8))  # 13 or 14 readings of 6 motions
    for k, slope in enumerate(normal.gradient):
        step = np.zeros(len(problem.prior))
        step[k] = 1e-6
        ahead, back = (evaluate_step(problem, state, sign * step, kept)[1].squares.sum() for sign in (1.0, -1.0))
        assert (back - ahead) / 4e-6 == pytest.approx(slope, rel=1e-3, abs=1e-3 * np.abs(normal.gradient).max())


@pytest.mark.parametrize("seeds", [(9, 12), pytest.param(range(20), marks=extended)])
@pytest.mark.parametrize("pattern", ["1R2T", "2T"])
def test_a_planar_robot_is_found_from_lengths_and_positions(pattern: str, seeds: Iterable[int]) -> None:
    """Calibration with 62 rows, and positions predicted from the lengths of 350 other rows."""
    drawn, deviations, errors = planar_robot(PLANAR).replace(motion_pattern=pattern), [], []
    for seed in seeds:
        truth, places, log = planar_log(seed, 412)
        found = sl.calibrate(drawn, log.rows(slice(0, 62)), model=STRAIGHT, folds=0)
        assert found.status is sl.CalibrationStatus.FOUND
        moved = found.robot.frame_anchors - truth.frame_anchors
        deviations.append((moved.ravel() / found.standard_error[:12])[[0, 2, 3, 5, 6, 8, 9, 11]])
        pose = found.forward(log.readings[62:]).pose
        errors.append(np.linalg.norm((pose.position - places[62:])[:, [0, 2]], axis=1))
        assert ("assumed" in found.log) == (pattern == "1R2T")  # rotations have too small an effect on the lengths
    assert np.mean(np.abs(deviations) < 2.0) >= 0.85
    # errors of lengths by 2.3 mm cause errors of 2.3 mm if the platform is known to stay level
    assert np.sqrt(np.mean(np.square(errors))) < (2.6e-3 if pattern == "2T" else 5e-3)


@pytest.mark.parametrize("seeds", [(3,), pytest.param(range(10), marks=extended)])
@pytest.mark.parametrize("model", [STRAIGHT, sl.Catenary()], ids=["straight", "catenary"])
def test_the_scale_of_reported_lengths_is_a_default_unknown(model: sl.CableModel, seeds: Iterable[int]) -> None:
    """Reported lengths that are 6 % too large, as those of a robot with drums of another radius than assumed."""
    drawn, errors = planar_robot(PLANAR).replace(motion_pattern="2T"), []
    for seed in seeds:
        _, places, log = planar_log(seed, 162)
        log = log.replace(unstrained_length=log.readings / 0.94)
        found = sl.calibrate(drawn, log.rows(slice(0, 62)), model=model, folds=0)
        assert found.status is sl.CalibrationStatus.FOUND
        (k,) = (k for k, name in enumerate(found.parameters.names) if name == "length_scale")
        assert abs(found.values[k] - 0.94) < 4.0 * found.standard_error[k] < 0.03
        pose = found.forward(log.readings[62:], sl.Pose(places[62:], np.eye(3))).pose
        errors.append(np.linalg.norm((pose.position - places[62:])[:, [0, 2]], axis=1))
        # a user's own choice replaces the default
        own = sl.calibrate(
            drawn, log.rows(slice(0, 62)), ["default", sl.Unknown("length_scale", deviation=0.1)], model=model, folds=0
        )
        assert own.parameters.names.count("length_scale") == 4
    # as without an error of the scale: 2.4 mm, and 3.0 mm if mass, center of mass and stiffness are estimated too
    assert np.sqrt(np.mean(np.square(errors))) < (2.8e-3 if model is STRAIGHT else 3.2e-3)


def test_self_calibration_from_lengths_alone() -> None:
    """27 poses of eight cables have two more lengths than motions each."""
    truth, _, log = cables_log(1, 27)
    begin = time.perf_counter()
    found = sl.calibrate(sl.load_robot("cogiro"), log, ["frame_anchors"], model=STRAIGHT, folds=0)
    assert time.perf_counter() - begin < 10.0  # 0.2 s on a free processor
    assert found.status is sl.CalibrationStatus.FOUND
    assert found.degrees_of_freedom == 27 * 2
    off = (found.robot.frame_anchors - truth.frame_anchors).ravel()
    assert np.sqrt(np.mean(np.linalg.solve(found.covariance, off) @ off / off.size)) == pytest.approx(1.0, abs=0.6)


@pytest.mark.parametrize("seeds", [(0,), pytest.param(range(8), marks=extended)])
def test_relative_lengths_are_found(seeds: Iterable[int]) -> None:
    deviations = []
    for seed in seeds:
        _, _, log = cables_log(seed, 40, position=1e-3)
        zero = log.readings[0]
        log = log.replace(unstrained_length=log.readings - zero)
        assert (log.readings < 0.0).any()
        found = sl.calibrate(sl.load_robot("cogiro"), log, model=STRAIGHT, folds=0)
        assert found.status is sl.CalibrationStatus.FOUND
        which = [name == "length_zero" for name in found.parameters.names]
        deviations.append((found.length_offset - zero) / found.standard_error[which])
        pose = found.forward(log.readings[:5], log.commanded[:5] if log.commanded is not None else None).pose
        assert np.linalg.norm(pose.position - found.poses[:5].position, axis=1).max() < 5e-3
    assert np.mean(np.abs(deviations) < 2.0) >= 0.85


def test_relative_lengths_need_their_zeros_and_a_pose() -> None:
    _, _, log = cables_log(0, 8, position=1e-3)
    log = log.replace(unstrained_length=log.readings - log.readings[0])
    with refused("log: length[0, 0]", allowed="> 0 m, or the unknown length_zero"):
        sl.calibrate(sl.load_robot("cogiro"), log, ["frame_anchors"], model=STRAIGHT)
    with refused("log", "relative lengths alone"):
        sl.calibrate(sl.load_robot("cogiro"), log.replace(position=None, commanded=None), model=STRAIGHT)


def test_a_wrong_length_is_the_outlier() -> None:
    _, _, log = cables_log(2, 40, position=1e-3)
    wrong = log.readings.copy()
    wrong[7, 3] += 0.02
    found = sl.calibrate(sl.load_robot("cogiro"), log.replace(unstrained_length=wrong), model=STRAIGHT, folds=3)
    assert [(one.row, one.cable, one.quantity) for one in found.outliers] == [(7, 3, "length")]
    assert found.outliers[0].size == pytest.approx(0.02, abs=3e-3)
    assert found.cross_validation is not None
    assert found.cross_validation.position < 0.1 * found.cross_validation.position_before


def test_moving_rows_are_used_and_the_result_is_kept(tmp_path: Path) -> None:
    _, _, log = cables_log(3, 30, position=1e-3)
    moving = log.replace(time=0.2 * np.arange(30.0))
    found = sl.calibrate(sl.load_robot("cogiro"), moving, model=STRAIGHT, folds=0)
    assert not found.left_out
    found.save(tmp_path / "found.nc")
    again = sl.load_calibration(tmp_path / "found.nc")
    assert again.model == STRAIGHT
    error = again.pose_error(found.poses[:3])
    assert np.all((error.position > 1e-4) & (error.position < 0.02))
    assert str(again)


@pytest.mark.parametrize("relative", [False, True])
def test_one_command(relative: bool, tmp_path: Path) -> None:
    _, _, log = planar_log(4)
    (tmp_path / "robot.yaml").write_text(sl.dump_robot(planar_robot(PLANAR)), encoding="utf-8")
    lengths = log.readings - relative * log.readings[0]
    assert (lengths < 0.0).any() == relative
    log.replace(unstrained_length=lengths).save(tmp_path / "log.csv")
    assert np.array_equal(sl.load_log(tmp_path / "log.csv").readings, lengths)
    files = str(tmp_path / "robot.yaml"), str(tmp_path / "log.csv")
    done = CliRunner().invoke(app, ["calibrate", *files, "--model", "straight", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["status"] == "FOUND"


@pytest.mark.parametrize("late", [0.0, 0.06])
def test_late_lengths_of_a_moving_robot_are_named(late: float) -> None:
    robot, rng, time = planar_robot(PLANAR), np.random.default_rng(0), 0.25 * np.arange(80)

    def place(at: Any) -> Array:
        return np.stack((1.45 + 0.7 * np.sin(0.5 * at), 0.0 * at, 1.15 + 0.5 * np.sin(0.8 * at)), axis=1)

    lengths = sl.inverse(robot, sl.Pose(place(time - late), np.eye(3)), STRAIGHT).unstrained_length
    log = sl.WinchLog(
        unstrained_length=lengths + rng.normal(0.0, 5e-4, lengths.shape),
        position=place(time) + rng.normal(0.0, POSITION, (80, 3)),
        time=time,
        sensors=sl.Sensors(length_deviation=5e-4, position_deviation=POSITION),
    )
    found = sl.calibrate(robot, log, model=STRAIGHT, folds=0)
    assert len(found.rows) == 80
    if not late:
        assert found.status is sl.CalibrationStatus.FOUND
        assert not found.criticisms
        return
    assert found.status is sl.CalibrationStatus.DOUBTFUL
    assert found.criticisms[0].kind == "clock_offset"
    timed = sl.calibrate(robot, log, ["default", "clock_offset"], model=STRAIGHT, folds=0)
    assert timed.status is sl.CalibrationStatus.FOUND
    assert timed.value_of("clock_offset")[0] == pytest.approx(late, abs=2e-3)


def test_parameters_of_forces_are_refused() -> None:
    _, _, log = planar_log(4)
    with refused("unknown: mass"):
        sl.calibrate(planar_robot(PLANAR), log, ["frame_anchors", "mass"], model=STRAIGHT)


def test_the_error_of_relative_coordinates_omits_the_normal_of_the_plane() -> None:
    _, _, log = planar_log(4)
    found = sl.calibrate(planar_robot(PLANAR), log, model=STRAIGHT, folds=0)
    shown = re.search(r"relative to one another ±\s(\d+\.?\d*)\smm", str(found))
    assert shown is not None
    assert float(shown[1]) < 1e3 * found.standard_error[:12].reshape(4, 3)[:, [0, 2]].max()
    assert not re.search("dead_cable|pulley_radius", str(found))


def test_deviations_of_the_sensors_are_estimated() -> None:
    _, _, log = planar_log(6, 200)
    wide = log.sensors.replace(length_deviation=2.0 * LENGTH, position_deviation=2.0 * POSITION)
    found = sl.calibrate(planar_robot(PLANAR), log.replace(sensors=wide), model=STRAIGHT, folds=0)
    deviations = {one.quantity: one for one in found.sensor_deviations()}
    for quantity, true in (("length", LENGTH), ("position", POSITION)):
        assert deviations[quantity].stated == pytest.approx(2.0 * true)
        assert deviations[quantity].found == pytest.approx(true, rel=0.2)
