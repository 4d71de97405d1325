"""Inverse kinematics one pose at a time, for a control loop."""

from __future__ import annotations

from functools import partial
from math import isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, checked, locked
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels import tables
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.inverse.verdicts import ENOUGH, decide_poses
from sagline.kernels.jit import machine_code
from sagline.kernels.memory import memory_for
from sagline.kinematics.inverse_rows import UNDECIDED, Found, Verdicts, covers_all
from sagline.kinematics.status import PoseStatus
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.closest import Closest
from sagline.tension.method import TensionMethod
from sagline.tension.options import kernel_options, takes_default_kernel

_STATUSES = tuple(PoseStatus)  # by code; a lookup costs a tenth of a conversion
QUATERNION_TOLERANCE = 2e-6  # of the squared length: as `Pose.from_quaternion`


class InverseStep(NamedTuple):
    """Answer for one pose; NaN where the status is not SOLVED.

    Attributes:
        unstrained_length: L [m], shape (m,).
        chord_tension: tau [N], shape (m,).
        horizontal_tension: T_x [N], shape (m,).
        vertical_force: T_z on the cable at its platform end [N], shape (m,).
        status: Why there is no answer, or SOLVED.
        shortfall: Smallest change of the force that would make the pose feasible [N].
    """

    unstrained_length: Array
    chord_tension: Array
    horizontal_tension: Array
    vertical_force: Array
    status: PoseStatus
    shortfall: float


class InverseSolver:
    """Solves one pose after another without setting anything up again.

    It owns its working memory and, for `Closest`, the last feasible tensions: `reset` forgets them. One solver
    serves one control loop; it is not to be shared between threads.

    Examples:
        >>> import sagline as sl
        >>> solver = sl.InverseSolver(sl.load_robot("cogiro"))
        >>> step = solver.step((1.0, 1.0, 2.0), (0.0, 0.0, 0.0, 1.0))
        >>> print(step.status.name, step.unstrained_length[:3].round(3))
        SOLVED [11.049 10.542  9.674]
    """

    def __init__(self, robot: Robot, model: CableModel | None = None, tension: TensionMethod | None = None) -> None:
        """Prepare the robot's arrays and compile the kernel.

        Args:
            robot: The robot, with at least as many cables as degrees of freedom.
            model: Cable model; the default is the exact one.
            tension: How the load is shared; the default is `Closest`, to the step before.

        Raises:
            InvalidValueError: If the robot has too few cables, or the method cannot share among them.
        """
        m, n = robot.cable_count, robot.degrees_of_freedom
        method = tension or Closest()
        self._robot = robot
        self._options = kernel_options(robot, model or Catenary(), method)
        self._pose = np.zeros((1, tables.POSE_COLUMNS))
        self._pose[0, 6] = 1.0
        self._position, self._quaternion = self._pose[0, :3], self._pose[0, 3:]
        self._wrench = np.zeros((1, 6))
        self._reference = np.full(m, np.nan)
        self._found = Found.empty(1, m, n)
        self._status = self._found.pose_status.data  # read five times faster than an array of one
        self._loaded = False  # whether the wrench of the last step was more than zero
        self._lengths = self._found.results[tables.LENGTH, 0]
        # the views are read-only: kernels are compiled for read-only inputs, and writing goes through the owner
        self._rows = locked(self._pose.view())
        model_terms, sharing_terms, limit_terms = self._options
        given = (robot_terms(robot), self._rows, locked(self._wrench.view()))
        memory, answers = memory_for(m), self._found.answers
        otherwise = None if takes_default_kernel(method) else True
        share = (*self._options, *given, self._reference, memory, otherwise, answers, 0, 1)
        self._solve = partial(machine_code(inverse_poses, share), *share)
        self._verdicts = Verdicts.empty(1, m, n)
        only = locked(np.zeros(1, dtype=np.int64))
        how = (only, covers_all(sharing_terms[0], m - n), memory, answers, self._verdicts.answers)
        decide = (model_terms, limit_terms, *given, *how)
        self._decide = partial(machine_code(decide_poses, decide), *decide)
        self.reset()

    def reset(self) -> None:
        """Forget the last tensions: the next step starts from the minimum norm."""
        self._reference.fill(np.nan)

    def step(self, position: ArrayLike, quaternion: ArrayLike, wrench: ArrayLike | None = None) -> InverseStep:
        """Solve one pose.

        Args:
            position: Of the platform origin [m], shape (3,).
            quaternion: Rotation platform -> world, unit, scalar last, shape (4,).
            wrench: External plus inertial, about the center of mass, world axes [N, N m], shape (6,); None for none.

        Returns:
            A fresh result whose arrays belong to the caller.

        Raises:
            InvalidValueError: If an argument is not finite or of the wrong shape.
        """
        _check_pose(position, quaternion)
        load = None if wrench is None else checked(wrench, "wrench", "N or N m", shape=(6,))
        lengths = np.empty(self._reference.size)
        status = self.step_into(position, quaternion, lengths, load)
        return InverseStep(
            lengths,
            self._found.results[tables.TENSION, 0].copy(),
            self._found.results[tables.HORIZONTAL, 0].copy(),
            self._found.results[tables.VERTICAL, 0].copy(),
            status,
            self._shortfall(status),
        )

    def step_into(
        self, position: ArrayLike, quaternion: ArrayLike, out: Array, wrench: ArrayLike | None = None
    ) -> PoseStatus:
        """Solve one pose into the caller's memory: no allocation, no check of the arguments.

        Args:
            position: Of the platform origin [m], shape (3,).
            quaternion: Rotation platform -> world, unit, scalar last, shape (4,).
            out: Filled with the unstrained lengths [m], shape (m,); NaN where there is no answer.
            wrench: External plus inertial, about the center of mass, world axes [N, N m], shape (6,); None for none.

        Returns:
            The status of the pose.
        """
        self._position[:] = position
        self._quaternion[:] = quaternion
        if wrench is not None:
            self._wrench[0] = wrench
        elif self._loaded:
            self._wrench.fill(0.0)
        self._loaded = wrench is not None
        self._solve()
        if self._status[0] in UNDECIDED:
            self._decide()
        out[:] = self._lengths
        status: PoseStatus = _STATUSES[self._status[0]]
        return status

    def _shortfall(self, status: PoseStatus) -> float:
        if status is PoseStatus.SOLVED:
            return 0.0
        decided = status in (PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE)
        return float(self._verdicts.brackets[0, ENOUGH]) if decided else nan


def _check_pose(position: Any, quaternion: Any) -> None:
    """Refuse what is no pose; plain floats first, because a control loop has no time for arrays."""
    try:
        x, y, z = position
        a, b, c, d = quaternion
        if isfinite(x + y + z) and abs(a * a + b * b + c * c + d * d - 1.0) < QUATERNION_TOLERANCE:
            return
    except (TypeError, ValueError):
        next_step = "Give the platform's position and a unit quaternion, scalar last."
    else:
        next_step = "Normalize it; scalar last: (x, y, z, w)."
    checked(position, "position", "m", shape=(3,))
    norm = float(np.linalg.norm(checked(quaternion, "quaternion", "", shape=(4,))))
    raise InvalidValueError("quaternion", f"of length {norm:.12g}", "length 1 to 1e-6", next_step)
