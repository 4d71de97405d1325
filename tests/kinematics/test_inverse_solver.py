"""The solver of a control loop returns a status and no lengths for invalid inputs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl

ROBOT = sl.load_robot("cogiro")
POSITION = (1.0, 0.5, 2.0)
NAN = float("nan")
NO_ROTATIONS = [(0, 0, 0, 5.0), (0, 0, 0, 0), (0, 0, 0, 1.00001), (NAN, 0, 0, 1), (0, 0, 0, 1e300), (9e-3, 0, 0, 1)]


@pytest.mark.parametrize(
    "quaternion", [(0, 0, 0, 5.0), (0, 0, 0, 0), (0, 0, 0, 1.00001), (NAN, 0, 0, 1), (0, 0, 0, 1e300)]
)
@pytest.mark.parametrize("kind", [tuple, np.array])
def test_an_invalid_rotation_has_a_status_and_no_lengths(quaternion: tuple[float, ...], kind: type) -> None:
    solver, lengths = sl.InverseSolver(ROBOT), np.ones(8)
    assert solver.step_into(POSITION, kind(quaternion), lengths) is sl.PoseStatus.NO_POSE
    assert np.isnan(lengths).all()
    with pytest.raises(sl.InvalidValueError, match="quaternion"):
        solver.step(POSITION, kind(quaternion))


@pytest.mark.parametrize("wrench", [(NAN,) * 6, (np.inf, 0, 0, 0, 0, 0), (0, 0, 0, 0, 0, -np.inf)])
def test_a_load_that_is_not_finite_has_a_status_and_no_lengths(wrench: tuple[float, ...]) -> None:
    solver, lengths = sl.InverseSolver(ROBOT), np.ones(8)
    assert solver.step_into(POSITION, (0, 0, 0, 1), lengths, wrench) is sl.PoseStatus.NO_POSE
    assert np.isnan(lengths).all()
    assert solver.step_into(POSITION, (0, 0, 0, 1), lengths) is sl.PoseStatus.SOLVED
    np.testing.assert_array_equal(lengths, sl.InverseSolver(ROBOT).step(POSITION, (0, 0, 0, 1)).unstrained_length)


@pytest.mark.parametrize("position", [(NAN, 0, 0), (0, np.inf, 0), (0, 0, -np.inf)])
def test_a_position_that_is_not_finite_has_a_status_and_no_lengths(position: tuple[float, ...]) -> None:
    lengths = np.ones(8)
    assert sl.InverseSolver(ROBOT).step_into(position, (0, 0, 0, 1), lengths) is sl.PoseStatus.NO_POSE
    assert np.isnan(lengths).all()


@pytest.mark.parametrize("factor", [1.0, 1.0 + 9e-7, 1.0 - 9e-7, -1.0, 1.0 + 1e-14])
def test_a_quaternion_that_is_nearly_of_length_one_is_normalized(factor: float) -> None:
    turn = Rotation.from_rotvec([0.1, -0.2, 0.15])
    lengths = np.empty(8)
    status = sl.InverseSolver(ROBOT).step_into(POSITION, factor * turn.as_quat(), lengths)
    assert status is sl.PoseStatus.SOLVED
    expected = sl.inverse(ROBOT, sl.Pose(POSITION, turn)).unstrained_length
    np.testing.assert_allclose(lengths, expected, rtol=0.0, atol=2e-14)


def test_a_refused_wrench_has_no_later_effect() -> None:
    solver, expected, lengths = sl.InverseSolver(ROBOT), np.empty(8), np.empty(8)
    solver.step_into(POSITION, (0, 0, 0, 1), expected)
    with pytest.raises(sl.InvalidValueError, match="wrench"):
        solver.step_into(POSITION, (0, 0, 0, 1), lengths, (500.0, 0.0, 0.0, 0.0, 0.0, "moment"))
    solver.reset()
    solver.step_into(POSITION, (0, 0, 0, 1), lengths)
    np.testing.assert_array_equal(lengths, expected)
