"""Forward kinematics as arrays: arguments and results of the kernels, and the solution of a batch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Flags, Indices, locked
from sagline.core.progress import Progress, blocks, rows_of
from sagline.core.results import Result
from sagline.core.table import Columns, Tabular
from sagline.kernels import codes, tables
from sagline.kernels.cable.geometry import CABLE_ROWS
from sagline.kernels.forward import platform
from sagline.kernels.forward.forward import fit_poses, forward_poses
from sagline.kernels.memory import memory_for
from sagline.kinematics.status import STABLE, ForwardStatus
from sagline.robot.batch import Robots, first_of, has_routing
from sagline.robot.equilibrium import Equilibrium, cables_of_results
from sagline.robot.pose import Pose
from sagline.statics.tables import body_table, cable_table


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ForwardSolution(Result, Tabular):
    """Result of `forward`, single or with a leading axis N.

    Attributes:
        state: Robot, poses, wrench and cables in equilibrium; NaN if the lengths are NaN.
        status: Codes of `ForwardStatus`, shape () or (N,).
        stiffness_min: Smallest stiffness of the platform against its free motions [N/m], shape () or (N,). A rotation
            is measured by its arc length at the root mean square distance of the platform ends from the center of mass.
        energy: Potential energy of cables, weight and given force [J], shape () or (N,). Heights of cables are measured
            from their frame ends; all other heights are measured from the world origin. NaN for the shallow models,
            which have no energy. For straight cables, the objective of the fit: half the sum of squared length errors
            [m^2].
        wrench_residual: Norms of the unbalanced force [N] and moment [N m] in the platform's free motions,
            shape (2,) or (N, 2).
        iterations: Number of Newton steps, shape () or (N,).
        covariance: Covariance of a pose from measured tensions: displacement of the center of mass [m] and rotation
            vector [rad], world axes, shape (6, 6) or (N, 6, 6). None if no tensions were measured.
    """

    _columns: ClassVar[Columns] = (
        "pose",
        "force_residual=wrench_residual.0",
        "moment_residual=wrench_residual.1",
        "stiffness_min",
        "iterations",
        ("status", ForwardStatus),
    )

    state: Equilibrium
    status: Codes
    stiffness_min: Array
    energy: Array
    wrench_residual: Array
    iterations: Indices
    covariance: Array | None = None

    @property
    def pose(self) -> Pose:
        """Pose of the platform."""
        return self.state.pose

    @property
    def solved(self) -> Flags:
        """True for a stable equilibrium in which the cables hold the platform, shape () or (N,)."""
        return np.asarray(self.status == ForwardStatus.SOLVED)

    @property
    def stable(self) -> Flags:
        """True for any stable equilibrium, even if the cables do not fully constrain the platform, shape () or (N,)."""
        return np.isin(self.status, STABLE)

    @property
    def slack(self) -> Flags:
        """True for slack cables, shape (m,) or (N, m): tau is at most half the weight of a cable as long as the chord.

        Such a cable sags by a quarter of its chord or more. A weightless cable is slack if its tension is zero.
        """
        cables = self.state.cables
        density = np.zeros(()) if cables.model.weightless else cables.cable.linear_density
        return np.asarray(cables.chord_tension <= 0.5 * density * cables.gravity * cables.chord)


BLOCK = 1 << 13  # cables per block; a block takes at most 130 ms, and interrupts are handled between blocks


class ForwardRows(NamedTuple):
    """Results of the kernel, in the order of the kernel's arguments."""

    poses: Array
    results: Array
    cable_status: Codes
    numbers: Array
    pose_status: Codes

    def keep(self, samples: Indices | slice, other: ForwardRows, which: Indices | slice = slice(None)) -> None:
        """Replace the results of the samples `which` (k,) of the batch by the results of `other` (k,)."""
        self.poses[samples] = other.poses[which]
        self.results[:, samples] = other.results[:, which]
        self.cable_status[samples] = other.cable_status[which]
        self.numbers[samples] = other.numbers[which]
        self.pose_status[samples] = other.pose_status[which]

    def part(self, samples: Indices) -> ForwardRows:
        """Copies of the results of some samples (k,)."""
        return ForwardRows(
            self.poses[samples],
            self.results[:, samples],
            self.cable_status[samples],
            self.numbers[samples],
            self.pose_status[samples],
        )

    def last_pose(self, before: Array) -> Array:
        """Last pose row with a result, (1, POSE_COLUMNS). If no sample has a result: `before`."""
        found = ~np.isin(self.pose_status, (codes.FORWARD_NOT_CONVERGED, codes.FORWARD_NO_LENGTHS))
        which = np.flatnonzero(found)[-1:]
        return locked(self.poses[which]) if which.size else before

    @property
    def arrays(self) -> platform.SolutionArrays:
        """Plain tuple of the arrays, which kernels accept fastest."""
        return self.poses, self.results, self.cable_status, self.numbers, self.pose_status

    @classmethod
    def empty(cls, count: int, cables: int, behind: bool | None) -> ForwardRows:
        """Empty arrays for a batch; `behind`: True if any cable has a pulley or a dead length."""
        return cls(
            np.empty((count, tables.POSE_COLUMNS)),
            np.empty((tables.RESULT_ROWS if behind else tables.BARE_ROWS, count, cables)),
            np.empty((count, cables), dtype=np.int8),
            np.empty((count, platform.FORWARD_NUMBERS)),
            np.empty(count, dtype=np.int8),
        )

    @property
    def stable(self) -> Flags:
        """True for samples in stable equilibrium, (N,)."""
        return np.isin(self.pose_status, STABLE)

    def solution(
        self,
        robot: Robots,
        model: CableModel,
        load: Array,
        shape: tuple[int, ...],
        covariance: Array | None = None,
    ) -> ForwardSolution:
        """Result of `forward` in the shape of the arguments, () or (N,).

        load: external plus inertial wrench, shape (6,) or (N, 6); shape: () for a single sample, (N,) for a batch;
        covariance: covariances of the poses, shape (N, 6, 6), or None.
        """
        pose = Pose._adopt(self.poses[:, :3].reshape(*shape, 3), self.poses[:, 3:].reshape(*shape, 4))
        whole = locked(np.ascontiguousarray(np.broadcast_to(load, (*shape, 6))))
        residuals = self.numbers[:, [platform.FORCE_RESIDUAL, platform.MOMENT_RESIDUAL]]
        cables, contact = cables_of_results(robot, model, self.results, self.cable_status, shape)
        return ForwardSolution(
            state=Equilibrium(robot, pose, whole, cables, contact),
            status=locked(self.pose_status.reshape(shape)),
            stiffness_min=locked(self.numbers[:, platform.STIFFNESS_MIN].reshape(shape)),
            energy=locked(self.numbers[:, platform.ENERGY].reshape(shape)),
            wrench_residual=locked(residuals.reshape(*shape, 2)),
            iterations=locked(self.numbers[:, platform.ITERATIONS].astype(np.int64).reshape(shape)),
            covariance=None if covariance is None else locked(covariance.reshape(*shape, 6, 6)),
        )


