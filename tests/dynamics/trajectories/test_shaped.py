import pickle
from itertools import pairwise

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from sagline.dynamics.trajectories.segments import _SplineCurve, piecewise, segments_of
from tests.motion.differences import angular_velocity, slope
from tests.refusal import refused

STOPS = [
    sl.Pose.from_euler(*stop)
    for stop in (
        ((0.0, 0.0, 1.5), 0.0, 0.0, 0.0),
        ((3.0, 1.0, 1.5), 0.1, 0.2, -0.3),
        ((3.0, 1.0, 1.5), 0.1, 0.2, -0.3),  # a dwell
        ((3.0, 1.0, 1.5), 0.5, 0.2, -0.3),  # only rotation
        ((0.0, 1.0, 2.5), 0.5, 0.2, -0.3),  # only translation
    )
]
OFF_GRID = (1.2345, 0.5, 1.71, 2.0)
ON_GRID = (1.25, 0.5, 1.75, 2.0)
NOTHING = sl.Shaper([0.0], [1.0])


def there(array: Array | None) -> Array:
    assert array is not None
    return array


@pytest.mark.parametrize("make", [sl.quintic_path, sl.septic_path])
@pytest.mark.parametrize("durations", [OFF_GRID, ON_GRID])
def test_one_impulse_changes_nothing(make: type, durations: tuple[float, ...]) -> None:
    path = make(STOPS, durations=durations, rate=100.0)
    again = sl.shaped(path, NOTHING)
    np.testing.assert_array_equal(there(again.rests), there(path.rests))
    np.testing.assert_array_equal(again.time, path.time)
    np.testing.assert_allclose(again.pose.position, path.pose.position, atol=1e-13)
    np.testing.assert_allclose(again.pose.quaternion, path.pose.quaternion, atol=1e-13)
    np.testing.assert_allclose(again.twist, path.twist, atol=1e-11)
    np.testing.assert_allclose(again.twist_rate, path.twist_rate, atol=1e-8)
    np.testing.assert_allclose(there(again.jerk)[:-1], there(path.jerk)[:-1], atol=1e-5)  # at rest at the very end


def test_a_straight_motion_is_the_sum_of_delayed_ones() -> None:
    shaper, T = sl.ZV([1.7, 2.9]), 2.0
    path = sl.quintic_path([(0, 0, 1.5), (3, 0, 1.5)], durations=T, rate=100.0)
    calm = sl.shaped(path, shaper)
    s = np.clip((calm.time[:, None] - shaper.time) / T, 0.0, 1.0)
    np.testing.assert_allclose(
        calm.pose.position[:, 0], 3.0 * (10 * s**3 - 15 * s**4 + 6 * s**5) @ shaper.amplitude, atol=1e-13
    )
    speed = 3.0 / T * 30.0 * (s * (1 - s)) ** 2 @ shaper.amplitude
    rate = 3.0 / T**2 * 60.0 * s * (1 - s) * (1 - 2 * s) @ shaper.amplitude
    np.testing.assert_allclose(calm.twist[:, 0], speed, atol=1e-12)
    np.testing.assert_allclose(calm.twist_rate[:, 0], rate, atol=1e-10)
    assert calm.duration == pytest.approx(T + shaper.duration)
    assert not calm.twist[:, 1:].any()


@pytest.mark.parametrize("durations", [OFF_GRID, ON_GRID])
def test_each_segment_is_shaped_separately(durations: tuple[float, ...]) -> None:
    shaper = sl.ZVD(2.5)
    path = sl.septic_path(STOPS, durations=durations, rate=200.0)
    calm = sl.shaped(path, shaper)
    longer = np.array(durations) + shaper.duration * np.array([1, 0, 1, 1])  # the duration of a dwell is unchanged
    np.testing.assert_allclose(there(calm.rests), np.append(0.0, np.cumsum(longer)), atol=1e-12)
    # on each segment the platform is on the line between its waypoints, rotated about their axis
    which = np.minimum(np.searchsorted(there(calm.rests)[1:], calm.time, side="right"), 3)
    for k, (a, b) in enumerate(pairwise(STOPS)):
        part = calm.pose[which == k]
        move = b.position - a.position
        off = np.cross(part.position - a.position, move)
        assert np.abs(off).max() < 1e-12
        turn = (b.rotation * a.rotation.inv()).as_rotvec()
        turned = (part.rotation * a.rotation.inv()).as_rotvec()
        assert np.abs(np.cross(turned, turn)).max() < 1e-12
    # and the rates are those of the poses
    h = 1.0 / 200.0
    quiet = np.ones(len(calm) - 3, dtype=bool)  # the last step is shorter
    centers = calm.time[1:-2]
    np.testing.assert_allclose(calm.twist[1:-2, :3], slope(calm.pose.position[:-1], h)[quiet], atol=2e-3)
    np.testing.assert_allclose(calm.twist[1:-2, 3:], angular_velocity(calm.pose.quaternion[:-1], h), atol=1e-3)
    np.testing.assert_allclose(calm.twist_rate[1:-2], slope(calm.twist[:-1], h), atol=2e-2)
    inside = np.abs(centers[:, None] - there(calm.rests)).min(axis=1) > 2 * h
    np.testing.assert_allclose(there(calm.jerk)[1:-2][inside], slope(calm.twist_rate[:-1], h)[inside], atol=1.0)


