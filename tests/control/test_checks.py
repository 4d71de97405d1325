"""Checks of a path and a motion before the first set point is sent."""

from __future__ import annotations

import re

import numpy as np
import pytest

import sagline as sl
from sagline import Path
from sagline.control.checks import plan_motion
from sagline.control.link import PERIOD
from sagline.control.states import RefusedError
from sagline.core.arrays import Array
from tests.control.rigs import HOME, at, prototype, rig, state_of

RATE = 100.0


def way(rate: float = RATE) -> Path:
    return sl.septic_path([HOME, at(0.2, 0.0, 1.5)], speed=0.2, acceleration=0.4, rate=rate)


def moved(path: Path, shift: Array) -> Path:
    """The same with shifted poses [m], shape (N, 3), and unchanged twists."""
    pose = sl.Pose.from_quaternion(path.pose.position + shift, path.pose.quaternion)
    return Path(path.time, pose, path.twist, path.twist_rate, path.jerk)


def planned(robot: sl.Robot, path: Path) -> object:
    return plan_motion(robot, path, PERIOD, sl.Catenary(), sl.Closest())


@pytest.mark.parametrize("jump", [1e-3, 6e-3, None])
def test_a_jump_of_poses_without_a_twist_is_refused(jump: float | None) -> None:
    """6 mm between two ticks were 3.4 mm of cable, too fast for a winch, without a twist."""
    path = way()
    half = len(path.time) // 2
    shift = np.zeros((len(path.time), 3))
    if jump is None:  # a slow drift that is not in the twist: 20 um per tick
        shift[:, 2] = 2e-5 * np.arange(len(path.time))
    else:
        shift[half:, 2] = jump
    control, _ = rig()
    with pytest.raises(RefusedError) as caught:
        control.execute(moved(path, shift))
    line = caught.value.reason
    found = re.search(r"([\d.]+) s to ([\d.]+) s .*cable (\d) .* ([\d.]+) mm; allowed: 0\.0", line)
    assert found is not None, line
    assert "path_from_samples" in caught.value.next_step
    if jump is not None:
        assert float(found[2]) == pytest.approx(path.time[half], abs=1e-9)
        plan = sl.inverse(prototype(), sl.Pose.from_quaternion(path.pose.position[half], path.pose.quaternion[half]))
        above = sl.inverse(prototype(), at(*(path.pose.position[half] + shift[half])))
        step = np.abs(above.unstrained_length - plan.unstrained_length)
        assert int(found[3]) == int(np.argmax(step))
        assert 1e-3 * float(found[4]) == pytest.approx(step.max(), rel=0.1)
    assert state_of(control).name == "IDLE"


def test_winches_that_are_too_fast_after_a_jump_are_named() -> None:
    robot = prototype()
    assert robot.winches is not None
    limit, winches = robot.winches.speed_limit, robot.winches
    assert limit is not None
    assert winches.drum_radius is not None
    path = way()
    shift = np.zeros((len(path.time), 3))
    shift[len(path.time) // 2 :, 2] = 0.02
    with pytest.raises(RefusedError, match=r"winch \d .* 314 rad/s"):
        planned(robot, moved(path, shift))
    fastest = 0.9 * float((limit * winches.drum_radius / np.abs(winches.gear)).min()) * PERIOD
    shift *= fastest / 0.02  # of the platform, slower than of a winch: the other check refuses it
    with pytest.raises(RefusedError, match=r"cable \d .* mm"):
        planned(robot, moved(path, shift))


PATHS = [
    lambda: way(),
    lambda: sl.quintic_path([(0, 0, 1.5), (0.3, 0.2, 1.4), (0.1, -0.3, 1.2)], speed=0.3),  # its end is not at a tick
]


@pytest.mark.parametrize("path", PATHS)
def test_consistent_paths_are_accepted(path: object) -> None:
    planned(prototype(), path())  # type: ignore[operator]


def test_the_load_of_a_motor_has_the_sign_of_the_tension() -> None:
    """A motor that winds in works against the cable: it needs the sum of force and tension, not the difference.

    The limit is put between the two, so that a load of the other sign would let the path through, or refuse a second.
    """
    robot = prototype()
    assert robot.winches is not None
    winches = robot.winches
    assert winches.inertia is not None
    assert winches.drum_radius is not None
    plan = sl.inverse(robot, way())
    assert plan.length_rate is not None
    assert plan.path is not None
    radius = float(winches.drum_radius.mean() / np.abs(winches.gear).mean())
    acceleration = np.gradient(plan.length_rate, plan.path.time, axis=0)
    own = winches.inertia / radius**2 * acceleration + winches.friction * np.sign(plan.length_rate)
    tension = plan.state.cables.frame_end_tension
    with_load, other_sign = (radius * float(np.abs(own + sign * tension).max()) for sign in (-1.0, 1.0))
    low, high = sorted((with_load, other_sign))
    assert high > 1.02 * low
    between = robot.replace(winches=winches.replace(torque_limit=0.5 * (low + high)))
    if with_load > other_sign:
        with pytest.raises(RefusedError, match=rf"would give {with_load:.2g}\d* N m"):
            planned(between, way())
    else:
        planned(between, way())
    few = robot.replace(winches=winches.replace(torque_limit=0.99 * with_load))
    with pytest.raises(RefusedError, match="would give"):
        planned(few, way())
    planned(robot.replace(winches=winches.replace(torque_limit=1.01 * with_load)), way())


def test_a_motion_of_another_period_or_robot_is_refused() -> None:
    """Rows of 100 ms in cycles of 10 ms are ten times as fast."""
    control, _ = rig()
    slow = plan_motion(prototype(), way(rate=10.0), 0.1, sl.Catenary(), sl.Closest())
    with pytest.raises(RefusedError, match=r"100 ms.* 10 ms"):
        control.start(slow)
    heavy = prototype().replace(mass=prototype().mass + 1.0)
    with pytest.raises(RefusedError, match="another robot"):
        control.start(plan_motion(heavy, way(), PERIOD, sl.Catenary(), sl.Closest()))
    own = control.plan(way())
    assert own.robot is control.robot
    assert own.period == PERIOD
    assert control.execute(own).status.name == "DONE"
