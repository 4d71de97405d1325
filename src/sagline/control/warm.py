"""Loading what a motion needs before time counts: the first call of a kernel reads it from disk, for half a second."""

from __future__ import annotations

from contextlib import suppress

import numpy as np

from sagline.arrays import Array
from sagline.cables.model import CableModel
from sagline.control.checks import motion_along
from sagline.control.courses import Standing
from sagline.control.homing import Homing
from sagline.control.jogging import PlatformJog, winch_jog
from sagline.errors import SaglineError
from sagline.kinematics.forward import forward
from sagline.motion.rest_to_rest import septic_path
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

MOVE = 0.01  # m


def load_all(robot: Robot, period: float, model: CableModel, method: TensionMethod) -> None:
    """Do once what homing, a path and jogs do, near the middle of a robot; what is refused there does not matter.

    Args:
        robot: The robot.
        period: Of a cycle [s].
        model: Of the cables.
        method: How the load is shared.
    """
    middle = Pose.from_euler(_middle(robot), 0.0, 0.0, 0.0)
    beside = Pose.from_euler(middle.position + np.array([MOVE, 0.0, 0.0]), 0.0, 0.0, 0.0)
    with suppress(SaglineError):
        homing = Homing(robot, middle, model, method)
        homing.off = np.zeros(robot.cable_count)
        homing.refusal()
        point = Standing.at(homing.state).step()
        forward(robot, point.length, None, model)
        motion_along(robot, septic_path([middle, beside], speed=0.1), period, model, method, homing.plan)
        winch_jog(robot, point.length, middle, 0, 1e-3, period, model)
        PlatformJog(robot, point, middle, np.full(6, 1e-3), period, model, method).step()


def _middle(robot: Robot) -> Array:
    """A place where a robot can probably be: the middle of its test box, else below that of its frame anchors."""
    if robot.test_box is not None:
        middle: Array = 0.5 * (robot.test_box.low + robot.test_box.high)
        return middle
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    return np.asarray(0.5 * (low + high) - [0.0, 0.0, 0.25 * float(np.linalg.norm((high - low)[:2]))])
