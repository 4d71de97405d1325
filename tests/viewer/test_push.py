"""A push and its effects compared with balances, differences and independent linear programs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import sagline as sl
from sagline import structure_matrix
from sagline.viewer.features import push
from sagline.viewer.features.push import Push, PushResponse
from sagline.viewer.page import home_pose
from tests.refusal import refused
from tests.tiers import wide

NAMES = wide(["cogiro", "falcon-7", "fast", "ipanema-2-pulleys"], 3)


def rest(name: str, model: sl.CableModel | None = None) -> sl.Equilibrium:
    """At home, turned a little, with tensions that are at no limit."""
    robot = sl.load_robot(name)
    home = home_pose(robot)
    pose = sl.Pose.from_euler(home.position, 0.03, -0.02, 0.01)
    return sl.inverse(robot, pose, model or sl.Catenary(), tension=sl.Centroid()).state


def push_of(state: sl.Equilibrium, size: float = 0.02) -> Push:
    """A force of a share of the middling tension, at a corner of the platform, in no special direction."""
    force = size * float(np.median(state.limited_tension)) * np.array([0.6, -0.3, 0.74])
    return Push(force, state.one_robot.platform_anchors[2])


def end_forces(state: sl.Equilibrium) -> np.ndarray:
    """Forces of the cables on the platform at their ends, in the horizontal direction to their exits, and up."""
    ends = state.pose.transform(state.one_robot.platform_anchors)
    away = (state.exit_point - ends)[:, :2]
    level = away / np.linalg.norm(away, axis=1, keepdims=True)
    return np.column_stack((level * state.cables.horizontal_tension[:, None], -state.cables.vertical_force))


@pytest.mark.parametrize("name", NAMES)
def test_the_displaced_platform_is_in_balance_with_fixed_lengths(name: str) -> None:
    state = rest(name)
    robot, push = state.one_robot, push_of(state)
    found = PushResponse.of(state, push)
    assert found.loaded is not None
    np.testing.assert_allclose(found.loaded.unstrained_length, state.unstrained_length, rtol=1e-9)
    center = found.loaded.pose.transform(robot.center_of_mass)
    ends = found.loaded.pose.transform(robot.platform_anchors)
    pulls = end_forces(found.loaded)
    weight = np.array([0.0, 0.0, -robot.mass * robot.gravity])
    size = np.abs(pulls).max()
    np.testing.assert_allclose(pulls.sum(axis=0) + weight + push.force, 0.0, atol=1e-6 * size)
    # the moment of the force is that about the center of mass at the rest before: it does not turn with the platform
    lever = state.pose.matrix @ (push.at - robot.center_of_mass)
    moment = np.cross(ends - center, pulls).sum(axis=0) + np.cross(lever, push.force)
    np.testing.assert_allclose(moment, 0.0, atol=1e-6 * size * np.abs(ends - center).max())
    assert np.linalg.norm(found.displacement) > 0.0


@pytest.mark.parametrize("name", NAMES)
def test_the_compliance_agrees_with_differences_of_forward(name: str) -> None:
    state = rest(name)
    robot, at = state.one_robot, push_of(state).at
    found = PushResponse.of(state, push_of(state))
    small = 1e-4 * float(np.median(state.limited_tension))
    columns = []
    for axis in np.eye(3):
        places = []
        for sign in (1.0, -1.0):
            force = sign * small * axis
            moment = np.cross(state.pose.matrix @ (at - robot.center_of_mass), force)
            there = sl.forward(robot, state.unstrained_length, state.pose, wrench=np.hstack((force, moment)))
            places.append(there.pose.transform(at))
        columns.append((places[0] - places[1]) / (2.0 * small))
    by_differences = np.column_stack(columns)
    np.testing.assert_allclose(found.compliance, by_differences, atol=1e-4 * np.abs(by_differences).max())
    lengths, directions = found.semi_axes
    assert np.all(np.diff(lengths) >= 0.0)
    # the ellipsoid is where forces of 1 N in all directions take the place
    some = np.random.default_rng(3).normal(size=(50, 3))
    some /= np.linalg.norm(some, axis=1, keepdims=True)
    inside = (some @ by_differences.T) @ directions / lengths
    np.testing.assert_allclose(np.linalg.norm(inside, axis=1), 1.0, atol=2e-3)


@pytest.mark.parametrize("name", NAMES)
def test_the_reserve_with_fixed_lengths_agrees_with_forward(name: str) -> None:
    state = rest(name)
    robot, push = state.one_robot, push_of(state)
    held = PushResponse.of(state, push).reserve
    assert held.cable is not None
    assert 0.0 < held.force < np.inf

    def margin(times: float) -> np.ndarray:
        force = times * held.force * push.force / np.linalg.norm(push.force)
        moment = np.cross(state.pose.matrix @ (push.at - robot.center_of_mass), force)
        there = sl.forward(robot, state.unstrained_length, state.pose, wrench=np.hstack((force, moment)))
        tension = there.state.limited_tension
        return np.asarray(np.stack((tension - robot.tension_min, robot.tension_max - tension)))

    assert np.all(margin(0.999) > 0.0)
    beyond = margin(1.001)
    assert np.argwhere(beyond < 0.0).tolist() == [[int(held.upper), held.cable]]
    for part in np.linspace(0.05, 0.95, 10):
        assert np.all(margin(part) > 0.0)


@pytest.mark.parametrize("name", NAMES[:3])
def test_the_reserve_with_redistribution_agrees_with_a_linear_program(name: str) -> None:
    state = rest(name, sl.Elastic())  # weightless: then tensions balance a load linearly
    robot, push = state.one_robot, push_of(state)
    shared = PushResponse.of(state, push).redistributed
    along = push.force / np.linalg.norm(push.force)
    lever = state.pose.matrix @ (push.at - robot.center_of_mass)
    load = np.hstack((along, np.cross(lever, along)))
    weight = np.array([0.0, 0.0, -robot.mass * robot.gravity, 0.0, 0.0, 0.0])
    matrix = structure_matrix(robot, state.pose)
    if not np.allclose(matrix @ state.limited_tension + weight, 0.0, atol=1e-6 * state.limited_tension.max()):
        matrix = -matrix
    np.testing.assert_allclose(matrix @ state.limited_tension + weight, 0.0, atol=1e-6 * state.limited_tension.max())
    m = robot.cable_count
    scale = float(state.limited_tension.max())
    bounds = [(low / scale, high / scale) for low, high in zip(robot.tension_min, robot.tension_max, strict=True)]
    answer = linprog(
        np.append(np.zeros(m), -1.0), A_eq=np.column_stack((matrix, load)), b_eq=-weight / scale,
        bounds=[*bounds, (0.0, None)],
    )  # fmt: skip
    assert answer.status == 0
    assert shared.force == pytest.approx(-answer.fun * scale, rel=1e-3)


def test_a_cable_at_its_limit_leaves_no_reserve_against_it() -> None:
    robot = sl.load_robot("falcon-7")
    state = sl.inverse(robot, home_pose(robot), tension=sl.MinimumNorm()).state
    at_limit = int(np.argmin(state.limited_tension - robot.tension_min))
    assert state.limited_tension[at_limit] == pytest.approx(robot.tension_min[at_limit], rel=1e-9)
    towards = robot.frame_anchors[at_limit] - state.pose.transform(robot.platform_anchors[at_limit])
    force = 5.0 * towards / np.linalg.norm(towards)
    found = PushResponse.of(state, Push(force, robot.platform_anchors[at_limit]))
    assert found.reserve.force < 1e-3  # N
    assert (found.reserve.cable, found.reserve.upper) == (at_limit, False)
    away = PushResponse.of(state, Push(-force, robot.platform_anchors[at_limit]))
    assert away.reserve.cable != at_limit or away.reserve.force > 0.0


def test_the_displacement_is_magnified_and_the_factor_stated() -> None:
    state = rest("cogiro")
    found = PushResponse.of(state, push_of(state))
    assert found.loaded is not None
    once, often = found.scaled_pose(1.0), found.scaled_pose(20.0)
    assert once is not None
    assert often is not None
    np.testing.assert_allclose(once.matrix, found.loaded.pose.matrix, atol=1e-12)
    np.testing.assert_allclose(once.position, found.loaded.pose.position, atol=1e-12)
    place = state.pose.transform(found.push.at)
    np.testing.assert_allclose(often.transform(found.push.at) - place, 20.0 * found.displacement, atol=1e-12)
    told = push.response_text(found, 100.0)
    assert f"{1e3 * np.linalg.norm(found.displacement):.3g}\N{NO-BREAK SPACE}mm" in told
    assert f"cable {found.reserve.cable}" in told
    assert f"{found.redistributed.force - found.force:.1f} N more" in told


def test_straight_cables_have_no_displacement() -> None:
    with refused("push: cable model", "straight", "one that stretches", kind=sl.InvalidValueError):
        PushResponse.of(rest("cogiro", sl.Straight()), push_of(rest("cogiro")))


def test_an_unconstrained_motion_is_reported() -> None:
    state = rest("cogiro")
    found = replace(PushResponse.of(state, push_of(state)), compliance=np.full((3, 3), np.nan), loaded=None)
    told = push.response_text(found, None)
    assert "no equilibrium" in told
    assert "no cable" in told
    assert found.scaled_pose(1.0) is None
