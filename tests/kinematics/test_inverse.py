import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline import (
    AnalyticCenter,
    Cable,
    CableGeometryError,
    CableModel,
    CableStatus,
    Catenary,
    Closest,
    Elastic,
    Empirical,
    InvalidValueError,
    InverseSolver,
    LowestSum,
    MinimumNorm,
    Parabolic,
    Pose,
    PoseStatus,
    Robot,
    Straight,
    article_balance,
    article_path,
    inverse,
    load_robot,
    quintic_path,
    robot_names,
    structure_matrix,
    without_cables,
)
from tests.kinematics.feasible import Variable
from tests.refusal import refused
from tests.tension.reference import nearest, needed, planar, random_poses, structure, unbalanced
from tests.tiers import wide

MODELS = (Catenary(), Straight(), Elastic(), Empirical(), Parabolic())
LEVEL = np.eye(3)


@pytest.mark.parametrize("name", robot_names())
@pytest.mark.parametrize("model", wide(MODELS, first=2), ids=lambda model: type(model).__name__)
def test_cables_balance_weight_and_wrench(name: str, model: CableModel) -> None:
    robot, rng = load_robot(name), np.random.default_rng(1)
    poses = random_poses(robot, 200, rng)
    load = rng.normal(size=(200, 6)) * 0.02 * robot.mass * robot.gravity
    load[:, 3:] *= np.ptp(robot.platform_anchors, axis=0).max()
    plan = inverse(robot, poses, model=model, tension=MinimumNorm(), wrench=load)
    assert plan.feasible.sum() > 100
    scale = max(1.0, 1e-6 * robot.tension_max.max())  # forces of FAST are meganewtons
    left = np.abs(unbalanced(plan)[plan.feasible])
    assert left.max() <= 1e-8 * scale
    assert plan.wrench_residual[plan.feasible].max() <= 1e-8 * scale
    tensions = plan.chord_tension[plan.feasible]
    slack = 1e-12 * robot.tension_max
    assert (tensions >= robot.tension_min - slack).all()
    assert (tensions <= robot.tension_max + slack).all()


def test_kernel_balance_and_article_balance_agree_with_the_definition() -> None:
    robot = load_robot("article-mixed").replace(center_of_mass=[0.02, -0.01, 0.05])
    poses = random_poses(robot, 30, np.random.default_rng(2))
    matrices, article = structure_matrix(robot, poses), article_balance(robot, poses)
    plan = inverse(robot, poses, model=Empirical(), tension=MinimumNorm())
    assert plan.feasible.sum() > 20
    for i in np.flatnonzero(plan.feasible):
        pose = poses[int(i)]
        np.testing.assert_allclose(matrices[i], structure(robot, pose), atol=1e-14)
        # the article's system holds for our horizontal tensions: H t_x + b = 0 without inertia
        left = article.h[i] @ plan.horizontal_tension[i] + article.b[i]
        np.testing.assert_allclose(left, 0.0, atol=1e-9)
        cosine = plan.state.cables.span[i] / plan.state.cables.chord[i]
        np.testing.assert_allclose(article.h[i] * cosine, matrices[i], atol=1e-13)


@pytest.mark.parametrize("variable", ["chord", "horizontal"])
@pytest.mark.parametrize("name", wide(["article-mixed", "falcon-7", "article-suspended", "cogiro", "ipanema-3"]))
def test_minimum_norm_and_closest_are_those_of_a_quadratic_program(name: str, variable: Variable) -> None:
    robot, rng = load_robot(name), np.random.default_rng(3)
    poses = random_poses(robot, 40, rng)
    path = quintic_path(poses.position[:5], durations=[20.0] * 4, rate=5)
    weight = np.zeros(6)
    at_limits = 0
    for motion, method in ((poses, MinimumNorm(variable)), (path, Closest(variable))):
        plan = inverse(robot, motion, model=Elastic(), tension=method)
        before = None
        for i in np.flatnonzero(plan.feasible):
            pose = plan.state.pose[int(i)]
            cosine = plan.state.cables.span[i] / plan.state.cables.chord[i]
            scale = cosine if variable == "horizontal" else np.ones(robot.cable_count)
            load = plan.state.wrench[i] if plan.state.wrench.ndim == 2 else weight
            target = np.zeros(robot.cable_count) if before is None or motion is poses else before
            best = nearest(
                structure(robot, pose) / scale,
                needed(robot, load),
                robot.tension_min * scale,
                robot.tension_max * scale,
                target,
                np.ones(robot.cable_count),
            )
            found = plan.chord_tension[i] * scale
            at_limits += int((np.abs(plan.chord_tension[i] - robot.tension_min) < 1e-9).any())
            np.testing.assert_allclose(found, best, atol=1e-6 * found.max())
            before = found
    assert at_limits > 0 or name in ("article-suspended", "cogiro")  # with limits far inside of the box


