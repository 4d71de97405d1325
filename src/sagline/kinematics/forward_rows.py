"""Forward kinematics in rows: robot, lengths and starts as the kernels take them, and their answers back."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Flags, Indices, locked
from sagline.core.progress import Progress, blocks, rows_of
from sagline.kernels import codes, tables
from sagline.kernels.cable.rows import CABLE_ROWS
from sagline.kernels.forward.fit import fit_poses
from sagline.kernels.forward.forward import forward_poses
from sagline.kernels.forward.problem import (
    ENERGY,
    FORCE_RESIDUAL,
    FORWARD_NUMBERS,
    ITERATIONS,
    LAST_COLUMNS,
    MOMENT_RESIDUAL,
    STIFFNESS_MIN,
    ChainArrays,
    FoundArrays,
)
from sagline.kernels.memory import memory_for
from sagline.kinematics.forward_solution import ForwardSolution
from sagline.kinematics.forward_status import STABLE
from sagline.kinematics.hung import hung_cables
from sagline.robot.equilibrium import Equilibrium
from sagline.robot.pose import Pose
from sagline.robot.several import Robots, anything_behind, first_of
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
        """Replace the answers of some samples by some of another's.

        Args:
            samples: Which to replace (k,).
            other: The answers to take from.
            which: Which of those to take (k,); all unless told otherwise.
        """
        self.poses[samples] = other.poses[which]
        self.results[:, samples] = other.results[:, which]
        self.cable_status[samples] = other.cable_status[which]
        self.numbers[samples] = other.numbers[which]
        self.pose_status[samples] = other.pose_status[which]

    def part(self, samples: Indices) -> Found:
        """The answers of some samples.

        Args:
            samples: Which (k,).

        Returns:
            Copies of their answers.
        """
        return Found(
            self.poses[samples],
            self.results[:, samples],
            self.cable_status[samples],
            self.numbers[samples],
            self.pose_status[samples],
        )

    def last_pose(self, before: Array) -> Array:
        """Where a sample that follows these starts.

        Args:
            before: Pose row at which these started, (1, POSE_COLUMNS).

        Returns:
            The last pose that was found, (1, POSE_COLUMNS); the one before if none was.
        """
        found = ~np.isin(self.pose_status, (codes.FORWARD_NOT_CONVERGED, codes.FORWARD_NO_LENGTHS))
        which = np.flatnonzero(found)[-1:]
        return locked(self.poses[which]) if which.size else before

    @property
    def arrays(self) -> FoundArrays:
        """A plain tuple: kernels know those the fastest."""
        return self.poses, self.results, self.cable_status, self.numbers, self.pose_status

    @classmethod
    def empty(cls, count: int, cables: int, behind: bool | None) -> Found:
        """Room for a batch.

        Args:
            count: Number of samples N.
            cables: Number of cables m.
            behind: Whether anything is behind them.

        Returns:
            Arrays to be filled.
        """
        return cls(
            np.empty((count, tables.POSE_COLUMNS)),
            np.empty((tables.RESULT_ROWS if behind else tables.BARE_ROWS, count, cables)),
            np.empty((count, cables), dtype=np.int8),
            np.empty((count, FORWARD_NUMBERS)),
            np.empty(count, dtype=np.int8),
        )

    @property
    def stable(self) -> Flags:
        """Whether each sample is a stable equilibrium, (N,)."""
        return np.isin(self.pose_status, STABLE)

    def solution(
        self,
        robot: Robots,
        model: CableModel,
        load: Array,
        shape: tuple[int, ...],
        covariance: Array | None = None,
    ) -> ForwardSolution:
        """The batch in the caller's shape, () or (N,).

        Args:
            robot: The robot, or one a sample.
            model: Cable model.
            load: External plus inertial wrench, shape (6,) or (N, 6).
            shape: () for a single sample, (N,) for a batch.
            covariance: Of the poses, shape (N, 6, 6), or None.

        Returns:
            ForwardSolution around these arrays.
        """
        pose = Pose._adopt(self.poses[:, :3].reshape(*shape, 3), self.poses[:, 3:].reshape(*shape, 4))
        whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*shape, 6))))
        residuals = self.numbers[:, [FORCE_RESIDUAL, MOMENT_RESIDUAL]]
        cables, contact = hung_cables(robot, model, self.results, self.cable_status, shape)
        return ForwardSolution(
            state=Equilibrium(robot, pose, whole, cables, contact),
            status=locked(self.pose_status.reshape(shape)),
            stiffness_min=locked(self.numbers[:, STIFFNESS_MIN].reshape(shape)),
            energy=locked(self.numbers[:, ENERGY].reshape(shape)),
            wrench_residual=locked(residuals.reshape(*shape, 2)),
            iterations=locked(self.numbers[:, ITERATIONS].astype(np.int64).reshape(shape)),
            covariance=None if covariance is None else locked(covariance.reshape(*shape, 6, 6)),
        )


def solve_rows(
    robot: Robots,
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
        robot: The robot, or one a sample.
        model: Cable model; straight cables are fitted.
        lengths: Unstrained lengths (N, m).
        starts: Pose rows (1 or N, POSE_COLUMNS).
        wrenches: External plus inertial (1 or N, 6).
        chained: Whether each sample starts where the last one ended.
        freedom: Motions to allow (n, 6); None for those of the robot.
        progress: Told after each block how many samples are done, of how many.

    Returns:
        The answers.
    """
    count, m = lengths.shape
    allowed = first_of(robot).freedom if freedom is None else freedom
    bodies, cables, behind = body_table(robot), cable_table(robot), anything_behind(robot) or None
    chain, memory = new_chain(m, len(allowed)), memory_for(m)  # the chain goes on from block to block
    found = Found.empty(count, m, behind)
    for part in blocks(count, max(1, BLOCK // m), progress):
        block = Found.empty(part.stop - part.start, m, behind)
        per_sample = (rows_of(bodies, part), rows_of(cables, part), lengths[part], rows_of(starts, part))
        given = (allowed, *per_sample, rows_of(wrenches, part))
        if model.code == codes.STRAIGHT:
            fit_poses(chained, given, chain, memory, block.arrays)
        else:
            forward_poses((model.code, *model.parameters, behind), chained, given, chain, memory, block.arrays)
        found.keep(part, block)
        if chained:
            starts = block.last_pose(starts)
    return found


def new_chain(cables: int, freedoms: int) -> ChainArrays:
    """What a chain of samples remembers, before the first: nothing."""
    return (
        np.full((CABLE_ROWS, cables), np.nan),
        np.full((freedoms, freedoms), np.nan),
        np.full(LAST_COLUMNS, np.nan),
    )
