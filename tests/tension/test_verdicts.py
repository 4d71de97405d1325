"""Every verdict is proved by its point or its Farkas vector in plain arithmetic, and agrees with a linear program."""

from typing import Any, NamedTuple

import daqp
import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from sagline import (
    Cable,
    CableModel,
    Catenary,
    Elastic,
    Empirical,
    MinimumNorm,
    Parabolic,
    Plan,
    Pose,
    PoseStatus,
    Robot,
    Straight,
    capacity_margin,
    inverse,
    load_robot,
    robot_names,
)
from tests.tension.reference import clear_of_pulleys, is_feasible, presets, random_poses, structures
from tests.tiers import extended, wide

FIRST = ("article-suspended", "article-mixed", "cogiro", "falcon-7", "fast", "expo2015-lucia-pulleys")
NAMES = (*FIRST, *(name for name in robot_names() if name not in FIRST))
MARGIN = 1e-9  # of the upper limit: the tolerance of a verdict


class Sample(NamedTuple):
    robot: Robot
    plan: Plan
    matrices: np.ndarray


def sampled(robot: Robot, count: int, rng: np.random.Generator, model: CableModel) -> Sample:
    """Random poses in and around the test box with random wrenches."""
    poses = random_poses(robot, count, rng, stretch=1.5)
    poses = poses[clear_of_pulleys(robot, poses)]
    count = len(poses)
    load = rng.normal(size=(count, 6)) * rng.uniform(0, 0.5, (count, 1)) * robot.mass * robot.gravity
    load[:, 3:] *= np.ptp(robot.platform_anchors, axis=0).max()
    plan = inverse(robot, poses, model=model, tension=MinimumNorm(), wrench=load, stability=False)
    return Sample(robot, plan, structures(robot, poses))


