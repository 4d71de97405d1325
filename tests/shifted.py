"""Robots and poses with small changes of all inputs of the kinematics, for tests of derivatives."""

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import sagline as sl
from sagline.core.arrays import Array
from tests.statics.test_sensitivities import planar

COGIRO = sl.load_robot("cogiro")
WRENCH = np.array([100.0, -50.0, 30.0, 20.0, 10.0, -30.0])


def tight(robot: sl.Robot, pose: sl.Pose, **changes: Any) -> sl.Robot:
    """The robot with a lower limit that is active at the pose."""
    tension = np.sort(sl.inverse(robot, pose, wrench=WRENCH).state.limited_tension)
    return robot.replace(tension_min=0.95 * tension[0] + 0.05 * tension[2], **changes)


POSE = sl.Pose.from_euler([1.0, 1.0, 2.0], 0.1, 0.05, 0.2)
INSIDE = sl.Pose.from_euler([0.3, 0.2, 1.5], 0.05, 0.05, 0.1)
PULLEYS = sl.load_robot("ipanema-2-pulleys")
SLANTED = COGIRO.replace(winches=sl.Winch(0.05, swivel_axis=[0.3, 0.1, 0.94], dead_cable=3.0, dead_rise=1.0))
CASES = {
    "cogiro": (COGIRO, POSE),
    "at a chord tension": (tight(COGIRO, POSE), POSE),
    "at a frame-end tension": (tight(COGIRO, POSE, tension_limits_of="frame_end"), POSE),
    "pulleys, at limits": (PULLEYS, INSIDE),
    "planar": (planar(), sl.Pose((0.4, 0.0, -0.3), Rotation.from_rotvec((0.0, 0.1, 0.0)))),
}

FORWARD = [CASES["cogiro"], CASES["pulleys, at limits"], CASES["planar"], (SLANTED, POSE)]


def close(found: Any, expected: Array) -> None:
    """Derivatives agree to a relative error of 1e-6, measured by the largest."""
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6 * np.abs(expected).max())


class Shifted:
    """A robot, its pose and lengths after small changes of all inputs."""

    def __init__(self, robot: sl.Robot, pose: sl.Pose) -> None:
        self.robot, self.pose = robot, pose
        self.lengths = np.array(sl.inverse(robot, pose, wrench=WRENCH * self.share).unstrained_length)
        rng = np.random.default_rng(5)
        self.motion = rng.normal(size=6) @ robot.freedom.T @ robot.freedom
        self.force, self.wound = 100.0 * rng.normal(size=6), rng.normal(size=len(self.lengths))
        # a planar robot stays planar
        keep = np.ones(3) if robot.plane_normal is None else 1.0 - np.abs(robot.plane_normal)
        self.frame, self.platform = rng.normal(size=(2, len(self.lengths), 3)) * keep

    @property
    def share(self) -> float:
        """Share of the wrench; zero for a planar robot."""
        return 1.0 if self.robot.plane_normal is None else 0.0

    def at(self, h: float) -> tuple[sl.Robot, Array, Array, sl.Pose]:
        """Robot, lengths, wrench and pose."""
        robot = self.robot.replace(
            frame_anchors=self.robot.frame_anchors + h * self.frame,
            platform_anchors=self.robot.platform_anchors + h * self.platform,
        )
        turn = Rotation.from_rotvec(h * self.motion[3:]) * Rotation.from_quat(np.array(self.pose.quaternion))
        moved = sl.Pose(self.pose.position + h * self.motion[:3], turn)
        return robot, self.lengths + h * self.wound, self.share * WRENCH + h * self.force, moved

    def forward(self, h: float) -> Array:
        """Position, quaternion and tensions after changes of lengths, wrench and anchors."""
        changed, lengths, wrench, _ = self.at(h)
        found = sl.forward(changed, lengths, self.pose, wrench=wrench)
        assert found.stable
        return np.concatenate((found.pose.position, found.pose.quaternion, found.state.cables.frame_end_tension))

    def inverse(self, h: float) -> Array:
        """Lengths and tensions after changes of pose, wrench and anchors."""
        changed, _, wrench, moved = self.at(h)
        found = sl.inverse(changed, moved, wrench=wrench)
        assert found.feasible
        return np.concatenate((found.unstrained_length, found.state.cables.frame_end_tension))

    def arguments(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arguments of both functions, and the direction of their changes."""
        anchors = {"frame_anchors": self.robot.frame_anchors, "platform_anchors": self.robot.platform_anchors}
        return (
            {"wrench": self.share * WRENCH, **anchors},
            {"wrench": self.force, "frame_anchors": self.frame, "platform_anchors": self.platform},
        )

    def arguments_of_forward(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arguments of `forward`, and the direction of their changes."""
        arguments, changes = self.arguments()
        return {"lengths": self.lengths, **arguments}, {"lengths": self.wound, **changes}

    def arguments_of_inverse(self) -> tuple[dict[str, Any], dict[str, Any]]:
        """Arguments of `inverse`, and the direction of their changes."""
        arguments, changes = self.arguments()
        turned = (
            0.5 * (Rotation.from_quat([*self.motion[3:], 0.0]) * Rotation.from_quat(self.pose.quaternion)).as_quat()
        )
        turned *= np.linalg.norm(self.motion[3:])
        return (
            {"position": self.pose.position, "quaternion": self.pose.quaternion, **arguments},
            {"position": self.motion[:3], "quaternion": turned, **changes},
        )
