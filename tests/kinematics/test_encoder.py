"""Encoder counts in both directions: layers, remembered winding, temperature and creep."""

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline import Plan
from sagline.article.ten_poses import tour
from sagline.robot.drum import Drums
from tests.kinematics.winches import wound
from tests.refusal import refused
from tests.tiers import extended

POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.0, 0.0, 0.0)


@pytest.fixture(scope="module")
def robot() -> sl.Robot:
    return wound()


@pytest.fixture(scope="module")
def plan(robot: sl.Robot) -> sl.Plan:
    return sl.inverse(robot, sl.quintic_path([(0, 0, 1.5), (3, 1, 2.5), (-3, -1, 1.5)], durations=3.0, rate=20.0))


def test_a_million_counts_are_recovered_over_four_layers(robot: sl.Robot) -> None:
    drums = Drums(robot)
    assert drums.most[0] == pytest.approx(80.0)
    rng = np.random.default_rng(5)
    turns = rng.uniform(0.0, 80.0, (125_000, 8))
    counts = np.rint(drums.counts(drums.lengths(turns)))
    length = sl.lengths_from_counts(robot, counts)
    back = drums.counts(length * (1.0 + drums.rest_strain))
    assert counts.size == 1_000_000
    np.testing.assert_array_equal(np.rint(back), counts)
    assert np.abs(back - counts).max() < 1e-6
    assert [np.ptp(counts[:, i]) > 79.9 * 12 * 4096 for i in range(2)] == [True, True]


def test_a_plan_is_recovered_to_half_a_count(robot: sl.Robot, plan: sl.Plan) -> None:
    counts = sl.encoder_counts(plan)
    np.testing.assert_array_equal(counts, np.rint(counts))
    back = sl.lengths_from_counts(robot, counts)
    half = 0.5 * 2.0 * np.pi * (0.05 + 3 * 0.0035) / (12 * 4096)
    assert 0.5 * half < np.abs(back - plan.unstrained_length).max() < half
    np.testing.assert_array_equal(sl.encoder_counts(sl.inverse(robot, plan.state.pose[0])), counts[0])


def test_one_layer_with_a_fixed_exit_is_linear() -> None:
    robot = wound(drum_width=None, layers=None, drum_distance=None, cable_length=None, gear=-3.0)
    plan = sl.inverse(robot, POSE)
    turns = (plan.unstrained_length * (1.0 + 160.0 / robot.cables.axial_stiffness) - 10.0) / np.hypot(
        2.0 * np.pi * 0.05, 0.004
    )
    np.testing.assert_array_equal(sl.encoder_counts(plan), np.rint(1e5 - turns * 3.0 * 4096))


def test_the_sign_of_the_gear_is_that_of_counts(plan: sl.Plan) -> None:
    counts = sl.encoder_counts(plan)
    with np.errstate(invalid="ignore"):
        way = np.sign(np.diff(counts, axis=0)) * np.sign(np.diff(plan.unstrained_length, axis=0))
    assert set(way[:, 0].tolist()) <= {1.0, 0.0}
    assert set(way[:, 1].tolist()) <= {-1.0, 0.0}


def test_counts_at_the_home_pose_are_the_given_ones(robot: sl.Robot) -> None:
    read = np.arange(8) * 1000.0 - 3500.0
    at_home = sl.inverse(robot, POSE)
    tension = at_home.state.cables.frame_end_tension
    zeroed = sl.home(robot, POSE, tension, read, temperature=10.0)
    np.testing.assert_array_equal(sl.encoder_counts(sl.inverse(zeroed, POSE), temperature=10.0), read)
    np.testing.assert_allclose(
        sl.lengths_from_counts(zeroed, read, temperature=10.0), at_home.unstrained_length, rtol=1e-13
    )
    assert robot.winches is not None
    np.testing.assert_array_equal(robot.winches.count_zero, np.full(8, 1e5))  # the given robot is unchanged


