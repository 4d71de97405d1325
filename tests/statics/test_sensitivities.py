"""Sensitivities of `stiffness` to anchors, tensions and lengths, compared with differences of forward solutions."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.kinematics.feasible import feasible_plan, motion_between
from tests.statics.test_stiffness import richardson
from tests.tiers import wide


def step_of(state: sl.Equilibrium) -> float:
    """Change of anchors and lengths [m] for which tensions change by at most a few percent."""
    cables = state.cables
    stiffest = (state.one_robot.cables.axial_stiffness / cables.unstrained_length).max()
    return min(0.03 * float(cables.frame_end_tension.min() / stiffest), 2e-4)


def planar() -> sl.Robot:
    """Four cables around a square platform in a vertical plane."""
    corners = np.array([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0], [-1.0, 0.0, -1.0], [1.0, 0.0, -1.0]])
    ends = corners[:, [2, 1, 0]]
    return sl.Robot(
        "planar",
        3.0 * corners,
        0.3 * ends,
        sl.Cable(0.05, 5e4),
        3.0,
        np.eye(3),
        motion_pattern="1R2T",
        plane_normal=(0, 1, 0),
        tension_min=20.0,
        tension_max=5000.0,
    )


def point() -> sl.Robot:
    """A point mass on four cables."""
    frame = [[3, 2, 4], [-3, 2, 4], [-3, -2, 4], [3, -2, 4]]
    return sl.Robot("point", frame, np.zeros((4, 3)), sl.Cable(0.05, 5e4), 10.0, motion_pattern="3T", tension_min=5.0)


def one_pose(robot: sl.Robot, model: sl.CableModel) -> sl.Equilibrium:
    """An equilibrium off the middle, with a wrench, tilted if the platform can rotate."""
    if robot.name == "planar":
        pose = sl.Pose((0.4, 0.0, -0.3), Rotation.from_rotvec((0.0, 0.1, 0.0)))
    elif robot.name == "point":
        pose = sl.Pose((0.7, -0.5, 1.2), np.eye(3))
    else:
        pose = feasible_plan(robot, 8, seed=31).state.pose[0]
    plan = sl.inverse(robot, pose, model=model, tension=sl.MinimumNorm())
    assert plan.feasible
    push = 0.05 * robot.mass * robot.gravity * np.array([1.0, -0.5, 0.3, 0.1, 0.2, -0.1])
    return sl.forward(robot, plan.unstrained_length, pose, model, push).state


CASES = [
    (sl.load_robot("cogiro"), sl.Catenary()),
    (sl.load_robot("cogiro"), sl.Elastic()),
    (sl.load_robot("cogiro"), sl.Parabolic()),
    (sl.load_robot("cogiro"), sl.Empirical()),
    (sl.load_robot("article-suspended"), sl.Catenary()),
    (sl.load_robot("ipanema-1"), sl.Catenary()),
    (sl.load_robot("falcon-7"), sl.Catenary()),
    (planar(), sl.Catenary()),
    (planar(), sl.Elastic()),
    (point(), sl.Catenary()),
    (point(), sl.Parabolic()),
]
NAMES = [f"{robot.name}, {type(model).__name__}" for robot, model in CASES]


class Moved:
    """Equilibrium of the platform after a change of one datum."""

    def __init__(self, state: sl.Equilibrium) -> None:
        self.state = state
        self.rest = self.solve(state.one_robot)
        self.step = step_of(state)

    def solve(self, robot: sl.Robot, wound: Array | float = 0.0) -> sl.ForwardSolution:
        state = self.state
        lengths = state.cables.unstrained_length + wound
        found = sl.forward(robot, lengths, state.pose, state.cables.model, state.wrench)
        assert found.stable
        return found

    def by_frame(self, i: int, k: int) -> Callable[[float], Array]:
        return lambda h: self.by_robot(frame_anchors=self.shifted(self.state.one_robot.frame_anchors, i, k, h))

    def by_platform(self, i: int, k: int) -> Callable[[float], Array]:
        return lambda h: self.by_robot(platform_anchors=self.shifted(self.state.one_robot.platform_anchors, i, k, h))

    def by_winch(self, column: Array) -> Callable[[float], Array]:
        return lambda h: motion_between(self.rest, self.solve(self.state.one_robot, h * column))

    def by_robot(self, **anchors: Array) -> Array:
        return motion_between(self.rest, self.solve(self.state.one_robot.replace(**anchors)))

    @staticmethod
    def shifted(anchors: Array, i: int, k: int, h: float) -> Array:
        moved = anchors.copy()
        moved[i, k] += h
        return moved

    def tensions(self, i: int) -> Callable[[float], Array]:
        one = np.eye(self.state.one_robot.cable_count)[i]
        return lambda h: self.solve(self.state.one_robot, h * one).state.cables.frame_end_tension


def agree(found: Array, expected: Array) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-7 * np.abs(expected).max())


@pytest.mark.parametrize(("robot", "model"), wide(CASES, first=4), ids=NAMES)
def test_sensitivities_to_anchors_are_the_slopes_of_the_forward_solution(robot: sl.Robot, model: sl.CableModel) -> None:
    state = one_pose(robot, model)
    stiff, moved = sl.stiffness(state), Moved(state)
    for i in (0, robot.cable_count - 1):
        frame = [richardson(moved.by_frame(i, k), moved.step) for k in range(3)]
        agree(stiff.frame_anchor_sensitivity[:, i], np.transpose(frame))
        platform = [richardson(moved.by_platform(i, k), moved.step) for k in range(3)]
        agree(stiff.platform_anchor_sensitivity[:, i], np.transpose(platform))


@pytest.mark.parametrize(("robot", "model"), CASES, ids=NAMES)
def test_sensitivities_of_tensions_are_the_slopes_of_the_forward_solution(
    robot: sl.Robot, model: sl.CableModel
) -> None:
    state = one_pose(robot, model)
    moved = Moved(state)
    slopes = [richardson(moved.tensions(i), moved.step) for i in range(robot.cable_count)]
    agree(sl.stiffness(state).tension_sensitivity, np.transpose(slopes))


@pytest.mark.parametrize(("robot", "model"), CASES, ids=NAMES)
def test_null_lengths_change_tensions_but_not_the_pose(robot: sl.Robot, model: sl.CableModel) -> None:
    state = one_pose(robot, model)
    stiff, moved = sl.stiffness(state), Moved(state)
    null = stiff.null_lengths
    spare = robot.cable_count - robot.degrees_of_freedom
    assert null.shape == (robot.cable_count, spare)
    np.testing.assert_allclose(null.T @ null, np.eye(spare), atol=1e-13)
    usual = np.abs(richardson(moved.by_winch(np.eye(robot.cable_count)[0]), moved.step)).max()
    for column in null.T:
        assert np.abs(richardson(moved.by_winch(column), moved.step)).max() < 1e-6 * usual
        assert np.abs(stiff.tension_sensitivity @ column).max() > 1.0


@pytest.mark.parametrize("model", [sl.Catenary(), sl.Elastic(), sl.Empirical()], ids=lambda m: type(m).__name__)
def test_cable_stiffness_is_the_slope_of_the_force_on_the_platform_end(model: sl.CableModel) -> None:
    state = one_pose(sl.load_robot("cogiro"), model)
    robot, cables = state.one_robot, state.cables
    reach = state.pose.position + robot.platform_anchors @ state.pose.matrix.T - robot.frame_anchors

    def forces(shift: Array) -> Array:
        x, y, z = (reach + shift).T
        hung = model.from_length(robot.cables, np.hypot(x, y), z, cables.unstrained_length, robot.gravity)
        level = (reach + shift)[:, :2] / np.hypot(x, y)[:, None]
        return np.column_stack((level * hung.horizontal_tension[:, None], hung.vertical_force))

    columns = [richardson(lambda h, one=one: forces(h * one), 1e-4) for one in np.eye(3)]
    agree(sl.stiffness(state).cable_stiffness, np.stack(columns, axis=-1))


def test_a_batch_agrees_with_its_poses_and_poses_without_lengths_are_nan() -> None:
    robot = sl.load_robot("article-suspended")
    plan = sl.inverse(robot, sl.Pose([[0.3, 0.2, 1.5], [0, 0, 9.0], [1.0, 0, 2.0]], np.tile(np.eye(3), (3, 1, 1))))
    assert plan.feasible.tolist() == [True, False, True]
    stiff = sl.stiffness(plan.state)
    alone = sl.stiffness(sl.inverse(robot, plan.state.pose[2]).state)
    for name, shape in {
        "cable_stiffness": (8, 3, 3),
        "frame_anchor_sensitivity": (6, 8, 3),
        "platform_anchor_sensitivity": (6, 8, 3),
        "tension_sensitivity": (8, 8),
        "null_lengths": (8, 2),
    }.items():
        values = getattr(stiff, name)
        assert values.shape == (3, *shape)
        assert np.isnan(values[1]).all()
        assert not np.isnan(values[[0, 2]]).any()
        assert not values.flags.writeable
        if name != "null_lengths":  # a basis; any other of the same plane is equally valid
            np.testing.assert_allclose(values[2], getattr(alone, name), rtol=1e-9, atol=1e-9 * np.abs(values[2]).max())


def test_singular_platforms_have_no_sensitivities_and_nonredundant_ones_no_null_lengths() -> None:
    frame = [[3, 3, 3], [-3, 3, 3], [-3, -3, 3], [3, -3, 3]]
    robot = sl.Robot("point", frame, np.zeros((4, 3)), sl.Cable(0.05, 5e4), 10.0, np.eye(3))
    stiff = sl.stiffness(sl.forward(robot, [4.4] * 4).state)
    assert np.isnan(stiff.frame_anchor_sensitivity).all()
    assert np.isnan(stiff.platform_anchor_sensitivity).all()
    assert np.isnan(stiff.tension_sensitivity).all()
    assert stiff.null_lengths.shape == (4, 0)
    assert np.isfinite(stiff.cable_stiffness).all()
