"""Numbers of a sweep agree with the functions for a single request."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.sweep.request import RequestBox
from sagline.sweep.work import compute_variables, count_outcomes
from tests.sweep.requests import PLANAR, planar
from tests.tiers import wide

QUANTITIES = ("tension", "length", "shortfall", "margin")


def whole(request: sl.sweep.Request, robot: int = 0) -> dict[str, Any]:
    _, poses, wrenches = request.shape
    return compute_variables(request, RequestBox(robot, slice(0, poses), slice(0, wrenches)))


def one_by_one(request: sl.sweep.Request, robot: int = 0) -> sl.Plan:
    """All requests of a robot as a batch; the wrench index changes fastest."""
    _, poses, wrenches = request.shape
    pose = request.poses[np.repeat(np.arange(poses), wrenches)]
    loads = np.tile(request.wrenches, (poses, 1))
    return sl.inverse(request.robots[robot], pose, request.model, request.tension, loads)


def spatial(name: str, quantities: tuple[str, ...] = QUANTITIES) -> sl.sweep.Request:
    robot, rng = sl.load_robot(name), np.random.default_rng(3)
    assert robot.test_box is not None
    pose = sl.Pose.from_euler(rng.uniform(1.2 * robot.test_box.low, 1.2 * robot.test_box.high, (12, 3)), 0.05, 0.0, 0.1)
    force = max(0.5 * robot.mass * robot.gravity, 0.5 * float(robot.tension_max.min()))
    loads = rng.normal(size=(15, 6)) * force * [1, 1, 1, 0.1, 0.1, 0.1]
    return sl.sweep.Request(robot, pose, loads, quantities)


@pytest.mark.parametrize("request_", [planar(quantities=QUANTITIES), spatial("cogiro"), spatial("ipanema-2-pulleys")])
def test_numbers_agree_with_inverse_and_margin(request_: sl.sweep.Request) -> None:
    found, plan = whole(request_), one_by_one(request_)
    shape = request_.shape[1:]
    np.testing.assert_array_equal(found["status"], plan.status.reshape(shape))
    np.testing.assert_array_equal(found["tension"], plan.chord_tension.reshape(*shape, -1))
    np.testing.assert_array_equal(found["length"], plan.unstrained_length.reshape(*shape, -1))
    np.testing.assert_array_equal(found["enough"], plan.shortfall.reshape(shape))
    assert plan.bracket is not None
    np.testing.assert_array_equal(found["proof"], plan.bracket[:, 0].reshape(shape))
    assert 0.1 < plan.feasible.mean() < 0.9
    for k, wrench in enumerate(request_.wrenches[:5]):
        margin = sl.margin(request_.robots[0], request_.poses, sl.WrenchPolytope([wrench]))
        np.testing.assert_allclose(found["margin"][:, k], margin.value, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(found["margin_low"][:, k], margin.low, rtol=1e-12, atol=1e-9)
        np.testing.assert_allclose(found["margin_high"][:, k], margin.high, rtol=1e-12, atol=1e-9)
        np.testing.assert_array_equal(found["margin_status"][:, k], margin.status)


def test_the_margin_is_that_of_the_set_around_each_wrench() -> None:
    given, around = planar(5, 3), sl.WrenchBox(force=[10.0, 0.0, 20.0], moment=[0.0, 2.0, 0.0])
    request = sl.sweep.Request(
        given.robots, given.poses, given.wrenches, "margin", around=around, moment_arm=0.25, model=sl.Straight()
    )
    found = whole(request)
    for k, wrench in enumerate(request.wrenches):
        loads = sl.WrenchBox([10.0, 0.0, 20.0], [0.0, 2.0, 0.0], center=wrench)
        margin = sl.margin(request.robots[0], request.poses, loads, model=sl.Straight(), moment_arm=0.25)
        np.testing.assert_allclose(found["margin"][:, k], margin.value, rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize("count", [400, pytest.param(40_000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("name", wide([PLANAR, "cogiro", "article-mixed", "ipanema-1", "point"]))
def test_a_shared_proof_contradicts_no_verdict(name: str, count: int) -> None:
    """Including the boundary: loads on rays through it, at decreasing distances."""
    robot, rng = some_robot(name), np.random.default_rng(11)
    box = robot.test_box
    low, high = (box.low, box.high) if box is not None else ((0.4, 0.0, 0.4), (3.6, 0.0, 2.6))
    pose = sl.Pose(rng.uniform(low, high, (4, 3)), np.eye(3))
    direction = rng.normal(size=(count // 40, 6)) @ robot.freedom.T @ robot.freedom
    direction[:, :3] *= robot.mass * robot.gravity
    direction[:, 3:] *= 0.1 * robot.mass * robot.gravity
    loads = np.concatenate([direction * size for size in np.geomspace(0.05, 3.0, 10)])
    edges = [_border(robot, pose[k], one) for k in range(4) for one in direction[:3]]
    loads = np.concatenate([loads, *edges])
    request = sl.sweep.Request(robot, pose, loads)
    found, plan = whole(request), one_by_one(request)
    shape = request.shape[1:]
    np.testing.assert_array_equal(found["status"], plan.status.reshape(shape))
    np.testing.assert_array_equal(found["tension"], plan.chord_tension.reshape(*shape, -1))
    infeasible = found["status"] == sl.PoseStatus.INFEASIBLE
    assert plan.bracket is not None
    proved, enough = (plan.bracket[:, k].reshape(shape)[infeasible] for k in (0, 1))
    assert (found["proof"][infeasible] >= 0.0).all()
    assert (found["proof"][infeasible] <= enough * (1.0 + 1e-9) + 1e-9).all()
    assert np.count_nonzero(found["proof"][infeasible] != proved) > 0.3 * np.count_nonzero(infeasible)
    assert (found["proof"][found["status"] == sl.PoseStatus.SOLVED] == 0.0).all()


def some_robot(name: Any) -> sl.Robot:
    robot = sl.load_robot(PLANAR if name == "point" else name)
    return robot.replace(motion_pattern="2T", platform_anchors=np.zeros((4, 3))) if name == "point" else robot


def _border(robot: sl.Robot, pose: sl.Pose, direction: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Loads along a direction near the boundary of feasibility, at distances from a millionth to rounding."""
    inside, outside = 0.0, 20.0
    for _ in range(50):
        middle = 0.5 * (inside + outside)
        solved = bool(sl.inverse(robot, pose, tension=sl.MinimumNorm(), wrench=direction * middle).feasible)
        inside, outside = (middle, outside) if solved else (inside, middle)
    return np.array([direction * inside * (1.0 + sign * 10.0**-k) for k in (6, 9, 12, 15) for sign in (-1, 1)])


