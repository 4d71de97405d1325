"""Inverse kinematics: from a motion of the platform to tensions and unstrained lengths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.arrays import Array, Codes, Flags, locked
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel, CableState
from sagline.errors import CableGeometryError, InvalidValueError
from sagline.kernels import codes, tables
from sagline.kernels.inverse.explain import explain_poses
from sagline.kernels.inverse.poses import Answers, inverse_poses
from sagline.kernels.memory import memory_for
from sagline.kinematics.blocks import Progress, blocks
from sagline.kinematics.plan import Plan
from sagline.motion.path import Path
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows, robot_terms
from sagline.statics.wrench import external_wrench, inertial_wrench
from sagline.tension.closest import Closest
from sagline.tension.method import TensionMethod, Variable
from sagline.tension.options import Options, kernel_options, takes_default_kernel

BLOCK = 1 << 12  # poses solved at once: less than 0.2 s, after which an interrupt is heard

_CATENARY = Catenary()
_CLOSEST = Closest()


def inverse(
    robot: Robot,
    motion: Path | Pose,
    model: CableModel = _CATENARY,
    tension: TensionMethod = _CLOSEST,
    wrench: ArrayLike | None = None,
    previous: Plan | None = None,
    *,
    progress: Progress | None = None,
) -> Plan:
    """Tensions that balance the platform within their limits, and the unstrained lengths that produce them.

    Args:
        robot: The robot, with m cables and n degrees of freedom, m >= n.
        motion: A path of N samples, whose inertia is included; or a pose or batch of N poses at rest.
        model: Cable model; the default is exact.
        tension: How the load is shared among redundant cables. `Closest` carries its reference along a
            path only; in a batch of poses each stands alone.
        wrench: External wrench on the platform about its center of mass in world axes, without gravity and
            inertia: force [N], then moment [N m], shape (6,) or (N, 6). None for none.
        previous: A plan that this one continues: `Closest` starts from its last feasible tensions.
        progress: Called every few hundredths of a second: how many poses are solved, or known not to be feasible and
            why, of how many.

    Returns:
        Plan with fields of shape (m,) for a single pose, (N, m) otherwise. A pose without an answer is not
        feasible there, says why, and holds NaN.

    Raises:
        InvalidValueError: If the robot has fewer cables than degrees of freedom, the method cannot share among
            its cables, or an argument is of the wrong shape.
        CableGeometryError: If a cable has no length at some pose.

    Source:
        Gia Luan & Truong Thinh 2020, figure 16; made exact in docs/model.md, section 5.
    """
    method = tension if isinstance(motion, Path) or previous is not None else tension.alone
    options = kernel_options(robot, model, method)
    pose = motion.pose if isinstance(motion, Path) else motion
    rows = pose_rows(pose)
    count = len(rows)
    load = external_wrench(wrench, count if pose.shape else None)
    if isinstance(motion, Path):
        load = locked(inertial_wrench(robot, pose, motion.twist, motion.twist_rate) + load)
    reference = _reference(robot, previous, tension.variable)
    found = Found.empty(count, robot.cable_count, robot.degrees_of_freedom)
    otherwise = None if takes_default_kernel(method) else True
    memory = memory_for(robot.cable_count)
    given = (*options, robot_terms(robot), rows, np.atleast_2d(load), reference, memory, otherwise, found.answers)
    done = 0
    for part in blocks(count, BLOCK):
        inverse_poses(*given, part.start, part.stop)
        done += int(np.count_nonzero(found.pose_status[part] != codes.POSE_INFEASIBLE))
        if progress is not None:
            progress(done, count)
    _refuse_missing_chords(found.pose_status, found.results)
    shortfall, farkas, blocking = explained(robot, options, rows, found, progress)
    cables = CableState(
        model=model,
        cable=robot.cables,
        gravity=robot.gravity,
        span=found.row(tables.SPAN, pose),
        rise=found.row(tables.RISE, pose),
        unstrained_length=found.row(tables.LENGTH, pose),
        horizontal_tension=found.row(tables.HORIZONTAL, pose),
        vertical_force=found.row(tables.VERTICAL, pose),
        chord_tension=found.row(tables.TENSION, pose),
        status=locked(found.cable_status.reshape(*pose.shape, -1)),
    )
    whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*pose.shape, 6))))
    return Plan(
        state=Equilibrium(robot, pose, whole, cables),
        path=motion if isinstance(motion, Path) else None,
        tension=tension,
        status=locked(found.pose_status.reshape(pose.shape)),
        shortfall=locked(shortfall.reshape(pose.shape)),
        wrench_residual=locked(found.residuals.reshape(*pose.shape, 2)),
        blocking=locked(blocking.reshape(*pose.shape, -1)),
        farkas=locked((farkas @ robot.freedom).reshape(*pose.shape, 6)),
        needed=locked((found.needed @ robot.freedom).reshape(*pose.shape, 6)),
    )


class Found(NamedTuple):
    """What the kernel fills, in its order; arrays lead with the N poses but for results (RESULT_ROWS, N, m)."""

    results: Array
    cable_status: Codes
    residuals: Array
    needed: Array
    pose_status: Codes

    @classmethod
    def empty(cls, count: int, cables: int, freedoms: int) -> Found:
        """Room for a batch."""
        return cls(
            np.empty((tables.RESULT_ROWS, count, cables)),
            np.empty((count, cables), dtype=np.int8),
            np.empty((count, 2)),
            np.empty((count, freedoms)),
            np.empty(count, dtype=np.int8),
        )

    @property
    def answers(self) -> Answers:
        """As the kernel takes it: a plain tuple."""
        return self.results, self.cable_status, self.residuals, self.needed, self.pose_status

    def row(self, row: int, pose: Pose) -> Array:
        """One row of the results in the caller's shape."""
        return locked(self.results[row].reshape(*pose.shape, -1))


