"""All tension distribution methods on linear (weightless) balances, compared with other programs and brute force."""

import pickle
from typing import Any

import numpy as np
import pytest
from scipy.optimize import linprog, minimize

from sagline import (
    AnalyticCenter,
    Cable,
    Catenary,
    Centroid,
    ClosedForm,
    Closest,
    Elastic,
    ImprovedClosedForm,
    InvalidValueError,
    LowestMaximum,
    LowestSum,
    MinimumNorm,
    PNorm,
    PolygonWalk,
    Pose,
    PoseStatus,
    Puncture,
    QuadraticProgram,
    Robot,
    TensionMethod,
    inverse,
    load_robot,
    tension_polygon,
    without_cables,
)
from sagline.kernels import codes
from sagline.tension.methods import methods_by_name
from tests.refusal import refused
from tests.tension.reference import nearest, needed, planar, random_poses, structure
from tests.tiers import wide

CLOSED = (ClosedForm(), ImprovedClosedForm(), Puncture())
WALKS = (PolygonWalk(), PolygonWalk(optimum="1-norm"), PolygonWalk(optimum="centroid"))
ANY_NUMBER = (
    MinimumNorm(),
    Closest(),
    QuadraticProgram(weights=3.0, target=200.0),
    LowestSum(),
    LowestMaximum(),
    PNorm(),
    AnalyticCenter(),
)
ALL = (*ANY_NUMBER, Centroid(), *CLOSED, *WALKS)


def many_cables(cables: int, seed: int) -> Robot:
    """The mixed robot of the article with additional cables from its walls."""
    mixed, rng = load_robot("article-mixed"), np.random.default_rng(seed)
    more = rng.uniform(-1, 1, (cables - 8, 3)) * [7.5, 5.5, 3.0] + [0, 0, 3]
    side = rng.integers(0, 2, cables - 8)
    more[np.arange(cables - 8), side] = np.sign(more[np.arange(cables - 8), side]) * np.array([7.5, 5.5])[side]
    return mixed.replace(
        name="many",
        frame_anchors=np.concatenate((mixed.frame_anchors, more)),
        platform_anchors=np.concatenate((mixed.platform_anchors, rng.uniform(-0.2, 0.2, (cables - 8, 3)))),
        cables=Cable(0.067, 44e3),
        tension_min=25.0,
        tension_max=2000.0,
    )


MANY = [(many_cables(m, seed), m) for m, seed in ((9, 1), (10, 2), (12, 3), (16, 4), (24, 5))]


CASES = [(name, method) for name in ("article-mixed", "cogiro") for method in ALL]
CASES += [(name, method) for name in ("falcon-7", "fast") for method in ALL if method not in WALKS]  # only n + 2 cables


@pytest.mark.parametrize(("name", "method"), CASES)
def test_balance_and_limits_hold(name: str, method: TensionMethod) -> None:
    robot, rng = load_robot(name), np.random.default_rng(1)
    poses = random_poses(robot, 300, rng, stretch=1.2)
    plan, least = inverse(robot, poses, tension=method), inverse(robot, poses, tension=MinimumNorm())
    found = plan.feasible
    assert plan.wrench_residual[found].max() <= 1e-8 * max(1.0, 1e-6 * robot.tension_max.max())
    slack = 2e-10 * robot.tension_max
    assert (plan.chord_tension[found] >= robot.tension_min - slack).all()
    assert (plan.chord_tension[found] <= robot.tension_max + slack).all()
    np.testing.assert_array_equal(plan.status == PoseStatus.INFEASIBLE, least.status == PoseStatus.INFEASIBLE)
    if method not in CLOSED:
        np.testing.assert_array_equal(found, least.feasible)


