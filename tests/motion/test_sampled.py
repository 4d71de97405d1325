import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation, RotationSpline

from sagline import InvalidValueError, Pose, path_from_samples, quintic_path

NODES = np.sort(np.concatenate((np.linspace(0.0, 2.0, 81), [0.012, 0.711, 1.3333])))  # not uniform


def tumbling(time: np.ndarray) -> Rotation:
    """A rotation with varying axis and speed, in motion at both ends."""
    inner = np.stack([0.1 * time**2, np.zeros_like(time), 0.4 * time], axis=-1)
    outer = np.stack([0.3 * np.sin(time), 0.5 * time, 0.2 * np.cos(2 * time)], axis=-1)
    return Rotation.from_rotvec(outer) * Rotation.from_rotvec(inner)


def reference_rates(time: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angular velocity and acceleration in world axes by differences of the rotation."""

    def omega(t: np.ndarray, h: float = 1e-4) -> np.ndarray:
        rates: np.ndarray = (tumbling(t + h) * tumbling(t - h).inv()).as_rotvec() / (2 * h)
        return rates

    return omega(time), (omega(time + 1e-3) - omega(time - 1e-3)) / 2e-3


def test_angular_rates_are_in_world_axes_up_to_the_ends() -> None:
    path = path_from_samples(NODES, Pose(np.zeros((NODES.size, 3)), tumbling(NODES)))
    omega, alpha = reference_rates(NODES)
    np.testing.assert_allclose(path.twist[:, 3:], omega, atol=3e-5)
    np.testing.assert_allclose(path.twist_rate[:, 3:], alpha, atol=5e-3)
    body = tumbling(NODES).inv().apply(omega)
    assert np.abs(path.twist[:, 3:] - body).max() > 0.1  # the frames differ here, so the test above distinguishes them


def test_coarse_samples_have_the_rates_of_their_spline() -> None:
    time = np.array([0.0, 0.5, 0.9, 1.5, 2.1, 2.4])  # up to 60 degrees apart
    rotation = Rotation.from_rotvec(np.outer(np.sin(1.7 * time), [1.5, 0.0, 0.3])) * tumbling(time)
    spline = CubicSpline(time, rotation.as_quat())  # Rotation normalizes the interpolated quaternions
    before, at, after = (Rotation.from_quat(spline(time + h)) for h in (-1e-4, 0.0, 1e-4))
    path = path_from_samples(time, Pose(np.zeros((6, 3)), rotation))
    np.testing.assert_allclose(path.twist[:, 3:], (after * before.inv()).as_rotvec() / 2e-4, atol=1e-6)
    alpha = ((after * at.inv()).as_rotvec() - (at * before.inv()).as_rotvec()) / 1e-8
    np.testing.assert_allclose(path.twist_rate[:, 3:], alpha, atol=2e-3)


def test_inner_samples_agree_with_scipys_rotation_spline() -> None:
    time = np.linspace(0.0, 2.0, 201)
    rotation = tumbling(time)
    spline = RotationSpline(time, rotation)  # its rates are in body axes
    path = path_from_samples(time, Pose(np.zeros((201, 3)), rotation))
    inner = slice(15, -15)
    np.testing.assert_allclose(path.twist[inner, 3:], rotation.apply(spline(time, 1))[inner], atol=1e-7)
    np.testing.assert_allclose(path.twist_rate[inner, 3:], rotation.apply(spline(time, 2))[inner], atol=1e-4)


def test_end_accelerations_are_correct_unlike_those_of_scipy() -> None:
    """The reason for the quaternion spline: the error of scipy's spline does not decrease with the step."""
    for samples, bound in ((101, 2e-3), (201, 5e-4)):
        time = np.linspace(0.0, 2.0, samples)
        rotation, (_, alpha) = tumbling(time), reference_rates(time)
        theirs = rotation.apply(RotationSpline(time, rotation)(time, 2))
        ours = path_from_samples(time, Pose(np.zeros((samples, 3)), rotation)).twist_rate[:, 3:]
        assert np.abs(theirs - alpha).max() > 1.0
        assert np.abs(ours - alpha).max() < bound


def test_cubic_positions_are_reproduced_exactly() -> None:
    coefficients = np.array([[1.0, -2.0, 0.5], [0.3, 0.1, -0.4], [0.2, -0.7, 0.9], [-0.1, 0.4, 0.2]])
    power = NODES[:, None]
    position = np.polynomial.polynomial.polyval(NODES, coefficients).T
    path = path_from_samples(NODES, Pose(position, tumbling(NODES)))
    velocity = coefficients[1] + 2 * power * coefficients[2] + 3 * power**2 * coefficients[3]
    np.testing.assert_allclose(path.twist[:, :3], velocity, atol=1e-11)
    np.testing.assert_allclose(path.twist_rate[:, :3], 2 * coefficients[2] + 6 * power * coefficients[3], atol=1e-8)
    np.testing.assert_array_equal(path.pose.position, position)


def test_rates_of_a_sampled_quintic_path() -> None:
    stops = Pose.from_euler([(0.0, 0.0, 1.0), (2.0, 1.0, 1.5)], [0.0, 2.5], [0.0, -0.5], [0.0, 0.4])
    path = quintic_path(stops, durations=3.0, rate=100.0)
    again = path_from_samples(path.time, path.pose)
    np.testing.assert_allclose(again.twist, path.twist, atol=1e-5)
    np.testing.assert_allclose(again.twist_rate, path.twist_rate, atol=2e-3)


def test_the_sign_of_a_quaternion_has_no_influence() -> None:
    time = np.linspace(0.0, 4.0, 401)  # the z angle passes 360 degrees
    quaternion = Rotation.from_rotvec(np.outer(2.0 * time, [0.0, 0.0, 1.0])).as_quat()
    quaternion[np.random.default_rng(7).random(401) < 0.5] *= -1.0
    path = path_from_samples(time, Pose.from_quaternion(np.zeros((401, 3)), quaternion))
    np.testing.assert_allclose(path.twist[:, 3:], np.tile([0.0, 0.0, 2.0], (401, 1)), atol=1e-6)
    np.testing.assert_allclose(path.twist_rate[:, 3:], 0.0, atol=1e-3)


def test_two_samples_are_constant_velocity() -> None:
    path = path_from_samples([1.0, 3.0], Pose.from_euler([(0.0, 0.0, 0.0), (4.0, 0.0, -2.0)], 0.0, 0.0, np.zeros(2)))
    np.testing.assert_allclose(path.twist, np.tile([2.0, 0.0, -1.0, 0.0, 0.0, 0.0], (2, 1)), atol=1e-15)
    np.testing.assert_allclose(path.twist_rate, 0.0, atol=1e-15)


def test_the_stated_effect_of_rounded_positions() -> None:
    step, rounding = 0.01, 0.5e-6
    position = np.zeros((501, 3))
    position[:, 0] = rounding * (-1.0) ** np.arange(501)
    path = path_from_samples(np.arange(501) * step, Pose(position, Rotation.identity(501)))
    assert np.abs(path.twist_rate[50:-50, 0]).max() == pytest.approx(12 * rounding / step**2, rel=1e-6)


@pytest.mark.parametrize(
    ("time", "samples", "item"),
    [([0.0, 1.0, 1.0], 3, "time[2]"), ([0.0, np.nan], 2, "time[1]"), ([0.0, 1.0], 3, "pose"), ([0.0], 1, "pose")],
)
def test_bad_input_is_named(time: list[float], samples: int, item: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        path_from_samples(time, Pose(np.zeros((samples, 3)), Rotation.identity(samples)))
    assert caught.value.item == item
