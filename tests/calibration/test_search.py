"""Cross-validation compared with explicit calibrations without the omitted poses, through public functions."""

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array, Flags
from tests.calibration.synthetic import Synthetic, log_of, true_robot, usual_sensors
from tests.tiers import wide

UNKNOWNS = ("frame_anchors", "length_zero", "axial_stiffness", "mass")
COUNT, FOLDS = 30, 4


def synthetic(robot: sl.Robot) -> Synthetic:
    sensors = usual_sensors(position_deviation=1e-3)
    errors = {"frame_anchors": 0.02, "length_zero": 0.02, "axial_stiffness": 0.1, "mass": 0.02}
    return log_of(true_robot(robot, errors, seed=2, sensors=sensors), COUNT, 3, sets=3, positions=12)


def missed(robot: sl.Robot, lengths: Array, made: Synthetic, which: Flags) -> tuple[Array, Array]:
    """Measured minus predicted load cells, and distances from measured positions."""
    found = sl.forward(robot, lengths[which], made.pose[np.flatnonzero(which)])
    assert found.stable.all()
    assert made.log.load_cells is not None
    assert made.log.position is not None
    cells = made.log.load_cells[which] - found.state.cables.frame_end_tension
    apart = np.linalg.norm(made.log.position[which] - found.pose.position, axis=1)
    return cells.reshape(-1), apart[~np.isnan(apart)]


def root(values: list[Array]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(values) ** 2)))


@pytest.mark.parametrize("name", wide(["cogiro", "article-suspended"]))
def test_cross_validation_agrees_with_explicit_calibrations(name: str) -> None:
    robot = sl.load_robot(name)
    made = synthetic(robot)
    assert made.log.unstrained_length is not None
    told = sl.calibrate(robot, made.log, UNKNOWNS, folds=FOLDS, robust=False).cross_validation
    assert told is not None
    missed_by: list[list[Array]] = [[], [], [], []]
    for part in np.array_split(np.arange(COUNT), FOLDS):
        left = np.isin(np.arange(COUNT), part)
        found = sl.calibrate(robot, made.log.rows(~left), UNKNOWNS, folds=0, robust=False)
        after = missed(found.robot, made.log.unstrained_length + found.length_offset, made, left)
        before = missed(robot, made.log.unstrained_length, made, left)
        for each, value in zip(missed_by, (*after, *before), strict=True):
            each.append(value)
    assert told.folds == FOLDS
    shown = [told.tension, told.position, told.tension_before, told.position_before]
    np.testing.assert_allclose(shown, [root(each) for each in missed_by], rtol=1e-3)
    np.testing.assert_allclose(shown[2:], [root(each) for each in missed_by[2:]], rtol=1e-6)
    assert told.tension < 0.3 * told.tension_before
    assert told.position < 0.2 * told.position_before


def test_without_positions_they_have_no_error() -> None:
    robot = sl.load_robot("cogiro")
    made = log_of(true_robot(robot, {"mass": 0.02}, seed=1), 8, 3)
    told = sl.calibrate(robot, made.log, ("mass",), folds=3).cross_validation
    assert told is not None
    assert np.isnan([told.position, told.position_before]).all()
    assert told.tension < told.tension_before


def test_more_folds_than_poses_omit_one_pose_at_a_time() -> None:
    robot = sl.load_robot("cogiro")
    made = log_of(true_robot(robot, {"mass": 0.02}, seed=1), 4, 3)
    told = sl.calibrate(robot, made.log, ("mass",), folds=50).cross_validation
    assert told is not None
    assert told.folds == 4


def test_no_cross_validation_by_default() -> None:
    robot = sl.load_robot("cogiro")
    made = log_of(true_robot(robot, {"mass": 0.02}, seed=1), 4, 3)
    assert sl.calibrate(robot, made.log, ("mass",), folds=0).cross_validation is None


def test_positions_in_unknown_axes_have_no_initial_error() -> None:
    robot = sl.load_robot("cogiro")
    turned = usual_sensors(position_deviation=1e-3, frame=sl.Pose.from_euler([1.0, 2.0, 0.0], 1.0, 0.0, 0.0))
    made = log_of(true_robot(robot, {"mass": 0.02}, 1, turned), 40, 3, positions=40)
    log = made.log.replace(sensors=usual_sensors(position_deviation=1e-3))
    found = sl.calibrate(robot, log, ("mass", "measuring_frame"), folds=3)
    assert found.cross_validation is not None
    assert found.cross_validation.position < 0.01
    assert np.isnan(found.cross_validation.position_before)
    assert "position: " in str(found)