@pytest.mark.parametrize("name", ["cogiro", "article-prototype", "article-mixed", "ipanema-1"])
@pytest.mark.parametrize(
    "winch",
    [
        sl.Winch(),
        sl.Winch(0.05, dead_cable=5.0, dead_rise=4.0),
        sl.Winch(0.05, swivel_axis=[0.0, 0.0, -1.0], dead_cable=5.0, dead_rise=-1.0),
    ],
    ids=["bare", "from below", "from above"],
)
@pytest.mark.parametrize("model", [sl.Catenary(), sl.Elastic(), sl.Parabolic()], ids=["exact", "elastic", "parabolic"])
def test_homing_finds_the_lengths_of_a_plan_from_its_tensions(name: str, winch: sl.Winch, model: sl.CableModel) -> None:
    robot = sl.load_robot(name).replace(winches=winch)
    assert robot.test_box is not None
    box = robot.test_box
    pose = sl.Pose(box.low + 0.4 * (box.high - box.low), np.eye(3))
    plan = sl.inverse(robot, pose, model)
    winches = sl.home(robot, pose, plan.state.cables.frame_end_tension, model=model).winches
    assert winches is not None
    assert winches.length_zero is not None
    np.testing.assert_allclose(winches.length_zero, plan.unstrained_length, rtol=1e-12)


@extended
def test_counts_with_pulleys_and_dead_length_give_the_pose() -> None:
    behind: dict[str, Any] = {
        "pulley_radius": 0.05,
        "dead_cable": 5.0,
        "dead_rise": 4.0,
        "cable_length": 33.0,
        "counts_per_turn": 1e7,
    }
    robot = wound(**behind)
    read = sl.inverse(robot, POSE).state.cables.frame_end_tension
    robot = sl.home(robot, POSE, read, 12345.0)
    poses = sl.Pose.from_euler([[1.0, 1.0, 2.0], [-2.0, 0.5, 2.5], [3.0, -1.0, 1.5]], 0.0, 0.0, 0.0)
    counts = sl.encoder_counts(sl.inverse(robot, poses))
    np.testing.assert_array_equal(counts[0], np.full(8, 12345.0))
    found = sl.forward(robot, sl.lengths_from_counts(robot, counts), start=poses)
    assert found.solved.all()
    np.testing.assert_allclose(found.pose.position, poses.position, rtol=0.0, atol=1e-8)


def test_warm_cables_are_longer(robot: sl.Robot, plan: sl.Plan) -> None:
    counts = sl.encoder_counts(plan)
    lengths = sl.lengths_from_counts(robot, counts)
    warm = sl.lengths_from_counts(robot, counts, temperature=np.arange(8.0))
    np.testing.assert_allclose(warm / lengths - 1.0, np.broadcast_to(1.2e-5 * np.arange(8.0), warm.shape), atol=1e-15)
    back = sl.lengths_from_counts(robot, sl.encoder_counts(plan, temperature=25.0), temperature=25.0)
    np.testing.assert_allclose(back, plan.unstrained_length, rtol=0.0, atol=4e-6)


def test_crept_cables_are_longer(robot: sl.Robot, plan: sl.Plan) -> None:
    creep = sl.Creep(3e5, 2.0)
    assert plan.path is not None
    strain = creep.strain(plan.path.time, plan.chord_tension)
    back = sl.lengths_from_counts(robot, sl.encoder_counts(plan, creep=creep)) * (1.0 + strain)
    assert strain.max() > 1e-3
    np.testing.assert_allclose(back, plan.unstrained_length, rtol=0.0, atol=4e-6)


def test_creep_over_pulleys_is_that_of_the_chord_tension() -> None:
    """Over wide pulleys the free cable has another chord, and a slightly different chord tension."""
    robot = wound(pulley_radius=0.3, counts_per_turn=1e9)
    plan = sl.inverse(robot, sl.quintic_path([(0, 0, 1.5), (3, 1, 2.5)], durations=3.0, rate=20.0))
    creep = sl.Creep(3e4, 2.0)
    assert plan.path is not None
    off = 1.0 + creep.strain(plan.path.time, plan.state.cables.chord_tension)
    crept = sl.lengths_from_counts(robot, sl.encoder_counts(plan, creep=creep))
    longer = 1.0 + creep.strain(plan.path.time, plan.chord_tension)
    np.testing.assert_allclose(crept * longer, plan.unstrained_length, rtol=0.0, atol=1e-9)
    assert np.abs(crept * off - plan.unstrained_length).max() > 1e-8


