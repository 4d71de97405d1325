from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog

import sagline as sl
from sagline import structure_matrix
from sagline.dynamics.trajectories.profiles import (
    ForceBalance,
    HalfPlanes,
    fastest_with_jerk,
    fastest_within,
)
from sagline.dynamics.trajectories.segments import segments_of
from tests.refusal import refused
from tests.tiers import extended, wide

ALONG_X = [(0.0, 0.0, 1.5), (3.0, 0.0, 1.5)]
TURNING = [
    sl.Pose.from_euler((0.0, 0.0, 1.5), 0.0, 0.0, 0.0),
    sl.Pose.from_euler((2.0, 1.0, 2.0), 0.1, 0.05, -0.2),
    sl.Pose.from_euler((2.0, 1.0, 2.0), 0.0, 0.0, 0.0),
]


@pytest.fixture(scope="module")
def suspended() -> sl.Robot:
    return sl.load_robot("article-suspended")


@pytest.fixture(scope="module")
def cogiro() -> sl.Robot:
    return sl.load_robot("cogiro")


def within(robot: sl.Robot, margin: float) -> sl.Robot:
    return robot.replace(tension_min=robot.tension_min + margin, tension_max=robot.tension_max - margin)


def faster_motion(path: sl.Path, factor: float) -> sl.Path:
    """The same motion in a fraction of its time."""
    return sl.Path(path.time * factor, path.pose, path.twist / factor, path.twist_rate / factor**2)


def shortest_quintic(robot: sl.Robot, waypoints: list[tuple[float, float, float]], margin: float) -> float:
    """By bisection, with 500 samples each."""
    low, high = 0.2, 10.0
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        path = sl.quintic_path(waypoints, durations=middle, rate=500.0 / middle)
        if sl.inverse(within(robot, margin), path).feasible.all():
            high = middle
        else:
            low = middle
    return high


def arc(rate: float = 100.0) -> sl.Path:
    time = np.arange(round(4.0 * rate) + 1) / rate
    s = time / 4.0
    angle = (10 * s**3 - 15 * s**4 + 6 * s**5) * 0.5 * np.pi
    position = np.stack((2.0 * np.cos(angle), 2.0 * np.sin(angle), 2.0 + 0.2 * angle), axis=1)
    return sl.path_from_samples(time, sl.Pose.from_euler(position, 0.05 * angle, 0.02 * angle, 0.1 * angle))


@pytest.mark.parametrize(("margin", "known"), wide([(5.0, (0.877, 1.142)), (0.0, (0.858, 1.118))]))
def test_it_is_faster_than_the_shortest_quintic(suspended: sl.Robot, margin: float, known: tuple[float, float]) -> None:
    """By the ratios of a study without a margin; docs/howto/without-vibration.md has the numbers."""
    quick = sl.fastest(suspended, sl.quintic_path(ALONG_X, durations=2.0), margin)
    quintic = shortest_quintic(suspended, ALONG_X, margin)
    assert quick.duration < 0.78 * quintic
    assert (quick.duration, quintic) == pytest.approx(known, abs=2e-3)


CASES = list(product(("line", "turning", "arc", "frame end", "pulleys"), (None, 100.0)))
QUICK = [("line", 100.0)]
LONGER = [("turning", None), ("arc", 100.0), ("frame end", None), ("pulleys", None)]