def test_robots_with_fewer_cables_have_empty_columns() -> None:
    eight, pose = sl.load_robot("cogiro"), sl.Pose.from_euler([[0.0, 0.0, 2.0]], 0.0, 0.0, 0.0)
    seven = sl.without_cables(eight, 2)
    request = sl.sweep.Request([seven, eight], pose, quantities=("tension", "length"))
    found = whole(request, 0)
    assert found["tension"].shape == (1, 1, 8)
    np.testing.assert_array_equal(found["tension"][0, 0, :7], sl.inverse(seven, pose[0]).chord_tension)
    assert np.isnan(found["tension"][..., 7]).all()
    assert np.isnan(found["length"][..., 7]).all()
    assert not np.isnan(whole(request, 1)["tension"]).any()


def test_all_parts_give_the_whole_sweep() -> None:
    request = planar()
    all_of_it = whole(request)
    for rows, columns in ((slice(3, 20), slice(5, 6)), (slice(0, 1), slice(0, 25))):
        part = compute_variables(request, RequestBox(0, rows, columns))
        for name in ("status", "tension"):
            np.testing.assert_array_equal(part[name], all_of_it[name][rows, columns])


def test_large_parts_are_computed_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    request = planar()
    before = whole(request)
    monkeypatch.setattr("sagline.sweep.work.ROWS", 7)
    after = whole(request)
    np.testing.assert_array_equal(before["tension"], after["tension"])
    np.testing.assert_array_equal(before["status"], after["status"])


def test_every_request_is_counted_once() -> None:
    request = planar(quantities=("tension", "margin"))
    found = whole(request)
    counts = count_outcomes(found)
    assert counts.feasible == np.count_nonzero(found["status"] == sl.PoseStatus.SOLVED)
    assert counts.infeasible == np.count_nonzero(found["status"] == sl.PoseStatus.INFEASIBLE)
    assert sum(counts) == len(request)
    statuses = list(sl.PoseStatus)
    told = count_outcomes({"status": np.array(statuses, dtype=np.int8)})
    assert told == (1, 1, len(statuses) - 4, 1, 1)
    assert count_outcomes({"margin_status": np.array(list(sl.MarginStatus), dtype=np.int8)}) == (1, 1, 3, 1, 0)
