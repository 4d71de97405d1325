"""Initial poses of forward kinematics from lengths alone, and the ranking of solutions."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import locked
from sagline.kinematics.forward import _outside_limits, _starting_positions, centered_positions, start_quaternions
from sagline.kinematics.forward_rows import solve_forward_rows
from tests.kinematics.feasible import pose_rows

COGIRO = sl.load_robot("cogiro")
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])


def test_the_platform_starts_below_the_middle_of_the_frame_by_a_tenth_of_its_cables() -> None:
    lengths = np.array([np.full(8, 6.0), np.full(8, 20.0), np.full(8, np.nan)])
    turned = Rotation.from_euler("zyx", (0.3, -0.2, 0.5))
    for rotation in (Rotation.identity(), turned):
        quaternion = np.array(rotation.as_quat())
        ends = COGIRO.platform_anchors @ rotation.as_matrix().T
        away = _starting_positions(COGIRO, lengths, quaternion) + ends.mean(axis=0) - COGIRO.frame_anchors.mean(axis=0)
        np.testing.assert_allclose(away, [(0.0, 0.0, -0.6), (0.0, 0.0, -2.0), (0.0, 0.0, -0.1)], atol=1e-12)
        found = centered_positions(COGIRO, quaternion) + ends.mean(axis=0)
        np.testing.assert_allclose(found, COGIRO.frame_anchors.mean(axis=0), atol=1e-12)


def test_a_platform_in_a_level_plane_starts_in_it() -> None:
    level = sl.Robot("table", [(1, 0, 0), (-1, 1, 0), (0, -1, 0)], np.zeros((3, 3)), sl.Cable(0.01, 1e4), 1.0,
                     motion_pattern="2T", plane_normal=(0.0, 0.0, 1.0))  # fmt: skip
    np.testing.assert_allclose(
        _starting_positions(level, np.ones((1, 3)), LEVEL), centered_positions(level, LEVEL)[None], atol=1e-15
    )
    upright = level.replace(plane_normal=(0.0, 1.0, 0.0))
    np.testing.assert_allclose(
        _starting_positions(upright, np.ones((1, 3)), LEVEL) - centered_positions(upright, LEVEL), [(0.0, 0.0, -0.1)]
    )


def test_tilts_are_about_the_free_axes_of_the_platform() -> None:
    turns = Rotation.from_quat(start_quaternions(COGIRO)).as_rotvec(degrees=True)
    np.testing.assert_allclose(turns[0], 0.0, atol=1e-12)
    assert sorted(map(tuple, np.round(turns[1:], 9) + 0.0)) == sorted(
        tuple(sign * tilt * axis + 0.0) for tilt in (25.0, 60.0) for sign in (1.0, -1.0) for axis in np.eye(3)
    )


@pytest.mark.parametrize(
    ("limits_of", "model"), [("chord", sl.Catenary()), ("frame_end", sl.Catenary()), ("frame_end", sl.Elastic())]
)
def test_violated_limits_are_counted_for_the_limited_tension(limits_of: str, model: sl.CableModel) -> None:
    pose = sl.Pose((1.0, 0.5, 1.5), np.eye(3))
    plan = sl.inverse(COGIRO, pose, model)
    chord = plan.chord_tension
    density = 0.0 if isinstance(model, sl.Elastic) else COGIRO.cables.linear_density
    weight = density * 9.81 * plan.unstrained_length
    winch = np.hypot(
        plan.horizontal_tension, plan.vertical_force - weight
    )  # above the platform, the platform suspends the cable
    # lower limits of three cables between both tensions, upper limits of two others; a hundredth is tolerated
    between = 0.5 * (chord + winch) + 1e-4
    low = np.where(np.arange(8) < 3, between / 0.99, 0.0)
    high = np.where(np.arange(8) > 5, between / 1.01, np.inf)
    robot = COGIRO.replace(tension_limits_of=limits_of, tension_min=low, tension_max=high)
    found = solve_forward_rows(robot, model, plan.unstrained_length[None], pose_rows(pose), locked(np.zeros((1, 6))))
    # a chord tension is below the interval and a frame-end tension above it; without weight both are equal
    expected = 2 if limits_of == "frame_end" and not isinstance(model, sl.Elastic) else 3
    assert _outside_limits(robot, model, found).tolist() == [expected]
