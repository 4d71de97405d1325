import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from sagline import InvalidValueError, Path, Pose, quintic_path, septic_path
from sagline.motion.rest_to_rest import QUINTIC, SEPTIC, RestProfile
from tests.motion.differences import angular_velocity, slope
from tests.refusal import refused
from tests.tiers import extended

Maker = Callable[..., Path]
CORNERS = np.array([[0.0, 0.0, 1.0], [3.0, 4.0, 1.0], [3.0, 4.0, 3.0], [-1.0, 2.0, 0.5]])
ANGLES = np.radians([[0.0, 0.0, 0.0], [40.0, -30.0, 20.0], [-70.0, 10.0, 60.0], [15.0, 50.0, -25.0]])


def tour() -> Pose:
    return Pose.from_euler(CORNERS, *ANGLES.T)


def turn_angles() -> np.ndarray:
    """Angles [rad] from waypoint to waypoint of the tour, from the traces of the rotation matrices."""
    matrices = tour().rotation.as_matrix()
    traces = np.einsum("kij,kij->k", matrices[1:], matrices[:-1])
    angles: np.ndarray = np.arccos((traces - 1.0) / 2.0)
    return angles


def peak(path: Path, field: str, columns: slice) -> float:
    return float(np.linalg.norm(getattr(path, field)[:, columns], axis=1).max())


def test_position_is_the_published_polynomial() -> None:
    path = quintic_path([(0.0, 0.0, 0.0), (2.0, -4.0, 1.0)], durations=4.0, rate=4.0)
    # 10 s^3 - 15 s^4 + 6 s^5 at s = 1/4 and 3/4, by hand: 53/512 and 459/512
    np.testing.assert_allclose(path.pose.position[4], np.array([2.0, -4.0, 1.0]) * 53 / 512, rtol=1e-15)
    np.testing.assert_allclose(path.pose.position[12], np.array([2.0, -4.0, 1.0]) * 459 / 512, rtol=1e-15)
    np.testing.assert_allclose(path.twist[8, :3], np.array([2.0, -4.0, 1.0]) * 15 / 8 / 4, rtol=1e-15)


def test_twist_and_its_rate_are_the_derivatives_of_the_pose() -> None:
    step = 1e-3
    path = quintic_path(tour(), durations=[1.0, 2.0, 1.5], rate=1.0 / step)
    velocity = slope(path.pose.position, step)
    omega = angular_velocity(path.pose.quaternion, step)
    np.testing.assert_allclose(path.twist[1:-1, :3], velocity, atol=2e-4)
    np.testing.assert_allclose(path.twist[1:-1, 3:], omega, atol=2e-4)
    # the acceleration has a corner at waypoints, so differences across them have a first-order error
    np.testing.assert_allclose(path.twist_rate[1:-1], slope(path.twist, step), atol=0.15)
    inner = np.all([np.abs(path.time[1:-1] - t) > 2 * step for t in (1.0, 3.0)], axis=0)
    np.testing.assert_allclose(path.twist_rate[1:-1][inner], slope(path.twist, step)[inner], atol=3e-4)


@pytest.mark.parametrize(("make", "fifth"), [(quintic_path, 720.0), (septic_path, 10_080.0)])
def test_jerk_is_the_derivative_of_the_twist_rate(make: Maker, fifth: float) -> None:
    step = 1e-3
    most = (
        1.02 * step**2 / 6.0 * fifth * 5.0
    )  # error of differences: the fifth derivative of the profile, of 5 m in 1 s
    path = make(tour(), durations=[1.0, 2.0, 1.5], rate=1.0 / step)
    assert path.jerk is not None
    inner = np.all([np.abs(path.time[1:-1] - t) > 2 * step for t in (1.0, 3.0)], axis=0)
    np.testing.assert_allclose(path.jerk[1:-1][inner], slope(path.twist_rate, step)[inner], atol=most)
    assert np.abs(path.jerk).max() > 50.0
    # a tenth of the step gives a hundredth of the error
    fine = make(tour()[:2], durations=1.0, rate=10.0 / step)
    assert fine.jerk is not None
    np.testing.assert_allclose(fine.jerk[1:-1], slope(fine.twist_rate, 0.1 * step), atol=most / 100)


