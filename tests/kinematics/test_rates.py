"""Rates of lengths compared with differences of finely sampled plans, and with chord rates of straight cables."""

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array, Indices
from tests.kinematics.feasible import Variable
from tests.tension.reference import public_methods
from tests.tiers import extended, wide

SUSPENDED, MIXED = sl.load_robot("article-suspended"), sl.load_robot("article-mixed")
COGIRO, IPANEMA = sl.load_robot("cogiro"), sl.load_robot("ipanema-1")
WAYS = {
    "article-suspended": [(0.0, 0.0, 1.5), (4.0, 3.0, 1.5)],
    "article-mixed": [(0.0, 0.0, 1.5), (-4.0, 3.0, 3.0)],
    "cogiro": [(0.0, 0.0, 3.0), (4.0, 2.0, 3.0)],
    "ipanema-1": [(0.5, 0.4, 1.0), (-0.6, 0.3, 0.5)],
}


DURATIONS = {"article-suspended": 6.0, "article-mixed": 6.0, "cogiro": 6.0, "ipanema-1": 2.0}


def tour(robot: sl.Robot, rate: float, slower: float = 1.0) -> sl.Path:
    """From rest to rest with a rotation."""
    ends = sl.Pose.from_euler(WAYS[robot.name], [0.0, 0.1], [0.0, -0.04], [0.02, 0.0])
    return sl.septic_path(ends, durations=slower * DURATIONS[robot.name], rate=rate)


def part(path: sl.Path, index: Indices) -> sl.Path:
    assert path.jerk is not None
    return sl.Path(path.time[index], path.pose[index], path.twist[index], path.twist_rate[index], jerk=path.jerk[index])


def missed(rates: Array, expected: Array) -> Array:
    """Largest error of each sample relative to the largest rate."""
    error: Array = np.abs(rates - expected).max(axis=1) / np.nanmax(np.abs(expected))
    return error


@pytest.mark.parametrize("robot", [MIXED, IPANEMA], ids=lambda r: r.name)
@pytest.mark.parametrize("method", [kind for kind in public_methods().values() if kind is not sl.Closest])
def test_methods_without_memory(robot: sl.Robot, method: type[sl.TensionMethod]) -> None:
    if method().needs_upper_limits and np.isinf(robot.tension_max).any():
        robot = robot.replace(tension_max=5e3)
    step = 2e-4
    fine = tour(robot, 1.0 / step)
    index = np.arange(40, len(fine) - 40, 97)
    plan = sl.inverse(robot, part(fine, index), tension=method())
    rates = plan.length_rate
    assert rates is not None
    assert not rates.flags.writeable
    near = {d: sl.inverse(robot, part(fine, index + d), tension=method()) for d in (-2, -1, 1, 2)}
    lengths = {d: one.unstrained_length for d, one in near.items()}
    central = (4 * (lengths[1] - lengths[-1]) / (2 * step) - (lengths[2] - lengths[-2]) / (4 * step)) / 3
    known = plan.feasible & np.all([one.feasible for one in near.values()], axis=0)
    assert known.sum() > 50
    errors = missed(rates[known], central[known])
    # at a few samples the active limits change, and with them the rate
    assert (errors > 1e-8).sum() <= 2
    np.testing.assert_array_equal(np.isnan(rates).all(axis=1), ~plan.feasible)


