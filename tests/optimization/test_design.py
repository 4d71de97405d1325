"""Searches compared with an optimum in closed form; seeds, initial robots and results."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from benchmarks.design import inside, posts
from tests.optimization.pair import BEST, MARGIN, UNDER, WEIGHT, apart, pair
from tests.refusal import refused
from tests.tiers import extended, wide

OPTIMIZERS = {"cma": 1e-6, "differential_evolution": 1e-6, "nsga2": 5e-3}  # and accuracy of 600 candidates [m]


def search(robot: sl.Robot, free: Any, goals: Any = ("least_margin",), **more: Any) -> sl.Front:
    given: dict[str, Any] = {"poses": UNDER, "model": sl.Straight(), **more}
    return sl.design(robot, free, list(goals), **given)


@pytest.mark.parametrize("optimizer", wide(OPTIMIZERS))
def test_every_optimizer_finds_the_best_anchors(optimizer: str) -> None:
    front = search(pair(), [apart()], optimizer=optimizer, evaluations=600)
    near = OPTIMIZERS[optimizer]
    assert front.better
    assert len(front.evaluated) <= 600
    np.testing.assert_allclose(front.best.frame_anchors[:, 0], [BEST, -BEST], atol=near)
    np.testing.assert_allclose(front.values[0], MARGIN, atol=near)
    np.testing.assert_allclose(front.start_values, WEIGHT / np.sqrt(5.0), rtol=1e-12)  # sine of the initial angle


def test_the_margin_is_that_of_the_best_robot() -> None:
    front = search(pair(), [apart()], evaluations=60)
    own = sl.margin(front.best, UNDER, model=sl.Straight(), moment_arm=1.0)
    np.testing.assert_allclose(front.values[0, 0], own.value, rtol=1e-12)


def test_two_free_numbers_lead_to_the_same_angle() -> None:
    """Lower or wider anchors: only the angle matters, and all pairs of anchors at 60 degrees are equally good."""
    up = sl.FreeAnchors("frame", -1.0, 3.0, along=[0, 0, 1], symmetry="together")
    front = search(pair(), [apart(), up], evaluations=600)
    x, _, z = front.best.frame_anchors[0]
    np.testing.assert_allclose(x / z, np.sqrt(3.0), rtol=1e-6)
    np.testing.assert_allclose(front.best.frame_anchors[1], [-x, 0.0, z], rtol=1e-12)


def global_state() -> bytes:
    state: Any = np.random.get_state()  # noqa: NPY002
    return bytes(state[1].tobytes())


@pytest.mark.parametrize("optimizer", wide(OPTIMIZERS))
def test_a_seed_gives_the_same_robots_bit_for_bit(optimizer: str) -> None:
    np.random.seed(1)  # noqa: NPY002 - what the packages would use
    before = global_state()
    first = search(pair(), [apart()], optimizer=optimizer, evaluations=120, seed=7)
    assert global_state() == before
    np.random.random(3)  # noqa: NPY002
    again = search(pair(), [apart()], optimizer=optimizer, evaluations=120, seed=7)
    other = search(pair(), [apart()], optimizer=optimizer, evaluations=120, seed=8)
    assert first.evaluated.tobytes() == again.evaluated.tobytes()
    assert first.evaluated_values.tobytes() == again.evaluated_values.tobytes()
    assert not np.array_equal(first.evaluated[: len(other.evaluated)], other.evaluated[: len(first.evaluated)])


@pytest.mark.parametrize("optimizer", wide(OPTIMIZERS))
def test_the_search_begins_with_the_robot_and_stays_within_bounds(optimizer: str) -> None:
    front = search(pair(), [apart(-0.25, 0.75)], optimizer=optimizer, evaluations=200)
    assert front.evaluated[0, 0] == 0.0
    assert front.evaluated.min() >= -0.25
    assert front.evaluated.max() <= 0.75
    np.testing.assert_allclose(front.changed[0], 0.75, atol=2e-3)  # the best robot is outside of the bounds


def test_a_search_without_improvement_says_so() -> None:
    front = search(pair(BEST), [apart(-0.5, 0.0)], evaluations=60)
    assert not front.better
    assert front.best is front.start
    assert f" {len(front.evaluated)} robots " in front.text
    assert str(front) == front.text


def test_goals_can_be_reversed() -> None:
    front = search(pair(), [apart(-0.5, 1.0)], [sl.Goal("least_margin", maximize=False)], evaluations=120)
    np.testing.assert_allclose(front.changed[0], -0.5, atol=1e-4)


def test_weights_decide_between_goals() -> None:
    """Wide limits increase the margin and also the largest tension: the goal with the larger weight dominates."""
    limit = sl.FreeLimit("tension_max", 12.0, 40.0)
    wide = sl.FreeAnchors("frame", -0.5, 5.0, along=[1, 0, 0], symmetry="x")

    def found(weight: float) -> float:
        goals = [sl.Goal("least_margin", weight=weight), sl.Goal("largest_tension")]
        return float(search(pair(), [wide, limit], goals, evaluations=200).values[0, 0])

    assert found(100.0) > 3.0 * found(0.01)


def test_limits_move_to_a_larger_margin() -> None:
    """A larger upper limit is never worse, and the angle of the best anchors follows: cos theta = G/T."""
    front = search(pair(), [apart(-0.5, 9.0), sl.FreeLimit("tension_max", 15.0, 40.0)], evaluations=800)
    assert front.values[0, 0] == pytest.approx(WEIGHT * np.sin(np.arccos(0.25)), rel=1e-4)
    assert front.best.tension_max[0] == pytest.approx(40.0, rel=1e-3)


def test_anchor_errors_give_the_worst_or_the_mean_of_samples() -> None:
    poses = sl.Pose(np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.25]]), np.eye(3))
    robot = pair(2.0)
    errors = np.random.default_rng(3).standard_normal((4, 2, 6)) * 0.05
    off = [
        robot.replace(frame_anchors=robot.frame_anchors + e[:, :3], platform_anchors=robot.platform_anchors + e[:, 3:])
        for e in errors
    ]
    least = [sl.margin(one, poses, model=sl.Straight(), moment_arm=0.0).value.min() for one in off]
    for take, expected in (("worst", min(least)), ("mean", np.mean(least))):
        sample = sl.AnchorErrors(0.05, samples=4, take=take, seed=3)
        front = search(robot, [apart()], poses=poses, robust=sample, evaluations=16)
        assert front.start_values[0] == pytest.approx(expected, rel=1e-9)


def test_moving_anchors_follow_the_platform() -> None:
    """Both anchors along one rail: the margin is largest if the platform is in the middle."""
    across = np.linspace(-1.5, 1.5, 7)
    poses = sl.Pose(np.column_stack((across, 0.0 * across, 0.0 * across)), np.eye(3))
    rail = sl.FreeAnchors("frame", -2.0, 2.0, along=[1, 0, 0], symmetry="together")
    found = sl.moving_anchors(pair(BEST), [rail], poses=poses, model=sl.Straight())
    np.testing.assert_allclose(found.moved[:, 0], across, atol=2e-4)
    np.testing.assert_allclose(found.margin, MARGIN, atol=1e-4)
    fixed = sl.margin(pair(BEST), poses, model=sl.Straight(), moment_arm=0.0)
    np.testing.assert_allclose(found.fixed_margin, fixed.value, rtol=1e-12)
    own = [sl.margin(one, poses[k], model=sl.Straight(), moment_arm=0.0).value for k, one in enumerate(found.robots)]
    np.testing.assert_allclose(own, found.margin, rtol=1e-12)


@extended
def test_a_search_includes_moving_anchors() -> None:
    across = np.array([-1.0, 0.0, 1.0])
    poses = sl.Pose(np.column_stack((across, 0.0 * across, 0.0 * across)), np.eye(3))
    rail = sl.FreeAnchors("frame", -2.0, 2.0, along=[1, 0, 0], symmetry="together")
    front = search(pair(), [apart()], poses=poses, inner=[rail], evaluations=200)
    np.testing.assert_allclose(front.values[0], MARGIN, atol=1e-3)  # of three poses as of one
    np.testing.assert_allclose(front.best.frame_anchors[0, 0], BEST, atol=1e-2)


def test_a_missing_package_is_named_with_its_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    def gone(module: str) -> None:
        raise ModuleNotFoundError(f"No module named {module!r}", name=module)

    monkeypatch.setattr("sagline.optimization.search.import_module", gone)
    with refused("the package cma", "missing", kind=sl.InvalidValueError) as caught:
        search(pair(), [apart()])
    assert '"sagline[design]"' in caught.value.next_step
    assert search(pair(), [apart()], optimizer="differential_evolution", evaluations=40).better


@pytest.mark.soak
def test_the_workspace_of_the_article_robot_grows_by_a_seventh() -> None:
    """Upper and lower cables of all posts lower or higher: 600 candidates at 315 poses."""
    robot, load = sl.load_robot("article-suspended"), sl.WrenchBox(force=50.0, moment=5.0)
    front = sl.design(robot, posts(), ["workspace_share"], load, box=inside(0.3), evaluations=600)
    assert front.values[0, 0] >= 1.07 * front.start_values[0]
