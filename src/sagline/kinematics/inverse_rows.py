"""Inverse kinematics in rows: robot, poses and wrenches as the kernels take them, and their answers back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.arrays import Array, Codes, Flags, locked
from sagline.blocks import Progress, blocks
from sagline.kernels import codes, tables
from sagline.kernels.inverse.explain import explain_poses
from sagline.kernels.inverse.poses import Answers, inverse_poses
from sagline.kernels.memory import memory_for
from sagline.robot.pose import Pose
from sagline.robot.several import Robots, first_of
from sagline.statics.tables import robot_terms
from sagline.tension.method import TensionMethod
from sagline.tension.options import Options, takes_default_kernel

BLOCK = 1 << 12  # poses solved at once: less than 0.2 s, after which an interrupt is heard


class Found(NamedTuple):
    """What the kernel fills, in its order; arrays lead with the N poses but for results (RESULT_ROWS, N, m)."""

    results: Array
    cable_status: Codes
    residuals: Array
    needed: Array
    pose_status: Codes

    @classmethod
    def empty(cls, count: int, cables: int, freedoms: int) -> Found:
        """Room for a batch.

        Args:
            count: Number of poses N.
            cables: Number of cables m.
            freedoms: Number of free motions n.

        Returns:
            Arrays to be filled.
        """
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
        """One row of the results in the caller's shape.

        Args:
            row: Which, as in kernels.tables.
            pose: One pose or a batch of N: whose shape.

        Returns:
            Array of shape (m,) or (N, m), write-locked.
        """
        return locked(self.results[row].reshape(*pose.shape, self.results.shape[2]))


def solve_rows(
    robot: Robots,
    method: TensionMethod,
    options: Options,
    rows: Array,
    loads: Array,
    reference: Array,
    progress: Progress | None = None,
) -> Found:
    """Run the kernel over poses.

    Args:
        robot: The robot, or one a pose.
        method: How the load is shared.
        options: Of `kernel_options`, for the same method.
        rows: Pose rows (N, POSE_COLUMNS).
        loads: External plus inertial wrenches (1 or N, 6).
        reference: Tensions that `Closest` starts from, in its variable (m,), or NaN; the last feasible ones on return.
        progress: Told after each block how many poses are solved, without the infeasible ones, of how many.

    Returns:
        The answers.
    """
    shared = first_of(robot)
    found = Found.empty(len(rows), shared.cable_count, shared.degrees_of_freedom)
    otherwise = None if takes_default_kernel(method) else True
    memory = memory_for(shared.cable_count)
    given = (*options, robot_terms(robot), rows, loads, reference, memory, otherwise, found.answers)
    done = 0
    for part in blocks(len(rows), BLOCK):
        inverse_poses(*given, part.start, part.stop)
        if progress is not None:
            done += int(np.count_nonzero(found.pose_status[part] != codes.POSE_INFEASIBLE))
            progress(done, len(rows))
    return found


def explained(
    robot: Robots, options: Options, rows: Array, found: Found, progress: Progress | None = None
) -> tuple[Array, Array, Flags]:
    """Why poses are infeasible.

    Args:
        robot: The robot, or one a pose.
        options: Of `kernel_options`.
        rows: Pose rows (N, POSE_COLUMNS).
        found: The answers.
        progress: Told after each block how many poses are done, the feasible ones among them, of how many.

    Returns:
        Shortfall [N] (N,), Farkas vectors along the free motions (N, n) and blocking cables (N, m).
    """
    count, n = found.needed.shape
    m = found.cable_status.shape[1]
    solved = found.pose_status == codes.POSE_SOLVED
    shortfall = np.where(solved, 0.0, np.nan)
    farkas = np.full((count, n), np.nan)
    blocking = np.zeros((count, m), dtype=np.bool_)
    which = np.flatnonzero(found.pose_status == codes.POSE_INFEASIBLE)
    terms, memory = robot_terms(robot), memory_for(m)
    for part in blocks(which.size, BLOCK):
        explain_poses(
            options.model,
            options.limits,
            terms,
            rows,
            found.needed,
            which[part],
            memory,
            (shortfall, farkas, blocking),
        )
        if progress is not None:
            progress(count - which.size + part.stop, count)
    return shortfall, farkas, blocking