@pytest.mark.parametrize("robot", wide([robot for robot, _ in MANY], first=2), ids=[f"{m} cables" for _, m in MANY])
def test_many_cables_agree_with_other_programs(robot: Robot) -> None:
    poses = random_poses(robot, 15, np.random.default_rng(7), stretch=1.1)
    rng = np.random.default_rng(8)
    load = rng.normal(size=(15, 6)) * [80, 80, 80, 20, 20, 20]
    weights, target = rng.uniform(0.5, 2, robot.cable_count), rng.uniform(0, 200, robot.cable_count)
    plans = {
        method: inverse(robot, poses, model=Elastic(), tension=method, wrench=load)
        for method in (*ANY_NUMBER, QuadraticProgram(weights=weights, target=target))
    }
    ones = np.ones(robot.cable_count)
    solved = 0
    for i, pose in enumerate(poses):
        matrix, right = structure(robot, pose), needed(robot, load[i])
        bounds = np.column_stack((robot.tension_min, robot.tension_max))
        verdict = linprog(ones, A_eq=matrix, b_eq=right, bounds=bounds)
        for method, plan in plans.items():
            assert bool(plan.feasible[i]) == (verdict.status == 0), method
        if verdict.status != 0:
            continue
        solved += 1
        found = {type(method): plan.chord_tension[i] for method, plan in plans.items()}
        for tensions in found.values():
            np.testing.assert_allclose(matrix @ tensions, right, atol=1e-8)
        assert found[LowestSum].sum() == pytest.approx(verdict.fun, rel=1e-9)
        assert found[LowestMaximum].max() == pytest.approx(_lowest_maximum(robot, matrix, right), rel=1e-9)
        limits = (matrix, right, robot.tension_min, robot.tension_max)
        np.testing.assert_allclose(found[MinimumNorm], nearest(*limits, 0 * ones, ones), atol=1e-5)
        np.testing.assert_allclose(found[QuadraticProgram], nearest(*limits, target, weights), atol=1e-5)
        _check_stationary(robot, matrix, found[AnalyticCenter], _barrier_slope(robot, found[AnalyticCenter]))
        _check_p_norm(robot, matrix, found[PNorm], 4.0)
    assert solved >= 5


def _lowest_maximum(robot: Robot, matrix: np.ndarray, right: np.ndarray) -> float:
    m = robot.cable_count
    found = linprog(
        np.append(np.zeros(m), 1.0),
        A_ub=np.column_stack((np.eye(m), -np.ones(m))),
        b_ub=np.zeros(m),
        A_eq=np.column_stack((matrix, np.zeros(len(matrix)))),
        b_eq=right,
        bounds=[*zip(robot.tension_min, robot.tension_max, strict=True), (0, None)],
    )
    assert found.status == 0
    return float(found.fun)


def _null(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.svd(matrix)[2][len(matrix) :])


def _barrier_slope(robot: Robot, tensions: np.ndarray) -> np.ndarray:
    return np.asarray(1 / (robot.tension_max - tensions) - 1 / (tensions - robot.tension_min))


def _check_stationary(robot: Robot, matrix: np.ndarray, tensions: np.ndarray, slope: np.ndarray) -> None:
    """No motion in the null space decreases the objective."""
    assert np.abs(_null(matrix) @ slope).max() < 1e-7 * np.abs(slope).max()


def _check_p_norm(robot: Robot, matrix: np.ndarray, tensions: np.ndarray, p: float) -> None:
    """Karush-Kuhn-Tucker: the slope is J^T y plus multipliers of cables at their limits."""
    slope = (tensions / tensions.max()) ** (p - 1)
    at_low = tensions <= robot.tension_min + 1e-7
    at_high = tensions >= robot.tension_max - 1e-7
    free = ~(at_low | at_high)
    y = np.linalg.lstsq(matrix.T[free], slope[free], rcond=None)[0]
    rest = slope - matrix.T @ y
    assert np.abs(rest[free]).max() < 1e-6
    if np.linalg.matrix_rank(matrix[:, free]) == len(matrix):
        assert (rest[at_low] > -1e-6).all()
        assert (rest[at_high] < 1e-6).all()


