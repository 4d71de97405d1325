"""Suspended robots with three to five cables: equilibrium, swing, and fall from an unstable equilibrium."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipk

import sagline as sl
from tests.refusal import refused

LENGTH, RADIUS, MASS = 4.0, 0.4, 20.0
INERTIA = np.diag([0.6, 0.8, 1.3])
STIFF = sl.Cable(linear_density=1e-5, axial_stiffness=2e7)


def hung(
    cables: int, frame_radius: float = RADIUS, rope: sl.Cable = STIFF, high: float = -0.2, **fields: object
) -> sl.Robot:
    """A platform under m cables; if the frame is as wide as the platform, the cables are vertical and equal."""
    angle = 2.0 * np.pi * np.arange(cables) / cables
    circle = np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
    return sl.Robot(
        f"hung-{cables}",
        frame_radius * circle + [0.0, 0.0, 5.0],
        RADIUS * circle,
        rope,
        MASS,
        INERTIA,
        center_of_mass=(0.0, 0.0, high),
        **fields,  # type: ignore[arg-type]
    )


def at_rest(robot: sl.Robot, wrench: np.ndarray | None = None) -> sl.Equilibrium:
    found = sl.forward(robot, np.full(robot.cable_count, LENGTH), wrench=wrench)
    assert found.solved
    return found.state


@pytest.mark.parametrize("cables", [3, 4, 5])
def test_parallel_cables_give_a_pendulum_and_a_trifilar_pendulum(cables: int) -> None:
    """Sway sqrt(g/l) as for a point, because the platform stays level; rotation sqrt(M g R^2/(I l)), which gives I."""
    modes = sl.modes(at_rest(hung(cables)))
    sway = np.sqrt(9.81 / LENGTH) / (2.0 * np.pi)
    turn = np.sqrt(MASS * 9.81 * RADIUS**2 / (INERTIA[2, 2] * LENGTH)) / (2.0 * np.pi)
    np.testing.assert_allclose(np.sort(modes.frequency[:3]), np.sort([sway, sway, turn]), rtol=2e-5)
    assert modes.frequency[3] > 30.0 * sway  # the other motions stretch the cables


@pytest.mark.parametrize("cables", [3, 5])
def test_with_cable_mass_the_swing_is_that_of_heavy_ropes(cables: int) -> None:
    """Rayleigh's quotient of a straight rope of mass m per cable: (M + n m/2) g/(M + n m/3) in place of g."""
    rope = sl.Cable(linear_density=0.05, axial_stiffness=2e7)
    robot = hung(cables, rope=rope)
    modes = sl.vibration(at_rest(robot), up_to=2.0)
    assert modes.complete
    ropes = cables * 0.05 * LENGTH
    expected = np.sqrt(9.81 / LENGTH * (MASS + ropes / 2.0) / (MASS + ropes / 3.0)) / (2.0 * np.pi)
    sways = modes.frequency[np.abs(modes.frequency - expected) < 1e-3]
    assert sways.size == 2
    np.testing.assert_allclose(sways, expected, rtol=1e-4)  # the quotient is larger by the second order of m/M
    assert (sways <= expected * (1.0 + 1e-6)).all()


@pytest.mark.parametrize("angle", [0.02, 0.5])
def test_the_free_swing_is_that_of_a_pendulum_at_any_amplitude(angle: float) -> None:
    """Released from rest at an angle: the period is 4 sqrt(l/g) K(sin^2(angle/2))."""
    robot = hung(3)
    aside = np.array([MASS * 9.81 * np.tan(angle), 0.0, 0.0, 0.0, 0.0, 0.0])
    state = at_rest(robot, aside)
    assert state.pose.position[0] == pytest.approx(LENGTH * np.sin(angle), rel=1e-5)
    run = sl.simulate(state, wrench=np.zeros(6), duration=9.0, step=2e-4, record=2e-3)
    x = run.pose.position[:, 0]
    down = np.flatnonzero((x[:-1] > 0.0) & (x[1:] <= 0.0))
    crossing = run.time[down] + (run.time[down + 1] - run.time[down]) * x[down] / (x[down] - x[down + 1])
    period = 4.0 * np.sqrt(LENGTH / 9.81) * ellipk(np.sin(0.5 * angle) ** 2)
    assert np.diff(crossing)[0] == pytest.approx(period, rel=1e-4)
    assert np.abs(run.energy.error).max() < 1e-6 * MASS * 9.81 * LENGTH