@pytest.mark.parametrize(
    ("kind", "jerk"),
    [
        *wide(QUICK + LONGER, first=len(QUICK)),
        *(pytest.param(*case, marks=pytest.mark.soak) for case in CASES if case not in QUICK + LONGER),
    ],
)
def test_limits_hold_exactly_and_are_reached(cogiro: sl.Robot, kind: str, jerk: float | None) -> None:
    robot = cogiro
    if kind == "frame end":
        robot = robot.replace(tension_limits_of="frame_end", tension_max=800.0, tension_min=30.0)
    if kind == "pulleys":
        robot = robot.replace(winches=sl.Winch(0.05, dead_cable=4.0))
    path = {"line": sl.quintic_path([(-1, 0, 1.5), (2, 1, 2)], durations=3.0), "arc": arc()}.get(
        kind, sl.quintic_path(TURNING, durations=4.0)
    )
    quick = sl.fastest(robot, path, margin=8.0, jerk=jerk)
    limited = within(robot, 8.0)
    assert sl.inverse(limited, quick).feasible.all()
    assert quick.rests is not None
    np.testing.assert_allclose(quick.twist[[0, -1]], 0.0, atol=1e-9)
    for k in (0, -1):
        np.testing.assert_allclose(quick.pose.position[k], path.pose.position[k], atol=1e-9)
        np.testing.assert_allclose(quick.pose.matrix[k], path.pose.matrix[k], atol=1e-9)
    if jerk is None:
        assert quick.jerk is None
        assert not sl.inverse(limited, faster_motion(quick, 0.995)).feasible.all()
    else:
        assert quick.jerk is not None
        sizes = np.linalg.norm(quick.jerk[:, :3], axis=1)
        assert sizes.max() <= jerk * (1.0 + 1e-9)
        assert sizes.max() > 0.99 * jerk
        h = np.diff(quick.time)[0]
        there = (quick.twist_rate[1:-1] - quick.twist_rate[:-2])[:, :3] / h  # rates of its samples
        assert np.linalg.norm(there, axis=1).max() <= jerk * 1.001


def test_it_stays_on_the_curve(cogiro: sl.Robot) -> None:
    quick = sl.fastest(cogiro, arc())
    x, y, z = quick.pose.position.T
    angle = np.arctan2(y, x)
    np.testing.assert_allclose(np.hypot(x, y), 2.0, atol=1e-9)
    np.testing.assert_allclose(z, 2.0 + 0.2 * angle, atol=1e-9)
    h = np.diff(quick.time)[0]
    np.testing.assert_allclose(
        quick.twist[1:-2, :3], (quick.pose.position[2:-1] - quick.pose.position[:-3]) / (2 * h), atol=0.06
    )


@pytest.mark.parametrize(
    ("name", "goal", "distance"),
    wide(
        [
            ("jerk", sl.Pose.from_euler((0.3, 0.4, 1.5), 0, 0, 0), 0.5),
            ("angular_jerk", sl.Pose.from_euler((0, 0, 1.5), 0, 0, 0.05), 0.05),
        ]
    ),
)
def test_the_time_with_only_a_jerk_limit_is_exact(name: str, goal: sl.Pose, distance: float) -> None:
    """A quarter of the time at each of +J, -J, -J, +J gives a distance of J T^3/32."""
    path = sl.quintic_path([sl.Pose.from_euler((0, 0, 1.5), 0, 0, 0), goal], durations=2.0)
    limit: dict[str, Any] = {name: 2.0}
    quick = sl.fastest(sl.load_robot("ipanema-1"), path, **limit)
    assert quick.duration == pytest.approx(np.cbrt(32.0 * distance / 2.0), rel=1e-6)


@extended
def test_a_high_jerk_limit_approaches_the_fastest_motion(suspended: sl.Robot) -> None:
    path = sl.quintic_path(ALONG_X, durations=2.0)
    least = sl.fastest(suspended, path).duration
    times = [sl.fastest(suspended, path, jerk=jerk).duration for jerk in (300.0, 1000.0)]
    assert times == sorted(times, reverse=True)
    assert least < times[-1] < 1.025 * least


@pytest.mark.parametrize("jerk", wide([None, 50.0]))
def test_winch_speeds_stay_within_limits(cogiro: sl.Robot, jerk: float | None) -> None:
    winch = sl.Winch(drum_radius=0.06, groove_pitch=0.006, gear=10.0, speed_limit=300.0)
    robot = cogiro.replace(winches=winch, cables=cogiro.cables.replace(diameter=0.004))
    path = sl.quintic_path([(-1, 0, 1.5), (2, 1, 2)], durations=3.0)
    quick = sl.fastest(robot, path, jerk=jerk)
    speed = np.abs(sl.winch_rates(sl.inverse(within(robot, 5.0), quick)).motor_speed)
    assert quick.duration > 1.1 * sl.fastest(cogiro, path, jerk=jerk).duration
    if jerk is None:  # except for the stretch of the cables at jumps of the acceleration
        assert np.median(np.sort(speed.max(axis=1))[-50:]) == pytest.approx(300.0, rel=0.05)
    else:
        assert 270.0 < speed.max() <= 300.0