def solve_forward_rows(
    robot: Robots,
    model: CableModel,
    lengths: Array,
    starts: Array,
    wrenches: Array,
    *,
    chained: bool = False,
    freedom: Array | None = None,
    progress: Progress | None = None,
) -> ForwardRows:
    """Run the kernel over samples, in blocks.

    lengths: unstrained lengths (N, m); starts: pose rows (1 or N, POSE_COLUMNS); wrenches: external plus inertial
    wrenches (1 or N, 6); chained: True if each sample starts at the result of the previous sample; freedom: free
    motions (n, 6); None for the free motions of the robot; progress: called after each block with the number of
    finished samples and the number of all samples.
    """
    count, m = lengths.shape
    allowed = first_of(robot).freedom if freedom is None else freedom
    bodies, cables, behind = body_table(robot), cable_table(robot), has_routing(robot) or None
    chain, memory = new_chain(m, len(allowed)), memory_for(m)  # the chain continues from block to block
    found = ForwardRows.empty(count, m, behind)
    for part in blocks(count, max(1, BLOCK // m), progress):
        block = ForwardRows.empty(part.stop - part.start, m, behind)
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


def new_chain(cables: int, freedoms: int) -> platform.LastEquilibriumArrays:
    """Arrays that pass the last equilibrium of a chain to the next sample. At the start of the chain, all are NaN."""
    return (
        np.full((CABLE_ROWS, cables), np.nan),
        np.full((freedoms, freedoms), np.nan),
        np.full(platform.LAST_COLUMNS, np.nan),
    )
