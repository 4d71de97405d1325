"""Forward kinematics compared with plans, with SciPy and an independent balance, and from distant starts."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
import scipy.optimize
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.feasible import angle_error, box_poses, by_tier, feasible_plan, moved, position_error, unbalance
from tests.refusal import refused

COGIRO = sl.load_robot("cogiro")
SUSPENDED = sl.load_robot("article-suspended")
MODELS = [sl.Catenary(), sl.Elastic(), sl.Parabolic(), sl.Empirical()]
Status = sl.ForwardStatus


def newtons(robot: sl.Robot) -> float:
    """Residual due to rounding of the pose alone, with a margin: 1e-8 N, more for the cabin of 30 t."""
    return max(1e-8, 2e-12 * float(robot.tension_max.max()))


@pytest.mark.parametrize("name", by_tier(sl.robot_names()))
def test_plans_are_confirmed_and_found_without_a_start(name: str) -> None:
    robot = sl.load_robot(name)
    plan = feasible_plan(robot, 60, seed=7)
    pose = plan.state.pose
    near = sl.forward(robot, plan.unstrained_length, start=pose)
    assert position_error(near, pose).max() < 1e-11
    assert angle_error(near, pose).max() < 1e-11
    assert near.wrench_residual.max() < newtons(robot)
    np.testing.assert_allclose(near.state.chord_tension, plan.chord_tension, rtol=1e-7)
    assert near.solved.all()
    far = sl.forward(robot, plan.unstrained_length)
    assert far.solved.all()
    assert position_error(far, pose).max() < 1e-9
    assert angle_error(far, pose).max() < 1e-9


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
def test_every_model_inverts_its_own_plan_under_load(model: sl.CableModel) -> None:
    wrench = (30.0, -20.0, 15.0, 5.0, -8.0, 6.0)
    pose = box_poses(COGIRO, 40, seed=8)
    plan = sl.inverse(COGIRO, pose, model=model, tension=sl.MinimumNorm(), wrench=wrench)
    keep = np.flatnonzero(plan.feasible)
    assert len(keep) > 30
    start = moved(pose, 0.05, 1.0, seed=9)[keep]
    found = sl.forward(COGIRO, plan.unstrained_length[keep], start, model, wrench)
    assert position_error(found, pose[keep]).max() < 1e-9
    assert angle_error(found, pose[keep]).max() < 1e-9
    assert found.wrench_residual.max() < 1e-8
    assert np.isnan(found.energy).all() == (type(model) in (sl.Parabolic, sl.Empirical))


def scipy_pose(robot: sl.Robot, lengths: Array, guess: sl.Pose, wrench: Array) -> tuple[Array, Rotation]:
    """MINPACK with the balance of the public catenary, in position and rotation vector from the initial pose."""
    base = Rotation.from_quat(guess.quaternion.copy())

    def balance(x: Array) -> Array:
        return unbalance(robot, sl.Catenary(), lengths, x[:3], Rotation.from_rotvec(x[3:]) * base, wrench)

    x = scipy.optimize.root(balance, np.append(guess.position, np.zeros(3)), tol=1e-13).x
    return x[:3], Rotation.from_rotvec(x[3:]) * base


def test_scipy_finds_the_same_pose() -> None:
    plan = feasible_plan(COGIRO, 5, seed=10)
    rng = np.random.default_rng(11)
    wrench = np.array([10.0, 20.0, -30.0, 3.0, 4.0, -5.0])
    lengths = plan.unstrained_length + rng.normal(scale=2e-3, size=(5, 8))  # arbitrary lengths
    found = sl.forward(COGIRO, lengths, plan.state.pose, wrench=wrench)
    for i in range(5):
        position, rotation = scipy_pose(COGIRO, lengths[i], plan.state.pose[i], wrench)
        np.testing.assert_allclose(found.pose.position[i], position, atol=1e-9)
        np.testing.assert_allclose(found.pose.matrix[i], rotation.as_matrix(), atol=1e-9)


@pytest.mark.parametrize(("degrees", "share"), [(2.0, 1.0), (20.0, 1.0), (40.0, 0.98)])
def test_a_start_off_by_a_meter(degrees: float, share: float) -> None:
    plan = feasible_plan(COGIRO, 200, seed=12)
    pose = plan.state.pose
    found = sl.forward(COGIRO, plan.unstrained_length, moved(pose, 1.0, degrees, seed=13))
    assert found.stable.all()
    assert found.wrench_residual.max() < 1e-8
    assert np.mean(position_error(found, pose) < 1e-9) >= share
    assert found.iterations.max() < 60


def test_a_trajectory_continues_from_its_first_pose() -> None:
    path = sl.article_path(rate=100.0)
    plan = sl.inverse(SUSPENDED, path)
    found = sl.forward(SUSPENDED, plan.unstrained_length, path.pose[0], wrench=plan.state.wrench)
    assert position_error(found, path.pose).max() < 1e-9
    assert found.iterations[1:].max() <= 5


@pytest.mark.parametrize("model", MODELS, ids=lambda m: type(m).__name__)
def test_a_trajectory_agrees_with_steps_from_the_previous_pose(model: sl.CableModel) -> None:
    plan = feasible_plan(COGIRO, 1, seed=24, model=model)
    rng = np.random.default_rng(25)
    steps = rng.normal(scale=np.geomspace(1e-6, 3e-2, 40)[:, None], size=(40, 8))  # jumps in different directions
    lengths = np.insert(plan.unstrained_length[0] + steps, [3, 20], np.nan, axis=0)  # two samples without a solution
    loads = rng.normal(scale=np.tile([0.0, 40.0], 21)[:, None], size=(42, 6))
    chain = sl.forward(COGIRO, lengths, plan.state.pose[0], model, loads)
    at = plan.state.pose[0]
    for i in range(len(lengths)):
        alone = sl.forward(COGIRO, lengths[i], at, model, loads[i])
        assert alone.status == chain.status[i]
        if alone.status != Status.NO_LENGTHS:
            at = chain.pose[i]
            assert position_error(alone, at) < 1e-11
            assert angle_error(alone, at) < 1e-11
            np.testing.assert_allclose(chain.stiffness_min[i], alone.stiffness_min, rtol=1e-7)
    assert chain.wrench_residual[chain.stable].max() < 1e-8


def test_a_step_of_a_trajectory_takes_two_newton_steps() -> None:
    start = feasible_plan(COGIRO, 1, seed=27).state.pose[0]
    position = start.position + 2e-3 * np.arange(30)[:, None] * np.array([0.6, 0.0, 0.8])
    turn = Rotation.from_rotvec(1e-3 * np.arange(30)[:, None] * np.array([0.0, 0.0, 1.0]))
    pose = sl.Pose(position, turn * Rotation.from_quat(start.quaternion.copy()))
    plan = sl.inverse(COGIRO, pose, tension=sl.MinimumNorm())
    assert plan.feasible.all()
    found = sl.forward(COGIRO, plan.unstrained_length, pose[0])
    assert found.iterations.max() <= 2  # three without the first-order prediction for the new lengths
    assert position_error(found, pose).max() < 1e-12


def test_the_smallest_stiffness_is_an_eigenvalue() -> None:
    plan = feasible_plan(COGIRO, 20, seed=26)
    found = sl.forward(COGIRO, plan.unstrained_length, plan.state.pose)
    levers = COGIRO.platform_anchors - COGIRO.center_of_mass
    arc = np.repeat([1.0, 1.0 / np.sqrt((levers**2).sum(axis=1).mean())], 3)
    scaled = arc[:, None] * sl.stiffness(found.state).matrix * arc
    expected = np.linalg.eigvalsh(0.5 * (scaled + np.swapaxes(scaled, 1, 2)))
    np.testing.assert_allclose(found.stiffness_min, expected[:, 0], atol=1e-13 * expected.max())


def test_samples_of_a_batch_do_not_depend_on_each_other() -> None:
    plan = feasible_plan(COGIRO, 20, seed=14)
    together = sl.forward(COGIRO, plan.unstrained_length)
    alone = sl.forward(COGIRO, plan.unstrained_length[13])
    np.testing.assert_array_equal(together.pose.position[13], alone.pose.position)
    assert alone.status.shape == ()
    assert alone.state.cables.shape == (8,)


def test_the_energy_is_minimal_at_the_solution() -> None:
    plan = feasible_plan(COGIRO, 1, seed=15)
    found = sl.forward(COGIRO, plan.unstrained_length[0])
    held = []
    for k in range(200):  # the pose with a wrench that balances it there: its energy is that of forward
        near = moved(found.pose, 1e-3, 0.05, seed=k)
        rotation = Rotation.from_quat(near.quaternion.copy())
        wrench = -unbalance(COGIRO, sl.Catenary(), plan.unstrained_length[0], near.position, rotation, np.zeros(6))
        state = sl.forward(COGIRO, plan.unstrained_length[0], near, wrench=wrench)
        assert position_error(state, near) < 1e-12
        held.append(float(state.energy) + wrench[:3] @ (near.position + near.matrix @ COGIRO.center_of_mass))
    assert min(held) > float(found.energy)


def test_a_rigid_motion_of_the_world_moves_the_solution() -> None:
    plan = feasible_plan(COGIRO, 3, seed=16)
    turn, shift = Rotation.from_rotvec([0.0, 0.0, 0.7]), np.array([1.0, -2.0, 5.0])
    robot = COGIRO.replace(frame_anchors=turn.apply(COGIRO.frame_anchors.copy()) + shift)
    found = sl.forward(robot, plan.unstrained_length)
    np.testing.assert_allclose(found.pose.position, turn.apply(plan.state.pose.position.copy()) + shift, atol=1e-9)
    np.testing.assert_allclose(found.pose.matrix, turn.as_matrix() @ plan.state.pose.matrix, atol=1e-9)


def test_cables_without_weight_are_elastic() -> None:
    plan = feasible_plan(COGIRO, 1, seed=17)
    light = COGIRO.replace(cables=sl.Cable(np.full(8, 1e-9), COGIRO.cables.axial_stiffness))
    exact = sl.forward(light, plan.unstrained_length[0])
    elastic = sl.forward(COGIRO, plan.unstrained_length[0], model=sl.Elastic())
    np.testing.assert_allclose(exact.pose.position, elastic.pose.position, atol=1e-7)
    heavy = sl.forward(COGIRO, plan.unstrained_length[0])
    assert position_error(heavy, elastic.pose) > 1e-5


# possible failures


def test_lengths_too_short_to_meet() -> None:
    found = sl.forward(COGIRO, np.full(8, 4.0))
    assert found.status == Status.OVERSTRETCHED
    assert "too short" in Status(int(found.status)).text
    assert (found.state.cables.chord_tension / COGIRO.cables.axial_stiffness).max() > 0.1
    assert found.wrench_residual.max() < 1e-4


def test_long_lengths_leave_few_taut_cables() -> None:
    lengths = sl.inverse(COGIRO, sl.Pose((0, 0, 2.0), np.eye(3))).unstrained_length
    lengths = lengths + 6.0 * np.array([0, 1, 1, 0, 1, 1, 0, 1])
    found = sl.forward(COGIRO, lengths)
    assert found.status == Status.LOOSE
    assert found.stable
    assert not found.solved
    assert found.slack.sum() >= 3
    assert found.wrench_residual.max() < 1e-8


def test_a_cable_is_slack_below_half_the_weight_of_its_chord() -> None:
    found = sl.forward(COGIRO, sl.inverse(COGIRO, sl.Pose((0, 0, 2.0), np.eye(3))).unstrained_length)
    cables = found.state.cables
    half = 0.5 * COGIRO.cables.linear_density * 9.81 * np.hypot(cables.span, cables.rise)
    shares = np.array([0.0, 0.5, 0.99, 1.01, 1.5, 1.99, 3.0, 100.0])
    hung = replace(found, state=replace(found.state, cables=replace(cables, chord_tension=shares * half)))
    assert hung.slack.tolist() == [True] * 3 + [False] * 5
    weightless = replace(cables, chord_tension=shares * half, model=sl.Elastic())
    assert replace(found, state=replace(found.state, cables=weightless)).slack.tolist() == [True] + [False] * 7


def test_rows_without_lengths_have_no_solution() -> None:
    pose = sl.Pose([[0, 0, 1.5], [0, 0, 9.0], [0.5, 0, 1.5]], np.tile(np.eye(3), (3, 1, 1)))
    plan = sl.inverse(SUSPENDED, pose)
    assert plan.feasible.tolist() == [True, False, True]
    for start in (None, pose, pose[0]):
        found = sl.forward(SUSPENDED, plan.unstrained_length, start)
        assert found.status.tolist() == [Status.SOLVED, Status.NO_LENGTHS, Status.SOLVED]
        assert np.isnan(found.pose.position[1]).all()
        assert np.isnan(found.pose.matrix[1]).all()
        assert np.isnan(sl.modes(found.state).frequency).all(axis=1).tolist() == [False, True, False]
        assert np.abs(found.pose.position - pose.position)[[0, 2]].max() < 1e-9


@pytest.mark.parametrize(
    ("lengths", "parts"),
    [
        ([5.0] * 7, ("unstrained_length", "of shape (7,)", "shape (8,) or (N, 8)")),
        ([5.0] * 7 + [-1.0], ("cable 7: unstrained length", "-1 m")),
        ([5.0] * 3 + [np.nan] + [5.0] * 4, ("cable 3: unstrained length", "nan m")),
        ([[5.0] * 8, [5.0] * 6 + [np.inf, 5.0]], ("sample 1, cable 6: unstrained length", "inf m")),
        ([[5.0] * 8, [5.0] * 6 + [0.0, 5.0]], ("sample 1, cable 6: unstrained length", "0 m")),
        (["long"] * 8, ("unstrained_length", None, "numbers")),
    ],
)
def test_wrong_lengths_are_refused_by_the_cable(lengths: list[float], parts: tuple[str | None, ...]) -> None:
    with refused(*parts, kind=sl.InvalidValueError):
        sl.forward(COGIRO, lengths)


def test_a_wrong_count_of_starts_or_wrenches_is_refused() -> None:
    lengths = np.full((3, 8), 5.0)
    with refused("start", "2 poses", "one pose, or 3"):
        sl.forward(COGIRO, lengths, box_poses(COGIRO, 2, seed=0))
    with refused("start", "2 poses", "one pose, for one sample"):
        sl.forward(COGIRO, lengths[0], box_poses(COGIRO, 2, seed=0))
    with pytest.raises(sl.InvalidValueError, match="wrench"):
        sl.forward(COGIRO, lengths, wrench=np.zeros((2, 6)))


def top_heavy() -> sl.Robot:
    return SUSPENDED.replace(center_of_mass=(0.0, 0.0, 3.0), tension_min=0.0)


def test_an_unstable_equilibrium_has_a_status_and_is_avoided_without_a_start() -> None:
    robot = top_heavy()
    pose = sl.Pose((0.0, 0.0, 1.5), np.eye(3))
    plan = sl.inverse(robot, pose)
    assert plan.feasible
    there = sl.forward(robot, plan.unstrained_length, pose)
    assert there.status == Status.UNSTABLE
    assert not there.stable
    assert there.stiffness_min < 0.0
    assert position_error(there, pose) < 1e-9
    elsewhere = sl.forward(robot, plan.unstrained_length)
    assert elsewhere.stable
    assert elsewhere.energy < there.energy
    assert angle_error(elsewhere, pose) > 0.3


def test_the_number_of_steps_is_bounded_for_any_start() -> None:
    plan = feasible_plan(COGIRO, 100, seed=18)
    rng = np.random.default_rng(19)
    count = len(plan.unstrained_length)
    start = sl.Pose(rng.uniform(-50, 50, (count, 3)), Rotation.from_quat(rng.normal(size=(count, 4))))
    found = sl.forward(COGIRO, plan.unstrained_length, start)
    assert found.iterations.max() <= 180
    assert np.isin(found.status, (Status.SOLVED, Status.LOOSE, Status.OVERSTRETCHED, Status.NOT_CONVERGED)).all()
    assert (found.wrench_residual[found.stable] < 1e-8).all()
    assert found.stable.mean() > 0.95


# other robots


def test_a_platform_on_four_cables_finds_its_equilibrium() -> None:
    frame = [[20, 15, 12], [-20, 15, 12], [-20, -15, 12], [20, -15, 12]]
    platform = [[0.2, 0.2, 0.1], [-0.2, 0.2, 0.1], [-0.2, -0.2, 0.1], [0.2, -0.2, 0.1]]
    robot = sl.Robot(
        "camera", frame, platform, sl.Cable(0.03, 2e5), 25.0, 0.5 * np.eye(3), center_of_mass=(0.01, -0.02, -0.3)
    )
    found = sl.forward(robot, [21.0, 24.0, 29.5, 27.0])
    assert found.status == Status.SOLVED
    assert found.wrench_residual.max() < 1e-9
    position, rotation = scipy_pose(robot, found.state.cables.unstrained_length, found.pose, np.zeros(6))
    np.testing.assert_allclose(found.pose.position, position, atol=1e-9)
    np.testing.assert_allclose(found.pose.matrix, rotation.as_matrix(), atol=1e-9)
    moment = unbalance(robot, sl.Catenary(), found.state.cables.unstrained_length, position, rotation, np.zeros(6))
    assert np.abs(moment).max() < 1e-8


def point_mass() -> sl.Robot:
    frame = [[3, 2, 4], [-3, 2, 4], [-3, -2, 4], [3, -2, 4]]
    return sl.Robot("point", frame, np.zeros((4, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T", tension_min=5.0)


def planar(normal: tuple[float, float, float], pattern: Literal["1R2T", "2T"]) -> sl.Robot:
    """Four cables around a square platform in a plane through the origin."""
    normal_ = np.array(normal) / np.linalg.norm(normal)
    first = np.cross((0.0, 0.0, 1.0), normal_) if abs(normal_[2]) < 0.99 else np.array([1.0, 0.0, 0.0])
    axes = np.stack((first / np.linalg.norm(first), np.cross(normal_, first / np.linalg.norm(first))))
    corners = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
    return sl.Robot(
        "planar",
        3.0 * corners @ axes,
        0.3 * corners[:, ::-1] @ axes if pattern == "1R2T" else np.zeros((4, 3)),
        sl.Cable(0.01, 5e4),
        3.0,
        np.eye(3),
        motion_pattern=pattern,
        plane_normal=normal,
        tension_min=20.0,
        tension_max=5000.0,
    )


@pytest.mark.parametrize("normal", [(0, 0, 1), (0, 1, 0), (1, 2, 0), (0.3, -0.2, 1.0)])
@pytest.mark.parametrize("pattern", ["1R2T", "2T"])
def test_planar_robots_recover_their_poses(pattern: Literal["1R2T", "2T"], normal: tuple[float, float, float]) -> None:
    robot = planar(normal, pattern)
    at = robot.freedom[:2, :3]
    turn = Rotation.from_rotvec(0.1 * np.asarray(robot.plane_normal)) if pattern == "1R2T" else Rotation.identity()
    pose = sl.Pose(0.4 * at[0] - 0.3 * at[1], turn)
    plan = sl.inverse(robot, pose)
    assert plan.feasible
    found = sl.forward(robot, plan.unstrained_length)
    assert found.status == Status.SOLVED
    assert position_error(found, pose) < 1e-9
    assert angle_error(found, pose) < 1e-9
    assert found.wrench_residual.max() < 1e-8
    if pattern == "2T":
        assert len(sl.equilibria(robot, plan.unstrained_length)) == 1


def test_weight_has_no_influence_in_a_level_plane() -> None:
    pose = sl.Pose((0.3, -0.4, 0.0), np.eye(3))
    light = planar((0, 0, 1), "2T")
    lengths = sl.inverse(light, pose).unstrained_length
    np.testing.assert_allclose(sl.inverse(light.replace(mass=1e4), pose).unstrained_length, lengths, rtol=1e-14)
    found = sl.forward(light.replace(mass=1e4), lengths)
    np.testing.assert_allclose(found.pose.position, pose.position, atol=1e-9)


def test_a_point_mass_recovers_its_position_and_has_one_equilibrium() -> None:
    robot = point_mass()
    pose = sl.Pose((0.7, -0.5, 1.2), np.eye(3))
    plan = sl.inverse(robot, pose)
    assert plan.feasible
    found = sl.equilibria(robot, plan.unstrained_length)
    assert len(found) == 1
    assert found.starts == 1
    np.testing.assert_allclose(found.solutions.pose.position, [pose.position], atol=1e-9)
    with_moment = sl.forward(robot, plan.unstrained_length, wrench=(0, 0, 0, 5.0, 5.0, 5.0))
    np.testing.assert_allclose(with_moment.pose.position, pose.position, atol=1e-9)  # no influence on a point mass


# straight cables


def chords(robot: sl.Robot, pose: sl.Pose) -> Array:
    ends = pose.position[..., None, :] + robot.platform_anchors @ np.swapaxes(pose.matrix, -1, -2)
    length: Array = np.linalg.norm(ends - robot.frame_anchors, axis=-1)
    return length


def test_straight_cables_are_fitted() -> None:
    pose = box_poses(COGIRO, 30, seed=20)
    found = sl.forward(COGIRO, chords(COGIRO, pose), moved(pose, 0.1, 3.0, seed=21), sl.Straight())
    assert (found.status == Status.FITTED).all()
    assert not found.stable.any()
    assert position_error(found, pose).max() < 1e-9
    assert found.state.cables.closure_residual.max() < 1e-9
    assert np.isnan(found.state.cables.chord_tension).all()


def test_fits_of_straight_cables_agree_with_scipy() -> None:
    pose = box_poses(COGIRO, 4, seed=22)
    lengths = chords(COGIRO, pose) + np.random.default_rng(23).normal(scale=0.01, size=(4, 8))
    found = sl.forward(COGIRO, lengths, pose, sl.Straight())
    for i in range(4):
        base = Rotation.from_quat(pose.quaternion[i].copy())

        def errors(x: Array, i: int = i, base: Rotation = base) -> Array:
            error: Array = chords(COGIRO, sl.Pose(x[:3], Rotation.from_rotvec(x[3:]) * base)) - lengths[i]
            return error

        best = scipy.optimize.least_squares(errors, np.append(pose.position[i], np.zeros(3)), xtol=1e-15, ftol=1e-15)
        np.testing.assert_allclose(found.pose.position[i], best.x[:3], atol=1e-7)
        assert found.energy[i] == pytest.approx(best.cost, rel=1e-9)
