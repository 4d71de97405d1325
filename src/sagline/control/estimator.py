"""Where the platform is by the encoders, from sample to sample."""

from __future__ import annotations

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array
from sagline.kinematics.forward_solver import ForwardSolver
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot


class Estimator:
    """Follows the platform by the lengths that are read.

    Attributes:
        position: Of the platform's origin [m], shape (3,); NaN where it was never known.
        quaternion: Rotation platform -> world, scalar last, shape (4,).
        status: Code of its `ForwardStatus`; -1 where there is none.
    """

    def __init__(self, robot: Robot, model: CableModel) -> None:
        """Nothing is known.

        Args:
            robot: As it is planned for.
            model: Of the cables.
        """
        self._solver = ForwardSolver(robot, model)
        self.forget()

    @property
    def pose(self) -> Pose | None:
        """Where the platform is; None where that is not known."""
        return Pose.from_quaternion(self.position, self.quaternion) if self.status in STABLE else None

    def forget(self) -> None:
        """Know nothing any more."""
        self.position, self.quaternion, self.status = np.full(3, np.nan), np.full(4, np.nan), -1

    def begin_at(self, pose: Pose) -> None:
        """Know where it is.

        Args:
            pose: There.
        """
        self._solver.reset(pose)
        self.position, self.quaternion, self.status = pose.position, pose.quaternion, int(ForwardStatus.SOLVED)

    def locate(self, length: Array, wrench: Array | None) -> ForwardStatus | None:
        """Follow it to where these lengths hold it.

        Args:
            length: Unstrained [m], shape (m,).
            wrench: On the platform, shape (6,); None for none.

        Returns:
            Why its place has been lost just now; None where it has not.
        """
        position, quaternion = np.empty(3), np.empty(4)
        status = self._solver.step_into(length, position, quaternion, wrench)
        lost = status not in STABLE and self.status in STABLE
        self.position, self.quaternion, self.status = position, quaternion, int(status)
        return status if lost else None
