"""Forward kinematics in rows: robot, lengths and starts as the kernels take them, and their answers back."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sagline.arrays import Array, Codes, Flags, Indices, locked
from sagline.cables.model import CableModel, CableState
from sagline.kernels import codes, tables
from sagline.kernels.forward import forward as kernel
from sagline.kernels.forward.fit import fit_poses
from sagline.kinematics.blocks import Progress, blocks, rows_of
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.kinematics.forward_status import STABLE
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import body_table, cable_table

BLOCK = 1 << 13  # cables solved at once: from a few to some 130 ms, after which an interrupt is heard


class Found(NamedTuple):
    """What the kernel fills, in its order."""

    poses: Array
    results: Array
    cable_status: Codes
    numbers: Array
    pose_status: Codes

    def keep(self, samples: Indices | slice, other: Found, which: Indices | slice = slice(None)) -> None:
        """Replace the answers of some samples by some of another's."""
        self.poses[samples] = other.poses[which]
        self.results[:, samples] = other.results[:, which]
        self.cable_status[samples] = other.cable_status[which]
        self.numbers[samples] = other.numbers[which]
        self.pose_status[samples] = other.pose_status[which]

    def part(self, samples: Indices) -> Found:
        """The answers of some samples."""
        return Found(
            self.poses[samples],
            self.results[:, samples],
            self.cable_status[samples],
            self.numbers[samples],
            self.pose_status[samples],
        )

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

    @property
    def stable(self) -> Flags:
        """Whether each sample is a stable equilibrium, (N,)."""
        return np.isin(self.pose_status, STABLE)

    def last_pose(self, before: Array) -> Array:
        """Row (1, POSE_COLUMNS) at which a sample after these starts; the one before if none of these was solved."""
        solved = ~np.isin(self.pose_status, (codes.FORWARD_NOT_CONVERGED, codes.FORWARD_NO_LENGTHS))
        which = np.flatnonzero(solved)[-1:]
        return locked(self.poses[which]) if which.size else before

    def cables(self, robot: Robot, model: CableModel, shape: tuple[int, ...]) -> CableState:
        """The cables of the batch in the caller's shape, () or (N,)."""
        wide = (*shape, robot.cable_count)
        return CableState(
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

    def solution(
        self,
        robot: Robot,
        model: CableModel,
        load: Array,
        shape: tuple[int, ...],
        covariance: Array | None = None,
    ) -> ForwardSolution:
        """The batch in the caller's shape, () or (N,)."""
        pose = Pose._adopt(self.poses[:, :3].reshape(*shape, 3), self.poses[:, 3:].reshape(*shape, 4))
        whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*shape, 6))))
        residuals = self.numbers[:, [kernel.FORCE_RESIDUAL, kernel.MOMENT_RESIDUAL]]
        return ForwardSolution(
            state=Equilibrium(robot, pose, whole, self.cables(robot, model, shape)),
            status=locked(self.pose_status.reshape(shape)),
            stiffness_min=locked(self.numbers[:, kernel.STIFFNESS_MIN].reshape(shape)),
            energy=locked(self.numbers[:, kernel.ENERGY].reshape(shape)),
            wrench_residual=locked(residuals.reshape(*shape, 2)),
            iterations=locked(self.numbers[:, kernel.ITERATIONS].astype(np.int64).reshape(shape)),
            covariance=None if covariance is None else locked(covariance.reshape(*shape, 6, 6)),
        )


def solve_rows(
    robot: Robot,
    model: CableModel,
    lengths: Array,
    starts: Array,
    wrenches: Array,
    *,
    chained: bool = False,
    freedom: Array | None = None,
    progress: Progress | None = None,
) -> Found:
    """Run the kernel over samples, in blocks.

    Args:
        robot: The robot.
        model: Cable model; straight cables are fitted.
        lengths: Unstrained lengths (N, m).
        starts: Pose rows (1 or N, POSE_COLUMNS).
        wrenches: External plus inertial (1 or N, 6).
        chained: Whether each sample starts where the last one ended.
        freedom: Motions to allow (n, 6); None for those of the robot.
        progress: Told after each block how many samples are done, of how many.
    """
    allowed = robot.freedom if freedom is None else freedom
    bodies, cables = body_table(robot), cable_table(robot)
    found = Found.empty(*lengths.shape)
    for part in blocks(len(lengths), max(1, BLOCK // robot.cable_count), progress):
        block = Found.empty(*lengths[part].shape)
        given = (rows_of(bodies, part), rows_of(cables, part), lengths[part], rows_of(starts, part))
        arguments: tuple[Any, ...] = (allowed, *given, rows_of(wrenches, part), *block)
        if model.code == codes.STRAIGHT:
            fit_poses(chained, *arguments)
        else:
            kernel.forward_poses(model.code, *model.parameters, chained, *arguments)
        found.keep(part, block)
        if chained:
            starts = block.last_pose(starts)
    return found