def explained(
    robot: Robot, options: Options, rows: Array, found: Found, progress: Progress | None = None
) -> tuple[Array, Array, Flags]:
    """Shortfall [N] (N,), Farkas vectors along the free motions (N, n) and blocking cables (N, m) of a batch."""
    count, n = found.needed.shape
    solved = found.pose_status == codes.POSE_SOLVED
    shortfall = np.where(solved, 0.0, np.nan)
    farkas = np.full((count, n), np.nan)
    blocking = np.zeros((count, robot.cable_count), dtype=np.bool_)
    which = np.flatnonzero(found.pose_status == codes.POSE_INFEASIBLE)
    memory = memory_for(robot.cable_count)
    for part in blocks(which.size, BLOCK):
        explain_poses(
            options.model,
            options.limits,
            robot_terms(robot),
            rows,
            found.needed,
            which[part],
            memory,
            (shortfall, farkas, blocking),
        )
        if progress is not None:
            progress(count - which.size + part.stop, count)
    return shortfall, farkas, blocking


def _reference(robot: Robot, previous: Plan | None, variable: Variable) -> Array:
    """Tensions to start from, in the sharing's variable (m,): the last feasible ones of a plan, or NaN."""
    if previous is None:
        return np.full(robot.cable_count, np.nan)
    cables = previous.state.cables
    if cables.shape[-1] != robot.cable_count:
        raise InvalidValueError(
            "previous",
            f"a plan of {cables.shape[-1]} cables",
            f"{robot.cable_count} cables",
            "Continue a plan of this robot.",
        )
    tensions = {
        "chord": cables.chord_tension,
        "horizontal": cables.horizontal_tension,
        "frame_end": cables.frame_end_tension,
    }[variable]
    feasible = np.flatnonzero(np.atleast_1d(previous.feasible))
    if not feasible.size:
        return np.full(robot.cable_count, np.nan)
    last: Array = np.atleast_2d(tensions)[feasible[-1]].copy()
    return last


def _refuse_missing_chords(status: Codes, results: Array) -> None:
    lost = np.flatnonzero(status == codes.POSE_NO_CHORD)
    if not lost.size:
        return
    pose = int(lost[0])
    cable = int(np.argmin(np.hypot(results[tables.SPAN, pose], results[tables.RISE, pose])))
    raise CableGeometryError(
        f"pose {pose}, cable {cable}: distance between its ends",
        "0 m",
        "> 1e-9 m",
        "Move the platform away from the anchor, or the anchor away from the path.",
    )