def test_remembered_winding_in_both_directions(robot: sl.Robot, plan: sl.Plan) -> None:
    counts = sl.encoder_counts(plan, "remembered")
    assert np.abs(counts - sl.encoder_counts(plan)).max() > 10.0
    tension = sl.winch_rates(plan).drum_tension
    back = sl.lengths_from_counts(robot, counts, "remembered", drum_tension=tension)
    np.testing.assert_allclose(back, plan.unstrained_length, rtol=0.0, atol=4e-6)


def effect_of_remembered_winding(plan: Plan, winding_tension: float) -> float:
    """Largest difference of lengths along a plan due to remembered winding [m]."""
    robot = plan.state.one_robot
    winch = sl.Winch(
        drum_radius=0.05,
        groove_pitch=0.006,
        counts_per_turn=1e8,
        length_zero=4.0,
        winding_tension=winding_tension,
    )
    there = robot.replace(cables=robot.cables.replace(diameter=0.002), winches=winch)
    along = sl.inverse(there, plan.path, plan.state.cables.model, plan.tension)  # type: ignore[arg-type]
    np.testing.assert_array_equal(along.unstrained_length, plan.unstrained_length)
    off = sl.lengths_from_counts(there, sl.encoder_counts(along, "remembered"))
    return float(np.abs(off - plan.unstrained_length).max())


def test_remembered_winding_changes_lengths_of_the_prototype_by_twelve_millimeters() -> None:
    plan, _ = tour()
    tension = plan.state.cables.frame_end_tension
    assert (tension.min(), tension.max()) == pytest.approx((71.0, 768.0), abs=0.5)
    assert plan.state.one_robot.cables.axial_stiffness == pytest.approx(14e3)
    # wound at the mean tension of the home pose, and at that of the whole path
    assert 1e3 * effect_of_remembered_winding(plan, tension[0].mean()) == pytest.approx(10.8, abs=0.1)
    assert 1e3 * effect_of_remembered_winding(plan, tension.mean()) == pytest.approx(13.6, abs=0.1)


def test_poses_without_lengths_have_no_counts(robot: sl.Robot) -> None:
    poses = sl.Pose.from_euler([[1.0, 1.0, 2.0], [30.0, 0.0, 2.0], [0.0, 1.0, 2.0]], 0.0, 0.0, 0.0)
    counts = sl.encoder_counts(sl.inverse(robot, poses))
    assert np.isnan(counts).all(axis=1).tolist() == [False, True, False]
    assert np.isnan(sl.lengths_from_counts(robot, counts)).all(axis=1).tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("changes", "parts", "step"),
    [
        (
            {"drum_radius": None, "groove_pitch": None},
            ("the robot", "without winches: drum_radius, groove_pitch"),
            "",
        ),
        ({"drum_width": None}, ("winches: drum_width", "not given"), ""),
        ({"cable_length": None}, ("winches: cable_length", "not given"), ""),
        ({"layers": None, "cable_length": None}, ("winches: cable_length", "not given"), ""),
        ({"counts_per_turn": None}, ("winches: counts_per_turn", "not given", "one value, or one per cable"), ""),
        ({"length_zero": None}, ("winches: length_zero", "not given"), "home(robot, pose, frame_end"),
        ({"drum_width": 0.003}, ("winches: drum_width[0]", "0.003 m", ">= 0.004 m, its groove_pitch"), ""),
        ({"layers": 5000}, ("winches: layers", "5000", "1 to 1000"), ""),
        ({"layers": 2}, ("winches: length_zero[0]", "10 m", "14.9963 to 27.999 m"), "2 layers, 40 turns"),
        ({"length_zero": 30.0}, ("winches: length_zero[0]", "30 m", "0.252534 to 27.999 m"), "28 m of cable"),
        (
            {"cable_length": 13.0},
            ("sample 1, cable 0: unstrained length", "14.5248 m", "0 to 12.996 m"),
            "13 m of cable",
        ),
        (
            {"cable_length": 37.0, "length_zero": 13.0},
            ("sample 0, cable 1: unstrained length", "9.17849 m", "9.25042 to 36.9905 m"),
            "4 layers, 80 turns",
        ),
    ],
)
def test_missing_or_inconsistent_arguments_are_named(
    changes: dict[str, Any], parts: tuple[str, ...], step: str
) -> None:
    poses = sl.Pose.from_euler([[0.0, 0.0, 2.0], [4.0, 3.0, 2.0]], 0.0, 0.0, 0.0)
    with refused(*parts, kind=sl.InvalidValueError) as caught:
        sl.encoder_counts(sl.inverse(wound(**changes), poses))
    assert step in caught.value.next_step


