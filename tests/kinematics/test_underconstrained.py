"""Robots with fewer cables than degrees of freedom: the equilibrium determines the rest of the pose."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import sagline as sl
from sagline.core.arrays import Array
from tests.refusal import refused


def suspended(m: int, density: float = 0.01, radius: float | None = None, **changes: Any) -> sl.Robot:
    """A platform of 13 kg under m cables, without symmetry."""
    angle = 2.0 * np.pi * np.arange(m) / m + 0.3
    high = 2.5 + 0.1 * np.sin(3.0 * angle)
    frame = np.stack((2.0 * np.cos(angle), 1.5 * np.sin(angle), high), axis=1)
    ends = np.stack((0.2 * np.cos(angle), 0.15 * np.sin(angle), 0.05 + 0.01 * np.arange(m)), axis=1)
    if m == 2:
        frame, ends = frame * (1.0, 0.0, 1.0), ends * (1.0, 0.0, 1.0)
    given: dict[str, Any] = {
        "name": "suspended", "frame_anchors": frame, "platform_anchors": ends, "cables": sl.Cable(density, 2e4),
        "mass": 13.0, "inertia": np.diag([0.2, 0.2, 0.3]), "center_of_mass": (0.01, 0.0 if m == 2 else 0.005, -0.05),
        "winches": None if radius is None else sl.Winch(radius),
    }  # fmt: skip
    return sl.Robot(**given | changes)


def places(m: int, count: int = 60) -> Array:
    """Positions below the frame; in the plane of two cables."""
    width = (0.6, 0.0 if m == 2 else 0.4, 0.5)
    return np.random.default_rng(m).uniform(-1.0, 1.0, (count, 3)) * width + (0.0, 0.0, 1.0)


@pytest.mark.parametrize("radius", [None, 0.03])
@pytest.mark.parametrize("density", [0.001, 0.1, 0.5])
@pytest.mark.parametrize("m", [2, 3, 4])
def test_the_forward_solution_of_the_lengths_is_the_found_pose(m: int, density: float, radius: float | None) -> None:
    """The forward calculation minimizes the energy at given lengths and uses no equation of the balance."""
    robot, wanted = suspended(m, density, radius), places(m)
    plan = sl.inverse(robot, wanted, given=("x", "z") if m == 2 else None)
    assert plan.solved.all()
    assert plan.wrench_residual.max() < 1e-9
    free = [0, 2] if m == 2 else [0, 1, 2]
    np.testing.assert_allclose(plan.state.pose.position[:, free], wanted[:, free], rtol=0.0, atol=1e-12)
    back = sl.forward(robot, plan.unstrained_length, start=plan.state.pose)
    np.testing.assert_allclose(back.pose.position, plan.state.pose.position, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(back.state.chord_tension, plan.chord_tension, rtol=1e-7)


def test_a_search_without_start_finds_the_same_pose() -> None:
    robot, wanted = suspended(4), places(4, 12)
    plan = sl.inverse(robot, wanted)
    found = sl.forward(robot, plan.unstrained_length)
    np.testing.assert_allclose(found.pose.position, wanted, rtol=0.0, atol=1e-9)


def structure_matrix(robot: sl.Robot, position: Array) -> Array:
    """J of straight cables to a level platform, with moments over the root mean square lever arm."""
    ends = position + robot.platform_anchors
    toward = robot.frame_anchors - ends
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    lever = robot.platform_anchors - robot.center_of_mass
    arm = np.sqrt((lever**2).sum(axis=1).mean())
    return np.hstack((toward, np.cross(lever, toward) / arm)).T


@pytest.mark.parametrize("level", [0.0, 8.0, -5.0])
def test_the_tension_level_is_the_direction_of_least_load_on_the_platform(level: float) -> None:
    robot, wanted = suspended(4), places(4, 20)
    plan = sl.inverse(robot, wanted, level=level)
    assert plan.solved.all()
    for position, tension in zip(wanted, plan.chord_tension, strict=True):
        weakest = np.linalg.svd(structure_matrix(robot, position))[2][-1]
        assert abs(weakest @ tension) == pytest.approx(abs(level), abs=1e-6)


def test_a_given_yaw_is_reached() -> None:
    """The yaw of the solution with level 0 is prescribed; the solution is the same."""
    robot, wanted = suspended(4), places(4, 20)
    free = sl.inverse(robot, wanted)
    yaw = free.state.pose.rotation.as_euler("ZYX")[:, 0]
    plan = sl.inverse(robot, sl.Pose.from_euler(wanted, yaw, 0.0, 0.0), given=("x", "y", "z", "yaw"))
    assert plan.solved.all()
    np.testing.assert_allclose(plan.state.pose.rotation.as_euler("ZYX")[:, 0], yaw, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(plan.chord_tension, free.chord_tension, rtol=1e-6)


def test_cables_that_would_push_or_exceed_a_limit_are_named() -> None:
    far = sl.inverse(suspended(4), (1.9, 1.3, 1.0))
    assert far.status == sl.PoseStatus.INFEASIBLE
    assert far.blocking.any()
    assert np.isnan(far.chord_tension).all()
    here = sl.inverse(suspended(4), (0.2, 0.1, 1.0))
    order = np.argsort(here.chord_tension)
    for limit, cable in (("tension_min", order[0]), ("tension_max", order[-1])):
        between = np.sort(here.chord_tension)[[0, 1] if limit == "tension_min" else [-2, -1]].mean()
        plan = sl.inverse(suspended(4, **{limit: between}), (0.2, 0.1, 1.0))
        assert plan.status == sl.PoseStatus.INFEASIBLE
        assert np.flatnonzero(plan.blocking).tolist() == [cable]


@pytest.mark.parametrize("radius", [None, 0.03])
def test_a_limit_just_below_the_smallest_tension_does_not_end_the_search(radius: float | None) -> None:
    """With heavy cables, the Newton steps to some of these equilibria come from below the limit."""
    wanted = places(4, 400) * (1.6, 1.6, 1.0)
    plan = sl.inverse(suspended(4, 0.5, radius), wanted)
    assert plan.solved.sum() > 300
    for position, tension in zip(wanted[plan.solved], plan.chord_tension[plan.solved], strict=True):
        least = tension.min()
        below = sl.inverse(suspended(4, 0.5, radius, tension_min=least * (1.0 - 1e-5)), position)
        assert below.status == sl.PoseStatus.SOLVED, position
        above = sl.inverse(suspended(4, 0.5, radius, tension_min=least * (1.0 + 1e-5)), position)
        assert above.status == sl.PoseStatus.INFEASIBLE, position
        assert np.flatnonzero(above.blocking).tolist() == [tension.argmin()], position


def test_a_high_center_of_mass_makes_the_equilibrium_unstable() -> None:
    robot = suspended(3, center_of_mass=(0.0, 0.0, 0.9))
    plan = sl.inverse(robot, (0.0, 0.0, 1.0))
    assert plan.status == sl.PoseStatus.UNSTABLE
    away = sl.Pose.from_euler(plan.state.pose.position, 0.0, 0.02, 0.0)
    assert np.linalg.norm(sl.forward(robot, plan.unstrained_length, start=away).pose.position - (0, 0, 1)) > 0.1


def test_along_a_path_the_lengths_have_rates_and_the_platform_swings_quasistatically() -> None:
    robot = suspended(4)
    path = sl.quintic_path([(0.0, 0.0, 1.0), (0.4, 0.2, 1.2), (-0.3, 0.1, 0.9)], speed=0.4, rate=50.0)
    plan = sl.inverse(robot, path)
    assert plan.solved.all()
    assert plan.method == "balance"
    assert plan.length_rate is not None
    k = 100
    step = 0.5 * (plan.unstrained_length[k + 1] - plan.unstrained_length[k - 1]) / (path.time[1] - path.time[0])
    np.testing.assert_allclose(plan.length_rate[k], step, rtol=0.0, atol=2e-4)
    alone = sl.inverse(robot, path.pose, wrench=plan.state.wrench)
    np.testing.assert_allclose(plan.unstrained_length, alone.unstrained_length, rtol=0.0, atol=1e-9)
    assert sl.confirm(plan).position_error.max() < 1e-8


@pytest.mark.parametrize("given", [("x", "y"), ("x", "y", "z", "z"), ("x", "y", "z", "roll"), ("x",) * 5])
def test_wrong_given_values_are_refused(given: Any) -> None:
    with refused("given", kind=sl.InvalidValueError):
        sl.inverse(suspended(4), (0.0, 0.0, 1.0), given=given)


def test_values_of_an_underconstrained_platform_need_one() -> None:
    with refused("given", None, "None for 8 cables and 3R3T"):
        sl.inverse(sl.load_robot("cogiro"), (0.0, 0.0, 2.0), given=("x", "y", "z", "level"))
    with refused("suspended: number of cables", "2", "3, 4 or >= 6 for 3R3T"):
        sl.inverse(suspended(2), (0.0, 0.0, 1.0))