def followed(robot: sl.Robot, method: sl.Closest) -> tuple[Array, Array, list[sl.Equilibrium]]:
    """Rates of `Closest` along a path, differences of single steps, and the states.

    A step from a state to an instant later, nearest to its tensions, and one twice as long: their slopes, extrapolated
    to no step at all, err by the square of the step.
    """
    step = 1e-4
    fine = tour(robot, 1.0 / step)
    rates, slopes, states = [], [], []
    plan = None
    for k in range(50, len(fine) - 50, len(fine) // 60):
        plan = sl.inverse(robot, part(fine, np.array([k])), tension=method, previous=plan)
        one, two = (
            sl.inverse(robot, part(fine, np.array([k + d])), tension=method, previous=plan).unstrained_length
            for d in (1, 2)
        )
        if np.isfinite(two).all() and plan.feasible.all():
            rate = plan.length_rate
            assert rate is not None
            rates.append(rate[0])
            slopes.append((2.0 * one - 0.5 * two - 1.5 * plan.unstrained_length)[0] / step)
            states.append(plan.state[0])
    return np.array(rates), np.array(slopes), states


def held_at(states: list[sl.Equilibrium], limit: Array, quantity: str = "chord_tension") -> Array:
    """Number of cables of each state at a limit."""
    tension = np.array([getattr(state.cables, quantity) for state in states])
    count: Array = np.isclose(tension, limit, rtol=1e-9).sum(axis=1)
    return count


@pytest.mark.parametrize("variable", wide(["chord", "horizontal", "frame_end"]))
@pytest.mark.parametrize(
    ("robot", "most"),
    wide([(MIXED, 2), (SUSPENDED, 0), (COGIRO, 0), (IPANEMA, 2)]),
    ids=lambda value: getattr(value, "name", ""),
)
def test_closest_follows_its_tensions(robot: sl.Robot, most: int, variable: Variable) -> None:
    rates, slopes, states = followed(robot, sl.Closest(variable))
    assert len(states) > 50
    assert held_at(states, robot.tension_min).max() == most
    errors = missed(rates, slopes)
    assert (errors > 5e-8).sum() <= 1  # another cable reaches its limit immediately afterwards


@pytest.mark.parametrize("limits_of", wide(["frame_end", "chord"]))
def test_cables_at_their_limits_stay_there(limits_of: str) -> None:
    robot = MIXED.replace(tension_limits_of=limits_of, tension_min=60.0)
    rates, slopes, states = followed(robot, sl.Closest())
    held = held_at(states, robot.tension_min, f"{limits_of}_tension")
    assert held.max() == 2
    assert (held > 0).sum() > 30
    assert (missed(rates, slopes) > 5e-8).sum() <= 1


@pytest.mark.parametrize(("robot", "margin"), wide([(SUSPENDED, 60.0), (MIXED, 60.0), (COGIRO, 300.0)]))
def test_the_lowest_point_bound_is_a_moving_limit(robot: sl.Robot, margin: float) -> None:
    rates, slopes, states = followed(robot, sl.Closest(lowest_point_margin=margin))
    cables = [state.cables for state in states]
    weight = np.array([0.5 * c.cable.linear_density * c.gravity * c.chord for c in cables])
    sine, cosine = (np.array([getattr(c, name) / c.chord for c in cables]) for name in ("rise", "span"))
    held = held_at(states, weight / np.abs(sine) + margin / cosine)
    assert (held > 0).sum() > 10
    assert (missed(rates, slopes) > 5e-8).sum() <= 1


@extended
@pytest.mark.parametrize("method", [sl.Closest(), sl.Closest("horizontal")], ids=lambda m: m.variable)
def test_rates_of_closest_converge_with_the_sampling(method: sl.TensionMethod) -> None:
    errors = []
    for step in (2e-3, 1e-3, 5e-4):
        plan = sl.inverse(COGIRO, tour(COGIRO, 1.0 / step), tension=method)
        central = (plan.unstrained_length[2:] - plan.unstrained_length[:-2]) / (2.0 * step)
        assert plan.length_rate is not None
        errors.append(missed(plan.length_rate[1:-1], central).max())
    assert errors[-1] < 1e-6
    assert errors[0] / errors[1] > 1.8
    assert errors[1] / errors[2] > 1.8


@pytest.mark.parametrize("model", wide([sl.Elastic(), sl.Empirical(), sl.Parabolic()]), ids=lambda m: type(m).__name__)
@pytest.mark.parametrize("method", wide([sl.MinimumNorm(), sl.Closest()]), ids=lambda m: type(m).__name__)
def test_other_models(model: sl.CableModel, method: sl.TensionMethod) -> None:
    step = 5e-4
    plan = sl.inverse(SUSPENDED, tour(SUSPENDED, 1.0 / step), model, method)
    central = (plan.unstrained_length[2:] - plan.unstrained_length[:-2]) / (2.0 * step)
    assert plan.length_rate is not None
    assert missed(plan.length_rate[1:-1], central).max() < 2e-6


@pytest.mark.parametrize("method", [sl.Closest(), sl.MinimumNorm()], ids=lambda m: type(m).__name__)
def test_a_straight_cable_winds_as_its_chord_changes(method: sl.TensionMethod) -> None:
    path = tour(COGIRO, 20.0)
    plan = sl.inverse(COGIRO, path, sl.Straight(), method)
    arm = path.pose.transform(COGIRO.platform_anchors) - path.pose.position[:, None]
    velocity = path.twist[:, None, :3] + np.cross(path.twist[:, None, 3:], arm)
    reach = path.pose.transform(COGIRO.platform_anchors) - COGIRO.frame_anchors
    expected = np.einsum("nij,nij->ni", reach, velocity) / np.linalg.norm(reach, axis=-1)
    assert plan.length_rate is not None
    np.testing.assert_allclose(plan.length_rate, expected, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("method", [sl.Closest(), sl.MinimumNorm()], ids=lambda m: type(m).__name__)
def test_a_cable_may_become_vertical(method: sl.TensionMethod) -> None:
    frame = [[1.0, 0, 4], [-3.0, 2, 4], [-3.0, -2, 4], [4.0, 2, 4], [4.0, -2, 4]]
    robot = sl.Robot("crane", frame, np.zeros((5, 3)), sl.Cable(0.1, 4e4), 20.0, motion_pattern="3T", tension_min=5.0)
    step = 1e-3
    plan = sl.inverse(robot, sl.septic_path([(-1, 0, 1), (3, 0, 1)], durations=4.0, rate=1.0 / step), tension=method)
    assert plan.feasible.all()
    assert plan.state.cables.span[2000, 0] < 1e-12
    central = (plan.unstrained_length[2:] - plan.unstrained_length[:-2]) / (2.0 * step)
    assert plan.length_rate is not None
    errors = missed(plan.length_rate[1:-1], central)
    assert errors[1990:2010].max() < 1e-5
    assert (errors > 1e-5).sum() <= 6


@pytest.mark.parametrize("method", wide([sl.MinimumNorm(), sl.Closest()]), ids=lambda m: type(m).__name__)
def test_a_changing_wrench_contributes_to_rates(method: sl.TensionMethod) -> None:
    step = 5e-4
    path = tour(COGIRO, 1.0 / step)
    shaken = np.sin(3.0 * path.time[:, None] + np.arange(6.0)) * [300.0, 300.0, 300.0, 50.0, 50.0, 50.0]
    plan = sl.inverse(COGIRO, path, tension=method, wrench=shaken)
    central = (plan.unstrained_length[2:] - plan.unstrained_length[:-2]) / (2.0 * step)
    assert plan.length_rate is not None
    assert missed(plan.length_rate[1:-1], central).max() < 2e-6
    steady = sl.inverse(COGIRO, path, tension=method).length_rate
    assert steady is not None
    assert missed(plan.length_rate, steady).max() > 1e-4


def test_a_changing_wrench_of_a_resting_platform() -> None:
    step = 1e-2
    dwell = sl.septic_path([(0, 0, 3.0), (0, 0, 3.0)], durations=2.0, rate=1.0 / step)
    shaken = np.sin(3.0 * dwell.time[:, None]) * [300.0, 0.0, 300.0, 50.0, 0.0, 0.0]
    plan = sl.inverse(COGIRO, dwell, wrench=shaken, tension=sl.MinimumNorm())
    first, second = ((np.roll(plan.unstrained_length, -k, 0) - np.roll(plan.unstrained_length, k, 0)) for k in (1, 2))
    central = (8.0 * first - second) / (12.0 * step)
    assert plan.length_rate is not None
    assert missed(plan.length_rate[2:-2], central[2:-2]).max() < 2e-6


def test_a_sampled_path_is_completed_by_a_spline() -> None:
    path = tour(COGIRO, 500.0)
    sampled = sl.path_from_samples(path.time, path.pose)
    exact, found = sl.inverse(COGIRO, path).length_rate, sl.inverse(COGIRO, sampled).length_rate
    assert exact is not None
    assert found is not None
    assert missed(found, exact)[5:-5].max() < 1e-6  # the third derivative of the spline is inaccurate at its ends
    assert missed(found, exact).max() < 1e-3
    two = sl.path_from_samples(path.time[:2], path.pose[:2])
    rates = sl.inverse(COGIRO, two).length_rate
    assert rates is not None
    assert np.isfinite(rates).all()


def test_rates_of_many_robots_are_those_of_each() -> None:
    path = tour(COGIRO, 10.0)
    robots = [COGIRO.replace(mass=COGIRO.mass * (1.0 + 0.01 * k)) for k in range(len(path))]
    for method in (sl.MinimumNorm(), sl.Closest()):
        rates = sl.inverse(robots, path, tension=method).length_rate
        assert rates is not None
        if not isinstance(method, sl.Closest):  # which remembers the robots before
            for i, robot in enumerate(robots):
                alone = sl.inverse(robot, path, tension=method).length_rate
                assert alone is not None
                np.testing.assert_allclose(rates[i], alone[i], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("robot", "way", "speed", "percent"),
    [
        (COGIRO, [(0, 0, 3), (4, 2, 3), (-3, 2, 2)], 1.0, 0.1),
        (IPANEMA, [(0, 0, 0.5), (0.5, 0.4, 1), (-0.6, 0.3, 0.5)], 2.0, 0.4),
        (SUSPENDED, [(0, 0, 1.5), (4, 3, 1.5), (-4, 3, 3)], 1.5, 0.8),
        (MIXED, [(0, 0, 1.5), (4, 3, 1.5), (-4, 3, 3)], 1.5, 3.8),
    ],
    ids=lambda value: getattr(value, "name", None),
)
def test_share_of_the_rate_due_to_changing_tensions(
    robot: sl.Robot, way: list[tuple[float, float, float]], speed: float, percent: float
) -> None:
    path = sl.septic_path(way, speed=speed)
    plan = sl.inverse(robot, path)
    rates = plan.length_rate
    assert rates is not None
    # lengths before and after, of cables with constant tensions
    h, kept = 1e-5, []
    for side in (-h, h):
        position = path.pose.position + side * path.twist[:, :3]
        reach = position[:, None] + robot.platform_anchors - robot.frame_anchors
        span = np.hypot(reach[..., 0], reach[..., 1])
        state = sl.Catenary().from_tension(robot.cables, span, reach[..., 2], plan.chord_tension, robot.gravity)
        kept.append(state.unstrained_length)
    share = np.abs(rates - (kept[1] - kept[0]) / (2.0 * h)).max() / np.abs(rates).max()
    assert round(100.0 * share, 1) == percent  # docs/model.md, section 7


def test_rates_of_a_slow_motion_are_accurate() -> None:
    fast, slow = (sl.inverse(COGIRO, tour(COGIRO, 10.0 / scale, scale), sl.Straight()) for scale in (1.0, 1e4))
    assert fast.length_rate is not None
    assert slow.length_rate is not None
    assert missed(1e4 * slow.length_rate, fast.length_rate).max() < 1e-8


def test_poses_have_no_rate_and_a_dwell_has_zero_rates() -> None:
    pose = sl.Pose.from_euler([[0, 0, 3.0], [1, 0, 3.0]], 0.0, 0.0, 0.0)
    assert sl.inverse(COGIRO, pose).length_rate is None
    assert sl.inverse(COGIRO, pose[0]).length_rate is None
    dwell = sl.septic_path([(0, 0, 3.0), (0, 0, 3.0)], durations=1.0, rate=5.0)
    for method in (sl.Closest(), sl.MinimumNorm()):
        rates = sl.inverse(COGIRO, dwell, tension=method).length_rate
        assert rates is not None
        np.testing.assert_allclose(rates, 0.0, atol=1e-9)


def test_a_plan_read_from_a_file_has_the_same_rates(tmp_path: object) -> None:
    from pathlib import Path

    file = Path(str(tmp_path)) / "run.nc"
    plan = sl.inverse(COGIRO, tour(COGIRO, 20.0))
    plan.save(file)
    np.testing.assert_array_equal(sl.load_plan(file).length_rate, plan.length_rate)