def test_missing_winches_or_diameters_are_named() -> None:
    robot = sl.load_robot("cogiro")
    with refused("the robot", "without winches: drum_radius, groove_pitch, cables: diameter"):
        sl.encoder_counts(sl.inverse(robot, POSE))
    thin = wound().replace(cables=robot.cables)
    with refused("cables: diameter", "not given"):
        sl.lengths_from_counts(thin, np.zeros(8))
    with refused("winches", "not given") as caught:
        sl.home(robot, POSE, 300.0)
    assert "winches=Winch(" in caught.value.next_step
    cold = wound().replace(cables=robot.cables.replace(diameter=0.004))
    with refused("cables: expansion", "not given"):
        sl.lengths_from_counts(cold, np.full(8, 1e5), temperature=3.0)


def test_counts_beyond_the_drum_are_refused_with_the_limit(robot: sl.Robot) -> None:
    counts = np.full((3, 8), 1e5)
    counts[2, 1] = -5e6
    with refused("sample 2, cable 1: count", "-5000000") as caught:
        sl.lengths_from_counts(robot, counts)
    low, high = (float(word) for word in caught.value.allowed.split(" to "))
    for end in (low, high):  # up to the limit in the message
        counts[2, 1] = end
        sl.lengths_from_counts(robot, counts)
    for end in (low - 1.0, high + 1.0):
        counts[2, 1] = end
        with refused("sample 2, cable 1: count", f"{end:.0f}"):
            sl.lengths_from_counts(robot, counts)


@pytest.mark.parametrize("tension", [1e-3, 1.0])
def test_tensions_below_the_least_catenary_tension_are_refused(robot: sl.Robot, tension: float) -> None:
    run = POSE.transform(robot.platform_anchors)[0] - robot.frame_anchors[0]
    span, rise = float(np.hypot(*run[:2])), float(run[2])
    cable = sl.Cable(robot.cables.linear_density[0], robot.cables.axial_stiffness[0])
    least = min(
        float(sl.Catenary().from_tension(cable, span, rise, tau, robot.gravity).frame_end_tension)
        for tau in np.linspace(2.0, 4.0, 2001)
    )
    with refused("cable 0: frame_end_tension", f"{tension:g} N") as caught:
        sl.home(robot, POSE, tension)
    told = float(caught.value.allowed.split()[1])
    assert least <= told <= 1.0003 * least


def test_remembered_winding_requires_tensions(robot: sl.Robot) -> None:
    with refused("drum_tension", "not given") as caught:
        sl.lengths_from_counts(robot, np.full(8, 1e5), "remembered")
    assert "winch_rates(plan).drum_tension" in caught.value.next_step
    with refused("drum_tension", "given"):
        sl.lengths_from_counts(robot, np.full(8, 1e5), drum_tension=np.ones(8))
    with refused("creep", "given for a plan without a path"):
        sl.encoder_counts(sl.inverse(robot, POSE), creep=sl.Creep(1e6, 1.0))


def test_counts_with_a_negative_length_are_refused() -> None:
    robot = wound(drum_width=None, layers=None, drum_distance=None, cable_length=None)
    counts = np.array(sl.encoder_counts(sl.inverse(robot, POSE)))
    step = (sl.lengths_from_counts(robot, counts + 1e4) - sl.lengths_from_counts(robot, counts))[3] / 1e4
    counts[3] -= (sl.lengths_from_counts(robot, counts)[3] + 2.5) / step
    with refused("cable 3: count", kind=sl.InvalidValueError) as caught:
        sl.lengths_from_counts(robot, counts)
    assert "-2.5" in caught.value.value