@extended
@pytest.mark.parametrize("jerk", [None, 60.0])
def test_winches_with_only_a_radius_stay_within_speed_limits(jerk: float | None) -> None:
    """The speed limit of the prototype, 15 rad/s of its drums of 30 mm, and a lower one."""
    robot = sl.load_robot("article-prototype")
    path = sl.quintic_path([(-0.3, 0, 1.0), (0.4, 0.2, 1.2)], durations=3.0)
    assert robot.winches is not None
    assert robot.winches.groove_pitch is None
    free = sl.fastest(robot.replace(winches=robot.winches.replace(speed_limit=None)), path, jerk=jerk)
    assert sl.fastest(robot, path, jerk=jerk).duration >= free.duration
    slow = robot.replace(winches=robot.winches.replace(speed_limit=100.0))
    quick = sl.fastest(slow, path, jerk=jerk)
    rate = sl.inverse(within(slow, 5.0), quick).length_rate
    assert rate is not None
    fastest = np.abs(rate).max(axis=1) / (100.0 / 20.0 * 0.03)
    assert quick.duration > 1.1 * free.duration
    if jerk is None:
        assert np.median(np.sort(fastest)[-50:]) == pytest.approx(1.0, rel=0.05)
    else:
        assert 0.9 < fastest.max() <= 1.0 + 1e-6


def test_a_speed_limit_needs_a_radius(cogiro: sl.Robot) -> None:
    robot = cogiro.replace(winches=sl.Winch(speed_limit=300.0))
    with refused("winches: drum_radius", "not given"):
        sl.fastest(robot, sl.quintic_path([(-1, 0, 1.5), (2, 1, 2)], durations=3.0))


@pytest.mark.parametrize("seed", wide(range(4)))
def test_half_planes_agree_with_linear_programs(cogiro: sl.Robot, seed: int) -> None:
    """The maximum in any direction of (u, x) over tensions is the maximum over the half planes."""
    rng = np.random.default_rng(seed)
    robot = cogiro.replace(center_of_mass=(0.05, 0.02, -0.1), tension_max=900.0)
    if seed == 3:
        robot = robot.replace(tension_max=np.inf)
    move = segments_of(arc())[0]
    assert move.curve is not None
    jet = move.curve.at(rng.uniform(0.0, 1.0, 3))
    balances = ForceBalance.at(robot, jet, sl.inverse(robot, jet.pose))
    planes = balances.half_planes()
    matrix = structure_matrix(robot, jet.pose)
    for k in range(3):
        said = np.isfinite(planes.bound[k])
        for _ in range(8):
            c = rng.normal(size=2) * (0.1, 1.0)
            box = [(-50.0, 50.0), (-50.0, 50.0)]
            two = linprog(-c, planes.rates[k][said], planes.bound[k][said], bounds=box)
            equal = np.hstack((balances.wrenches[:, k].T, matrix[k]))
            limits = [*box, *zip(balances.low[k], balances.high[k], strict=True)]
            whole = linprog(np.append(-c, np.zeros(8)), A_eq=equal, b_eq=balances.standing[k], bounds=limits)
            assert two.fun == pytest.approx(whole.fun, rel=1e-7, abs=1e-7)


