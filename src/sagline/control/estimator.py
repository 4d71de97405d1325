"""Estimate of the pose by the encoders."""

from __future__ import annotations

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array
from sagline.kinematics.forward_solver import ForwardSolver
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


class Estimator:
    """Forward kinematics of each sample, started at the pose before.

    Attributes:
        position: Of the platform's origin [m], shape (3,); NaN where it was never known.
        quaternion: Rotation platform -> world, scalar last, shape (4,).
        status: Code of its `ForwardStatus`; -1 where there is none.
    """

    def __init__(self, robot: Robot, model: CableModel) -> None:
        """Begin without a pose."""
        self._solver = ForwardSolver(robot, model)
        self.forget()

    @property
    def pose(self) -> Pose | None:
        """Pose of the platform; None where it is not known."""
        return Pose.from_quaternion(self.position, self.quaternion) if self.status in STABLE else None

    def forget(self) -> None:
        """Forget the pose."""
        self.position, self.quaternion, self.status = np.full(3, np.nan), np.full(4, np.nan), -1

    def begin_at(self, pose: Pose) -> None:
        """Start at a known pose."""
        self._solver.reset(pose)
        self.position, self.quaternion, self.status = pose.position, pose.quaternion, int(ForwardStatus.SOLVED)

    def locate(self, length: Array, wrench: Array | None) -> ForwardStatus | None:
        """Solve for the pose; the status where it has just been lost. length [m] (m,), wrench (6,) or None."""
        position, quaternion = np.empty(3), np.empty(4)
        status = self._solver.step_into(length, position, quaternion, wrench)
        lost = status not in STABLE and self.status in STABLE
        self.position, self.quaternion, self.status = position, quaternion, int(status)
        return status if lost else None
