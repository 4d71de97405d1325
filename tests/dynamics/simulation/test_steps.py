"""The limit of stability compared with eigenvalues of the whole system."""

from __future__ import annotations

import numpy as np
import pytest

import sagline as sl
from tests.dynamics.machines import prototype
from tests.refusal import refused

ROPE = sl.Cable(0.05, 2e4)


def suspended_mass() -> sl.Robot:
    """A mass on three cables, one of which can be wound in until it is short."""
    frame = [[3, 0, 4], [-3, 2, 4], [-3, -2, 4]]
    return sl.Robot("hung", frame, np.zeros((3, 3)), ROPE, 100.0, inertia=np.eye(3), motion_pattern="3T")


def exact(robot: sl.Robot, place: np.ndarray) -> float:
    """Highest frequency at a position on taut cables [rad/s]."""
    chords = place - robot.frame_anchors
    length = np.linalg.norm(chords, axis=1)
    unit = chords / length[:, None]
    return float(np.sqrt(np.linalg.eigvalsh((unit.T * (2e4 / length)) @ unit)[-1] / robot.mass))


def limit_of(error: sl.InvalidValueError) -> float:
    """Largest step for an error [s]."""
    return float(error.allowed.removeprefix("<= ").split(" s, ")[0])


def test_the_limit_is_that_of_the_stiffest_pose_of_the_path() -> None:
    robot = suspended_mass()
    ends = np.array([[0.0, 0.0, 1.5], [2.6, 0.0, 3.2]])
    plan = sl.inverse(robot, sl.septic_path(ends, durations=4.0, rate=100.0))
    stiffest = max(exact(robot, place) for place in plan.state.pose.position)
    assert stiffest > 1.5 * exact(robot, ends[0])
    with refused("step", kind=sl.InvalidValueError) as caught:
        sl.simulate(plan, step=2.1 / stiffest, integrator="splitting")
    assert limit_of(caught.value) == pytest.approx(2.0 / stiffest, rel=0.01)


def test_given_lengths_of_a_state_reduce_the_step() -> None:
    robot = suspended_mass()
    state = sl.inverse(robot, sl.Pose.from_euler([0.0, 0.0, 1.5], 0, 0, 0)).state
    short = state.unstrained_length.copy()
    short[0] = 0.86
    limits = []
    for lengths in (state.unstrained_length, short):
        with refused("step", kind=sl.InvalidValueError) as caught:
            sl.simulate(
                state,
                unstrained_length=([0.0, 4.0], [state.unstrained_length, lengths]),
                step=0.3,
                integrator="splitting",
            )
        limits.append(limit_of(caught.value))
    assert limits[1] < 0.6 * limits[0]


def test_coupled_drums_and_platform_have_higher_frequencies() -> None:
    robot = prototype(speed_gain=10.0, integral_gain=0.0, inertia=2.77e-6)
    state = sl.inverse(robot, sl.Pose.from_euler([0.0, 0.0, 1.0], 0, 0, 0)).state
    chords = state.pose.position + robot.platform_anchors - robot.frame_anchors
    length = np.linalg.norm(chords, axis=1)
    unit = chords / length[:, None]
    rows = np.hstack((unit, np.cross(robot.platform_anchors - robot.center_of_mass, unit)))
    whole = np.hstack((rows, -np.eye(8)))
    inertia = 2.77e-6 * (20.0 / 0.0315) ** 2  # on the first layer of the drum, cable 3 mm
    mass = np.zeros((14, 14))
    mass[:3, :3], mass[3:6, 3:6], mass[6:, 6:] = robot.mass * np.eye(3), robot.inertia, inertia * np.eye(8)
    stiffness = (whole.T * (robot.cables.axial_stiffness / length)) @ whole
    together = float(np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real.max()))
    with refused("step", kind=sl.InvalidValueError) as caught:
        sl.simulate(state, winches="robot", step=0.1, duration=1.0)
    assert 0.7 * 2.0 / together < limit_of(caught.value) <= 1.001 * 2.0 / together