@pytest.mark.parametrize("name", wide(["article-suspended", "falcon-7", "article-mixed", "ipanema-1"], first=2))
def test_few_cables_agree_with_other_programs(name: str) -> None:
    robot = load_robot(name)
    poses = random_poses(robot, 40, np.random.default_rng(9))
    methods = (LowestSum(), LowestMaximum(), PNorm(p=4.0), PNorm(p=16.0), AnalyticCenter(), PNorm(p=2.0), MinimumNorm())
    plans = [inverse(robot, poses, model=Elastic(), tension=method).chord_tension for method in methods]
    feasible = np.isfinite(plans[0][:, 0])
    assert feasible.sum() > 20
    for i in np.flatnonzero(feasible):
        matrix, right = structure(robot, poses[int(i)]), needed(robot, np.zeros(6))
        bounds = np.column_stack((robot.tension_min, robot.tension_max))
        lowest = linprog(np.ones(robot.cable_count), A_eq=matrix, b_eq=right, bounds=bounds)
        assert plans[0][i].sum() == pytest.approx(lowest.fun, rel=1e-9)
        assert plans[1][i].max() == pytest.approx(_lowest_maximum(robot, matrix, right), rel=1e-8)
        _check_p_norm(robot, matrix, plans[2][i], 4.0)
        _check_p_norm(robot, matrix, plans[3][i], 16.0)
        _check_stationary(robot, matrix, plans[4][i], _barrier_slope(robot, plans[4][i]))
        np.testing.assert_allclose(plans[5][i], plans[6][i], rtol=1e-8)


def test_lowest_maximum_breaks_ties_by_norm() -> None:
    robot = planar()
    pull = np.array([4.0, 1.0])
    pose = Pose([0.05, -0.02, 0.0], np.eye(3))
    found = inverse(robot, pose, tension=LowestMaximum(), wrench=[*-pull, 0, 0, 0, 0]).chord_tension
    matrix = robot.freedom @ structure(robot, pose)
    top = found.max()
    best = nearest(matrix, pull, robot.tension_min, np.full(4, top + 1e-9), np.zeros(4), np.ones(4))
    np.testing.assert_allclose(found, best, atol=1e-6)


@pytest.mark.parametrize("name", ["article-mixed", "article-suspended", "cogiro", "ipanema-1"])
def test_polygon_walk_and_cut_agree(name: str) -> None:
    robot = load_robot(name)
    poses = random_poses(robot, 500, np.random.default_rng(10), stretch=1.2)
    same = (LowestSum(), MinimumNorm(), Centroid())
    for optimum, other in zip(("1-norm", "2-norm", "centroid"), same, strict=True):
        walked = inverse(robot, poses, model=Elastic(), tension=PolygonWalk(optimum=optimum))  # type: ignore[arg-type]
        cut = inverse(robot, poses, model=Elastic(), tension=other)
        np.testing.assert_array_equal(walked.status, cut.status)
        assert 50 < walked.feasible.sum() < 500 or name != "article-mixed"
        np.testing.assert_allclose(walked.chord_tension, cut.chord_tension, rtol=1e-7, atol=1e-7)


def test_centroid_by_sampling() -> None:
    robot, rng = load_robot("article-mixed"), np.random.default_rng(11)
    pose = Pose([1.0, -0.5, 2.5], np.eye(3))
    polygon = tension_polygon(robot, pose, model=Elastic())
    low, high = polygon.vertices.min(axis=0), polygon.vertices.max(axis=0)
    points = rng.uniform(low, high, (400_000, 2))
    tensions = polygon.origin + points @ polygon.basis
    inside = ((tensions >= robot.tension_min) & (tensions <= robot.tension_max)).all(axis=1)
    found = polygon.coordinates(inverse(robot, pose, model=Elastic(), tension=Centroid()).chord_tension)
    spread = (high - low) / np.sqrt(inside.sum())
    assert (np.abs(points[inside].mean(axis=0) - found) < 3 * spread).all()


