"""Inverse kinematics of single poses, for a control loop."""

from __future__ import annotations

import struct
from array import array
from math import hypot, isfinite, nan
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import brief, flag, instance
from sagline.core.arrays import Array, exactly, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import codes, tables
from sagline.kernels.forward.sensitivity import stabilities_of_poses
from sagline.kernels.inverse.feasibility import decide_poses
from sagline.kernels.inverse.poses import inverse_poses
from sagline.kernels.jit import bound
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.inverse_rows import UNDECIDED, InverseRows, covers_all
from sagline.kinematics.status import BALANCED, PoseStatus
from sagline.robot.batch import has_routing
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import TensionMethod, kernel_options, takes_default_kernel
from sagline.tension.methods import DEFAULT, method_of

ARRAY: Final = np.ndarray  # a module-level name is faster than an attribute of another module
FLOAT: Final = np.dtype(np.float64)
WHOLE: Final = slice(None)
_STATUSES = tuple(sorted(PoseStatus))  # status of each code; a lookup takes a tenth of the time of a conversion
# A struct accepts exactly the right number of real numbers, and is faster than the assignment of a tuple to an array.
_POSE = struct.Struct(f"{tables.POSE_COLUMNS}d").pack_into
QUATERNION_TOLERANCE = 1e-6  # largest deviation of the length of a quaternion from 1, as in `Pose.from_quaternion`
_PLAIN = (tuple, list)
ROUNDING = 1e-15  # no normalization is needed below this deviation


def copy_in(memory: Any, given: Any, item: str, unit: str) -> None:
    """Copy a caller's numbers into a `memoryview` (k,) of float64; the solver checks that they are finite."""
    # A memoryview accepts only an array of equal type and size. This check takes tens of nanoseconds, which is less
    # than a numpy copy takes.
    try:
        if given.__class__ is ARRAY:
            memory[WHOLE] = given
            return
        if isinstance(given, list | tuple):
            memory[WHOLE] = array("d", given)
            return
    except (TypeError, ValueError, NotImplementedError, OverflowError):
        # the numbers have another type or shape: integers and similar types are converted; other values raise an error
        pass
    memory[WHOLE] = exactly(given, item, unit, (len(memory),))


def copy_out(values: Array, out: Any, item: str) -> None:
    """Copy the result `values` (k,) into a caller's array."""
    try:
        if out.dtype is FLOAT or out.dtype == FLOAT:
            out[WHOLE] = values
            return
    # the target is not an array, or has another shape, or is write-locked
    except (AttributeError, IndexError, TypeError, ValueError):
        pass
    allowed = f"a writable array of float64 of shape ({values.size},)"
    raise InvalidValueError(item, brief(out), allowed, f"Give np.empty({values.size}).")


class InverseStep(NamedTuple):
    """Result of one pose. All numbers are NaN at a pose without a solution. An unstable equilibrium has numbers.

    Attributes:
        unstrained_length: L [m], shape (m,).
        chord_tension: tau [N], shape (m,).
        horizontal_tension: T_x [N], shape (m,).
        vertical_force: T_z on the cable at its platform end [N], shape (m,).
        status: SOLVED, or the reason why the pose has no solution.
        shortfall: Smallest change of the force that would make the pose feasible [N].
    """

    unstrained_length: Array
    chord_tension: Array
    horizontal_tension: Array
    vertical_force: Array
    status: PoseStatus
    shortfall: float


