"""Confirmation of a plan: exact equilibria of the platform at the planned lengths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from sagline.cables.models import Catenary
from sagline.core.arguments import callback, instance
from sagline.core.arrays import Array, Codes, Flags, Progress, blocks, locked
from sagline.core.results import Columns, Result, Tabular
from sagline.kinematics.forward import forward
from sagline.kinematics.forward_rows import ForwardSolution, iterate_routing, solve_forward_rows
from sagline.kinematics.plan import Plan
from sagline.kinematics.status import ForwardStatus
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.routing import differs, kernel_length
from sagline.statics.tables import pose_rows

_CATENARY = Catenary()
BLOCK = 1 << 14  # poses per block, to limit memory


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Confirmation(Result, Tabular):
    """A plan, and the exact equilibria for its lengths.

    Attributes:
        plan: The plan, of any cable model.
        pose: Equilibrium pose with catenary cables of the planned lengths; NaN if the plan has no solution.
        status: Codes of `ForwardStatus`, shape () or (N,).
        wrench_residual: Norms of the unbalanced force [N] and moment [N m] at the equilibrium pose: shape (2,) or (N,
            2).
    """

    _columns: ClassVar[Columns] = (
        "plan.path.time",
        "pose",
        "error_@=position_error",
        "rotation_error",
        ("status", ForwardStatus),
    )

    plan: Plan
    pose: Pose
    status: Codes
    wrench_residual: Array

    @property
    def held(self) -> Flags:
        """True if the cables hold the platform in a stable equilibrium, shape () or (N,)."""
        return np.asarray(self.status == ForwardStatus.SOLVED)

    @property
    def position_error(self) -> Array:
        """Position of the platform origin minus the planned position [m], world axes, shape (3,) or (N, 3)."""
        return locked(self.pose.position - self.plan.state.pose.position)

    @property
    def rotation_error(self) -> Array:
        """Angle between equilibrium orientation and planned orientation [rad], shape () or (N,)."""
        planned, real = self.plan.state.pose.quaternion, self.pose.quaternion
        # With sine and cosine of half the angle, even a very small angle is precise.
        sine = 0.5 * np.linalg.norm(real - planned, axis=-1) * np.linalg.norm(real + planned, axis=-1)
        cosine = np.abs(np.einsum("...i,...i->...", real, planned))
        return locked(np.asarray(2.0 * np.arctan2(sine, cosine)))


def confirm(plan: Plan, *, progress: Progress | None = None) -> Confirmation:
    """Equilibrium of the platform with catenary cables of the planned lengths.

    Inertia and external wrench are taken from the plan. The search starts at the planned poses.

    Args:
        plan: A plan of any cable model. The cable model of the plan causes the pose errors. With the exact model, the
            pose errors are only rounding errors.
        progress: Function that is called about ten times per second. The arguments are the number of confirmed poses
            and the number of all poses.

    Returns:
        The plan with its exact equilibrium poses.

    Raises:
        InvalidValueError: If `plan` is not a Plan.

    Examples:
        >>> import numpy as np
        >>> import sagline as sl
        >>> path = sl.quintic_path([(0, 0, 2), (2, 1, 2.5)], durations=4.0)
        >>> plan = sl.inverse(sl.load_robot("cogiro"), path, model=sl.Elastic())
        >>> error = np.linalg.norm(sl.confirm(plan).position_error, axis=1)
        >>> print(f"{1e3 * error.max():.2f} mm off")
        0.23 mm off
    """
    callback(progress, "progress")
    state, lengths = instance(plan, Plan, "plan").state, plan.unstrained_length
    if not state.pose.shape or not len(lengths):  # all poses in a single block
        found = _forward(state, progress)
        return Confirmation(plan, found.pose, found.status, found.wrench_residual)
    parts = []
    for rows in blocks(len(lengths), BLOCK):
        part, progress_of_part = state[rows], None if progress is None else _from(rows.start, len(lengths), progress)
        found = _forward(part, progress_of_part)
        parts.append((found.pose.position, found.pose.quaternion, found.status, found.wrench_residual))
    position, quaternion, status, residual = (locked(np.concatenate(each)) for each in zip(*parts, strict=True))
    return Confirmation(plan, Pose._adopt(position, quaternion), status, residual)


def _forward(state: Equilibrium, progress: Progress | None) -> ForwardSolution:
    """Forward kinematics for the lengths and the friction of `state`."""
    robot, winding = state.robot, None if state.contact is None else state.contact.winding
    if not differs(robot, winding):
        return forward(robot, state.unstrained_length, state.pose, wrench=state.wrench, progress=progress)
    lengths, planned = (locked(np.atleast_2d(each).view()) for each in (state.unstrained_length, kernel_length(state)))
    loads = locked(np.atleast_2d(state.wrench).view())
    found = solve_forward_rows(robot, _CATENARY, planned, pose_rows(state.pose), loads, progress=progress)
    found = iterate_routing(robot, _CATENARY, found, lengths, loads, winding, lengths - planned)
    return found.solution(robot, _CATENARY, state.wrench, state.pose.shape)


def _from(first: int, count: int, progress: Progress) -> Progress:
    """Progress callback for a part of `count` poses. The `first` poses before this part are added to the number."""
    return lambda done, _: progress(first + done, count)