def test_the_septic_is_the_published_polynomial_and_its_twist_the_derivative() -> None:
    path = septic_path([(0.0, 0.0, 0.0), (2.0, -4.0, 1.0)], durations=4.0, rate=4.0)
    # 35 s^4 - 84 s^5 + 70 s^6 - 20 s^7 at s = 1/4 and 3/4, by hand: 289/4096 and 3807/4096
    np.testing.assert_allclose(path.pose.position[4], np.array([2.0, -4.0, 1.0]) * 289 / 4096, rtol=1e-14)
    np.testing.assert_allclose(path.pose.position[12], np.array([2.0, -4.0, 1.0]) * 3807 / 4096, rtol=1e-14)
    step = 1e-3
    path = septic_path(tour(), durations=[1.0, 2.0, 1.5], rate=1.0 / step)
    np.testing.assert_allclose(path.twist[1:-1, :3], slope(path.pose.position, step), atol=3e-4)
    np.testing.assert_allclose(path.twist[1:-1, 3:], angular_velocity(path.pose.quaternion, step), atol=3e-4)
    np.testing.assert_allclose(path.twist_rate[1:-1], slope(path.twist, step), atol=5e-3)  # also at waypoints


def test_the_jerk_of_a_septic_path_is_continuous_and_that_of_a_quintic_jumps() -> None:
    jumps = []
    for make in (quintic_path, septic_path):
        path = make(tour(), durations=[1.0, 2.0, 1.5], rate=1e4)
        assert path.jerk is not None
        jumps.append(np.abs(np.diff(path.jerk, axis=0)).max())
    assert jumps[0] > 100.0  # 60 distance/T^3 on both sides of a waypoint
    assert jumps[1] < 0.5  # 840 distance/T^4 per second
    path = septic_path(tour(), durations=[1.0, 2.0, 1.5], rate=100.0)
    stops = np.array([0, 100, 300, 450])
    for rates in (path.twist, path.twist_rate, path.jerk):
        assert rates is not None
        np.testing.assert_allclose(rates[stops], 0.0, atol=1e-11)
    np.testing.assert_allclose(path.pose.position[stops], CORNERS, atol=1e-15)


def test_at_a_waypoint_the_jerk_of_a_quintic_is_that_of_the_segment_that_begins() -> None:
    path = quintic_path([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 2.0, 0.0)], durations=[2.0, 4.0], rate=10.0)
    assert path.jerk is not None
    np.testing.assert_allclose(path.jerk[20, :3], [0.0, 60.0 * 2.0 / 4.0**3, 0.0], rtol=1e-13)


@pytest.mark.parametrize(("make", "profile"), [(quintic_path, QUINTIC), (septic_path, SEPTIC)])
def test_peaks_and_derivatives_of_a_profile(make: Maker, profile: RestProfile) -> None:
    path = make([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0)], durations=2.0, rate=5000.0)
    assert peak(path, "twist", slice(3)) == pytest.approx(profile.peak_speed * 5.0 / 2.0, rel=1e-12)
    assert peak(path, "twist_rate", slice(3)) == pytest.approx(profile.peak_acceleration * 5.0 / 4.0, rel=1e-6)
    published = {2: (15 / 8, 10 / np.sqrt(3.0)), 3: (35 / 16, 84 * np.sqrt(5.0) / 25)}[profile.order]
    assert (profile.peak_speed, profile.peak_acceleration) == pytest.approx(published, rel=1e-15)
    s = np.linspace(0.0, 1.0, 101)
    power = np.polynomial.Polynomial([0.0] * (profile.order + 1) + list(profile.tail))
    np.testing.assert_allclose(profile.share(s), power(s), atol=1e-14)
    for order, rates in enumerate(profile.rates(s), start=1):
        np.testing.assert_allclose(rates, power.deriv(order)(s), atol=1e-11)
        if order <= profile.order:
            np.testing.assert_array_equal(rates[[0, -1]], 0.0)


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"speed": 1.5}, 35 / 16 * 5.0 / 1.5),
        ({"acceleration": 0.5}, np.sqrt(84 / (5 * np.sqrt(5.0)) * 5.0 / 0.5)),
    ],
)
def test_limits_of_a_septic_path(limits: dict[str, float], expected: float) -> None:
    path = septic_path([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0)], **limits, rate=2000.0)
    assert path.duration == pytest.approx(expected, rel=1e-15)
    reached = {"speed": peak(path, "twist", slice(3)), "acceleration": peak(path, "twist_rate", slice(3))}
    for name, limit in limits.items():
        assert limit * (1 - 1e-5) <= reached[name] <= limit * (1 + 1e-12)


