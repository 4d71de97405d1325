"""Forward kinematics: from unstrained lengths to the pose in which the platform rests."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, Codes, locked
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.cables.state import CableState
from sagline.errors import InvalidValueError
from sagline.kernels import forward as kernel
from sagline.kernels import tables
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table, pose_rows
from sagline.statics.wrench import external_wrench

_CATENARY = Catenary()


def forward(
    robot: Robot,
    unstrained_length: ArrayLike,
    start: Pose | None = None,
    model: CableModel = _CATENARY,
    wrench: ArrayLike | None = None,
) -> ForwardSolution:
    """The pose in which the platform rests on cables of given unstrained lengths.

    Args:
        robot: The robot, with m cables.
        unstrained_length: L [m], > 0, shape (m,) for one sample or (N, m). A row of NaN, as a plan has it at an
            infeasible pose, is answered by the status NO_LENGTHS.
        start: Where to begin. A batch of N poses: one a sample. A single pose with N samples: a trajectory, the
            first sample begins there and each other where the last one ended.
        model: Cable model; the default is exact.
        wrench: External plus inertial wrench on the platform about its center of mass in world axes, without
            gravity: force [N], then moment [N m], shape (6,) or (N, 6). None for none.

    Returns:
        ForwardSolution, single or with a leading axis N.

    Raises:
        InvalidValueError: If a length is not positive or single lengths of a sample are NaN (the message names the
            cable), or an argument is of the wrong shape.

    Source:
        docs/model.md, section 6.
    """
    if start is None:
        raise InvalidValueError("start", "None", "a Pose", "Give a start: the planned pose, or the last known one.")
    lengths = checked_lengths(robot, unstrained_length)
    load = external_wrench(wrench, len(lengths) if lengths.ndim == 2 else None)
    rows = start_rows(start, lengths)
    chained = lengths.ndim == 2 and not start.shape
    found = solve_rows(robot, model, np.atleast_2d(lengths), rows, np.atleast_2d(load), chained=chained)
    return found.solution(robot, model, load, lengths.shape[:-1])


def checked_lengths(robot: Robot, lengths: ArrayLike) -> Array:
    """The caller's lengths, shape (m,) or (N, m), positive or whole rows of NaN.

    Raises:
        InvalidValueError: If they are not; the message names the cable and, of many, the sample.
    """
    try:
        array = np.array(lengths, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        raise InvalidValueError(
            "unstrained_length", repr(lengths), "numbers", f"Give lengths as plain numbers ({error})."
        ) from None
    m = robot.cable_count
    if array.ndim not in (1, 2) or array.shape[-1] != m:
        raise InvalidValueError(
            "unstrained_length",
            f"of shape {array.shape}",
            f"shape ({m},) or (N, {m})",
            f"Give one length for each of the {m} cables of {robot.name}.",
        )
    absent = np.isnan(array).all(axis=-1, keepdims=True)
    wrong = ~(np.isfinite(array) & (array > 0.0)) & ~absent
    if wrong.any():
        index = tuple(int(i) for i in np.argwhere(wrong)[0])
        sample = f"sample {index[0]}, " if array.ndim == 2 else ""
        raise InvalidValueError(
            f"{sample}cable {index[-1]}: unstrained length",
            f"{array[index]:g} m",
            "> 0 m, finite; or NaN for all cables of a sample",
            "Correct the length of this cable.",
        )
    return locked(array)


def start_rows(start: Pose, lengths: Array) -> Array:
    """Pose rows (1 or N, POSE_COLUMNS) to begin at.

    Raises:
        InvalidValueError: If the counts of poses and samples differ.
    """
    if start.shape and start.shape != lengths.shape[:-1]:
        samples = len(lengths) if lengths.ndim == 2 else 1
        raise InvalidValueError(
            "start", f"{len(start)} poses", f"one pose, or {samples}", "Give one start a sample, or a single one."
        )
    return pose_rows(start)


class Found(NamedTuple):
    """What the kernel fills, in its order."""

    poses: Array
    results: Array
    cable_status: Codes
    numbers: Array
    pose_status: Codes

    @classmethod
    def empty(cls, count: int, cables: int) -> Found:
        """Room for a batch."""
        return cls(
            np.empty((count, tables.POSE_COLUMNS)),
            np.empty((tables.RESULT_ROWS, count, cables)),
            np.empty((count, cables), dtype=np.int8),
            np.empty((count, kernel.FORWARD_NUMBERS)),
            np.empty(count, dtype=np.int8),
        )

    def solution(self, robot: Robot, model: CableModel, load: Array, shape: tuple[int, ...]) -> ForwardSolution:
        """The batch in the caller's shape, () or (N,)."""
        wide = (*shape, robot.cable_count)
        pose = Pose._adopt(self.poses[:, :3].reshape(*shape, 3), self.poses[:, 3:].reshape(*shape, 4))
        cables = CableState(
            model=model,
            cable=robot.cables,
            gravity=robot.gravity,
            span=locked(self.results[tables.SPAN].reshape(wide)),
            rise=locked(self.results[tables.RISE].reshape(wide)),
            unstrained_length=locked(self.results[tables.LENGTH].reshape(wide)),
            horizontal_tension=locked(self.results[tables.HORIZONTAL].reshape(wide)),
            vertical_force=locked(self.results[tables.VERTICAL].reshape(wide)),
            chord_tension=locked(self.results[tables.TENSION].reshape(wide)),
            status=locked(self.cable_status.reshape(wide)),
        )
        whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*shape, 6))))
        residuals = self.numbers[:, [kernel.FORCE_RESIDUAL, kernel.MOMENT_RESIDUAL]]
        return ForwardSolution(
            state=Equilibrium(robot, pose, whole, cables),
            status=locked(self.pose_status.reshape(shape)),
            stiffness_min=locked(self.numbers[:, kernel.STIFFNESS_MIN].reshape(shape)),
            energy=locked(self.numbers[:, kernel.ENERGY].reshape(shape)),
            wrench_residual=locked(residuals.reshape(*shape, 2)),
            iterations=locked(self.numbers[:, kernel.ITERATIONS].astype(np.int64).reshape(shape)),
        )


def solve_rows(
    robot: Robot, model: CableModel, lengths: Array, starts: Array, wrenches: Array, *, chained: bool
) -> Found:
    """Run the kernel over samples: lengths (N, m), starts (1 or N, POSE_COLUMNS), wrenches (1 or N, 6)."""
    found = Found.empty(*lengths.shape)
    kernel.forward_poses(
        model.code,
        *model.parameters,
        chained,
        robot.freedom,
        body_table(robot),
        cable_table(robot),
        lengths,
        starts,
        wrenches,
        found.poses,
        found.results,
        found.cable_status,
        found.numbers,
        found.pose_status,
    )
    return found
