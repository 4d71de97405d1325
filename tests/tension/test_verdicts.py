"""Every verdict is proved by its own point or its own Farkas vector, in plain arithmetic; a linear program agrees."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import linprog

from sagline.cables.catenary import Catenary
from sagline.cables.elastic import Elastic
from sagline.cables.model import CableModel
from sagline.files.robot_file import load_robot
from sagline.kinematics.inverse import inverse
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import PoseStatus
from sagline.robot.robot import Robot
from sagline.tension.margin import capacity_margin
from sagline.tension.minimum_norm import MinimumNorm
from tests.tension.reference import is_feasible, presets, random_poses, structures

MARGIN = 1e-9  # of the upper limit: what the verdict may be wrong by


class Sample(NamedTuple):
    robot: Robot
    plan: Plan
    matrices: np.ndarray


def sampled(robot: Robot, count: int, rng: np.random.Generator, model: CableModel) -> Sample:
    """Random poses in and around the test box, under random wrenches."""
    poses = random_poses(robot, count, rng, stretch=1.5)
    load = rng.normal(size=(count, 6)) * rng.uniform(0, 0.5, (count, 1)) * robot.mass * robot.gravity
    load[:, 3:] *= np.ptp(robot.platform_anchors, axis=0).max()
    plan = inverse(robot, poses, model=model, tension=MinimumNorm(), wrench=load)
    return Sample(robot, plan, structures(robot, poses))


def largest_gap(sample: Sample, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """y . needed less the most that tensions within limits supply along y (N,): above zero it proves infeasibility."""
    assert sample.plan.farkas is not None
    assert sample.plan.needed is not None
    y = sample.plan.farkas
    along = np.einsum("nk,nki->ni", y, sample.matrices)
    along[np.abs(along) < 1e-13 * np.abs(along).max(axis=1, keepdims=True)] = 0.0
    return np.asarray(np.einsum("nk,nk->n", y, sample.plan.needed) - np.maximum(along * low, along * high).sum(axis=1))


def unproved(sample: Sample) -> np.ndarray:
    """Poses whose verdict is not proved, to within the margin."""
    robot, plan = sample.robot, sample.plan
    assert plan.needed is not None
    margin = MARGIN * robot.tension_max.max()
    tensions = plan.chord_tension
    left = np.abs(np.einsum("nki,ni->nk", sample.matrices, tensions) - plan.needed).max(axis=1)
    inside = ((tensions >= robot.tension_min - margin) & (tensions <= robot.tension_max + margin)).all(axis=1)
    by_point = plan.feasible & inside & (left <= margin)
    by_vector = (plan.status == PoseStatus.INFEASIBLE) & (largest_gap(sample, robot.tension_min, robot.tension_max) > 0)
    doubtful = (plan.status == PoseStatus.INFEASIBLE) & (plan.shortfall <= margin)
    return np.flatnonzero(~(by_point | by_vector | doubtful))


def disagreeing(sample: Sample) -> list[int]:
    """Poses where a linear program says otherwise, and still does with limits moved by the margin."""
    robot, plan = sample.robot, sample.plan
    assert plan.needed is not None
    lost = []
    for i in range(len(plan.status)):
        found = bool(plan.feasible[i])
        low, high = robot.tension_min, robot.tension_max
        if is_feasible(sample.matrices[i], plan.needed[i], low, high) != found:
            shift = (MARGIN if found else -MARGIN) * robot.tension_max
            if is_feasible(sample.matrices[i], plan.needed[i], low - shift, high + shift) != found:
                lost.append(i)
    return lost


@pytest.mark.parametrize("robot", presets(), ids=lambda robot: robot.name)
def test_a_linear_program_agrees(robot: Robot) -> None:
    sample = sampled(robot, 770, np.random.default_rng(20), Elastic())
    assert 10 < sample.plan.feasible.sum() < 760
    assert not len(unproved(sample))
    assert not disagreeing(sample)


@pytest.mark.parametrize("robot", presets(), ids=lambda robot: robot.name)
def test_every_verdict_with_sag_is_proved(robot: Robot) -> None:
    sample = sampled(robot, 5000, np.random.default_rng(21), Catenary())
    statuses = set(np.unique(sample.plan.status))
    assert statuses <= {PoseStatus.SOLVED, PoseStatus.INFEASIBLE, PoseStatus.TOO_SLACK}
    lost = [i for i in unproved(sample) if sample.plan.status[i] != PoseStatus.TOO_SLACK]
    assert not lost


@pytest.mark.soak
@pytest.mark.parametrize("robot", presets(), ids=lambda robot: robot.name)
def test_a_million_verdicts(robot: Robot) -> None:
    rng = np.random.default_rng(22)
    for _ in range(16):
        sample = sampled(robot, 4808, rng, Elastic())
        assert not len(unproved(sample))
        assert not disagreeing(sample)


def test_blocking_cables_are_those_of_the_proof() -> None:
    for robot in presets():
        sample = sampled(robot, 500, np.random.default_rng(23), Elastic())
        plan = sample.plan
        assert plan.farkas is not None
        lost = np.flatnonzero(plan.status == PoseStatus.INFEASIBLE)
        along = np.abs(np.einsum("nk,nki->ni", plan.farkas[lost], sample.matrices[lost]))
        takes_part = along > 1e-7 * along.max(axis=1, keepdims=True)
        blocking = np.asarray(plan.blocking)[lost]
        assert (takes_part == blocking).mean() > 0.999
        assert (blocking.sum(axis=1) <= robot.cable_count - robot.degrees_of_freedom + 1).all()
        np.testing.assert_allclose(np.linalg.norm(plan.farkas[lost, :3], axis=1), 1.0, rtol=1e-12)
        assert np.isnan(plan.farkas[plan.feasible]).all()


def test_shortfall_is_the_least_force_that_helps() -> None:
    # adding the shortfall along the best direction makes the pose feasible, and no smaller force does
    for robot in presets():
        sample = sampled(robot, 300, np.random.default_rng(24), Elastic())
        plan, rng = sample.plan, np.random.default_rng(25)
        assert plan.farkas is not None
        assert plan.needed is not None
        lost = np.flatnonzero((plan.status == PoseStatus.INFEASIBLE) & np.isfinite(plan.shortfall))[:8]
        assert not np.isnan(plan.shortfall[plan.status == PoseStatus.INFEASIBLE]).any()
        gaps = largest_gap(sample, robot.tension_min, robot.tension_max)
        for i in lost:
            assert gaps[i] <= plan.shortfall[i] * (1 + 1e-6)  # any proof's gap is a lower bound of it
            for way in rng.normal(size=(3, 3)):
                less = np.zeros(6)
                less[:3] = way / np.linalg.norm(way) * plan.shortfall[i] * 0.999
                assert not is_feasible(sample.matrices[i], plan.needed[i] + less, robot.tension_min, robot.tension_max)
            assert _distance(sample, int(i)) == pytest.approx(plan.shortfall[i], rel=1e-3)


def _distance(sample: Sample, i: int) -> float:
    """The least force, as the best lower bound over a fine set of half-spaces found by cutting planes (LPs only)."""
    assert sample.plan.needed is not None
    robot, matrix, right = sample.robot, sample.matrices[i], sample.plan.needed[i]
    scale = float(sample.plan.shortfall[i])
    m = robot.cable_count
    # least |f| by outer polyhedral approximation of its ball, refined where the solution lies
    ways = [np.eye(3)[k] * sign for k in range(3) for sign in (1, -1)]
    least = 0.0
    for _ in range(60):
        cost = np.append(np.zeros(m + 3), 1.0)
        equal = np.column_stack((matrix, -np.eye(6)[:, :3] * scale, np.zeros(6)))
        upper = np.array([[*np.zeros(m), *way, -1.0] for way in ways])
        bounds = [*zip(robot.tension_min, robot.tension_max, strict=True), *[(None, None)] * 3, (0, None)]
        found = linprog(cost, A_ub=upper, b_ub=np.zeros(len(ways)), A_eq=equal, b_eq=right, bounds=bounds)
        assert found.status == 0
        force, least = found.x[m : m + 3], float(found.fun)
        length = float(np.linalg.norm(force))
        if length <= least * (1 + 1e-4):
            break
        ways.append(force / length)
    return least * scale


def test_capacity_margin_is_the_force_that_still_fits() -> None:
    for robot in presets():
        sample = sampled(robot, 60, np.random.default_rng(26), Elastic())
        plan, rng = sample.plan, np.random.default_rng(27)
        assert plan.needed is not None
        margins = capacity_margin(plan.state)
        np.testing.assert_array_equal(np.isnan(margins), ~plan.feasible)
        assert (margins[plan.feasible] >= -MARGIN * robot.tension_max.max()).all()
        for i in np.flatnonzero(plan.feasible)[:4]:
            for way in rng.normal(size=(4, 3)):
                more = np.append(way / np.linalg.norm(way) * margins[i] * 0.999, np.zeros(3))
                assert is_feasible(sample.matrices[i], plan.needed[i] + more, robot.tension_min, robot.tension_max)


@pytest.mark.parametrize("name", ["article-mixed", "falcon-7", "fast"])
def test_capacity_margin_is_no_less(name: str) -> None:
    sample = sampled(load_robot(name), 40, np.random.default_rng(28), Elastic())
    margins = capacity_margin(sample.plan.state)
    ways = _directions(300)  # 12 degrees apart: a face at distance d is met within d / cos 8 degrees
    for i in np.flatnonzero(sample.plan.feasible)[:2]:
        reach = min(_reach(sample, int(i), way) for way in ways)
        assert margins[i] <= reach * (1 + 1e-6)
        assert margins[i] >= reach * 0.97


def _directions(count: int) -> np.ndarray:
    """Evenly spread over the sphere, by the golden angle."""
    k = np.arange(count)
    z, turn = 1 - (2 * k + 1) / count, np.pi * (1 + 5**0.5) * k
    return np.column_stack((np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z))


def _reach(sample: Sample, i: int, way: np.ndarray) -> float:
    """How far the force can grow along a direction: a linear program in the tensions and that length."""
    assert sample.plan.needed is not None
    robot, matrix = sample.robot, sample.matrices[i]
    scale = robot.tension_max.max()
    found = linprog(
        np.append(np.zeros(robot.cable_count), -1.0),
        A_eq=np.column_stack((matrix, -np.append(way, np.zeros(3)))),
        b_eq=sample.plan.needed[i] / scale,
        bounds=[*zip(robot.tension_min / scale, robot.tension_max / scale, strict=True), (0, None)],
    )
    assert found.status == 0
    return float(-found.fun * scale)
