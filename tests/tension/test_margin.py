"""Distances of tensions from their limits, by hand."""

from dataclasses import replace

import numpy as np
import pytest

from sagline import Elastic, MinimumNorm, Pose, inverse, limit_margin, load_robot
from sagline.tension.margin import cable_margins
from tests.kinematics.feasible import box_poses
from tests.tension.reference import planar

COGIRO = load_robot("cogiro")


def test_at_a_limit_by_hand() -> None:
    plan = inverse(planar(), Pose(np.zeros(3), np.eye(3)), model=Elastic(), tension=MinimumNorm())
    np.testing.assert_allclose(plan.chord_tension, 3.8)
    assert limit_margin(plan.state) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("limits_of", ["chord", "frame_end"])
def test_the_distance_to_the_nearer_limit_of_the_tension_that_is_limited(limits_of: str) -> None:
    robot = COGIRO.replace(tension_limits_of=limits_of, tension_min=100.0, tension_max=2500.0)
    poses = box_poses(robot, 30, seed=3)
    plan = inverse(robot, poses)
    expected = np.full(len(poses), np.nan)
    for k in np.flatnonzero(plan.feasible):
        gaps = []
        for i in range(8):
            horizontal, vertical = float(plan.horizontal_tension[k, i]), float(plan.vertical_force[k, i])
            weight = float(robot.cables.linear_density[i]) * 9.81 * float(plan.unstrained_length[k, i])
            winch = np.hypot(horizontal, vertical - weight)  # half of the cable's weight acts at each end
            tension = winch if limits_of == "frame_end" else float(plan.chord_tension[k, i])
            gaps.append(min(tension - 100.0, 2500.0 - tension))
        expected[k] = min(gaps)
        np.testing.assert_allclose(cable_margins(plan.state)[k], gaps, rtol=1e-9, atol=1e-8)
    assert plan.feasible.sum() > 10
    np.testing.assert_allclose(limit_margin(plan.state), expected, rtol=1e-9, atol=1e-8)


def test_both_limits_are_considered() -> None:
    plan = inverse(COGIRO, box_poses(COGIRO, 1, seed=3)[0])
    tension = plan.chord_tension
    near_top = COGIRO.replace(tension_min=0.0, tension_max=float(tension.max()) + 3.0)
    near_low = COGIRO.replace(tension_min=float(tension.min()) - 2.0, tension_max=1e6)
    assert limit_margin(replace(plan.state, robot=near_top)) == pytest.approx(min(3.0, tension.min()))
    assert limit_margin(replace(plan.state, robot=near_low)) == pytest.approx(2.0)
