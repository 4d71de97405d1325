"""Results of the article on its two simulated robots, on the path of this project (docs/model.md, section 7)."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.tiers import wide

ROBOTS = ("article-suspended", "article-mixed")


@cache
def plan_of(robot: str, model: sl.CableModel, tension: sl.TensionMethod, rate: float = 100.0) -> sl.Plan:
    return sl.inverse(sl.load_robot(robot), sl.article_path(rate), model, tension)


def error_along(plan: sl.Plan) -> Array:
    """Distance between the desired position and the equilibrium of exact cables with the planned lengths [m]."""
    found = sl.forward(plan.state.robot, plan.unstrained_length, start=plan.state.pose, wrench=plan.state.wrench)
    error: Array = np.linalg.norm(found.pose.position - plan.state.pose.position, axis=1)
    return error


def test_the_path_is_feasible_for_both_robots() -> None:
    for robot in ROBOTS:
        assert plan_of(robot, sl.Catenary(), sl.MinimumNorm()).feasible.all()
        assert plan_of(robot, sl.Catenary(), sl.Closest()).feasible.all()


@pytest.mark.parametrize("tension", [sl.MinimumNorm(), sl.Closest()], ids=["minimum norm", "closest"])
@pytest.mark.parametrize("robot", wide(ROBOTS))
def test_tensions_are_continuous_with_bounded_slope(robot: str, tension: sl.TensionMethod) -> None:
    """At twice the rate the largest change between samples halves, and so does the second difference."""
    tensions = [plan_of(robot, sl.Catenary(), tension, rate).chord_tension for rate in (100.0, 200.0)]
    first = [np.abs(np.diff(t, axis=0)).max() for t in tensions]
    second = [np.abs(np.diff(t, 2, axis=0)).max() for t in tensions]
    assert first[0] < 0.7  # [N] in 10 ms
    np.testing.assert_allclose(first[0] / first[1], 2.0, atol=0.02)
    assert second[0] < 0.5
    assert second[0] / second[1] > 1.7


def test_highest_horizontal_tension_of_the_mixed_robot_is_twice_that_of_the_suspended_one() -> None:
    suspended, mixed = (plan_of(robot, sl.Catenary(), sl.MinimumNorm()).horizontal_tension.max() for robot in ROBOTS)
    np.testing.assert_allclose(mixed / suspended, 2.1, atol=0.03)


def test_minimum_norm_sets_lower_cables_of_the_mixed_robot_to_their_minimum() -> None:
    lower = np.array([1, 3, 5, 7])
    robot = sl.load_robot("article-mixed")
    assert np.all(robot.frame_anchors[lower, 2] == 0.0)
    least = plan_of("article-mixed", sl.Catenary(), sl.MinimumNorm()).chord_tension
    at_limit = np.any(least[:, lower] < robot.tension_min[lower] + 1e-6, axis=1)
    assert at_limit.mean() > 0.9
    assert np.median(least[:, lower]) < 2.0 * robot.tension_min[0]


def test_closest_depends_on_the_path_and_minimum_norm_does_not() -> None:
    """The path returns to its start: (55) gives other tensions there, the minimum norm gives the same."""
    for robot, gap in zip(ROBOTS, (9.0, 200.0), strict=True):
        closest = plan_of(robot, sl.Catenary(), sl.Closest()).chord_tension
        assert np.abs(closest[-1] - closest[0]).max() > gap
        least = plan_of(robot, sl.Catenary(), sl.MinimumNorm()).chord_tension
        np.testing.assert_allclose(least[-1], least[0], atol=1e-9)


@pytest.mark.parametrize(("robot", "largest"), [("article-suspended", 1.66e-3), ("article-mixed", 1.13e-3)])
def test_position_error_along_the_path(robot: str, largest: float) -> None:
    """The empirical model has errors of one to two millimeters, the parabolic one of hundredths, the exact one none."""
    errors = {
        model: error_along(plan_of(robot, model, sl.MinimumNorm())).max()
        for model in (sl.Empirical(), sl.Parabolic(), sl.Catenary())
    }
    np.testing.assert_allclose(errors[sl.Empirical()], largest, rtol=0.01)
    assert errors[sl.Parabolic()] < 0.04e-3
    assert errors[sl.Catenary()] < 1e-9


@pytest.mark.parametrize(
    ("robot", "largest", "share"), [("article-suspended", 2.23e-3, 1.0), ("article-mixed", 3.53e-3, 0.981)]
)
def test_position_error_over_the_middle_of_the_frame(robot: str, largest: float, share: float) -> None:
    """A grid over the middle 70 % of the frame: the errors stay clearly within the ±6 mm of the article at 25 N."""
    loaded = sl.load_robot(robot)
    axes = (np.linspace(-5.25, 5.25, 13), np.linspace(-3.85, 3.85, 11), np.linspace(0.9, 5.1, 9))
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    poses = sl.Pose.from_euler(grid, 0.0, 0.0, 0.0)
    for model, limit in ((sl.Empirical(), largest), (sl.Parabolic(), 0.4e-3), (sl.Catenary(), 1e-9)):
        plan = sl.inverse(loaded, poses, model)
        feasible = np.flatnonzero(plan.feasible)
        np.testing.assert_allclose(len(feasible) / len(grid), share, atol=2e-3)
        found = sl.forward(loaded, plan.unstrained_length[feasible], start=poses[feasible])
        error = np.linalg.norm(found.pose.position - grid[feasible], axis=1).max()
        assert error < 1.01 * limit
        if model == sl.Empirical():
            assert error > 0.99 * limit