class InverseSolver:
    """Solver for successive poses, prepared once.

    The solver owns its work arrays. For `Closest`, the solver stores the last feasible tensions. `reset` clears these
    tensions. Use one solver per control loop, and do not share a solver between threads.

    Examples:
        >>> import sagline as sl
        >>> solver = sl.InverseSolver(sl.load_robot("cogiro"))
        >>> step = solver.step((1.0, 1.0, 2.0), (0.0, 0.0, 0.0, 1.0))
        >>> print(step.status.name, step.unstrained_length[:3].round(3))
        SOLVED [11.049 10.542  9.674]
    """

    def __init__(
        self,
        robot: Robot,
        model: CableModel | str | None = None,
        tension: TensionMethod | str | None = None,
        *,
        stability: bool = True,
    ) -> None:
        """Prepare the robot's arrays and the kernel.

        Args:
            robot: The robot, with at least as many cables as degrees of freedom.
            model: Cable model; the default is the exact model.
            tension: Tension distribution method; the default is `Closest`, relative to the previous step.
            stability: True to check the stability of every equilibrium. False saves a tenth of a microsecond per step;
                the status UNSTABLE is then not used.

        Raises:
            InvalidValueError: If the robot has too few cables, or its winches have guides. If `tension` does not
                support the number of cables. If an argument has the wrong type.
        """
        without_guides(instance(robot, Robot, "robot"), "InverseSolver", "inverse")
        m, n = robot.cable_count, robot.degrees_of_freedom
        method = method_of(DEFAULT if tension is None else tension)
        self._robot = robot
        self._stability = flag(stability, "stability")
        self._options = kernel_options(robot, Catenary() if model is None else model_of(model), method)
        self._pose = np.zeros((1, tables.POSE_COLUMNS))
        self._pose[0, 6] = 1.0
        self._wrench = np.zeros((1, 6))
        self._pose_bytes = self._pose[0].data.cast("B")
        self._position: Any = self._pose[0, :3].data
        self._quaternion: Any = self._pose[0, 3:].data
        self._load = self._wrench[0].data
        self._reference = np.full(m, np.nan)
        self._found = InverseRows.empty(robot, 1)
        # reading this memory takes a fifth of the time of reading an array of one element
        self._status = self._found.pose_status.data
        self._loaded = False  # True if the wrench of the last step was not zero
        self._lengths = self._found.results[tables.LENGTH, 0]
        # The views are read-only, because kernels are compiled for read-only inputs. Values are written through the
        # owner of the memory.
        self._rows = locked(self._pose.view())
        model_terms, sharing_terms, limit_terms = self._options
        given = (robot_terms(robot), self._rows, locked(self._wrench.view()))
        memory, answers = memory_for(m), self._found.answers
        otherwise = None if takes_default_kernel(method) else True
        share = (*self._options, *given, self._reference, memory, otherwise, self._stability, answers, 0, 1)
        self._solve = bound(inverse_poses, *share)
        only = locked(np.zeros(1, dtype=np.int64))
        how = (only, covers_all(sharing_terms[0], m - n), memory, answers, self._found.proofs)
        decide = (model_terms, limit_terms, *given, *how)
        self._decide = bound(decide_poses, *decide)
        terms = (*model_terms, has_routing(robot) or None)
        checked = (only, memory, self._found.results, self._found.pose_status)
        self._decide_stability = bound(stabilities_of_poses, terms, *given[:2], *checked)
        self.reset()

    def reset(self) -> None:
        """Clear the last tensions: the next step starts from the minimum norm."""
        self._reference.fill(np.nan)

    def step(self, position: ArrayLike, quaternion: ArrayLike, wrench: ArrayLike | None = None) -> InverseStep:
        """Solve one pose.

        Args:
            position: Position of the platform origin [m], shape (3,).
            quaternion: Rotation platform -> world, unit, scalar last, shape (4,).
            wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for
                zero.

        Returns:
            A new result whose arrays belong to the caller.

        Raises:
            InvalidValueError: If an argument is not finite or has the wrong shape. If the length of the quaternion
                differs from 1 by more than 1e-6.
        """
        load = None if wrench is None else exactly(wrench, "wrench", "N or N m", (6,))
        lengths = np.empty(self._reference.size)
        status = self.step_into(position, quaternion, lengths, load)
        if status is PoseStatus.NO_POSE:
            exactly(self._pose[0, :3], "position", "m", (3,))
            length = float(np.linalg.norm(exactly(self._pose[0, 3:], "quaternion", "", (4,))))
            hint = "Normalize it; scalar last: (x, y, z, w)."
            raise InvalidValueError("quaternion", f"of length {length:.12g}", "length 1 to 1e-6", hint)
        decided = status in (PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE)
        unknown = 0.0 if status in BALANCED else nan
        return InverseStep(
            lengths,
            self._found.results[tables.TENSION, 0].copy(),
            self._found.results[tables.HORIZONTAL, 0].copy(),
            self._found.results[tables.VERTICAL, 0].copy(),
            status,
            float(self._found.shortfall[0]) if decided else unknown,
        )

    def step_into(
        self, position: ArrayLike, quaternion: ArrayLike, out: Array, wrench: ArrayLike | None = None
    ) -> PoseStatus:
        """Solve one pose and fill `out`, without allocation of memory. The status reports wrong numbers.

        Args:
            position: Position of the platform origin [m], shape (3,).
            quaternion: Rotation platform -> world, scalar last, shape (4,). Length 1 within 1e-6; normalized.
            out: Filled with the unstrained lengths [m], shape (m,), or with NaN at a pose without a solution.
            wrench: External plus inertial wrench about the center of mass, world axes [N, N m], shape (6,); None for
                zero.

        Returns:
            The status of the pose; NO_POSE if a number is not finite, or the length of the quaternion is not 1.

        Raises:
            InvalidValueError: If an argument is not an array of the required type and shape.
        """
        place: Any = position
        turn: Any = quaternion
        try:
            if place.__class__ is ARRAY and turn.__class__ is ARRAY:
                self._position[WHOLE] = place
                self._quaternion[WHOLE] = turn
            elif place.__class__ in _PLAIN and turn.__class__ in _PLAIN:
                (x, y, z), (i, j, k, w) = place, turn
                _POSE(self._pose_bytes, 0, x, y, z, i, j, k, w)
            else:
                raise TypeError
        except (struct.error, TypeError, ValueError, NotImplementedError, OverflowError):
            # converts integers and similar types, or raises an error with the reason
            copy_in(self._position, place, "position", "m")
            copy_in(self._quaternion, turn, "quaternion", "")
        if wrench is not None:
            self._loaded = True
            copy_in(self._load, wrench, "wrench", "N or N m")
        elif self._loaded:
            self._loaded = False
            self._wrench.fill(0.0)
        if not -ROUNDING < (length := hypot(*self._quaternion)) - 1.0 < ROUNDING and not self._normalized(length):
            self._lengths.fill(nan)
            copy_out(self._lengths, out, "out")
            return PoseStatus.NO_POSE
        self._solve()
        code = self._status[0]
        if code:  # 0 is SOLVED
            if not (isfinite(sum(self._position)) and isfinite(sum(self._load))):
                self._lengths.fill(nan)
                copy_out(self._lengths, out, "out")
                return PoseStatus.NO_POSE
            if code in UNDECIDED:
                self._decide()
                code = self._status[0]
                if self._stability and not code:
                    code = codes.UNPROVED_STABILITY
            if code == codes.UNPROVED_STABILITY:
                self._decide_stability()
                code = self._status[0]
        try:
            if out.dtype is not FLOAT:
                raise TypeError
            out[WHOLE] = self._lengths
        except (AttributeError, IndexError, TypeError, ValueError):
            copy_out(self._lengths, out, "out")  # this call converts the numbers, or raises an error with the reason
        status: PoseStatus = _STATUSES[code]
        return status

    def _normalized(self, length: float) -> bool:
        """Normalize the quaternion in place if its length is close enough to 1."""
        if not abs(length - 1.0) <= QUATERNION_TOLERANCE:  # the condition is also true for NaN
            return False
        self._pose[0, 3:] /= length
        return True