def test_closed_forms_by_definition() -> None:
    robot = load_robot("article-mixed")
    poses = random_poses(robot, 200, np.random.default_rng(12))
    plans = [inverse(robot, poses, model=Elastic(), tension=method) for method in CLOSED]
    middle = (robot.tension_min + robot.tension_max) / 2
    held = 0
    for i, pose in enumerate(poses):
        matrix, right = structure(robot, pose), needed(robot, np.zeros(6))
        simple = middle + np.linalg.pinv(matrix) @ (right - matrix @ middle)
        improved = _improved(matrix, right, robot.tension_min, robot.tension_max)
        if (simple >= robot.tension_min).all() and (simple <= robot.tension_max).all():
            np.testing.assert_allclose(plans[0].chord_tension[i], simple, rtol=1e-9)
        else:
            assert plans[0].status[i] in (PoseStatus.NOT_COVERED, PoseStatus.INFEASIBLE)
        if improved is None:
            assert plans[1].status[i] in (PoseStatus.NOT_COVERED, PoseStatus.INFEASIBLE)
            continue
        held += int(np.abs(improved - simple).max() > 1.0)
        np.testing.assert_allclose(plans[1].chord_tension[i], improved, rtol=1e-8)
        least = np.linalg.pinv(matrix) @ right  # the puncture is on the line between the two
        way, there = improved - least, plans[2].chord_tension[i] - least
        share = way @ there / (way @ way)
        np.testing.assert_allclose(there, share * way, atol=1e-7)
        outside = least + (share - 1e-6) * way
        assert share < 1e-9 or (outside < robot.tension_min).any() or (outside > robot.tension_max).any()
    assert held > 20