def test_profiles_of_constant_bounds_are_known() -> None:
    place, a, b, v = np.linspace(0.0, 1.0, 101), 2.0, 4.0, 0.8

    def planes(*rows: tuple[float, float, float]) -> HalfPlanes:
        every = np.repeat(np.array(rows)[None], len(place), axis=0)
        return HalfPlanes(every[..., :2], every[..., 2])

    bang = fastest_within(place, planes((1.0, 0.0, a), (-1.0, 0.0, a)))
    assert bang is not None
    assert bang.x[-1] == pytest.approx(2.0 / np.sqrt(a), rel=1e-12)
    held = fastest_within(place, planes((1.0, 0.0, a), (-1.0, 0.0, b), (0.0, 1.0, v**2)))
    assert held is not None
    expected = 1.0 / v + 0.5 * v * (1.0 / a + 1.0 / b)  # two ramps and a part at full speed
    assert held.x[-1] == pytest.approx(expected, rel=2e-3)  # the ramps end between grid points
    assert fastest_within(place, planes((-1.0, 0.0, -1.0))) is None  # only acceleration is possible
    time = np.linspace(0.0, bang.x[-1], 9)
    np.testing.assert_allclose(bang(time[:5]), 0.5 * a * time[:5] ** 2, rtol=1e-12)


@pytest.mark.parametrize("jerk", wide([None, 100.0]))
def test_dwells_are_kept_and_progress_is_reported(suspended: sl.Robot, jerk: float | None) -> None:
    stops = [(0, 0, 1.5), (1, 0, 1.5), (1, 0, 1.5), (1, 1, 1.5)]
    told: list[tuple[int, int]] = []
    path = sl.quintic_path(stops, durations=(2.0, 0.7, 2.0))
    quick = sl.fastest(suspended, path, jerk=jerk, progress=lambda done, of: told.append((done, of)))
    assert quick.rests is not None
    assert np.diff(quick.rests)[1] == pytest.approx(0.7)
    assert told == [(1, 3), (2, 3), (3, 3)]
    middle = (quick.time > quick.rests[1]) & (quick.time < quick.rests[2])
    assert not quick.twist[middle].any()


def test_impossible_motions_are_refused(suspended: sl.Robot) -> None:
    path = sl.quintic_path(ALONG_X, durations=2.0)
    for name, value in (("margin", -1.0), ("jerk", 0.0), ("jerk", np.nan), ("angular_jerk", -2.0)):
        bad: dict[str, Any] = {name: value}
        with refused(name):
            sl.fastest(suspended, path, **bad)
    with refused("margin", "10000 N", "< 987.5 N, half the range of cable 0"):
        sl.fastest(suspended, path, margin=1e4)
    with refused("the move from 0 s to 2 s at rest", "infeasible at (1.95, 0, 1.5) m"):
        sl.fastest(suspended, path, margin=100.0)
    time = np.linspace(0.0, 1.0, 11)
    position = np.stack((time, 0.0 * time, 0.0 * time + 1.5), axis=1)
    moving = sl.path_from_samples(time, sl.Pose.from_euler(position, 0.0, 0.0, 0.0))
    with refused("the path at its begin", "in motion, at 1 m/s and 0 rad/s"):
        sl.fastest(suspended, moving)


@pytest.mark.parametrize("kind", ["chord", "frame end", "pulleys"])
def test_the_boundary_of_the_polygon_agrees_with_inverse(cogiro: sl.Robot, kind: str) -> None:
    """Heavy cables: the largest acceleration, by bisection with `inverse`, is that of the polygon after iterations."""
    robot = cogiro.replace(cables=sl.Cable(0.3, 5e5), tension_min=100.0, tension_max=1500.0)
    if kind == "frame end":
        robot = robot.replace(tension_limits_of="frame_end")
    if kind == "pulleys":
        robot = robot.replace(winches=sl.Winch(0.05, dead_cable=4.0))
    move = segments_of(arc())[0]
    assert move.curve is not None
    jet = move.curve.at(np.array([0.1, 0.5, 0.8]))
    balances = ForceBalance.at(robot, jet, sl.inverse(robot, jet.pose))
    for sign in (1.0, -1.0):
        low, high = np.zeros(3), np.full(3, 50.0)
        for _ in range(40):
            middle = 0.5 * (low + high)
            wrench = balances.wrench(np.stack((sign * middle, 0.0 * middle), axis=1))
            held = sl.inverse(robot, jet.pose, wrench=wrench).feasible
            low, high = np.where(held, middle, low), np.where(held, high, middle)
        border = np.stack((sign * low, 0.0 * low), axis=1)
        planes = balances.near_motion(border).half_planes()
        along = sign * planes.rates[..., 0]
        found = np.min(np.where(along > 1e-9, planes.bound / np.where(along > 1e-9, along, 1.0), np.inf), axis=1)
        np.testing.assert_allclose(found, low, rtol=1e-4)