def test_closest_depends_on_the_path_and_minimum_norm_does_not() -> None:
    robot, path = load_robot("article-mixed"), article_path(rate=10)
    closest, least = inverse(robot, path), inverse(robot, path, tension=MinimumNorm())
    np.testing.assert_array_equal(path.pose.position[0], path.pose.position[-1])
    np.testing.assert_allclose(least.chord_tension[0], least.chord_tension[-1], rtol=1e-9)
    np.testing.assert_allclose(closest.chord_tension[0], least.chord_tension[0], rtol=1e-12)
    assert np.abs(closest.chord_tension[0] - closest.chord_tension[-1]).max() > 1.0


def test_poses_of_a_batch_are_independent_and_previous_continues() -> None:
    robot, path = load_robot("article-suspended"), article_path(rate=10)
    alone = inverse(robot, path.pose)
    np.testing.assert_array_equal(alone.chord_tension, inverse(robot, path.pose, tension=MinimumNorm()).chord_tension)
    whole = inverse(robot, path.pose, previous=inverse(robot, path.pose[0]))
    first = inverse(robot, path.pose[:300])
    carried = inverse(robot, path.pose[:300], previous=inverse(robot, path.pose[0]))
    rest = inverse(robot, path.pose[300:], previous=carried)
    np.testing.assert_array_equal(rest.chord_tension, whole.chord_tension[300:])
    assert np.abs(rest.chord_tension - alone.chord_tension[300:]).max() > 1e-3
    assert np.abs(carried.chord_tension - first.chord_tension).max() > 1e-3


@pytest.mark.parametrize("variable", ["chord", "horizontal"])
@pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
def test_limits_at_the_frame_end_are_met_exactly(model: CableModel, variable: Variable) -> None:
    robot = load_robot("article-mixed").replace(tension_limits_of="frame_end")
    poses = random_poses(robot, 100, np.random.default_rng(4))
    plan = inverse(robot, poses, model=model, tension=MinimumNorm(variable))
    tension = plan.state.cables.frame_end_tension[plan.feasible]
    assert tension.min() == pytest.approx(25.0, abs=1e-9)
    assert (np.abs(tension - 25.0) < 1e-9).sum() > 50
    assert tension.max() <= 2000.0 + 1e-9


@pytest.mark.parametrize("share", np.linspace(0.2, 1.5, 14))
def test_frame_end_limits_near_the_least_catenary_tension(share: float) -> None:
    robot = load_robot("ipanema-1").replace(cables=Cable(0.07, 24e3), tension_limits_of="frame_end", tension_min=0.0)
    pose = Pose([0.0, 0.0, 1.2], LEVEL)
    chord = np.linalg.norm(pose.transform(robot.platform_anchors) - robot.frame_anchors, axis=1)
    limit = share * 0.5 * 0.07 * robot.gravity * chord
    floor = robot.frame_anchors[:, 2] < 1.0
    low = inverse(robot.replace(tension_min=limit), pose)
    assert low.feasible
    assert (low.state.cables.frame_end_tension >= limit - 1e-9).all()
    # no plan keeps an upper limit below the tension of every catenary
    high = inverse(robot.replace(tension_max=np.where(floor, limit, 720.0)), pose)
    assert high.feasible == (share > 1.05)
    assert high.feasible or high.status == PoseStatus.INFEASIBLE