def _improved(matrix: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray | None:
    """Algorithm of Pott: fix the worst cable at its limit, remove it from the problem, solve again."""
    free, tensions = np.ones(len(low), dtype=bool), np.zeros(len(low))
    for _ in range(matrix.shape[1] - matrix.shape[0] + 1):
        middle = ((low + high) / 2)[free]
        part = matrix[:, free]
        rest = right - matrix[:, ~free] @ tensions[~free]
        tensions[free] = middle + np.linalg.pinv(part) @ (rest - part @ middle)
        miss = np.maximum(low - tensions, tensions - high)
        if miss.max() <= 1e-9:
            return tensions
        worst = int(miss.argmax())
        tensions[worst] = low[worst] if tensions[worst] < low[worst] else high[worst]
        free[worst] = False
        if free.sum() < len(right):
            return None
    return None


@pytest.mark.parametrize("method", [MinimumNorm("frame_end"), PNorm("frame_end", p=4.0), LowestMaximum("frame_end")])
def test_the_objective_of_frame_end_tensions_is_minimal(method: TensionMethod) -> None:
    # SLSQP with exact cables: no other tensions of the pose have a smaller objective at the frame end
    robot = load_robot("cogiro").replace(tension_limits_of="frame_end")
    exponent = {MinimumNorm: 2.0, PNorm: 4.0, LowestMaximum: np.inf}[type(method)]
    for pose in random_poses(robot, 3, np.random.default_rng(13)):
        plan = inverse(robot, pose, tension=method)
        best = np.linalg.norm(plan.state.cables.frame_end_tension, exponent)
        polygon = tension_polygon(robot, pose, variable="chord")
        for vertex in polygon.vertices:
            way = vertex - polygon.coordinates(plan.chord_tension)
            for share in (1e-2, 0.1):
                goal = polygon.origin + (polygon.coordinates(plan.chord_tension) + share * way) @ polygon.basis
                other = inverse(robot, pose, tension=QuadraticProgram(target=np.maximum(goal, 0.0)))
                end = other.state.cables.frame_end_tension
                assert np.linalg.norm(end, exponent) >= best * (1 - 1e-9)


def test_variables_differ() -> None:
    robot = load_robot("cogiro")
    pose = random_poses(robot, 1, np.random.default_rng(14))[0]
    found = [inverse(robot, pose, tension=MinimumNorm(v)).chord_tension for v in ("chord", "horizontal", "frame_end")]
    assert np.abs(found[0] - found[1]).max() > 1.0
    assert 1e-3 < np.abs(found[0] - found[2]).max() < 50.0


def test_broken_cable() -> None:
    robot = load_robot("article-mixed")
    left = without_cables(robot, 5)
    poses = random_poses(robot, 50, np.random.default_rng(3))
    feasible = np.flatnonzero(inverse(left, poses, tension=Centroid()).feasible)
    assert 5 < len(feasible) < 45
    pose = poses[int(feasible[0])]
    matrix = np.delete(structure(robot, pose), 5, axis=1)
    np.testing.assert_allclose(structure(left, pose), matrix)
    alone = inverse(left, pose, model=Elastic(), tension=Centroid())
    np.testing.assert_allclose(matrix @ alone.chord_tension, needed(robot, np.zeros(6)), atol=1e-8)
    with refused("cable", "8", "0 to 7", kind=InvalidValueError):
        without_cables(robot, 8)


def test_remaining_cables_keep_their_material_and_limits() -> None:
    whole = load_robot("article-mixed").replace(
        cables=Cable(0.01 * np.arange(1, 9), 1e4 * np.arange(1, 9)),
        tension_min=np.arange(8.0),
        tension_max=1000.0 + np.arange(8.0),
    )
    left, kept = without_cables(whole, 1, 6), [0, 2, 3, 4, 5, 7]
    np.testing.assert_array_equal(left.frame_anchors, whole.frame_anchors[kept])
    np.testing.assert_array_equal(left.platform_anchors, whole.platform_anchors[kept])
    np.testing.assert_array_equal(left.cables.linear_density, [0.01 * (k + 1) for k in kept])
    np.testing.assert_array_equal(left.cables.axial_stiffness, [1e4 * (k + 1) for k in kept])
    np.testing.assert_array_equal(left.tension_min, kept)
    np.testing.assert_array_equal(left.tension_max, [1000.0 + k for k in kept])
    assert (left.mass, left.name) == (whole.mass, whole.name)


def test_unlimited_cables() -> None:
    robot = planar(tension_max=np.inf)
    pose = Pose([0.1, 0.0, 0.0], np.eye(3))
    for centered in (Centroid(), AnalyticCenter()):
        plan = inverse(robot, pose, tension=centered)
        assert plan.status == PoseStatus.UNBOUNDED
        assert np.isnan(plan.chord_tension).all()
    for method in CLOSED:
        with refused("planar: tension_max[0]", "infinite", "finite", kind=InvalidValueError):
            inverse(robot, pose, tension=method)
    limited = inverse(planar(tension_max=1e4), pose, tension=LowestSum())
    np.testing.assert_allclose(inverse(robot, pose, tension=LowestSum()).chord_tension, limited.chord_tension)


def test_options_are_checked() -> None:
    with refused("p", "1.5", kind=InvalidValueError):
        PNorm(p=1.5)
    with refused("p", "100", "2 to 32", kind=InvalidValueError):
        PNorm(p=100.0)
    with refused("optimum", "'best'", kind=InvalidValueError):
        PolygonWalk(optimum="best")  # type: ignore[arg-type]
    with refused("weights[1]", "0", kind=InvalidValueError):
        QuadraticProgram(weights=[1.0, 0.0])
    with refused("target", "of shape (3,)", kind=InvalidValueError):
        inverse(load_robot("cogiro"), Pose([0, 0, 2.0], np.eye(3)), tension=QuadraticProgram(target=[1.0, 2.0, 3.0]))
    with refused("many: number of cables", "9", "6 to 8 for 3R3T with Centroid", kind=InvalidValueError):
        inverse(MANY[0][0], Pose(np.zeros(3), np.eye(3)), tension=Centroid())
    again = pickle.loads(pickle.dumps(QuadraticProgram(weights=2.0, target=[3.0, 4.0])))
    np.testing.assert_array_equal(again.target, [3.0, 4.0])


def test_p_norm_between_norm_and_maximum() -> None:
    robot = load_robot("article-mixed")
    poses = random_poses(robot, 300, np.random.default_rng(15))
    plans = [inverse(robot, poses, model=Catenary(), tension=PNorm(p=p)) for p in (2.0, 4.0, 8.0, 16.0, 32.0)]
    found = plans[0].feasible
    assert all((plan.feasible == found).all() for plan in plans)
    norms = [2, 4, 8, 16, 32]
    sizes = np.array([[np.linalg.norm(plan.chord_tension[found], q, axis=1) for plan in plans] for q in norms])
    for k in range(len(norms)):  # in its own norm no other is smaller, up to differences of sag forces
        assert (sizes[k, k] <= sizes[k].min(axis=0) * (1 + 1e-5)).all()
    least = inverse(robot, poses, tension=LowestMaximum()).chord_tension[found].max(axis=1)
    top = plans[-1].chord_tension[found].max(axis=1)
    assert (top >= least * (1 - 1e-5)).all()
    assert (
        top <= 8 ** (1 / 32) * least * (1 + 1e-5)
    ).all()  # a p-norm of m numbers is at most m^(1/p) times their maximum


def test_slsqp_agrees_with_p_norm() -> None:
    robot = load_robot("ipanema-1")
    pose = random_poses(robot, 1, np.random.default_rng(16))[0]
    polygon = tension_polygon(robot, pose, model=Elastic())
    found = inverse(robot, pose, model=Elastic(), tension=PNorm(p=6.0)).chord_tension
    scale = found.max()

    def size(point: np.ndarray) -> float:
        return float((((polygon.origin + point @ polygon.basis) / scale) ** 6).sum())

    def gaps(point: np.ndarray) -> np.ndarray:
        tensions = polygon.origin + point @ polygon.basis
        gap = np.concatenate((tensions - robot.tension_min, robot.tension_max - tensions))
        return np.asarray(gap / scale)

    start = polygon.vertices.mean(axis=0)
    best = minimize(size, start, method="SLSQP", constraints={"type": "ineq", "fun": gaps}, options={"ftol": 1e-15})
    assert size(polygon.coordinates(found)) <= best.fun * (1 + 1e-9)


@pytest.mark.parametrize("method", methods_by_name().values())
def test_an_infinite_lower_limit_is_infeasible(method: type[TensionMethod]) -> None:
    """(54) of the article requires an infinite tension of a level cable: a verdict for every method."""
    robot = load_robot("article-suspended").replace(tension_max=1e9)
    anchor, end = robot.frame_anchors[0], robot.platform_anchors[0]
    level = Pose.from_euler([0.0, 0.0, float(anchor[2] - end[2])], 0.0, 0.0, 0.0)
    plan = inverse(robot, level, tension=method(lowest_point_margin=0.0))
    assert plan.status == PoseStatus.INFEASIBLE


def point_mass() -> Robot:
    """Four cables suspend a point mass; the first one is vertical at x = y = 0."""
    frame = [(0.0, 0.0, 6.0), (4.0, 0.0, 6.0), (-2.0, 3.5, 6.0), (-2.0, -3.5, 6.0)]
    return Robot("point", frame, np.zeros((4, 3)), Cable(np.full(4, 1.0), np.full(4, 1e6)), 50.0, motion_pattern="3T")


def test_a_vertical_cable_has_the_bound_of_its_neighborhood() -> None:
    """(54) without a margin: tau > wD/(2 |sin phi|) holds for a vertical cable as for one beside it."""
    method = MinimumNorm(lowest_point_margin=0.0)
    plumb, beside = (
        inverse(point_mass(), Pose.from_euler([x, 0.0, 2.0], 0.0, 0.0, 0.0), tension=method) for x in (0.0, 1e-9)
    )
    assert plumb.status == beside.status
    assert plumb.chord_tension[0] >= 0.5 * 9.81 * 4.0 * (1.0 - 1e-12)
    np.testing.assert_allclose(plumb.chord_tension, beside.chord_tension, rtol=1e-6)


def test_weightless_cables_without_tension_have_a_frame_end_tension() -> None:
    robot = point_mass()
    pose = Pose.from_euler(np.column_stack((np.linspace(0.0, 1.0, 21), np.zeros(21), np.full(21, 2.0))), 0.0, 0.0, 0.0)
    chord, end = (inverse(robot, pose, Elastic(), method) for method in (LowestSum("chord"), LowestSum("frame_end")))
    assert (chord.chord_tension == 0.0).any()
    np.testing.assert_array_equal(end.status, chord.status)
    np.testing.assert_array_equal(end.chord_tension, chord.chord_tension)


def test_an_empty_batch_has_an_empty_result() -> None:
    plan = inverse(point_mass(), Pose.from_euler(np.zeros((0, 3)), 0.0, 0.0, 0.0))
    assert plan.unstrained_length.shape == (0, 4)
    assert plan.feasible.shape == (0,)


@pytest.mark.parametrize(
    ("robot", "item", "value"),
    [
        (None, "robot", "None"),
        (5, "robot", "5"),
        ("cogiro", "robot", "'cogiro'"),
        ([], "robot", "empty"),
        (["cogiro"], "robot[0]", "'cogiro'"),
    ],
)
def test_other_objects_than_robots_are_named(robot: Any, item: str, value: str) -> None:
    allowed = "a Robot, or several in a list" if item == "robot" else "a Robot"
    with refused(item, value, allowed, kind=InvalidValueError):
        inverse(robot, Pose.from_euler([0.0, 0.0, 2.0], 0.0, 0.0, 0.0))


class Own(TensionMethod):
    """A method with any code and any preferences."""

    code = codes.QUADRATIC_PROGRAM
    rows: object = np.ones((2, 8))

    def preference(self, cables: int) -> Any:
        """Preferences that do not depend on the number of cables."""
        return self.rows


@pytest.mark.parametrize("code", [99, -1, codes.METHOD_COUNT, 0.5, None])
def test_a_method_that_the_kernels_do_not_have_is_refused(code: object) -> None:
    with refused("Other.code", str(code), f"0 to {codes.METHOD_COUNT - 1}", kind=InvalidValueError):
        type("Other", (Own,), {"code": code})()
    with refused("Other.code", "missing", kind=InvalidValueError):
        type("Other", (TensionMethod,), {})()


@pytest.mark.parametrize("rows", [np.ones((2, 7)), np.ones(8), np.ones((3, 8)), 1.0, "ab", None])
def test_preferences_of_another_shape_are_refused(rows: object) -> None:
    robot, pose = load_robot("cogiro"), Pose.from_euler([1.0, 0.5, 2.0], 0.0, 0.0, 0.0)
    with refused("Other.preference", kind=InvalidValueError):
        inverse(robot, pose, tension=type("Other", (Own,), {"rows": rows})())
    mean = inverse(robot, pose, tension=type("Other", (Own,), {})())
    np.testing.assert_array_equal(
        mean.chord_tension, inverse(robot, pose, tension=QuadraticProgram(target=1.0)).chord_tension
    )


def test_an_own_preference_states_root_weights_and_plain_targets() -> None:
    robot, pose = load_robot("cogiro"), Pose.from_euler([1.0, 0.5, 2.0], 0.0, 0.0, 0.0)
    weights, target = np.arange(1.0, 9.0), 100.0 * np.arange(1.0, 9.0)
    own = type("Other", (Own,), {"rows": np.stack((np.sqrt(weights), target))})()
    found, quadratic = (
        inverse(robot, pose, Elastic(), tension=each)
        for each in (own, QuadraticProgram(weights=weights, target=target))
    )
    np.testing.assert_array_equal(found.chord_tension, quadratic.chord_tension)
    # no other tensions in balance are nearer to the targets, with these weights
    null = np.linalg.svd(structure(robot, pose))[2][6:]
    assert np.all((found.chord_tension > robot.tension_min) & (found.chord_tension < robot.tension_max))
    np.testing.assert_allclose(null @ (weights * (found.chord_tension - target)), 0.0, atol=1e-8)
