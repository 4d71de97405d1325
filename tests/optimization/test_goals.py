"""Values of all goals compared with the functions that compute them."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from sagline import FreeCable
from sagline.optimization.candidates import Candidates
from sagline.optimization.rating import distribute
from tests.tension.reference import random_poses
from tests.tiers import extended

PULLEYS = pytest.param("expo2015-lucia-pulleys", marks=extended)
PRESETS = ("article-suspended", "cogiro", "ipanema-1", PULLEYS, "fast", "copacabana")


@pytest.mark.parametrize("name", PRESETS)
def test_plans_of_tables_agree_with_inverse(name: str) -> None:
    robot, seed = sl.load_robot(name), np.random.default_rng(4)
    poses = random_poses(robot, 30, seed)
    wrench = robot.freedom.T @ robot.freedom @ np.array([5.0, -3.0, 8.0, 0.5, -0.25, 0.75])
    lift = sl.FreeAnchors("frame", -0.1, 0.1, along=[0, 0, 1], symmetry="together")
    table = Candidates(robot, [lift]).cables(np.zeros((len(poses), 1)))  # limits of the robot
    rows = np.hstack((poses.position, poses.quaternion))
    tension, sag, stiffness = distribute(robot, sl.Catenary(), table, rows, wrench, stiffness=True)
    plan = sl.inverse(robot, poses, tension=sl.MinimumNorm(), wrench=wrench)
    held = ~np.isnan(tension)
    assert held.sum() > 5
    assert plan.feasible[held].all()
    np.testing.assert_allclose(tension[held], plan.chord_tension[held].max(axis=1), rtol=1e-14)
    np.testing.assert_allclose(sag[held], plan.state.cables.sag[held].max(axis=1), rtol=1e-12, atol=1e-12)
    assert stiffness is not None
    softest = np.linalg.norm(sl.stiffness(plan.state[held]).compliance[:, :3, :3], ord=2, axis=(1, 2))
    np.testing.assert_allclose(stiffness[held], 1.0 / softest, rtol=1e-6)


BOX = sl.WrenchBox(force=[100.0, 100.0, 50.0], moment=10.0)
MIDDLE = [0.0, 0.0, -50.0, 0.0, 0.0, 0.0]  # of both sets of loads


@pytest.mark.parametrize(
    "load",
    [
        sl.WrenchBox(force=100.0, moment=10.0, center=MIDDLE),
        pytest.param(BOX + sl.WrenchPolytope([[0.0] * 6, [0.0, 0.0, -100.0, 0.0, 0.0, 0.0]]), id="polytope"),
    ],
)
def test_values_of_goals_agree_with_functions(load: sl.WrenchSet) -> None:
    robot = sl.load_robot("cogiro")
    poses = random_poses(robot, 20, np.random.default_rng(2))
    own = sl.Cable(robot.cables.linear_density[0], robot.cables.axial_stiffness[0])
    catalogue = [sl.CableChoice("own", own, cost=3.0), sl.CableChoice("thin", sl.Cable(0.03, 2e5), cost=1.0)]
    kinds = ["workspace_share", "mean_margin", "least_margin", "largest_tension", "largest_sag", "least_stiffness"]
    front = sl.design(robot, [FreeCable(catalogue)], [*kinds, "cable_cost"], load, poses, evaluations=16)
    for robot_found, values in ((front.start, front.start_values), (front.best, front.values[0])):
        margin = sl.margin(robot_found, poses, load).value
        plan = sl.inverse(robot_found, poses, tension=sl.MinimumNorm(), wrench=MIDDLE)
        assert plan.feasible.all()
        stiff = np.linalg.norm(sl.stiffness(plan.state).compliance[:, :3, :3], ord=2, axis=(1, 2))
        ends = poses.transform(robot.platform_anchors)
        longest = np.linalg.norm(ends - robot.frame_anchors, axis=-1).max(axis=0).sum()
        expected = [
            np.mean(margin >= 0.0),
            margin.mean(),
            margin.min(),
            plan.chord_tension.max(),
            plan.state.cables.sag.max(),
            (1.0 / stiff).min(),
            longest * (3.0 if robot_found is front.start else 1.0),
        ]
        np.testing.assert_allclose(values, expected, rtol=1e-6)
    assert front.better  # the cost of the thin cable is a third
    assert front.best.cables.linear_density[0] == 0.03


def test_a_robot_with_an_infeasible_pose_is_no_candidate() -> None:
    """With smaller tension_max more and more poses become infeasible: none of these robots has a value."""
    robot = sl.load_robot("cogiro")
    poses = random_poses(robot, 10, np.random.default_rng(2))
    robot = robot.replace(tension_max=2000.0)
    front = sl.design(robot, [sl.FreeLimit("tension_max", 100.0, 2000.0)], ["largest_tension"], poses=poses)
    limits, values = front.evaluated[:, 0], front.evaluated_values[:, 0]
    for limit, value in list(zip(limits, values, strict=True))[::25]:
        plan = sl.inverse(robot.replace(tension_max=limit), poses, tension=sl.MinimumNorm())
        assert plan.feasible.all() == (not np.isnan(value))
        if plan.feasible.all():
            np.testing.assert_allclose(value, plan.chord_tension.max(), rtol=1e-12)
    assert np.isnan(values).any()
    assert front.best.tension_max[0] == limits[np.nanargmin(values)]


def test_infeasible_poses_of_the_first_robot_are_excluded() -> None:
    robot = sl.load_robot("cogiro")
    inside = random_poses(robot, 6, np.random.default_rng(2))
    far = np.concatenate((inside.position, [[60.0, 0.0, 2.0]]))
    poses = sl.Pose.from_quaternion(far, np.concatenate((inside.quaternion, [[0.0, 0.0, 0.0, 1.0]])))
    free = sl.FreeAnchors("frame", -0.5, 0.5, along=[0, 0, 1], symmetry="together")
    with_it, without = (
        sl.design(robot, [free], ["largest_tension"], poses=some, evaluations=16) for some in (poses, inside)
    )
    assert np.isfinite(with_it.start_values).all()
    assert with_it.evaluated_values.tobytes() == without.evaluated_values.tobytes()
