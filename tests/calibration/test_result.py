"""Expected pose errors compared with robots drawn from the covariance."""

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.calibration.observations import MachineTerms
from sagline.calibration.parameters import parameters_of, with_values
from sagline.calibration.result import _motion_slopes
from sagline.core.arrays import Array
from tests.calibration.reference import counts_of, pose_rows
from tests.calibration.synthetic import log_of, true_robot, with_drums
from tests.kinematics.feasible import box_poses

DRAWS = 250
UNKNOWNS = {
    "cogiro": ("frame_anchors", "length_zero", "axial_stiffness", "mass", "center_of_mass"),
    "drums": ("frame_anchors", "platform_anchors", "length_zero", "drum_radius", "linear_density", "axial_stiffness"),
}
ERRORS = {"frame_anchors": 0.01, "length_zero": 0.01, "axial_stiffness": 0.05, "mass": 0.02}


def nominal(name: str) -> sl.Robot:
    return sl.load_robot("cogiro") if name == "cogiro" else with_drums()


@cache
def found(name: str) -> sl.Calibration:
    truth = true_robot(nominal(name), ERRORS, seed=5)
    return sl.calibrate(nominal(name), log_of(truth, 40, 6).log, UNKNOWNS[name], folds=0)


@cache
def commanded(name: str) -> sl.Pose:
    pose = box_poses(nominal(name), 40, 9)
    return pose[np.flatnonzero(sl.inverse(found(name).robot, pose).feasible)[:3]]