def test_difference_error_falls_with_the_square_of_the_step() -> None:
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        path = quintic_path(tour()[:2], durations=1.0, rate=1.0 / step)
        errors.append(np.abs(path.twist[1:-1, 3:] - angular_velocity(path.pose.quaternion, step)).max())
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


def test_orientation_turns_about_one_axis_and_not_by_euler_angles() -> None:
    path = quintic_path(tour(), durations=1.0, rate=100.0)
    first = path.twist[1:100, 3:]
    axes = first / np.linalg.norm(first, axis=1, keepdims=True)
    np.testing.assert_allclose(axes, np.broadcast_to(axes[0], axes.shape), atol=1e-12)
    turned = (path.pose.rotation[50] * path.pose.rotation[0].inv()).magnitude()
    assert turned == pytest.approx(turn_angles()[0] / 2.0, rel=1e-13)


def test_every_waypoint_is_met_at_rest() -> None:
    path = quintic_path(tour(), durations=[1.0, 2.0, 1.5], rate=100.0)
    stops = np.array([0, 100, 300, 450])
    np.testing.assert_allclose(path.time[stops], [0.0, 1.0, 3.0, 4.5], rtol=1e-15)
    np.testing.assert_allclose(path.pose.position[stops], CORNERS, atol=1e-15)
    error = (path.pose.rotation[stops] * tour().rotation.inv()).magnitude()
    np.testing.assert_allclose(error, 0.0, atol=1e-15)
    np.testing.assert_allclose(path.twist[stops], 0.0, atol=1e-12)
    np.testing.assert_allclose(path.twist_rate[stops], 0.0, atol=1e-12)


def test_peaks_of_a_segment() -> None:
    path = quintic_path([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0)], durations=2.0, rate=5000.0)
    assert peak(path, "twist", slice(3)) == pytest.approx(15 / 8 * 5.0 / 2.0, rel=1e-12)
    assert peak(path, "twist_rate", slice(3)) == pytest.approx(10 / np.sqrt(3) * 5.0 / 4.0, rel=1e-6)


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({"speed": 1.5}, 15 / 8 * 5.0 / 1.5),
        ({"acceleration": 0.5}, np.sqrt(10 / np.sqrt(3) * 5.0 / 0.5)),
        ({"speed": 1.5, "acceleration": 0.5}, np.sqrt(10 / np.sqrt(3) * 5.0 / 0.5)),
        ({"speed": 0.5, "acceleration": 0.5}, 15 / 8 * 5.0 / 0.5),
    ],
)
def test_limits_give_the_shortest_duration(limits: dict[str, float], expected: float) -> None:
    path = quintic_path([(0.0, 0.0, 0.0), (3.0, 4.0, 0.0)], **limits)
    assert path.duration == pytest.approx(expected, rel=1e-15)