def arc(rate: float, radius: float = 2.0) -> sl.Path:
    """A quarter circle with rotation and tilt of the platform, from rest to rest in 2 s."""
    time = np.arange(round(2.0 * rate) + 1) / rate
    s = time / 2.0
    angle = (10 * s**3 - 15 * s**4 + 6 * s**5) * 0.5 * np.pi
    position = np.stack((radius * np.cos(angle), radius * np.sin(angle), 1.5 + 0.2 * angle), axis=1)
    return sl.path_from_samples(time, sl.Pose.from_euler(position, 0.3 * angle, 0.1 * angle**2, angle))


def test_on_a_curve_the_platform_stays_on_it() -> None:
    off = []
    for rate in (50.0, 100.0):
        calm = sl.shaped(arc(rate), sl.ZVD(1.5))
        x, y, z = calm.pose.position.T
        angle = np.arctan2(y, x)
        there = sl.Pose.from_euler(calm.pose.position, 0.3 * angle, 0.1 * angle**2, angle)
        turned = np.abs((there.rotation * calm.pose.rotation.inv()).as_rotvec()).max()
        off.append(max(np.abs(np.hypot(x, y) - 2.0).max(), np.abs(z - 1.5 - 0.2 * angle).max(), turned))
        h = 1.0 / rate
        np.testing.assert_allclose(calm.twist[1:-2, :3], slope(calm.pose.position[:-1], h), atol=30.0 * h**2)
        np.testing.assert_allclose(calm.twist[1:-2, 3:], angular_velocity(calm.pose.quaternion[:-1], h), atol=9 * h**2)
        np.testing.assert_allclose(calm.twist_rate[1:-2], slope(calm.twist[:-1], h), atol=400.0 * h**2)
        assert calm.duration == pytest.approx(2.0 + 1.0 / 1.5)
    assert off[0] < 1e-6
    assert off[1] < 0.05 * off[0] or off[1] < 1e-9


def test_the_length_along_a_curve_is_convolved() -> None:
    shaper = sl.ZV(1.5)
    calm = sl.shaped(arc(200.0), shaper)
    s = np.clip((calm.time[:, None] - shaper.time) / 2.0, 0.0, 1.0)
    angle = (10 * s**3 - 15 * s**4 + 6 * s**5) @ shaper.amplitude * 0.5 * np.pi
    x, y, _ = calm.pose.position.T
    # 0.1 angle^2 increases the length per radian along the arc: the length is shaped, not the angle
    np.testing.assert_allclose(np.arctan2(y, x), angle, atol=5e-3)
    plain = sl.path_from_samples(
        arc(200.0).time, sl.Pose.from_euler(arc(200.0).pose.position * [1, 1, 0] + [0, 0, 1.5], 0.0, 0.0, 0.0)
    )
    calm = sl.shaped(plain, shaper)
    np.testing.assert_allclose(np.arctan2(calm.pose.position[:, 1], calm.pose.position[:, 0]), angle, atol=2e-6)


def test_sampled_paths_rest_at_constant_samples() -> None:
    path = sl.quintic_path(STOPS, durations=ON_GRID, rate=100.0)
    bare = sl.Path(path.time, path.pose, path.twist, path.twist_rate, path.jerk)
    known, found = sl.shaped(path, sl.ZV(2.0)), sl.shaped(bare, sl.ZV(2.0))
    np.testing.assert_allclose(found.pose.position[-1], known.pose.position[-1], atol=1e-12)
    dwell = slice(1, 3)  # all samples of the dwell are at rest
    np.testing.assert_allclose(there(found.rests)[[0, 1, -3, -2, -1]], there(known.rests)[[0, 1, 2, 3, 4]], atol=1e-9)
    assert there(known.rests)[dwell].size == 2


def test_paths_that_cannot_be_shaped_are_refused() -> None:
    path = sl.quintic_path([(0, 0, 1.5), (3, 0, 1.5)], durations=2.0, rate=20.0)
    with refused("the shaper's frequency", "10.1 Hz", "<= 10 Hz, half the path's sample rate"):
        sl.shaped(path, sl.ZV(2.0) * sl.ZV(10.1))
    time = np.linspace(0.0, 1.0, 21)
    line = np.outer(time, [1.0, 0.0, 0.0])
    moving = sl.path_from_samples(time, sl.Pose.from_euler(line * time[:, None], 0.0, 0.0, 0.0))
    with refused("the path at its end", "in motion, at 2 m/s and 0 rad/s"):
        sl.shaped(moving, sl.ZV(2.0))
    time = np.linspace(0.0, 1.0, 401)
    swing = np.sin(np.pi * time)[:, None] ** 4 * [1.0, 0.0, 0.0]
    there_and_back = sl.path_from_samples(time, sl.Pose.from_euler(swing, 0.0, 0.0, 0.0))
    with refused("the path at 0.5 s"):
        sl.shaped(there_and_back, sl.ZV(2.0))
    one = path.pose[:1]
    with refused("path", "of one sample"):
        sl.shaped(sl.Path([0.0], one, np.zeros((1, 6)), np.zeros((1, 6))), sl.ZV(2.0))
    with refused("shaper", "'a ZV'", "a Shaper"):
        sl.shaped(path, "a ZV")  # type: ignore[arg-type]