def values_drawn(calibration: sl.Calibration, count: int, rng: np.random.Generator) -> Array:
    """Values drawn from the covariance, (count, P)."""
    error = calibration.standard_error
    values, vectors = np.linalg.eigh(calibration.covariance / np.outer(error, error))
    normal = rng.normal(size=(count, len(error)))
    found: Array = calibration.values + error * ((normal * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)
    return found


def drawn(name: str, believed: Array, start: sl.Pose, rng: np.random.Generator) -> tuple[Array, Rotation]:
    """Positions of robots drawn from the covariance, (DRAWS, 3), at measured lengths or counts."""
    calibration = found(name)
    counted = name == "drums"
    parameters = calibration.parameters
    values = values_drawn(calibration, DRAWS, rng)
    robots, lengths = [], []
    for value in values:
        robot = with_values(calibration.robot, parameters, value)
        noise = calibration.sensors.length_deviation * rng.normal(size=8)
        if counted:
            lengths.append(sl.lengths_from_counts(robot, believed) + noise)
        else:
            lengths.append(believed + calibration.parameters.length_offset(value) + noise)
        robots.append(robot)
    starts = sl.Pose(np.tile(start.position, (DRAWS, 1)), np.tile(start.matrix, (DRAWS, 1, 1)))
    solution = sl.forward(robots, np.array(lengths), starts)
    assert solution.stable.all()
    return solution.pose.position, Rotation.from_quat(solution.pose.quaternion.copy())


def agrees(samples: Array, covariance: Array) -> None:
    """Squared draws have the expected mean, and each coordinate has its standard deviation."""
    values, vectors = np.linalg.eigh(covariance)
    scaled = (samples @ vectors) / np.sqrt(values)
    np.testing.assert_allclose(np.mean(scaled**2, axis=0), 1.0, atol=5.0 * np.sqrt(2.0 / len(samples)))
    np.testing.assert_allclose(np.mean(scaled**2), 1.0, atol=5.0 * np.sqrt(2.0 / scaled.size))


@pytest.mark.parametrize("name", ["cogiro", pytest.param("drums", marks=pytest.mark.soak)])
def test_robots_drawn_from_the_covariance(name: str) -> None:
    calibration, pose = found(name), commanded(name)[0]
    expected = calibration.pose_error(pose)
    lengths = sl.inverse(calibration.robot, pose).unstrained_length
    believed = lengths - calibration.length_offset
    if name == "drums":
        believed = counts_of(calibration.robot, lengths[None])[0]
    position, rotation = drawn(name, believed, pose, np.random.default_rng(3))
    turn = (rotation * Rotation.from_quat(pose.quaternion.copy()).inv()).as_rotvec()
    agrees(np.hstack((position - pose.position, turn)), expected.covariance)
    assert abs(expected.position - np.sqrt(np.mean(np.sum((position - pose.position) ** 2, axis=1)))) < (
        0.15 * expected.position
    )
    assert abs(expected.rotation / np.sqrt(np.mean(np.sum(turn**2, axis=1))) - 1.0) < 0.15


def test_common_errors_of_the_poses_of_the_log() -> None:
    """Own errors: drawn robots minus the shift and rotation that fit their errors at the poses of the log best."""
    calibration, pose = found("cogiro"), commanded("cogiro")[0]
    rng = np.random.default_rng(4)
    values = values_drawn(calibration, 150, rng)
    some = slice(0, 40, 4)
    poses, lengths = calibration.poses[some], calibration.unstrained_length[some]
    wanted = sl.inverse(calibration.robot, pose).unstrained_length
    offset = calibration.length_offset
    left, turns = [], []
    for value in values:
        robot = with_values(calibration.robot, calibration.parameters, value)
        more = calibration.parameters.length_offset(value) - offset
        moved = sl.forward(robot, lengths + more, poses).pose.position - poses.position
        there = sl.forward(robot, wanted + more + 5e-4 * rng.normal(size=8), pose).pose
        here = there.position - pose.position
        around = np.stack((-poses.position[:, 1], poses.position[:, 0], np.zeros(len(poses))), axis=1)
        matrix = np.concatenate((np.tile(np.eye(3), (len(poses), 1)), around.reshape(-1, 1)), axis=1)
        common = np.linalg.lstsq(matrix, moved.reshape(-1), rcond=None)[0]
        turns.append((there.rotation * pose.rotation.inv()).as_rotvec() - common[3] * np.eye(3)[2])
        left.append(here - common[:3] - common[3] * np.array([-pose.position[1], pose.position[0], 0.0]))
    expected = calibration.pose_error(pose)
    assert abs(np.sqrt(np.mean(np.sum(np.square(left), axis=1))) / expected.own_position - 1.0) < 0.2
    spread = np.sqrt(np.diagonal(expected.own_covariance)[3:])
    np.testing.assert_allclose(np.std(turns, axis=0) / spread, 1.0, atol=0.25)
    assert expected.own_position < 0.5 * expected.position


@pytest.mark.parametrize("name", UNKNOWNS)
def test_forward_propagates_the_covariance(name: str) -> None:
    calibration, poses = found(name), commanded(name)
    lengths = sl.inverse(calibration.robot, poses).unstrained_length
    solution = calibration.forward(lengths - calibration.length_offset, poses)
    assert solution.covariance is not None
    np.testing.assert_allclose(solution.pose.position, poses.position, atol=1e-9)
    reach = poses.matrix @ calibration.robot.center_of_mass
    expected = calibration.pose_error(poses).covariance
    for k in range(len(poses)):
        x, y, z = reach[k]
        carried = np.eye(6)
        carried[:3, 3:] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
        np.testing.assert_allclose(solution.covariance[k], carried @ expected[k] @ carried.T, rtol=1e-6, atol=1e-12)
    single = calibration.forward(lengths[0] - calibration.length_offset, poses[0])
    assert single.covariance is not None
    np.testing.assert_allclose(single.covariance, solution.covariance[0], rtol=1e-6, atol=1e-12)


def test_a_pose_without_equilibrium_has_no_error() -> None:
    pose = commanded("cogiro")
    far = sl.Pose(np.array([pose.position[0], [50.0, 0.0, 1.0]]), np.array([pose.matrix[0], np.eye(3)]))
    expected = found("cogiro").pose_error(far)
    assert np.isfinite(expected.position[0])
    assert np.isnan(expected.position[1])
    assert np.isnan(expected.own_covariance[1]).all()


def test_an_undetermined_parameter_leaves_the_pose_undetermined() -> None:
    truth = true_robot(nominal("cogiro"), ERRORS, seed=5)
    free = (sl.Unknown("frame_anchors", deviation=np.inf), "length_zero", "mass")
    calibration = sl.calibrate(nominal("cogiro"), log_of(truth, 40, 6).log, free, folds=0)
    assert np.isinf(calibration.pose_error(commanded("cogiro")[0]).position)


@pytest.mark.parametrize("name", ["the world turned about the vertical", "the world shifted along y"])
def test_a_shifted_world_is_not_an_own_error(name: str) -> None:
    """Poses in a rotated or shifted world have exactly this error, and the own errors of the robot are zero."""
    calibration, pose = found("cogiro"), commanded("cogiro")
    vector = next(one.vector for one in calibration.gauge if one.name == name)
    sharp = calibration.sensors.replace(length_deviation=1e-9)
    told = replace(calibration, covariance=np.outer(vector, vector), sensors=sharp).pose_error(pose)
    assert np.abs(told.own_covariance).max() < 1e-10 * np.abs(told.covariance).max()
    moved = vector[:24].reshape(8, 3)  # the frame anchors
    if "turned" in name:
        angle = moved[0, 1] / calibration.robot.frame_anchors[0, 0]
        np.testing.assert_allclose(told.rotation, abs(angle), rtol=1e-6)
        np.testing.assert_allclose(told.position, abs(angle) * np.hypot(*pose.position[:, :2].T), rtol=1e-6)
    else:
        np.testing.assert_allclose(told.position, abs(moved[0, 1]), rtol=1e-6)


def test_errors_are_printed_in_one_line() -> None:
    """Root mean squares over poses with an equilibrium."""
    covariance = np.zeros((3, 6, 6))
    covariance[:2, :3, :3] = np.diag([1e-6, 2e-6, 6e-6]), np.diag([9e-6, 10e-6, 22e-6])  # 3 mm and 6.4 mm
    covariance[:2, 5, 5] = 4e-6
    covariance[2] = np.nan
    own = 0.04 * covariance
    error = sl.PoseError(sl.Pose(np.zeros((3, 3)), np.eye(3)), covariance, own)
    assert re.findall(r"\d+\s\w+", str(error)) == ["2 poses", "5\u00a0mm", "1\u00a0mm", "2\u00a0mrad"]
    assert repr(error) == f"<PoseError: {error}>"


def test_forward_reports_undetermined_errors() -> None:
    """A platform with a center of mass beside its origin, and one undetermined parameter."""
    told = found("cogiro")
    free = np.array(told.covariance)
    free[0, 0] = np.inf  # x of an anchor, which all six coordinates follow
    lost = replace(told, covariance=free)
    lengths = told.unstrained_length[:2]
    assert told.robot.center_of_mass.any()
    open_way = lost.forward(lengths).covariance
    assert open_way is not None
    assert np.isinf(np.diagonal(open_way, axis1=1, axis2=2)).all()
    mass = told.parameters.labels.index("mass")
    kept = np.array(told.covariance)
    kept[mass, :] = kept[:, mass] = 0.0
    kept[mass, mass] = np.inf
    level = replace(told, covariance=kept).forward(lengths).covariance
    assert level is not None
    assert np.isinf(np.diagonal(level, axis1=1, axis2=2)[:, 2]).all()  # a lower or a higher position


@pytest.mark.parametrize("counted", [False, True])
def test_the_effect_of_stiffness_differs_between_counts_and_lengths(counted: bool) -> None:
    """Rope that was wound under tension is shorter at rest: counts contain less information on it than lengths."""
    robot, sensors, step = with_drums(), sl.Sensors(tension_deviation=5.0), 1e-4
    parameters = parameters_of(robot, ["axial_stiffness"], sensors, counted=counted)
    plan = sl.inverse(robot, commanded("drums")[0])
    lengths = np.asarray(plan.state.unstrained_length)[None]
    by_values, _ = _motion_slopes(
        MachineTerms(robot, sl.Catenary(), parameters, sl.Sensors()), pose_rows(plan.state.pose), lengths
    )
    moved = by_values[0, :3]
    believed = counts_of(robot, lengths)
    for k, value in enumerate(parameters.prior):
        ends = []
        for sign in (-1.0, 1.0):
            values = parameters.prior.copy()
            values[k] = value * (1.0 + sign * step)
            other = with_values(robot, parameters, values)
            length = sl.lengths_from_counts(other, believed[0]) if counted else lengths[0]
            ends.append(sl.forward(other, length, plan.state.pose).pose.position)
        slope = (ends[1] - ends[0]) / (2.0 * step * value)
        np.testing.assert_allclose(moved[:, k], slope, rtol=1e-4, atol=1e-4 * np.abs(slope).max())