def test_bounds_hold_at_both_ends_of_every_step() -> None:
    rng = np.random.default_rng(5)
    place = np.linspace(0.0, 1.0, 61)
    for _ in range(20):
        normals = rng.normal(size=(9, 2)) + 0.3 * np.sin(rng.uniform(2.0, 9.0, (1, 9, 1)) * place[:, None, None])
        box = np.broadcast_to([[1.0, 0.0], [-1.0, 0.0]], (len(place), 2, 2))
        planes = HalfPlanes(
            np.hstack((normals, box)), np.full((len(place), 11), 1.0) * [*rng.uniform(0.5, 2.0, 9), 5, 5]
        )
        profile = fastest_within(place, planes)
        assert profile is not None
        for k in range(len(place) - 1):
            for end in (k, k + 1):
                point = np.array([profile(profile.x[k], 2), profile(profile.x[end], 1) ** 2])
                assert (planes.rates[end] @ point <= planes.bound[end] + 1e-9).all()


def test_a_forced_deceleration_requires_an_entry_speed() -> None:
    """In the second half it decelerates by 1 or more, so it must enter with a square of 1 or more."""
    place = np.linspace(0.0, 1.0, 101)
    for most, possible in ((0.5, False), (1.5, True)):
        up = np.where(place < 0.5, most, -1.0)
        rates = np.broadcast_to([[1.0, 0.0], [-1.0, 0.0]], (101, 2, 2))
        profile = fastest_within(place, HalfPlanes(rates.copy(), np.stack((up, np.full(101, 8.0)), axis=1)))
        assert (profile is not None) == possible


@extended
def test_the_jerk_on_a_curve_ends_within_its_limit(cogiro: sl.Robot) -> None:
    move = segments_of(arc())[0]
    assert move.curve is not None
    robot = cogiro.replace(tension_max=5000.0)

    def free(parameter: np.ndarray) -> HalfPlanes:
        return HalfPlanes(np.zeros((parameter.size, 0, 2)), np.zeros((parameter.size, 0)))

    course = fastest_with_jerk(move.curve, robot, free, (20.0, np.inf), 0.5)
    assert course is not None
    motion = np.stack([course(np.linspace(0.0, course.x[-1], 2001), order) for order in range(4)])
    jerk = np.linalg.norm(move.curve.at(motion[0]).twists(motion)[2, :, :3], axis=1)
    assert np.sort(jerk)[-20] == pytest.approx(20.0, rel=5e-3)
    assert jerk.max() < 20.0 * 1.005


@pytest.mark.soak
@pytest.mark.parametrize("name", sl.robot_names())
@pytest.mark.parametrize("seed", range(3))
def test_every_preset_moves_within_its_limits(name: str, seed: int) -> None:
    robot = sl.load_robot(name)
    box, rng = robot.test_box, np.random.default_rng(seed)
    if box is None:
        pytest.fail("a preset without a box")
    middle, half = 0.5 * (box.low + box.high), 0.25 * (box.high - box.low)
    stops = middle + rng.uniform(-1.0, 1.0, (3, 3)) * half
    path = sl.quintic_path(stops, durations=3.0, rate=200.0)
    slow = sl.quintic_path(stops, durations=1000.0, rate=1.0)
    held = sl.inverse(within(robot, 1.0), slow).feasible.all()
    for jerk in (None, 50.0):
        if not held:
            with pytest.raises(sl.InvalidValueError, match="move from"):
                sl.fastest(robot, path, margin=1.0, jerk=jerk)
            continue
        quick = sl.fastest(robot, path, margin=1.0, jerk=jerk)
        assert sl.inverse(within(robot, 1.0), quick).feasible.all()
        if jerk is not None:
            assert quick.jerk is not None
            assert np.linalg.norm(quick.jerk[:, :3], axis=1).max() <= jerk * (1.0 + 1e-9)