def pulls_on_a_grid(sample: Sample, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tensions between the limits of each cable, and its exact sag forces there (points, K, m)."""
    robot, cables = sample.robot, sample.plan.state.cables
    tensions = np.geomspace(robot.tension_min, robot.tension_max, 400)[:, None, :]
    span, rise = cables.span[which], cables.rise[which]
    tau = np.broadcast_to(tensions, (400, *span.shape))
    force = cables.model.from_tension(robot.cables, span, rise, tau, gravity=robot.gravity).vertical_force
    return tau, np.asarray(force - tau * rise / np.hypot(span, rise))


def largest_gap(sample: Sample, which: np.ndarray) -> np.ndarray:
    """y . demand minus the largest contribution of the cables along y (K,): a positive value proves infeasibility."""
    assert sample.plan.farkas is not None
    robot, y, matrices = sample.robot, sample.plan.farkas[which], sample.matrices[which]
    tau, pull = pulls_on_a_grid(sample, which)
    turn = sample.plan.state.pose.rotation.as_matrix()[which]
    lever = (robot.platform_anchors - robot.center_of_mass) @ np.swapaxes(turn, 1, 2)
    hanging = y[:, 2, None] + y[:, 3, None] * lever[..., 1] - y[:, 4, None] * lever[..., 0]
    along = np.einsum("nk,nki->ni", y, matrices)
    along[np.abs(along) < 1e-13 * np.abs(along).max(axis=1, keepdims=True)] = 0.0
    most = (along * tau - hanging * pull).max(axis=0).sum(axis=1)
    demand = np.array([0, 0, robot.mass * robot.gravity, 0, 0, 0]) - sample.plan.state.wrench[which]
    return np.asarray(np.einsum("nk,nk->n", y, demand) - most)


def unproved(sample: Sample) -> np.ndarray:
    """Poses whose verdict is not proved, within the margin, by their tensions or their direction."""
    robot, plan = sample.robot, sample.plan
    assert plan.needed is not None
    assert plan.farkas is not None
    margin = MARGIN * robot.tension_max.max()
    tensions = plan.chord_tension
    left = np.abs(np.einsum("nki,ni->nk", sample.matrices, tensions) - plan.needed).max(axis=1)
    inside = ((tensions >= robot.tension_min - margin) & (tensions <= robot.tension_max + margin)).all(axis=1)
    proved = plan.feasible & inside & (left <= margin)
    by_vector = np.flatnonzero((plan.status == PoseStatus.INFEASIBLE) & ~np.isnan(plan.farkas[:, 5]))
    for part in np.array_split(by_vector, 1 + len(by_vector) // 500):
        proved[part] = largest_gap(sample, part) > 0.0
    return np.flatnonzero(~proved)


def disagreeing(sample: Sample) -> list[int]:
    """Poses with another verdict of a linear program, also with limits changed by the margin."""
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


@pytest.mark.parametrize(("name", "count"), wide([(NAMES[0], 100), *((name, 400) for name in NAMES)]))
def test_a_linear_program_agrees(name: str, count: int) -> None:
    sample = sampled(load_robot(name), count, np.random.default_rng(20), Elastic())
    assert 10 < sample.plan.feasible.sum() < len(sample.plan.status) - 10
    assert not len(unproved(sample))
    assert not disagreeing(sample)


def check_with_sag(name: str, count: int, seed: int) -> None:
    robot = load_robot(name)
    sample = sampled(robot, count, np.random.default_rng(seed), Catenary())
    plan = sample.plan
    assert plan.bracket is not None
    statuses = set(np.unique(plan.status))
    assert statuses <= {PoseStatus.SOLVED, PoseStatus.INFEASIBLE, PoseStatus.TOO_SLACK, PoseStatus.BORDERLINE}
    # if no single direction is a proof, the load is near the boundary: within a hundredth of the weight, or a moment
    lost = unproved(sample)
    assert len(lost) <= 0.01 * count
    for i in lost:
        assert plan.status[i] != PoseStatus.SOLVED
        if plan.status[i] != PoseStatus.TOO_SLACK:
            assert plan.shortfall[i] < 0.01 * robot.mass * robot.gravity or np.isinf(plan.shortfall[i])


@pytest.mark.parametrize("name", wide(NAMES, first=6))
def test_every_verdict_with_sag_is_proved(name: str) -> None:
    check_with_sag(name, 500, 21)


@pytest.mark.soak
@pytest.mark.parametrize("name", NAMES)
def test_many_verdicts_with_sag_are_proved(name: str) -> None:
    check_with_sag(name, 5000, 31)


@pytest.mark.soak
@pytest.mark.parametrize("name", NAMES)
def test_a_million_verdicts(name: str) -> None:
    rng = np.random.default_rng(22)
    for _ in range(16):
        sample = sampled(load_robot(name), 4808, rng, Elastic())
        assert not len(unproved(sample))
        assert not disagreeing(sample)


def test_wider_limits_of_blocking_cables_reduce_the_shortfall() -> None:
    for robot in presets():
        sample = sampled(robot, 200, np.random.default_rng(23), Elastic())
        plan = sample.plan
        assert plan.farkas is not None
        lost = np.flatnonzero((plan.status == PoseStatus.INFEASIBLE) & np.isfinite(plan.shortfall))[:12]
        np.testing.assert_allclose(np.linalg.norm(plan.farkas[lost, :3], axis=1), 1.0, rtol=1e-12)
        assert np.isnan(plan.farkas[plan.feasible]).all()
        for i in lost:
            along = plan.farkas[i] @ sample.matrices[i]
            for cable in range(robot.cable_count):
                wider = 1e-3 * min(plan.shortfall[i] / np.abs(along).max(), robot.tension_min[cable])
                low, high = robot.tension_min.copy(), robot.tension_max.copy()
                if along[cable] > 0:
                    high[cable] += wider
                else:
                    low[cable] -= wider
                # the direction of the proof gives the effect: a newton of limit changes the shortfall by its component
                least = least_change(sample.matrices[i], needed_by(sample, i), low, high)
                gained = plan.shortfall[i] - least
                expected = wider * abs(along[cable]) if plan.blocking[i, cable] else 0.0
                assert gained == pytest.approx(expected, abs=0.02 * wider + 1e-9 * robot.tension_max.max())


def needed_by(sample: Sample, i: Any) -> np.ndarray:
    assert sample.plan.needed is not None
    return np.asarray(sample.plan.needed[i])


def least_change(matrix: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """Least force that makes the demand feasible: a quadratic program by DAQP; infinite if no force does.

    In the force alone it is strictly convex; the tensions get a weight of 1e-12, by which the force is off by less
    than 1e-9 of them.
    """
    m = len(low)
    size = float(np.abs(right).max())
    rows = np.column_stack((matrix, -np.eye(6)[:, :3]))
    norms = np.linalg.norm(rows, axis=1)
    used = norms > 1e-12
    rows, sides = rows[used] / norms[used, None], right[used] / norms[used] / size
    upper = np.concatenate((np.minimum(high, 1e9) / size, np.full(3, 1e9), sides))
    lower = np.concatenate((low / size, np.full(3, -1e9), sides))
    sense = np.concatenate((np.zeros(m + 3), np.full(len(sides), 5))).astype(np.int32)
    weights = np.diag(np.concatenate((np.full(m, 1e-12), np.ones(3))))
    x, _value, flag, _info = daqp.solve(
        weights, np.zeros(m + 3), rows, upper, lower, sense, primal_tol=1e-12, dual_tol=1e-13
    )
    return float(np.linalg.norm(x[m:]) * size) if flag == 1 else np.inf


def test_shortfall_is_that_of_a_quadratic_program() -> None:
    count = 0
    for robot in presets():
        if robot.degrees_of_freedom < 6:
            continue
        sample = sampled(robot, 120, np.random.default_rng(24), Elastic())
        plan = sample.plan
        for i in np.flatnonzero(plan.status == PoseStatus.INFEASIBLE):
            least = least_change(sample.matrices[i], needed_by(sample, i), robot.tension_min, robot.tension_max)
            weight = robot.mass * robot.gravity
            assert plan.shortfall[i] == pytest.approx(least, rel=1e-6, abs=1e-7 * weight)
            count += 1
    assert count > 300


def check_brackets(count: int, seed: int) -> int:
    """The gap of the proof, computed again, reaches the shortfall: no smaller force is sufficient. Count them."""
    checked = 0
    for robot in presets():
        sample = sampled(robot, count, np.random.default_rng(seed), Elastic())
        plan = sample.plan
        assert plan.bracket is not None
        lost = np.flatnonzero((plan.status == PoseStatus.INFEASIBLE) & np.isfinite(plan.shortfall))
        gap = largest_gap(sample, lost)
        weight = robot.mass * robot.gravity
        np.testing.assert_allclose(gap, plan.shortfall[lost], rtol=1e-6, atol=1e-9 * max(weight, 1.0))
        np.testing.assert_allclose(plan.bracket[lost, 0], gap, rtol=1e-6, atol=1e-9 * max(weight, 1.0))
        np.testing.assert_array_equal(plan.bracket[lost, 1], plan.shortfall[lost])
        checked += len(lost)
    return checked


def test_no_force_below_the_shortfall_is_sufficient() -> None:
    assert check_brackets(150, 29) > 500


@pytest.mark.soak
def test_no_force_below_ten_thousand_shortfalls_is_sufficient() -> None:
    assert check_brackets(2500, 30) > 10000


def test_the_bracket_contains_the_shortfall_with_sag() -> None:
    # forward tensions show that the force is sufficient; the gap of the proof is a lower bound with exact curves
    for robot in presets():
        sample = sampled(robot, 150, np.random.default_rng(32), Catenary())
        plan = sample.plan
        assert plan.bracket is not None
        assert plan.farkas is not None
        weight = robot.mass * robot.gravity
        proved = np.flatnonzero((plan.status == PoseStatus.INFEASIBLE) & np.isfinite(plan.shortfall))
        proved = proved[~np.isnan(plan.farkas[proved, 0])]
        gap = largest_gap(sample, proved)
        assert (plan.bracket[proved, 0] <= gap + 1e-6 * weight).all()
        assert (gap <= plan.shortfall[proved] * (1 + 1e-6) + 1e-6 * weight).all()


def least_force(sample: Sample, i: int, starts: list[np.ndarray]) -> float:
    """Least force for which some tensions balance the exact cables, by sequential quadratic programs."""
    robot, pose = sample.robot, sample.plan.state.pose[i]
    m, weight = robot.cable_count, robot.mass * robot.gravity
    matrix = robot.freedom @ sample.matrices[i]
    turned = np.arange(len(matrix)) >= int((np.abs(robot.freedom[:, :3]).sum(axis=1) > 0.5).sum())
    lever = (robot.platform_anchors - robot.center_of_mass) @ pose.matrix.T
    nothing, one = np.zeros(m), np.ones(m)
    hanging = robot.freedom @ np.stack((nothing, nothing, one, lever[:, 1], -lever[:, 0], nothing))
    demand = robot.freedom @ (np.array([0, 0, weight, 0, 0, 0]) - sample.plan.state.wrench[i])
    span, rise = sample.plan.state.cables.span[i], sample.plan.state.cables.rise[i]
    unit = np.where(turned, 1 / np.abs(sample.matrices[i][3:]).max(), 1.0)[:, None] / weight

    def pull(tau: np.ndarray) -> np.ndarray:
        state = Catenary().from_tension(robot.cables, span, rise, tau, gravity=robot.gravity)
        return np.asarray(state.vertical_force - tau * rise / np.hypot(span, rise))

    def left(tau: np.ndarray) -> np.ndarray:
        return np.asarray(unit[:, 0] * (demand + hanging @ pull(tau) - matrix @ tau))

    def slopes(tau: np.ndarray) -> np.ndarray:
        step = 1e-5 * tau
        return np.asarray(unit * (hanging * ((pull(tau + step) - pull(tau - step)) / (2 * step)) - matrix))

    least = np.inf
    for start in starts:
        found = minimize(
            lambda tau: float(np.sum(left(tau)[~turned] ** 2)),
            np.clip(start, robot.tension_min, robot.tension_max),
            jac=lambda tau: 2 * left(tau)[~turned] @ slopes(tau)[~turned],
            constraints={"type": "eq", "fun": lambda t: left(t)[turned], "jac": lambda t: slopes(t)[turned]},
            bounds=list(zip(robot.tension_min, robot.tension_max, strict=True)),
            method="SLSQP",
            options={"ftol": 1e-15, "maxiter": 500},
        )
        if np.abs(left(found.x)[turned]).max(initial=0.0) < 1e-9:
            least = min(least, float(np.linalg.norm(left(found.x)[~turned])) * weight)
    return least


def check_forces(name: str, count: int, most: int, seed: int) -> None:
    """No nonlinear program finds less than the shortfall, and adding the relief makes the pose feasible."""
    rng = np.random.default_rng(seed)
    sample = sampled(load_robot(name), count, rng, Catenary())
    robot, plan = sample.robot, sample.plan
    assert plan.relief is not None
    weight = robot.mass * robot.gravity
    known = np.flatnonzero((plan.status == PoseStatus.INFEASIBLE) & np.isfinite(plan.shortfall))
    np.testing.assert_allclose(np.linalg.norm(plan.relief[known], axis=1), plan.shortfall[known], rtol=1e-9)
    wrench = plan.state.wrench[known].copy()
    wrench[:, :3] += plan.relief[known]
    relieved = inverse(robot, plan.state.pose[known], tension=MinimumNorm(), wrench=wrench)
    assert (relieved.feasible | (relieved.shortfall < 1e-6 * weight)).all()  # it brings the load to the boundary
    middle = np.sqrt(robot.tension_min * robot.tension_max)
    found = 0
    for i in known[:most]:
        starts = [middle, robot.tension_min, *rng.uniform(robot.tension_min, middle, (3, robot.cable_count))]
        least = least_force(sample, int(i), starts)
        assert least >= plan.shortfall[i] * (1 - 1e-6) - 1e-8 * weight
        found += least <= plan.shortfall[i] * (1 + 1e-3) + 1e-6 * weight
    assert found >= 0.3 * len(known[:most])  # and it finds a solution: from some start it is often as close


SAGGING = ["article-suspended", "article-prototype", "article-mixed", "cogiro", "fast"]


@extended
@pytest.mark.parametrize("name", SAGGING)
def test_a_nonlinear_program_finds_no_smaller_force_with_sag(name: str) -> None:
    check_forces(name, 200, 10, 51)


@pytest.mark.soak
@pytest.mark.parametrize("name", SAGGING)
def test_a_nonlinear_program_finds_no_smaller_force_at_many_poses(name: str) -> None:
    check_forces(name, 2000, 200, 52)


def test_without_lower_limits_or_gravity_verdicts_are_decided() -> None:
    rng = np.random.default_rng(53)
    for name in ("cogiro", "article-suspended"):
        preset = load_robot(name)
        for robot in (preset.replace(tension_min=0.0), preset.replace(gravity=0.0, tension_min=0.0)):
            for model in (Catenary(), Elastic(), Straight(), Parabolic(), Empirical()):
                poses = random_poses(robot, 150, rng, stretch=1.5)
                plan = inverse(robot, poses, model, MinimumNorm(), rng.normal(size=(150, 6)) * 300.0, stability=False)
                assert 0 < plan.feasible.sum() < 150
                assert set(plan.status) <= {PoseStatus.SOLVED, PoseStatus.INFEASIBLE, PoseStatus.TOO_SLACK}


def test_limits_below_a_tenth_of_the_weight_of_a_cable_are_satisfied() -> None:
    rng = np.random.default_rng(54)
    robot = load_robot("article-suspended").replace(cables=Cable(8.0, 1e6), tension_min=5.0, tension_max=60.0)
    poses = random_poses(robot, 300, rng)
    plan = inverse(robot, poses, tension=MinimumNorm(), wrench=rng.normal(size=(300, 6)) * 300.0 + [0, 0, 700, 0, 0, 0])
    tensions = plan.chord_tension[plan.feasible]
    assert ((tensions >= 5.0 * (1 - 1e-12)) & (tensions <= 60.0 * (1 + 1e-12))).all()
    assert (plan.status == PoseStatus.INFEASIBLE).any()


def test_distant_poses_are_decided_equally_fast() -> None:
    robot = load_robot("cogiro")
    for height in (50.0, 200.0, 1000.0):
        plan = inverse(robot, Pose([0.0, 0.0, height], np.eye(3)), tension=MinimumNorm())
        assert plan.status == PoseStatus.INFEASIBLE
        assert plan.bracket is not None
        assert plan.bracket[0] > 0.9 * plan.bracket[1] > 0.0


@pytest.mark.parametrize("name", wide(NAMES, first=5))
def test_capacity_margin_is_the_largest_additional_force(name: str) -> None:
    robot = load_robot(name)
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


@extended
@pytest.mark.parametrize("name", ["article-mixed", "falcon-7", "fast"])
def test_capacity_margin_is_not_underestimated(name: str) -> None:
    sample = sampled(load_robot(name), 40, np.random.default_rng(28), Elastic())
    margins = capacity_margin(sample.plan.state)
    ways = _directions(300)  # 12 degrees apart: a face at distance d is hit within d / cos 8 degrees
    for i in np.flatnonzero(sample.plan.feasible)[:2]:
        reach = min(_reach(sample, int(i), way) for way in ways)
        assert margins[i] <= reach * (1 + 1e-6)
        assert margins[i] >= reach * 0.97


def _directions(count: int) -> np.ndarray:
    """Uniformly distributed over the sphere by the golden angle."""
    k = np.arange(count)
    z, turn = 1 - (2 * k + 1) / count, np.pi * (1 + 5**0.5) * k
    return np.column_stack((np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z))


def _reach(sample: Sample, i: int, way: np.ndarray) -> float:
    """Largest force along a direction: a linear program in the tensions and the force."""
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
