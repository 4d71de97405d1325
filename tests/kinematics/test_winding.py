"""Forward of inverse with guides and friction, along paths and in files; refusals."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.winches import wound
from tests.refusal import refused
from tests.tension.reference import random_poses
from tests.tiers import extended, wide


def eyelets(robot: sl.Robot) -> Array:
    """From a drum on the floor outside, over an eyelet, to an eyelet above the frame anchor."""
    top = robot.frame_anchors
    out = top * np.array([1.1, 1.1, 0.0])
    ways = (out, np.array([0.3, 0.2, 0.1])), (out, np.array([0.0, 0.0, 2.5])), (top, np.array([0.0, 0.1, 0.4]))
    found: Array = np.stack([place + way for place, way in ways], axis=1)
    return found


def machine(name: str, **fields: Any) -> sl.Robot:
    robot = sl.load_robot(name)
    given = {"pulley_radius": 0.05, "pulley_friction": 0.1, "rolling_friction": 0.02, "guides": eyelets(robot)}
    winch = sl.Winch(**{key: value for key, value in {**given, **fields}.items() if value is not None})
    return robot.replace(winches=winch, tension_min=60.0)


CASES: list[dict[str, Any]] = [
    {},
    {"pulley_radius": 0.0},
    {"swivel_axis": [0.0, 0.0, -1.0]},
    {"guides": None, "dead_cable": 4.0, "dead_rise": 3.0},
    {"guides": None, "pulley_friction": 0.3},
]


@extended
@pytest.mark.parametrize("name", ["cogiro", "article-prototype"])
@pytest.mark.parametrize("fields", CASES)
def test_lengths_with_friction_and_guides_give_the_pose(name: str, fields: dict[str, Any]) -> None:
    robot, rng = machine(name, **fields), np.random.default_rng(5)
    poses = random_poses(robot, 12, rng)
    for winding in (None, rng.integers(-1, 2, (12, robot.cable_count)).astype(float), np.ones(robot.cable_count)):
        plan = sl.inverse(robot, poses, winding=winding)
        kept = plan.feasible
        assert kept.sum() > 4
        assert sl.confirm(plan).position_error[kept].max() < 1e-11
        wide = None if winding is None else np.broadcast_to(winding, plan.chord_tension.shape)[kept]
        near = sl.Pose(poses.position[kept] + rng.normal(0.0, 0.05, (kept.sum(), 3)), poses.rotation[kept])
        for start in (near, None):  # a search may find another equilibrium of the same lengths
            found = sl.forward(robot, plan.unstrained_length[kept], start=start, winding=wide)
            assert found.solved.all()
            lengths = found.state.unstrained_length
            np.testing.assert_allclose(lengths, plan.unstrained_length[kept], rtol=0.0, atol=5e-12)
            if start is not None:
                assert np.abs(found.pose.position - poses.position[kept]).max() < 1e-11


@extended
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("name", ["cogiro", "article-prototype"])
def test_high_friction_converges(name: str, sign: float) -> None:
    """Five radians at 0.3: the tension ratio is 4.5, for which simple iterations do not converge."""
    robot = machine(name, pulley_friction=0.3)
    poses, winding = random_poses(robot, 12, np.random.default_rng(5)), np.full(robot.cable_count, sign)
    plan = sl.inverse(robot, poses, winding=winding)
    kept = plan.feasible
    assert kept.sum() > 4
    assert sl.confirm(plan).position_error[kept].max() < 1e-11
    found = sl.forward(robot, plan.unstrained_length[kept], poses[kept], winding=winding)
    assert found.solved.all()  # other poses with the same lengths are near
    np.testing.assert_allclose(found.state.unstrained_length, plan.unstrained_length[kept], rtol=0.0, atol=5e-12)


@extended
def test_a_single_sample_and_a_chain_agree() -> None:
    robot = machine("cogiro")
    poses = sl.Pose.from_euler([[0.5, 0.5, 2.0], [0.6, 0.5, 2.0], [0.7, 0.6, 2.1]], 0.0, 0.0, 0.0)
    winding = np.array([1.0, -1.0, 0.0, 1.0, 1.0, -1.0, -1.0, 0.0])
    plan = sl.inverse(robot, poses, winding=winding)
    chain = sl.forward(robot, plan.unstrained_length, start=poses[0], winding=winding)
    np.testing.assert_allclose(chain.pose.position, poses.position, rtol=0.0, atol=1e-11)
    for i in range(3):
        one = sl.inverse(robot, poses[i], winding=winding)
        np.testing.assert_allclose(one.unstrained_length, plan.unstrained_length[i], rtol=0.0, atol=1e-13)
        alone = sl.forward(robot, one.unstrained_length, winding=winding)
        np.testing.assert_allclose(alone.pose.position, poses.position[i], rtol=0.0, atol=1e-11)
    several = sl.inverse([robot, robot.replace(mass=200.0), robot], poses, tension=sl.MinimumNorm(), winding=winding)
    heavy = sl.inverse(robot.replace(mass=200.0), poses[1], tension=sl.MinimumNorm(), winding=winding)
    np.testing.assert_allclose(several.unstrained_length[1], heavy.unstrained_length, rtol=0.0, atol=1e-13)
    back = sl.forward(several.state.robot, several.unstrained_length, poses, winding=winding)
    np.testing.assert_allclose(back.pose.position, poses.position, rtol=0.0, atol=1e-11)


@extended
def test_many_starts_find_the_pose_over_guides() -> None:
    robot = machine("cogiro")
    pose = sl.Pose.from_euler([0.5, 0.5, 2.0], 0.0, 0.0, 0.0)
    found = sl.equilibria(robot, sl.inverse(robot, pose).unstrained_length, starts=5)
    away = np.linalg.norm(found.solutions.pose.position - pose.position, axis=1)
    assert away.min() < 1e-11


@extended
def test_along_a_path_the_direction_of_winding_follows_from_lengths() -> None:
    robot = machine("cogiro")
    path = sl.quintic_path([(0, 0, 2), (1, 0.5, 2.5)], durations=2.0, rate=20.0)
    plain = sl.inverse(robot, path)
    plan = sl.inverse(robot, path, winding="path")
    contact = plan.state.contact
    assert contact is not None
    assert contact.winding is not None
    assert plain.length_rate is not None
    np.testing.assert_array_equal(contact.winding, -np.sign(plain.length_rate))
    change = plan.unstrained_length - plain.unstrained_length
    assert (change[contact.winding > 0.0] < 0.0).all()
    assert (change[contact.winding < 0.0] > 0.0).all()
    assert np.abs(sl.confirm(plan).position_error).max() < 1e-11


@pytest.mark.parametrize("tension", wide([sl.MinimumNorm(), sl.Closest()]))
def test_rates_are_those_of_the_lengths(tension: sl.TensionMethod) -> None:
    robot = machine("cogiro")
    path = sl.quintic_path([(0, 0, 2), (1, 0.5, 2.5)], durations=2.0, rate=500.0)
    plan = sl.inverse(robot, path, tension=tension, winding=np.ones(8))
    assert plan.length_rate is not None
    step = path.time[1] - path.time[0]
    lengths = plan.unstrained_length
    # fourth order
    middle = (8.0 * (lengths[3:-1] - lengths[1:-3]) - (lengths[4:] - lengths[:-4])) / (12.0 * step)
    limit = 1e-6 if isinstance(tension, sl.MinimumNorm) else 1e-3 * np.abs(middle).max()
    np.testing.assert_allclose(plan.length_rate[2:-2], middle, rtol=0.0, atol=limit)


def test_the_tension_at_the_drum_has_the_friction() -> None:
    robot = wound(pulley_radius=0.05, dead_cable=4.0, pulley_friction=0.1, inertia=1e-3, length_zero=14.0)
    path = sl.quintic_path([(0, 0, 2), (1, 0.5, 2.5)], durations=2.0, rate=10.0)
    with_, without = (sl.winch_rates(sl.inverse(robot, path, winding=way)) for way in ("path", None))
    state = sl.inverse(robot, path).state
    ratio = with_.drum_tension / without.drum_tension
    assert state.contact is not None
    expected = np.exp(-0.1 * np.sign(without.drum_speed) * state.contact.wrap_angle)
    np.testing.assert_allclose(ratio[1:-1], expected[1:-1], rtol=5e-3)  # except for the weight on the pulley
    plan = sl.inverse(robot, path, winding=np.zeros(8))
    np.testing.assert_allclose(sl.winch_rates(plan).drum_tension, without.drum_tension, rtol=1e-9)


@extended
def test_a_plan_file_contains_the_winding(tmp_path: Path) -> None:
    path = sl.quintic_path([(0, 0, 2), (1, 0.5, 2.5)], durations=2.0, rate=5.0)
    for winding in (None, "path"):
        plan = sl.inverse(machine("cogiro"), path, winding=winding)
        plan.save(tmp_path / "run.nc")
        back = sl.load_plan(tmp_path / "run.nc")
        assert plan.state.contact is not None
        assert back.state.contact is not None
        for name in plan.state.contact.__slots__:
            np.testing.assert_array_equal(getattr(back.state.contact, name), getattr(plan.state.contact, name))
        np.testing.assert_array_equal(back.unstrained_length, plan.unstrained_length)
        assert sl.confirm(back).position_error.max() < 1e-11
        part = back.state[2:4].contact
        assert part is not None
        assert (part.winding is None) == (winding is None)


def test_robots_with_guides_are_saved_exactly(tmp_path: Path) -> None:
    def parsed(text: str) -> sl.Robot:
        file = tmp_path / "robot.yaml"
        file.write_text(text, encoding="utf-8")
        return sl.load_robot(file)

    robot = machine("cogiro", guides=eyelets(sl.load_robot("cogiro")) + np.pi / 30.0)
    back = parsed(sl.dump_robot(robot))
    assert robot.winches is not None
    assert back.winches is not None
    for name, field in robot.winches.known().items():
        np.testing.assert_array_equal(getattr(back.winches, name), field, err_msg=name)
    text = sl.dump_robot(sl.load_robot("cogiro")) + "winches:\n  guides: [[0 m, 9, 10 cm], [0, 9, 300 cm]]\n"
    winches = parsed(text).winches
    assert winches is not None
    assert winches.guides is not None
    np.testing.assert_array_equal(winches.guides, np.tile([[[0.0, 9.0, 0.1], [0.0, 9.0, 3.0]]], (8, 1, 1)))


def test_dead_length_follows_from_guides() -> None:
    robot = sl.load_robot("cogiro")
    points = eyelets(robot)
    guided = robot.replace(winches=sl.Winch(0.05, guides=points))
    winches = guided.winches
    assert winches is not None
    for i, anchor in enumerate(robot.frame_anchors):
        whole = sum(np.linalg.norm(b - a) for a, b in pairwise([*points[i], anchor]))
        assert winches.dead_cable[i] == pytest.approx(whole, rel=1e-15)
        assert winches.dead_rise[i] == anchor[2] - points[i, 0, 2]
    moved = guided.replace(frame_anchors=robot.frame_anchors + np.array([0.0, 0.0, 1.0]))
    assert moved.winches is not None
    np.testing.assert_allclose(moved.winches.dead_rise, winches.dead_rise + 1.0, rtol=1e-15)
    assert (moved.winches.dead_cable > winches.dead_cable).all()
    other = guided.replace(winches=winches.replace(guides=points[:, 1:]))
    assert other.winches is not None
    assert (other.winches.dead_cable < winches.dead_cable).all()
    straight = winches.replace(guides=None)
    np.testing.assert_array_equal(straight.dead_cable, winches.dead_cable)
    fewer = sl.without_cables(guided, 2)
    assert fewer.winches is not None
    np.testing.assert_array_equal(fewer.winches.dead_cable, np.delete(winches.dead_cable, 2))


def wrong_guides() -> list[tuple[Any, str, *tuple[str, ...]]]:
    """Impossible guides, for one cable or in one of eight; parts of the error."""
    good = eyelets(sl.load_robot("cogiro"))
    shape = "shape (k, 3) or (m, k, 3), k >= 1"
    found: list[tuple[Any, str, *tuple[str, ...]]] = [
        ([1.0, 2.0, 3.0], "guides", "of shape (3,)", shape),
        ([[1.0, 2.0]], "guides", "of shape (1, 2)"),
        (np.empty((0, 3)), "guides", "of shape (0, 3)"),
        (good[None], "guides", "of shape (1, 8, 3, 3)"),
        (good[:7], "guides", "7 values", "one value, or 8, one per cable"),
        (7.0, "guides", "of shape ()"),
        ("drum", "guides", "'drum'", "numbers"),
        ([[0, 0, 0], [0, 0, 0]], "guides[1]", "at the previous guide"),
        ([[0, 0, 1e300]], "guides[0, 2]", "1e+300 m"),
    ]
    rng = np.random.default_rng(8)
    for _ in range(20):
        i, j, axis = (int(rng.integers(n)) for n in (8, 3, 3))
        for number in (np.nan, np.inf, -np.inf):
            bad = good.copy()
            bad[i, j, axis] = number
            found.append((bad, f"guides[{i}, {j}, {axis}]", f"{number:g} m", "finite"))
        twin = good.copy()
        twin[i, 1 + j % 2] = twin[i, j % 2]
        found.append((twin, f"guides[{i}, {1 + j % 2}]", "at the previous guide"))
        last = good.copy()
        last[i, -1] = sl.load_robot("cogiro").frame_anchors[i]
        found.append((last, f"guides[{i}, 2]", "at the frame anchor"))
    return found


def test_impossible_guides_are_refused_by_name() -> None:
    robot = sl.load_robot("cogiro")
    for guides, item, *parts in wrong_guides():
        with refused(f"winches: {item}", *parts, kind=sl.InvalidValueError) as caught:
            robot.replace(winches=sl.Winch(0.05, guides=guides))
        assert len(str(caught.value)) < 300
    guides = eyelets(robot)
    follows = robot.replace(winches=sl.Winch(guides=guides)).winches
    assert follows is not None
    wrong: list[tuple[str, dict[str, Any]]] = [
        ("dead_cable", {"dead_cable": 20.0}),
        ("dead_cable", {"dead_cable": follows.dead_cable * (1.0 + 1e-8)}),
        ("dead_rise", {"dead_cable": follows.dead_cable, "dead_rise": 1.0}),
    ]
    for field, given in wrong:
        with refused(f"winches: {field}[0]", kind=sl.InvalidValueError) as caught:
            robot.replace(winches=sl.Winch(guides=guides, **given))
        assert caught.value.allowed.endswith(", or 0")
    with refused("winches: rolling_friction[1]", "1", ">= 0, < 1"):
        sl.Winch(rolling_friction=[0.5, 1.0])


@pytest.mark.parametrize(
    ("winding", "parts"),
    [
        (0.5 * np.ones(8), ("winding[0]", "0.5", "1 winding in, -1 paying out, or 0 at rest")),
        ([1, 1, 1, 2, 1, 1, 1, 1], ("winding[3]", "2")),
        (np.ones(7), ("winding", "of shape (7,)", "shape (8,) or (2, 8)")),
        (np.ones((3, 8)), ("winding", "of shape (3, 8)")),
        (1.0, ("winding", "of shape ()")),
        ([np.nan] * 8, ("winding[0]", "nan")),
        ("in", ("winding", "'in'")),
    ],
)
def test_unknown_windings_are_refused(winding: Any, parts: tuple[str, ...]) -> None:
    robot = machine("cogiro")
    poses = sl.Pose.from_euler([[0.5, 0.5, 2.0], [0.6, 0.5, 2.0]], 0.0, 0.0, 0.0)
    with refused(*parts):
        sl.inverse(robot, poses, winding=winding)
    with refused(*parts):
        sl.forward(robot, np.full((2, 8), 9.0), winding=winding)


def test_functions_without_guides_refuse_them() -> None:
    robot = machine("cogiro")
    pose = sl.Pose.from_euler([0.5, 0.5, 2.0], 0.0, 0.0, 0.0)
    with refused("winding", "'path' for poses without a path"):
        sl.inverse(robot, pose, winding="path")
    for solver in (sl.InverseSolver, sl.ForwardSolver):
        with refused("winches: guides", "given", f"None for {solver.__name__}"):
            solver(robot)
    with refused("winches: guides", "given", "None for home"):
        sl.home(robot, pose, 300.0)