def test_rests_are_kept_and_checked() -> None:
    path = sl.quintic_path(STOPS, durations=OFF_GRID, rate=100.0)
    np.testing.assert_allclose(there(path.rests), np.append(0.0, np.cumsum(OFF_GRID)))
    np.testing.assert_array_equal(there(pickle.loads(pickle.dumps(path)).rests), there(path.rests))
    for rests in ([0.0, 1.0], [0.0, 3.0, 2.0, path.time[-1]], [path.time[-1]], [[0.0]]):
        with pytest.raises(sl.InvalidValueError, match="rests"):
            sl.Path(path.time, path.pose, path.twist, path.twist_rate, path.jerk, rests)


@pytest.mark.parametrize(("known", "at_end"), [(3, 3), (3, 2), (4, 4), (4, 3)])
def test_piecewise_polynomials_are_exact_up_to_their_degree(known: int, at_end: int) -> None:
    rng = np.random.default_rng(3)
    polynomial = np.polynomial.Polynomial(rng.normal(size=known + at_end))
    knots = np.array([0.0, 0.3, 0.35, 1.0])
    derivatives = [polynomial if k == 0 else polynomial.deriv(k) for k in range(8)]
    values = np.stack([derivatives[k](knots) for k in range(known)])
    values[at_end:, -1] = np.nan
    found = piecewise(knots, values, at_end)
    place = np.linspace(-0.1, 1.1, 50)
    for order in range(4):
        np.testing.assert_allclose(found(place, order), derivatives[order](place), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("make", "close"), [(sl.quintic_path, 1e-12), (sl.septic_path, 1e-10)])
@pytest.mark.parametrize("durations", [OFF_GRID, ON_GRID])
def test_motions_between_samples_are_the_original_polynomials(
    make: type, close: float, durations: tuple[float, ...]
) -> None:
    coarse, fine = (make(STOPS, durations=durations, rate=rate) for rate in (50.0, 1000.0))
    which = np.minimum(np.searchsorted(there(fine.rests)[1:], fine.time, side="right"), 3)
    for k, move in enumerate(segments_of(coarse)):
        part = which == k
        if move.curve is None:
            assert not fine.twist[part].any()
            continue
        motion = move.rates(fine.time[part] - move.begin)
        jet = move.curve.at(motion[0])
        np.testing.assert_allclose(jet.pose.position, fine.pose.position[part], rtol=0.0, atol=close)
        np.testing.assert_allclose(jet.pose.matrix, fine.pose.matrix[part], rtol=0.0, atol=close)
        np.testing.assert_allclose(jet.twists(motion)[0], fine.twist[part], rtol=0.0, atol=300.0 * close)


def test_the_rates_of_a_curve_are_those_of_its_poses() -> None:
    """By differences: each rate is the slope of the previous one, along the parameter and in time."""
    s = np.linspace(0.0, 1.0, 201)
    position = np.stack((np.sin(2 * s), np.cos(3 * s), s**3), axis=1)
    curve = _SplineCurve(sl.Pose.from_euler(position, 0.4 * np.sin(2 * s), 0.5 * s**2, 1.5 * s), s)
    h = 1e-4
    place = np.linspace(0.2, 0.8, 7)[:, None] + h * np.arange(-1, 2)
    jets = [curve.at(column) for column in place.T]
    turned = (jets[2].pose.rotation * jets[0].pose.rotation.inv()).as_rotvec() / (2 * h)
    np.testing.assert_allclose(jets[1].rates[0, :, 3:], turned, atol=1e-6)
    for order in range(2):
        difference = (jets[2].rates[order] - jets[0].rates[order]) / (2 * h)
        np.testing.assert_allclose(jets[1].rates[order + 1], difference, atol=2e-4)

    def twists(time: np.ndarray) -> np.ndarray:
        motion = np.stack((0.3 + 0.2 * np.sin(time), 0.2 * np.cos(time), -0.2 * np.sin(time), -0.2 * np.cos(time)))
        return curve.at(motion[0]).twists(motion)

    time = np.linspace(0.0, 2.0, 9)
    before, now, after = (twists(time + shift) for shift in (-h, 0.0, h))
    np.testing.assert_allclose(now[1:], (after - before)[:2] / (2 * h), atol=1e-5)
