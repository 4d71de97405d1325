"""Poses outside of a motion pattern."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import sagline as sl
from tests.refusal import refused

SEED = 3
NORMAL = np.array([1.0, 2.0, -2.0]) / 3.0


def robot(pattern: Any) -> sl.Robot:
    normal = NORMAL if pattern in ("1R2T", "2T") else None
    generator = np.random.default_rng(SEED)
    frame, platform = generator.uniform(-5, 5, (8, 3)), generator.uniform(-0.3, 0.3, (8, 3))
    inertia = np.eye(3)
    return sl.Robot("any", frame, platform, sl.Cable(0.05, 5e4), 10.0, inertia, motion_pattern=pattern,
                    plane_normal=normal, tension_min=1.0)  # fmt: skip


def poses(turn: Rotation, shift: np.ndarray) -> sl.Pose:
    """Two poses; the second is rotated and shifted relative to the first, an oblique one."""
    first = Rotation.from_rotvec([0.3, -0.2, 0.5])
    turns = Rotation.from_quat([first.as_quat(), (turn * first).as_quat()])
    return sl.Pose(np.array([[0.1, 0.2, 0.3], np.array([0.1, 0.2, 0.3]) + shift]), turns)


IN_PLANE = np.cross(NORMAL, [0.0, 0.0, 1.0])
NONE = Rotation.identity()


@pytest.mark.parametrize(
    ("pattern", "turn", "shift", "value", "allowed"),
    [
        ("3R3T", Rotation.from_rotvec([1.0, 1.0, 0.0]), NORMAL, "", ""),
        ("3T", NONE, NORMAL, "", ""),
        ("3T", Rotation.from_rotvec([0.0, np.radians(20.0), 0.0]), NORMAL, "turned by 20 deg about (0, 1, 0)", ""),
        ("1R2T", Rotation.from_rotvec(2.5 * NORMAL), IN_PLANE, "", ""),
        ("1R2T", Rotation.from_rotvec(0.01 * IN_PLANE), IN_PLANE, "turned by 0.427 deg", "a turn about plane_normal"),
        ("1R2T", Rotation.from_rotvec(2.5 * NORMAL), 0.25 * NORMAL, "0.25 m along plane_normal", "0 m"),
        ("2T", NONE, IN_PLANE, "", ""),
        ("2T", Rotation.from_rotvec(0.1 * NORMAL), IN_PLANE, "turned by 5.73 deg", "no turn, by motion_pattern 2T"),
        ("2T", NONE, -1e-3 * NORMAL, "-0.001 m along plane_normal", "0 m"),
    ],
)
def test_poses_that_no_motion_connects_are_refused(
    pattern: str, turn: Rotation, shift: np.ndarray, value: str, allowed: str
) -> None:
    batch = poses(turn, shift)
    if not value:
        sl.inverse(robot(pattern), batch)
        return
    with refused("pose[1]", kind=sl.InvalidValueError) as caught:
        sl.inverse(robot(pattern), batch)
    assert caught.value.value.startswith(value)
    assert caught.value.allowed.startswith(allowed)
    for k in range(2):  # each alone is the pose of a possible installation
        sl.inverse(robot(pattern), batch[k])


def test_a_pose_outside_of_the_motion_pattern_is_reported() -> None:
    turned = sl.Pose([0.0, 0.0, 0.0], Rotation.from_rotvec([0.0, 0.0, np.radians(90.0)]))
    (text,) = sl.inverse(robot("3T"), turned).warnings
    for fact in ("turned by 90 deg", "(0, 0, 1)", "motion_pattern 3T"):
        assert fact in text
    assert sl.inverse(robot("3R3T"), turned).warnings == ()


def test_a_planar_robot_out_of_its_plane_is_reported() -> None:
    flat = sl.Robot("flat", [[-3, 0.5, 3], [3, 0.5, 3], [0, 0.5, 0]], np.zeros((3, 3)), sl.Cable(0.05, 5e4), 10.0,
                    motion_pattern="2T", plane_normal=[0, 1, 0], tension_min=1.0)  # fmt: skip
    assert sl.inverse(flat, sl.Pose([0.0, 0.5, 1.5], np.eye(3))).warnings == ()
    away = sl.Pose([0.0, 2.0, 1.5], np.eye(3))
    with refused("pose", allowed="0 m, by motion_pattern 2T", kind=sl.InvalidValueError) as caught:
        sl.inverse(flat, away)
    assert caught.value.value.startswith("1.5 m along plane_normal")
    batch = sl.Pose([[0.0, 2.0, 1.5], [0.1, 2.0, 1.5]], np.eye(3))
    with refused("pose[0]", kind=sl.InvalidValueError):
        sl.inverse(flat, batch)