def test_the_slower_of_translation_and_rotation_decides_segment_by_segment() -> None:
    limits = {"speed": 1.0, "acceleration": 0.8, "angular_speed": 0.4, "angular_acceleration": 0.3}
    path = quintic_path(tour(), **limits, rate=2000.0)
    distances, angles = np.array([5.0, 2.0, np.sqrt(16.0 + 4.0 + 6.25)]), turn_angles()
    candidates = np.array(
        [
            15 / 8 * distances / 1.0,
            np.sqrt(10 / np.sqrt(3) * distances / 0.8),
            15 / 8 * angles / 0.4,
            np.sqrt(10 / np.sqrt(3) * angles / 0.3),
        ]
    )
    assert set(candidates.argmax(axis=0)) >= {0, 2}  # the example has both cases
    assert path.duration == pytest.approx(candidates.max(axis=0).sum(), rel=1e-13)
    peaks = [peak(path, field, columns) for columns in (slice(3), slice(3, 6)) for field in ("twist", "twist_rate")]
    ratios = np.array(peaks) / list(limits.values())
    assert (ratios <= 1.0 + 1e-12).all()
    assert ratios[[0, 2]] == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize(("total", "samples"), [(1.0, 101), (0.996, 101), (1.004, 102), (0.013, 3), (0.29, 30)])
def test_the_grid_ends_exactly_at_the_end(total: float, samples: int) -> None:
    path = quintic_path([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], durations=total, rate=100.0)
    assert len(path) == samples
    assert path.time[-1] == total
    np.testing.assert_array_equal(path.time[:-1], np.arange(samples - 1) / 100.0)
    np.testing.assert_array_equal(path.pose.position[-1], [1.0, 0.0, 0.0])
    np.testing.assert_array_equal(path.twist[-1], 0.0)


@pytest.mark.parametrize("durations", [[0.003, 1.0], [1.0, 0.003], [0.01, 1.0], [1.0, 1e-9]])
@pytest.mark.parametrize("make", [quintic_path, septic_path])
def test_a_motion_without_a_sample_is_refused(make: Maker, durations: list[float]) -> None:
    k = int(np.argmin(durations))
    with refused(f"the time from waypoints[{k}] to waypoints[{k + 1}]", kind=InvalidValueError) as caught:
        make(CORNERS[:3], durations=durations, rate=100.0)
    assert caught.value.value.startswith(f"{durations[k]:g} s, ")
    dwell = [CORNERS[0], CORNERS[1], CORNERS[1]] if k else [CORNERS[0], CORNERS[0], CORNERS[1]]
    assert len(make(dwell, durations=durations, rate=100.0)) >= 101  # a rest needs no sample


def test_the_grid_is_one_for_all_segments() -> None:
    path = quintic_path(CORNERS, durations=[0.123, 0.234, 0.345], rate=100.0)
    np.testing.assert_allclose(path.time[:-1], np.arange(71) / 100.0, rtol=1e-15)
    assert path.time[-1] == pytest.approx(0.702, rel=1e-15)


def test_a_waypoint_given_twice_is_a_dwell() -> None:
    path = quintic_path([(1.0, 2.0, 3.0), (1.0, 2.0, 3.0), (2.0, 2.0, 3.0)], durations=[0.5, 1.0], rate=10.0)
    np.testing.assert_array_equal(path.pose.position[:6], np.tile([1.0, 2.0, 3.0], (6, 1)))
    np.testing.assert_array_equal(path.twist[:6], 0.0)
    assert path.duration == 1.5


def test_a_half_turn_is_about_one_axis() -> None:
    half = Pose.from_euler([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], [0.0, np.pi], 0.0, 0.0)
    path = quintic_path(half, durations=1.0, rate=10.0)
    assert path.pose.rotation[5].magnitude() == pytest.approx(np.pi / 2.0, rel=1e-14)
    np.testing.assert_allclose(path.twist[:, 3:5], 0.0, atol=1e-14)
    assert (path.pose.rotation[10] * half.rotation[1].inv()).magnitude() < 1e-15


def test_batch_sequence_and_positions_are_the_same_waypoints() -> None:
    flat = Pose.from_euler(CORNERS, 0.0, 0.0, np.zeros(4))
    one_by_one = [Pose.from_euler(corner, 0.0, 0.0, 0.0) for corner in CORNERS]
    paths = [quintic_path(w, speed=1.0, rate=20.0) for w in (flat, one_by_one, CORNERS, CORNERS.tolist())]
    for path in paths[1:]:
        np.testing.assert_array_equal(path.pose.position, paths[0].pose.position)
        np.testing.assert_array_equal(path.pose.quaternion, paths[0].pose.quaternion)
    np.testing.assert_array_equal(paths[2].pose.quaternion, np.tile([0.0, 0.0, 0.0, 1.0], (len(paths[2]), 1)))