def test_article_bound_keeps_the_lowest_point_outside_the_span() -> None:
    robot, margin = load_robot("article-mixed").replace(tension_min=0.0), 3.0
    poses = random_poses(robot, 100, np.random.default_rng(5))
    plain = inverse(robot, poses, model=Empirical(), tension=MinimumNorm("horizontal"))
    bound = inverse(robot, poses, model=Empirical(), tension=MinimumNorm("horizontal", lowest_point_margin=margin))
    state = bound.state.cables
    weight = robot.cables.linear_density * robot.gravity
    least = 0.5 * weight * state.chord * state.span / np.abs(state.rise) + margin
    gap = (bound.horizontal_tension - least)[bound.feasible]
    assert bound.feasible.sum() > 10
    assert gap.min() == pytest.approx(0.0, abs=1e-9)
    assert (plain.horizontal_tension - least)[plain.feasible].min() < -1.0
    assert not (state.status[bound.feasible] == CableStatus.BELOW_VALIDITY).any()


def test_infeasible_poses_have_only_the_reason() -> None:
    robot = load_robot("article-suspended")
    path = quintic_path([(0, 0, 1.5), (7.4, 0, 1.5), (0, 0, 1.5), (7.45, 0, 1.5)], durations=[5, 5, 5], rate=20)
    plan = inverse(robot, path)
    lost = ~plan.feasible
    assert 10 < lost.sum() < len(lost) - 10
    assert np.isnan(plan.chord_tension[lost]).all()
    assert np.isnan(plan.unstrained_length[lost]).all()
    assert (plan.shortfall[lost] > 0).all()
    assert (plan.shortfall[~lost] == 0).all()
    assert len(plan.gaps) == 2
    covered = np.concatenate([np.arange(gap.first, gap.last + 1) for gap in plan.gaps])
    np.testing.assert_array_equal(covered, np.flatnonzero(lost))
    for gap in plan.gaps:
        assert gap.status is PoseStatus.INFEASIBLE
        assert gap.shortfall == plan.shortfall[gap.first : gap.last + 1].max()
        assert gap.cables
    after, before = plan.gaps[0].last + 1, plan.gaps[0].first - 1
    # the last feasible set is the reference after the gap, as for a solver without the gap
    solver = InverseSolver(robot)
    for i in (*range(before + 1), after):
        step = solver.step(path.pose.position[i], path.pose.quaternion[i], plan.state.wrench[i])
    np.testing.assert_allclose(step.chord_tension, plan.chord_tension[after], rtol=1e-9)


def test_known_answer_of_a_planar_robot() -> None:
    pull = np.array([-4.955131227, 0.055732486])
    plan = inverse(planar(), Pose([0.08, 0.045, 0.0], LEVEL), tension=MinimumNorm(), wrench=[*-pull, 0, 0, 0, 0])
    np.testing.assert_allclose(plan.chord_tension, [5.209314465, 3.8, 3.8, 6.876421727], atol=2e-9)


def test_equal_limits_leave_one_solution() -> None:
    robot = planar(tension_min=10.0, tension_max=10.0)
    centered = inverse(robot, Pose(np.zeros(3), LEVEL), tension=MinimumNorm())
    np.testing.assert_allclose(centered.chord_tension, 10.0, rtol=1e-12)
    assert not inverse(robot, Pose([0.01, 0.0, 0.0], LEVEL), tension=MinimumNorm()).feasible


def test_no_upper_limit() -> None:
    robot = load_robot("article-mixed").replace(tension_max=np.inf)
    limited = load_robot("article-mixed")
    poses = random_poses(robot, 50, np.random.default_rng(6))
    found, same = (inverse(r, poses, tension=MinimumNorm()) for r in (robot, limited))
    both = found.feasible & same.feasible
    assert both.sum() > 20
    np.testing.assert_allclose(found.chord_tension[both], same.chord_tension[both], rtol=1e-9)
    assert (found.feasible | ~same.feasible).all()


