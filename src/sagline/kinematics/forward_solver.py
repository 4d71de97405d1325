"""Forward kinematics of single samples, for a control loop."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import instance
from sagline.core.arrays import LARGEST, SMALLEST, Array, checked, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes, tables
from sagline.kernels.forward.forward import forward_poses
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward import dead_only, search
from sagline.kinematics.forward_rows import ForwardRows, new_chain, without_guides
from sagline.kinematics.inverse_solver import copy_in, copy_out
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.batch import dead_cable, has_routing
from sagline.robot.pose import PoseLike, single_pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows


class ForwardStep(NamedTuple):
    """Result of one sample.

    Attributes:
        position: Position of the platform origin [m], shape (3,).
        quaternion: Rotation platform -> world, scalar last, shape (4,).
        chord_tension: tau of the cables [N], shape (m,).
        status: Kind of the equilibrium, or the reason if no equilibrium was found.
        stiffness_min: Smallest stiffness [N/m], as in `ForwardSolution`.
        force_residual: Norm of the unbalanced force [N].
        moment_residual: Norm of the unbalanced moment [N m].
    """

    position: Array
    quaternion: Array
    chord_tension: Array
    status: ForwardStatus
    stiffness_min: float
    force_residual: float
    moment_residual: float


class ForwardSolver:
    """Solver for successive samples. Each sample starts from the last stable equilibrium.

    The solver owns its work arrays, and stores the last equilibrium. `reset` clears this equilibrium. Use one solver
    per control loop, and do not share a solver between threads.
    """

    def __init__(self, robot: Robot, model: CableModel | str | None = None, start: PoseLike | None = None) -> None:
        """Prepare the robot's arrays and the kernel.

        Args:
            robot: The robot.
            model: Cable model; the default is the exact model. The model `Straight` is refused, because it has no
                forces.
            start: Initial pose of the first step; with None, the first step searches its pose in several hundred
                microseconds.

        Raises:
            InvalidValueError: If `model` is Straight, which has no forces. If `start` is a batch. If the robot's
                winches have guides. If an argument has the wrong type.
        """
        self._robot = without_guides(instance(robot, Robot, "robot"), "ForwardSolver", "forward")
        self._model = Catenary() if model is None else model_of(model)
        if self._model.code == codes.STRAIGHT:
            step = "Use forward() to fit straight cables."
            raise InvalidValueError("model", "Straight()", "a cable model other than Straight", step)
        m = robot.cable_count
        self._dead = None if robot.winches is None else dead_cable(robot)
        self._lengths = np.ones((1, m))
        self._start = np.zeros((1, tables.POSE_COLUMNS))
        self._wrench = np.zeros((1, 6))
        self._found = ForwardRows.empty(robot, 1)
        self._arguments: tuple[Any, ...] = (
            (self._model.code, *self._model.parameters, has_routing(robot) or None),
            True,  # arrays that keep the last equilibrium for the next sample
            (
                robot.freedom,
                body_table(robot),
                cable_table(robot, slanted=True),
                *(locked(array.view()) for array in (self._lengths, self._start, self._wrench)),
            ),
            new_chain(m, robot.degrees_of_freedom),
            memory_for(m),
            self._found.arrays,
        )
        self._own_lengths, self._load = self._lengths[0].data, self._wrench[0].data
        self._place, self._turn = self._found.poses[0, :3], self._found.poses[0, 3:]
        self._loaded = False  # True if the last sample had a wrench
        self._start[0, 6] = 1.0
        self._lengths[0] = np.nan  # loads the kernel without solving
        forward_poses(*self._arguments)
        self.reset(start)

    def reset(self, start: PoseLike | None = None) -> None:
        """Clear the last pose. The next step starts at `start`, or searches its pose.

        Args:
            start: Initial pose of the next step; with None, the next step searches its pose.

        Raises:
            InvalidValueError: If `start` is not a single pose.
        """
        self._lost = start is None
        if start is not None:
            self._start[:] = pose_rows(single_pose(start, "start"))

    def step(self, unstrained_length: ArrayLike, wrench: ArrayLike | None = None) -> ForwardStep:
        """Solve one sample.

        Args:
            unstrained_length: L [m], > 0, shape (m,).
            wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for
                zero.

        Returns:
            A new result whose arrays belong to the caller.

        Raises:
            InvalidValueError: If a length is not positive, or not longer than its dead length: the message names the
                cable. If a shape is wrong.
        """
        lengths = self._checked(unstrained_length)
        if self._dead is not None and not (lengths > self._dead).all():
            raise dead_only(lengths, self._dead)
        load = None if wrench is None else exactly(wrench, "wrench", "N or N m", (6,))
        position, quaternion = np.empty(3), np.empty(4)
        status = self.step_into(lengths, position, quaternion, load)
        numbers = self._found.numbers[0]
        return ForwardStep(
            position,
            quaternion,
            self._found.results[tables.TENSION, 0].copy(),
            status,
            float(numbers[tables.STIFFNESS_MIN]),
            float(numbers[tables.FORCE_RESIDUAL]),
            float(numbers[tables.MOMENT_RESIDUAL]),
        )

    def _checked(self, unstrained_length: ArrayLike) -> Array:
        """Check that lengths (m,) are positive and finite. For few numbers, a check of a list is fastest."""
        given, shape = unstrained_length, self._lengths.shape[1:]
        if type(given) is np.ndarray and given.dtype == np.float64 and given.shape == shape:
            values = given.tolist()
            if min(values) >= SMALLEST and sum(values) < LARGEST:  # if one length is NaN, the sum is NaN
                return given
        lengths = checked(unstrained_length, "unstrained_length", "m", shape=shape, above=0.0)
        if lengths.ndim != 1:
            step = "Give the lengths of one sample."
            raise InvalidValueError("unstrained_length", f"of shape {lengths.shape}", f"shape {shape}", step)
        return lengths

    def step_into(
        self, unstrained_length: Array, position: Array, quaternion: Array, wrench: Array | None = None
    ) -> ForwardStatus:
        """Solve one sample and fill the caller's arrays. After the first solved pose, no memory is allocated.

        A wrong length or wrench raises no error, but is reported by the status.

        Args:
            unstrained_length: L [m], shape (m,).
            position: Filled with the position of the platform origin [m], shape (3,).
            quaternion: Filled with the rotation platform -> world, scalar last, shape (4,).
            wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for
                zero.

        Returns:
            The status of the sample.

        Raises:
            InvalidValueError: If an argument is not an array of the required type and shape.
        """
        copy_in(self._own_lengths, unstrained_length, "unstrained_length", "m")
        if wrench is not None:
            self._loaded = True
            copy_in(self._load, wrench, "wrench", "N or N m")
        elif self._loaded:
            self._loaded = False
            self._wrench.fill(0.0)
        if self._lost:
            found = search(self._robot, self._model, locked(self._lengths.copy()), locked(self._wrench.copy()))
            self._start[:] = found.poses
        forward_poses(*self._arguments)
        status = ForwardStatus(self._found.pose_status[0])
        if status in STABLE:
            self._start[0] = self._found.poses[0]
            self._lost = False
        copy_out(self._place, position, "position")
        copy_out(self._turn, quaternion, "quaternion")
        return status
