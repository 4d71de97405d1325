"""Simulations with moving anchors: invariance, inertial forces, energy, an independent integration, files, refusals."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.dynamics.machines import prototype
from tests.refusal import refused
from tests.tiers import extended

COGIRO = sl.load_robot("cogiro")
TIME = np.linspace(0.0, 6.0, 241)
PLACE = (0.0, 0.0, 2.0)
GUST = ([0.0, 0.2, 0.4], np.outer([0.0, 1.0, 0.0], [50.0, 30.0, -200.0, 5.0, 0.0, 3.0]))
VELOCITY, ACCELERATION = np.array([2.0, -1.0, 0.5]), np.array([0.4, 0.3, -0.6])


def ship(roll: float = 0.05) -> sl.Path:
    sway = np.stack((0.3 * np.sin(1.2 * TIME), 0.2 * np.sin(0.9 * TIME), 0.25 * np.sin(1.5 * TIME)), axis=-1)
    return sl.path_from_samples(TIME, sl.Pose.from_euler(sway, 0.1 * np.sin(0.7 * TIME), 0.0, roll * np.sin(TIME)))


@cache
def plan(robot: sl.Robot, rate: float = 500.0, roll: float = 0.05) -> sl.Plan:
    way = sl.septic_path([PLACE, (0.5, 0.4, 2.3)], durations=1.5, rate=rate)
    return sl.inverse(robot, way, anchors=sl.anchors_on_bases(robot, [(ship(roll), range(5))]))


def accelerated(robot: sl.Robot, acceleration: Array) -> tuple[sl.AnchorMotion, sl.Path]:
    """Anchors with a constant acceleration, and the path of a platform at rest relative to them."""
    time = np.linspace(0.0, 2.0, 401)
    moved = np.outer(time, VELOCITY) + np.outer(0.5 * time**2, acceleration)
    twist, rate = np.zeros((401, 6)), np.zeros((401, 6))
    twist[:, :3], rate[:, :3] = VELOCITY + np.outer(time, acceleration), acceleration
    path = sl.Path(time, sl.Pose.from_euler(PLACE + moved, 0, 0, 0), twist, rate, jerk=np.zeros((401, 6)))
    return sl.AnchorMotion(time, robot.frame_anchors + moved[:, None]), path


def balance(run: sl.Simulation) -> float:
    """Energy error relative to the range of the work of the anchors."""
    return float(np.abs(run.energy.error).max() / np.ptp(run.energy.supplied))


@pytest.mark.parametrize("acceleration", [np.zeros(3), ACCELERATION], ids=["velocity", "acceleration"])
@pytest.mark.parametrize("damping", [0.0, 1e-3])
def test_a_moving_frame_agrees_with_a_frame_at_rest(acceleration: Array, damping: float) -> None:
    anchors, path = accelerated(COGIRO, acceleration)
    inertial = np.concatenate((-COGIRO.mass * acceleration, np.zeros(3)))
    at_rest = sl.inverse(COGIRO, PLACE, wrench=inertial).state
    steady: dict[str, Any] = {"step": 5e-4, "damping": sl.Damping(loss_time=damping)}
    gust = np.asarray(GUST[1])
    moving = sl.simulate(sl.inverse(COGIRO, path, anchors=anchors), wrench=GUST, **steady)
    still = sl.simulate(at_rest, wrench=(GUST[0], gust + inertial), duration=2.0, **steady)
    moved = np.outer(moving.time, VELOCITY) + np.outer(0.5 * moving.time**2, acceleration)
    assert np.ptp(still.pose.position[:, 2]) > 5e-3
    np.testing.assert_allclose(moving.pose.position - moved, still.pose.position, atol=1e-9)
    np.testing.assert_allclose(moving.tensions, still.tensions, rtol=1e-7)
    np.testing.assert_allclose(moving.energy.lost, still.energy.lost, atol=1e-9)
    if not acceleration.any():
        np.testing.assert_allclose(moving.pose.position - moved, still.pose.position, atol=1e-10)
        np.testing.assert_allclose(moving.tensions, still.tensions, rtol=1e-8)


def test_the_platform_follows_the_plan_and_the_energy_balances() -> None:
    run = sl.simulate(plan(COGIRO), step=1e-3)
    way = plan(COGIRO).path
    assert way is not None
    there = np.stack([np.interp(run.time, way.time, place) for place in way.pose.position.T], axis=-1)
    assert np.abs(run.pose.position - there).max() < 2e-8  # set points are cubic between samples at 500 Hz
    assert np.ptp(run.energy.supplied) > 100.0
    assert balance(run) < 1e-8
    assert np.abs(run.energy.error).max() > 0.0


def test_a_platform_at_rest_below_a_ship_swings_and_its_energy_balances() -> None:
    anchors = sl.anchors_on_bases(COGIRO, [(ship(), range(8))])
    run = sl.simulate(COGIRO, PLACE, anchors=anchors, duration=2.0, step=2.5e-4)
    assert np.ptp(run.pose.position[:, 0]) > 0.1
    assert balance(run) < 1e-9
    np.testing.assert_array_equal(run.robot.frame_anchors, anchors.at(0.0))
    coarse = sl.simulate(COGIRO, PLACE, anchors=anchors, duration=2.0, step=5e-4)
    assert 20.0 < balance(coarse) / balance(run) < 45.0  # order 4 of the motion, order 5 of the energy


@pytest.mark.parametrize("damping", [sl.Damping(loss_time=2e-3), sl.Damping(air_damping=5.0)], ids=["loss", "air"])
def test_the_energy_balances_with_losses_and_breaks(damping: sl.Damping) -> None:
    anchors = sl.anchors_on_bases(COGIRO, [(ship(), [0, 1, 5])])
    event = sl.Break(cable=1, time=0.25)
    run = sl.simulate(COGIRO, PLACE, anchors=anchors, duration=0.6, step=1.25e-4, damping=damping, events=event)
    assert run.energy.lost[-1] > 1.0
    assert balance(run) < 1e-7


def test_air_damping_of_a_robot_in_translation_agrees_with_the_drag_of_its_chords() -> None:
    anchors, path = accelerated(COGIRO, np.zeros(3))
    drag = sl.Damping(air_damping=0.01)
    run = sl.simulate(sl.inverse(COGIRO, path, anchors=anchors), duration=0.02, step=1e-4, damping=drag)
    chords = sl.inverse(COGIRO, PLACE).state.cables.chord
    power = 0.01 * chords.sum() * (VELOCITY @ VELOCITY)
    assert run.energy.lost[-1] == pytest.approx(0.02 * power, rel=1e-4)


def test_a_break_agrees_with_a_robot_without_the_cable() -> None:
    anchors = sl.anchors_on_bases(COGIRO, [(ship(), [0, 1, 5])])
    broken = sl.simulate(COGIRO, PLACE, anchors=anchors, duration=0.3, step=5e-4, events=sl.Break(cable=1, time=0.0))
    state = sl.inverse(COGIRO, PLACE).state
    kept = np.arange(8) != 1
    fewer = sl.without_cables(COGIRO, 1)
    start = sl.Equilibrium(fewer, state.pose, state.wrench, state.cables[kept])
    alone = sl.AnchorMotion(anchors.time, anchors.position[:, kept])
    run = sl.simulate(start, unstrained_length=state.unstrained_length[kept], anchors=alone, duration=0.3, step=5e-4)
    np.testing.assert_allclose(broken.pose.position, run.pose.position, atol=1e-9)


def springs(robot: sl.Robot, anchors: Callable[[float], Array], length: Array) -> Callable[[float, Array], Array]:
    """Independent model: a rigid body on weightless springs. State: position, velocity, quaternion, spin."""
    stiffness, inverse = robot.cables.axial_stiffness, np.linalg.inv(robot.inertia)

    def rates(time: float, state: Array) -> Array:
        place, velocity, turn, spin = state[:3], state[3:6], state[6:10], state[10:]
        rotation = Rotation.from_quat(turn).as_matrix()
        lever = (robot.platform_anchors - robot.center_of_mass) @ rotation.T
        away = anchors(time) - (place + lever)
        distance = np.linalg.norm(away, axis=1)
        force = (np.maximum(stiffness * (distance / length - 1.0), 0.0) / distance)[:, None] * away
        body = rotation.T @ spin
        moment = np.cross(lever, force).sum(axis=0)
        spin_rate = rotation @ (inverse @ (rotation.T @ moment - np.cross(body, robot.inertia @ body)))
        x, y, z, w = turn
        a, b, c = spin
        turning = 0.5 * np.array(
            [a * w + b * z - c * y, b * w + c * x - a * z, c * w + a * y - b * x, -a * x - b * y - c * z]
        )
        weight = np.array([0.0, 0.0, -robot.gravity])
        return np.concatenate((velocity, force.sum(axis=0) / robot.mass + weight, turning, spin_rate))

    return rates


def test_an_independent_integration_agrees() -> None:
    """Weightless cables without slackness, the same splines of the anchors evaluated by scipy, tolerances of 1e-12."""
    away = np.multiply.outer(1.0 - np.cos(3.0 * TIME), np.linspace(0.02, 0.05, 8)[:, None] * [1.0, -0.6, 0.4])
    anchors = sl.AnchorMotion(TIME, COGIRO.frame_anchors + away)
    state = sl.inverse(COGIRO, PLACE, model=sl.Elastic()).state
    run = sl.simulate(state, anchors=anchors, duration=0.5, step=1.25e-4)
    assert run.tensions.min() > 50.0
    assert np.ptp(run.pose.position[:, 0]) > 0.01
    begin = np.zeros(13)
    begin[:3], begin[9] = np.array(PLACE) + COGIRO.center_of_mass, 1.0
    splines = CubicSpline(anchors.time, anchors.position)
    rates = springs(COGIRO, splines, state.unstrained_length)
    found = solve_ivp(rates, (0.0, 0.5), begin, "DOP853", t_eval=[0.25, 0.5], rtol=1e-12, atol=1e-12)
    for k, column in enumerate(found.y.T):
        pose = run.pose[25 * (k + 1)]
        center = pose.position + pose.matrix @ COGIRO.center_of_mass
        np.testing.assert_allclose(center, column[:3], atol=2e-9)
        turned = Rotation.from_quat(column[6:10]).inv() * pose.rotation
        assert turned.magnitude() < 2e-9


def test_pulleys_on_a_base_that_yaws_balance_their_energy() -> None:
    robot = COGIRO.replace(winches=sl.Winch(0.1, dead_cable=3.0, dead_rise=2.0))
    run = sl.simulate(plan(robot, roll=0.0), step=1e-3)
    assert np.ptp(run.energy.supplied) > 100.0
    assert balance(run) < 1e-8


@extended
def test_drums_on_a_moving_frame_have_order_two() -> None:
    robot = prototype(friction=0.0)
    way = sl.septic_path([(0.0, 0.0, 1.0), (0.2, 0.1, 1.1)], durations=1.0, rate=1000.0)
    moved = sl.anchors_on_bases(robot, [(ship(0.0), range(8))])
    planned = sl.inverse(robot, way, anchors=moved)
    assert planned.feasible.all()
    errors = [balance(sl.simulate(planned, winches="robot", step=step)) for step in (5e-4, 2.5e-4)]
    assert errors[1] < 1e-5
    assert 3.0 < errors[0] / errors[1] < 5.0


def test_files_keep_the_anchors(tmp_path: Path) -> None:
    run = sl.simulate(plan(COGIRO), duration=0.1)
    run.save(tmp_path / "run.nc")
    again = sl.load_simulation(tmp_path / "run.nc")
    assert again.anchors is not None
    assert run.anchors is not None
    np.testing.assert_array_equal(again.anchors.position, run.anchors.position)
    plan(COGIRO).save(tmp_path / "plan.nc")
    replayed = sl.simulate(sl.load_plan(tmp_path / "plan.nc"), duration=0.1)
    np.testing.assert_array_equal(replayed.pose.position, run.pose.position)


def refusals() -> dict[str, tuple[Callable[[], object], dict[str, str]]]:
    anchors = sl.anchors_on_bases(COGIRO, [(ship(), range(8))])
    elsewhere = sl.AnchorMotion(anchors.time, anchors.position + np.array([0.0, 0.0, 0.3]))
    state = sl.inverse(COGIRO, PLACE).state
    return {
        "lumped": (
            lambda: sl.simulate(plan(COGIRO), cable_mass="lumped"),
            {"item": "cable_mass", "value": '"lumped"', "allowed": '"none" with moving anchors'},
        ),
        "modal": (lambda: sl.simulate(plan(COGIRO), cable_mass="modal"), {"item": "cable_mass", "value": '"modal"'}),
        "elsewhere": (
            lambda: sl.simulate(state, anchors=elsewhere, duration=1.0),
            {"item": "anchors", "value": "0.3 m from those of the start, at 0 s"},
        ),
        "too long": (
            lambda: sl.simulate(plan(COGIRO), duration=7.0),
            {"item": "anchors: time", "value": "7 s", "allowed": "0 s to 6 s, the samples of anchors"},
        ),
        "no motion": (
            lambda: sl.simulate(state, anchors=ship(), duration=1.0),  # type: ignore[arg-type]
            {"item": "anchors", "allowed": "an AnchorMotion"},
        ),
    }


@pytest.mark.parametrize("name", list(refusals()))
def test_unsupported_simulations_are_refused(name: str) -> None:
    call, parts = refusals()[name]
    with refused(**parts):  # type: ignore[arg-type]
        call()