@pytest.mark.parametrize("variable", ["chord", "horizontal", "frame_end"])
def test_closest_to_feasible_tensions_are_these_tensions(variable: Variable) -> None:
    robot = load_robot("article-mixed")
    pose = random_poses(robot, 1, np.random.default_rng(3))[0]
    before = inverse(robot, pose, tension=AnalyticCenter())
    same = inverse(robot, pose, tension=Closest(variable), previous=before)
    np.testing.assert_allclose(same.chord_tension, before.chord_tension, rtol=1e-9)
    assert np.abs(inverse(robot, pose, tension=Closest(variable)).chord_tension - before.chord_tension).max() > 1.0


def test_the_solver_does_not_keep_the_previous_wrench() -> None:
    robot, pose = load_robot("article-suspended"), Pose([1.0, 0.5, 2.0], np.eye(3))
    wrench = np.array([30.0, -20.0, -100.0, 1.0, 2.0, 3.0])
    solver = InverseSolver(robot, tension=MinimumNorm())
    at = pose.position, pose.quaternion
    free, loaded = (inverse(robot, pose, tension=MinimumNorm(), wrench=load).chord_tension for load in (None, wrench))
    np.testing.assert_allclose(solver.step(*at, wrench).chord_tension, loaded, rtol=1e-12)
    np.testing.assert_allclose(solver.step(*at).chord_tension, free, rtol=1e-12)
    assert np.abs(free - loaded).max() > 1.0


def test_solver_agrees_with_inverse() -> None:
    robot, path = load_robot("article-suspended"), article_path(rate=5)
    plan = inverse(robot, path.pose, previous=inverse(robot, path.pose[0]))
    solver = InverseSolver(robot)
    out = np.empty(8)
    solver.step(path.pose.position[0], path.pose.quaternion[0])
    for i, (position, quaternion) in enumerate(zip(path.pose.position, path.pose.quaternion, strict=True)):
        step = solver.step(position, quaternion)
        np.testing.assert_array_equal(step.unstrained_length, plan.unstrained_length[i])
        np.testing.assert_array_equal(step.chord_tension, plan.chord_tension[i])
        np.testing.assert_array_equal(step.vertical_force, plan.vertical_force[i])
    assert solver.step_into(position, quaternion, out) is PoseStatus.SOLVED
    np.testing.assert_allclose(out, plan.unstrained_length[-1], rtol=1e-12)
    lost = solver.step([7.45, 0.0, 1.5], [0.0, 0.0, 0.0, 1.0])
    assert lost.status is PoseStatus.INFEASIBLE
    assert np.isnan(lost.unstrained_length).all()
    assert lost.shortfall > 0
    solver.reset()
    fresh = solver.step(path.pose.position[7], path.pose.quaternion[7])
    np.testing.assert_array_equal(fresh.chord_tension, inverse(robot, path.pose[7]).chord_tension)


def test_singular_pose() -> None:
    # all cables meet the axis through the center of mass: no cable resists a rotation about it
    corners = np.array([[3.0, 3, 3], [-3, 3, 3], [-3, -3, 3], [3, -3, 3]])
    frame = np.concatenate((corners, corners * [1, 1, -1]))
    ends = np.repeat([[0.0, 0, 0.2], [0, 0, -0.2]], 4, axis=0)
    robot = Robot("spinning", frame, ends, Cable(0.01, 1e5), 5.0, np.eye(3), tension_min=1.0, tension_max=1e3)
    plan = inverse(robot, Pose([0.1, 0.0, 0.0], LEVEL))
    assert plan.status == PoseStatus.SINGULAR
    assert np.isnan(plan.chord_tension).all()
    assert np.isnan(plan.shortfall)