def test_blocks_are_continuous() -> None:
    path = quintic_path(tour(), durations=[1.0, 2.0, 1.5], rate=40_000.0)
    every_hundredth = quintic_path(tour(), durations=[1.0, 2.0, 1.5], rate=400.0)
    assert len(path) == 180_001
    np.testing.assert_allclose(path.twist_rate[::100], every_hundredth.twist_rate, atol=1e-9)
    np.testing.assert_allclose(path.pose.quaternion[::100], every_hundredth.pose.quaternion, atol=1e-14)


@extended
def test_memory_is_that_of_the_path_and_one_copy() -> None:
    stops = tour()
    tracemalloc.start()
    path = quintic_path(stops, durations=[1.0, 2.0, 1.5], rate=100_000.0)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert path.jerk is not None
    rates = (path.twist, path.twist_rate, path.jerk)
    size = sum(a.nbytes for a in (path.time, path.pose.position, path.pose.quaternion, *rates))
    assert size == 450_001 * 208
    assert peak < 2.5 * size


TWO = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]


def test_both_profiles_refuse_the_same() -> None:
    for make in (quintic_path, septic_path):
        with refused("the timing of the path", "missing"):
            make(TWO)


@pytest.mark.parametrize(
    ("waypoints", "options", "item"),
    [
        (TWO, {}, "the timing of the path"),
        (TWO, {"durations": 1.0, "speed": 1.0}, "the timing of the path"),
        (TWO, {"durations": 0.0}, "durations"),
        (TWO, {"durations": [1.0, 2.0]}, "durations"),
        (CORNERS, {"durations": [1.0, 0.0, 1.0]}, "durations[1]"),
        (CORNERS, {"durations": [1.0, np.nan, 1.0]}, "durations[1]"),
        (TWO, {"speed": 0.0}, "speed"),
        (TWO, {"speed": -1.0}, "speed"),
        (TWO, {"speed": [1.0, 2.0]}, "speed"),
        (TWO, {"acceleration": np.nan}, "acceleration"),
        (TWO, {"angular_speed": 1.0}, "the limit of speed"),
        (TWO, {"speed": 1.0, "angular_acceleration": 0.0}, "angular_acceleration"),
        (tour(), {"speed": 1.0}, "the limit of angular_speed"),
        ([TWO[0], TWO[1], TWO[1]], {"speed": 1.0}, "waypoints[2]"),
        (TWO, {"durations": 1.0, "rate": 0.0}, "rate"),
        (TWO, {"durations": 1.0, "rate": np.inf}, "rate"),
        (TWO, {"durations": 1e9, "rate": 1000.0}, "the number of samples"),
        (TWO[:1], {"durations": 1.0}, "waypoints"),
        (TWO[0], {"durations": 1.0}, "waypoints"),
        ([], {"durations": 1.0}, "waypoints"),
        ([(0.0, 0.0, np.nan), (1.0, 0.0, 0.0)], {"durations": 1.0}, "waypoints[0, 2]"),
        (Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0), {"durations": 1.0}, "waypoints"),
    ],
)
def test_bad_input_is_named(waypoints: object, options: dict[str, object], item: str) -> None:
    with pytest.raises(InvalidValueError) as caught:
        quintic_path(waypoints, **options)  # type: ignore[arg-type]
    assert caught.value.item == item


def test_rounding_of_an_orientation_needs_no_angular_limit() -> None:
    pose = Pose(CORNERS, Rotation.from_euler("ZYX", np.tile([0.3, 0.2, 0.1], (4, 1)) + 1e-16))
    wobble = Pose.from_euler(CORNERS, 0.3 + np.array([0.0, 1e-15, 0.0, -1e-15]), 0.2, 0.1)
    assert quintic_path(wobble, speed=1.0).duration == pytest.approx(quintic_path(pose, speed=1.0).duration, rel=1e-14)
