"""The table of gains along a plan."""

import re

import numpy as np

import sagline as sl
from sagline.control.null_space import gains_along, null_space
from tests.control.stops import PROTOTYPE, stops
from tests.refusal import refused


def plan(duration: float = 2.2, rate: float = 100.0) -> sl.Plan:
    path = sl.quintic_path([(0, 0, 1.5), (0.2, -0.4, 1.4)], durations=duration, rate=rate)
    return sl.inverse(PROTOTYPE, path)


def test_rows_are_half_a_second_apart_with_the_last_pose() -> None:
    given = plan()
    gains = gains_along(given)
    assert gains is not None
    assert given.path is not None
    np.testing.assert_allclose(gains.time, [0.0, 0.5, 1.0, 1.5, 2.0, 2.2], atol=1e-12)
    for time, row in zip(gains.time, gains.rows, strict=True):
        expected = null_space(given.state[int(np.argmin(abs(given.path.time - time)))])
        for one, other in zip(row, expected, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)


def test_the_nearest_row_is_returned_as_the_same_object() -> None:
    gains = gains_along(plan())
    assert gains is not None
    for time in np.random.default_rng(3).uniform(-1.0, 3.0, 200):
        nearest = int(np.argmin(abs(gains.time - time)))
        assert gains.at(time) is gains.rows[nearest]


def test_sparse_samples_have_one_row_each() -> None:
    gains = gains_along(plan(rate=1.0), every=0.1)
    assert gains is not None
    np.testing.assert_allclose(gains.time, [0.0, 1.0, 2.0, 2.2], atol=1e-12)


def test_a_single_pose_has_one_row() -> None:
    held = sl.inverse(PROTOTYPE, stops().state.pose[0])
    gains = gains_along(held)
    assert gains is not None
    assert len(gains.rows) == 1
    assert gains.at(-5.0) is gains.at(1e6)
    np.testing.assert_allclose(gains.at(0.0).correction, null_space(held.state).correction, atol=1e-12)


def test_a_robot_without_redundancy_has_no_tension_loop() -> None:
    frame = [[3, 2, 4], [-3, 2, 4], [0, -3, 4]]
    tripod = sl.Robot("tripod", frame, np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T")
    assert gains_along(sl.inverse(tripod, sl.Pose((0.2, 0.1, 1.0), np.eye(3)))) is None


def test_invalid_arguments_are_refused() -> None:
    with refused("plan", "of poses without a path", kind=sl.InvalidValueError):
        gains_along(stops())
    with refused("every", "0 s", kind=sl.InvalidValueError):
        gains_along(plan(), every=0.0)
    path = sl.quintic_path([(0, 0, 2.5), (0, 0, 3.2)], durations=2.0, rate=10.0)
    with refused("plan", kind=sl.InvalidValueError) as caught:
        gains_along(sl.inverse(PROTOTYPE, path))
    assert re.search(r"[\d.]+ s$", caught.value.value)