def test_bad_input() -> None:
    robot = load_robot("article-suspended")
    pose = Pose([0, 0, 1.5], LEVEL)
    with refused("wrench", "of shape (2, 6)", "shape (6,)"):
        inverse(robot, pose, wrench=np.zeros((2, 6)))
    with refused("wrench[2]", "nan N or N m"):
        inverse(robot, pose, wrench=[0, 0, np.nan, 0, 0, 0])
    with refused("position[1]", "nan m"):
        InverseSolver(robot).step([0, np.nan, 0], [0, 0, 0, 1])
    with refused("article-suspended: number of cables", "5", "3, 4 or >= 6 for 3R3T"):
        inverse(without_cables(robot, 0, 1, 2), pose)
    other = inverse(load_robot("falcon-7"), Pose([-0.25, 0, 0.75], LEVEL))
    with refused("previous", "a plan of 7 cables", "8 cables"):
        inverse(robot, pose, previous=other)
    with refused("variable", "'sum'"):
        MinimumNorm("sum")  # type: ignore[arg-type]
    with refused("pose, cable 0: distance between its ends", "0 m", kind=CableGeometryError):
        inverse(robot, Pose(robot.frame_anchors[0] - robot.platform_anchors[0], Rotation.identity()))


def test_empirical_model_below_its_range_is_reported_and_unchanged() -> None:
    robot = load_robot("article-mixed").replace(tension_min=1.0)
    poses = random_poses(robot, 50, np.random.default_rng(8))
    plan = inverse(robot, poses, model=Empirical(), tension=MinimumNorm())
    cables = plan.state.cables
    weight = robot.cables.linear_density * 4.845 * cables.chord
    below = cables.chord_tension * np.abs(cables.rise) / cables.chord <= weight
    below[~plan.feasible] = False
    told = [f"cable {i}: at {count} of 50 poses" for i, count in enumerate(below.sum(axis=0)) if count]
    assert told
    assert [text.split(" its tension")[0] for text in plan.warnings] == told
    assert np.nanmin(plan.chord_tension) == pytest.approx(1.0)
    exact = inverse(robot, poses, tension=MinimumNorm())
    assert exact.at_border is not None
    # one pose was found by a search at the boundary, which is the only information on the exact model
    assert [text.split(" are at")[0] for text in exact.warnings] == [f"{exact.at_border.sum()} of 50 poses"]


def test_tensions_continue_along_the_plan() -> None:
    robot = load_robot("cogiro")
    poses = Pose.from_euler([[0.0, 0.0, 2.0], [0.4, 0.1, 2.1]], 0.0, 0.0, 0.0)
    before = inverse(robot, poses[0], tension=LowestSum())
    continued = inverse(robot, poses[1], previous=before)
    again = inverse(robot, poses[1], previous=before.chord_tension.tolist())
    np.testing.assert_array_equal(continued.chord_tension, again.chord_tension)
    assert not np.allclose(continued.chord_tension, inverse(robot, poses[1]).chord_tension, rtol=1e-3)
    for wrong in (before.chord_tension[:7], 3.0, "closest", [np.nan] * 8):
        with pytest.raises(InvalidValueError, match="previous"):
            inverse(robot, poses[1], previous=wrong)


def test_models_and_methods_by_their_names_on_the_command_line() -> None:
    robot, pose = sl.load_robot("cogiro"), (1.0, 1.0, 2.0)
    for model, kind in (("elastic", sl.Elastic()), ("straight", sl.Straight())):
        named, made = sl.inverse(robot, pose, model=model), sl.inverse(robot, pose, kind)
        np.testing.assert_array_equal(named.unstrained_length, made.unstrained_length)
        assert isinstance(named.state.cables.model, type(kind))
    for method, choice in (("centroid", sl.Centroid()), ("improved-closed-form", sl.ImprovedClosedForm())):
        named = sl.inverse(robot, pose, tension=method)
        np.testing.assert_array_equal(named.chord_tension, sl.inverse(robot, pose, tension=choice).chord_tension)
    with refused("model", "'elastik'", "straight, elastic, empirical, parabolic, catenary"):
        sl.inverse(robot, pose, model="elastik")
    with refused("tension", "3"):
        sl.inverse(robot, pose, tension=3)  # type: ignore[arg-type]
