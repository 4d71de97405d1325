import numpy as np
import pytest
from scipy.integrate import quad_vec

import sagline as sl
from sagline.dynamics.trajectories.segments import segments_of
from sagline.dynamics.vibration.vibration import excitation
from tests.refusal import refused


@pytest.fixture(scope="module")
def robot() -> sl.Robot:
    return sl.load_robot("article-suspended")


def at_the_goal(robot: sl.Robot, path: sl.Path) -> sl.Modes:
    return sl.modes(sl.inverse(robot, path.pose[-1], tension=sl.MinimumNorm()).state)


def test_the_excitation_of_a_straight_motion_agrees_with_its_formula(robot: sl.Robot) -> None:
    robot = robot.replace(center_of_mass=(0.02, -0.01, 0.05))
    start, goal = sl.Pose.from_euler((0, 0, 1.5), 0, 0, 0), sl.Pose.from_euler((2, 0.5, 1.7), 0, 0, 0)
    path = sl.septic_path([start, goal], durations=1.5)
    modes = at_the_goal(robot, path)
    turning = 2.0 * np.pi * modes.frequency

    def acceleration(t: float) -> np.ndarray:
        s = t / 1.5
        value: np.ndarray = np.exp(-1j * turning * t) * 420.0 * (s * (1 - s)) ** 2 * (1 - 2 * s) / 1.5**2
        return value

    transform = np.abs(quad_vec(acceleration, 0.0, 1.5, epsabs=1e-12)[0])
    direction = robot.mass * (goal.position - start.position)
    shape = modes.shape
    expected = np.abs(shape[:3].T @ direction) * np.linalg.norm(shape, axis=0) * transform / turning
    found = excitation(robot, segments_of(path)[0], modes.frequency, shape)
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-12)


def test_along_x_two_modes_and_along_z_one(robot: sl.Robot) -> None:
    along_x = sl.quintic_path([(-1.5, 0, 1.5), (1.5, 0, 1.5)], durations=2.0)
    np.testing.assert_allclose(sl.to_shape(at_the_goal(robot, along_x), along_x), [1.81, 2.91], atol=0.01)
    along_z = sl.quintic_path([(0, 0, 1.0), (0, 0, 2.5)], durations=2.0)
    modes = at_the_goal(robot, along_z)
    found = sl.to_shape(modes, along_z)
    assert found.shape == (1,)
    assert np.abs(modes.shape[2, modes.frequency == found]) > 0.9 / np.sqrt(robot.mass)  # a vertical motion


def test_the_segment_with_the_largest_excitation_is_used(robot: sl.Robot) -> None:
    goal = (0, 0, 1.5)
    there = sl.quintic_path([(0, 0, 1.0), goal], durations=2.0)
    modes = at_the_goal(robot, there)
    gently_up = sl.quintic_path([(0, -1, 1.5), goal, (0, 0, 1.6)], durations=(1.5, 3.0))
    along_y = sl.quintic_path([(0, -1, 1.5), goal], durations=1.5)
    np.testing.assert_array_equal(sl.to_shape(modes, gently_up), sl.to_shape(modes, along_y))


def test_motions_without_excitation_are_refused(robot: sl.Robot) -> None:
    path = sl.quintic_path([(0, 0, 1.5), (1, 0, 1.5)], durations=2.0, rate=5.0)
    plan = sl.inverse(robot, path)
    with refused("modes", "of 11 states", "of a single state") as caught:
        sl.to_shape(sl.modes(plan.state), path)
    assert "modes(plan.state[-1])" in caught.value.next_step
    still = sl.quintic_path([(0, 0, 1.5), (0, 0, 1.5)], durations=2.0)
    with refused("path", "without motion"):
        sl.to_shape(sl.modes(plan.state[-1]), still)
    out = sl.Pose.from_euler((50.0, 0, 1.5), 0, 0, 0)
    with refused("modes", "without a frequency"):
        sl.to_shape(sl.modes(sl.inverse(robot, out).state), path)
    with refused("modes", "3", "a Modes or a Vibration"):
        sl.to_shape(3, path)  # type: ignore[arg-type]