def test_a_zv_of_the_swing_stops_a_crane() -> None:
    """Three cables change their lengths; a quintic profile leaves a swing, a shaped one almost none."""
    robot = hung(3, frame_radius=3.0, rope=sl.Cable(0.02, 2e5))
    first, last = np.array([4.0, 4.0, 4.0]), np.array([3.6, 4.1, 4.1])
    goal = sl.forward(robot, last)
    swing = sl.modes(goal.state).frequency[:2]
    share = sl.quintic_path([(0, 0, 0), (1, 0, 0)], durations=0.8, rate=1000.0)  # share of the change
    left = []
    for path in (share, sl.shaped(share, sl.ZV(swing))):
        lengths = first + path.pose.position[:, :1] * (last - first)
        run = sl.simulate(
            sl.forward(robot, first).state, unstrained_length=(path.time, lengths), duration=path.duration + 4.0
        )
        after = run.time >= path.duration
        left.append(np.linalg.norm(run.pose.position[after] - goal.pose.position, axis=1).max())
    assert left[0] > 0.02
    assert left[1] < 0.03 * left[0]


@pytest.mark.parametrize("cables", [3, 4])
def test_an_unstable_platform_falls_in_the_reported_direction(cables: int) -> None:
    robot = hung(cables, frame_radius=3.0, rope=sl.Cable(0.02, 2e5), high=1.5)
    lengths = np.full(cables, 4.0)
    # height of the upright position, by symmetry: balance along z only
    one = sl.Catenary()

    def lift(z: float) -> float:
        state = one.from_length(robot.cables, np.full(cables, 3.0 - RADIUS), np.full(cables, z - 5.0), lengths)
        return float(-state.vertical_force.sum() - MASS * 9.81)

    z = brentq(lift, 1.0, 2.5, xtol=1e-13)
    upright = sl.forward(robot, lengths, start=sl.Pose.from_euler((0.0, 0.0, z), 0.0, 0.0, 0.0))
    assert sl.ForwardStatus(int(upright.status)) is sl.ForwardStatus.UNSTABLE
    assert upright.pose.position[2] == pytest.approx(z, abs=1e-9)
    assert np.isnan(sl.modes(upright.state).frequency).sum() == 2  # it may fall along x and along y
    modes = sl.vibration(upright.state, up_to=2.0)
    assert modes.status.name == "UNSTABLE"
    assert modes.frequency.size == 0
    ways = modes.negative_directions
    assert ways.shape == (6, 2)
    push = ([0.0, 0.05, 0.051], np.outer([1.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    run = sl.simulate(upright.state, wrench=push, duration=8.0)
    tilt = np.arccos(np.clip(run.pose.matrix[:, 2, 2], -1.0, 1.0))
    k = int(np.argmax(tilt > 1e-2))
    assert k > 0
    lever = (run.pose[k].matrix - np.eye(3)) @ robot.center_of_mass
    moved = run.pose.position[k] - upright.pose.position + lever
    motion = np.append(moved, run.pose.rotation[k].as_rotvec())
    aside = motion - ways @ np.linalg.lstsq(ways, motion, rcond=None)[0]
    assert np.linalg.norm(aside) < 0.02 * np.linalg.norm(motion)
    assert tilt.max() > 1.0  # and continues
    lower = sl.equilibria(robot, lengths, starts=60).solutions
    assert (lower.pose.position @ [0, 0, 1] + lower.pose.matrix[:, 2, 2] * 1.5 < z + 1.5 - 0.5).all()


def test_a_margin_requires_as_many_cables_as_degrees_of_freedom() -> None:
    with refused("hung-3: number of cables", "3", ">= 6 for 3R3T"):
        sl.margin(hung(3), sl.Pose.from_euler((0.0, 0.0, 1.0), 0.0, 0.0, 0.0))
