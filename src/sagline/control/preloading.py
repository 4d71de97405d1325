"""Loading what a motion needs before time counts: the first call of a kernel reads it from disk, for half a second."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

import numpy as np

from sagline.cables.model import CableModel
from sagline.control.checks import motion_along
from sagline.control.homing import Homing
from sagline.control.jogging import PlatformJog, winch_jog
from sagline.control.set_points import SetPoint, standing_at
from sagline.core.arrays import Array
from sagline.core.errors import SaglineError
from sagline.motion.rest_to_rest import septic_path
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod

MOVE = 0.01  # m
HEIGHTS = (0.25, 0.5, 0.1, 0.75)  # below the frame's anchors, in widths of the frame


def load_all(robot: Robot, period: float, model: CableModel, method: TensionMethod) -> None:
    """Do once what homing, a path and jogs do, near the middle of a robot; what is refused there does not matter.

    Each part is tried by itself: one that is refused leaves no other cold.

    Args:
        robot: The robot.
        period: Of a cycle [s].
        model: Of the cables.
        method: How the load is shared.
    """
    middle, homing = _homed(robot, model, method)
    beside = Pose.from_euler(middle.position + np.array([MOVE, 0.0, 0.0]), 0.0, 0.0, 0.0)
    path, by = septic_path([middle, beside], speed=0.1), np.full(6, 1e-3)
    previous = None if homing is None else homing.plan
    point = _hanging(robot, middle) if homing is None else homing.standing.step()
    parts: tuple[Callable[[], object], ...] = (
        lambda: None if homing is None else homing.refusal(),
        lambda: standing_at(robot, point.length, None, model),
        lambda: motion_along(robot, path, period, model, method, previous),
        lambda: winch_jog(robot, point.length, middle, 0, 1e-3, period, model),
        lambda: PlatformJog(robot, point, middle, by, period, model, method).step(),
    )
    for part in parts:
        with suppress(SaglineError):
            part()


def _homed(robot: Robot, model: CableModel, method: TensionMethod) -> tuple[Pose, Homing | None]:
    """The first place where the tensions are within their limits; else the middle, and None."""
    for place in _middles(robot):
        pose = Pose.from_euler(place, 0.0, 0.0, 0.0)
        with suppress(SaglineError):
            homing = Homing(robot, pose, model, method)
            homing.off = np.zeros(robot.cable_count)
            return pose, homing
    return Pose.from_euler(_middles(robot)[0], 0.0, 0.0, 0.0), None


def _hanging(robot: Robot, pose: Pose) -> SetPoint:
    """A set point with straight cables."""
    length = np.linalg.norm(pose.transform(robot.platform_anchors) - robot.frame_anchors, axis=1)
    none, unknown = np.zeros(len(length)), np.full(len(length), np.nan)
    return SetPoint(length, none, unknown, unknown, None, None, np.nan, True)


def _middles(robot: Robot) -> list[Array]:
    """Places where a robot can probably be: the middle of its test box, those below that of its frame anchors."""
    low, high = robot.frame_anchors.min(axis=0), robot.frame_anchors.max(axis=0)
    width = float(np.linalg.norm((high - low)[:2]))
    below = [np.asarray(0.5 * (low + high) - [0.0, 0.0, height * width]) for height in HEIGHTS]
    box = robot.test_box
    return below if box is None else [0.5 * (box.low + box.high), *below]
