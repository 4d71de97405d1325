"""Inverse kinematics as arrays: arguments of the kernels, and their results."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sagline.core.arrays import Array, Codes, Flags, locked
from sagline.core.progress import Progress, blocks
from sagline.kernels import codes, tables
from sagline.kernels.forward.sensitivity import stabilities_of_poses
from sagline.kernels.inverse.feasibility import ENOUGH, PROVED, decide_poses
from sagline.kernels.inverse.poses import Answers, ModelTerms, inverse_poses
from sagline.kernels.inverse.poses import Robots as RobotTerms
from sagline.kernels.memory import memory_for
from sagline.robot.batch import Robots, first_of, has_routing
from sagline.statics.tables import robot_terms
from sagline.tension.method import Options, TensionMethod, takes_default_kernel

UNDECIDED = (codes.POSE_INFEASIBLE, codes.POSE_NOT_CONVERGED)  # statuses of poses without a result from the iterations
SOLVED = (codes.POSE_SOLVED, codes.UNPROVED_STABILITY)  # statuses of poses with a result
BLOCK = 1 << 12  # poses per block of the solution, which takes at most 0.1 s; interrupts are handled between blocks
DECIDED = 1 << 10  # poses per block of the feasibility decision, which takes longer per pose


class InverseRows(NamedTuple):
    """Results of the kernel, in its order. The first axis has the length N, except in results (RESULT_ROWS, N, m)."""

    results: Array
    cable_status: Codes
    residuals: Array
    needed: Array
    pose_status: Codes

    @classmethod
    def empty(cls, count: int, cables: int, freedoms: int, behind: bool) -> InverseRows:
        """Empty arrays for a batch; `behind`: True if any cable has a pulley or a dead length."""
        return cls(
            np.empty((tables.RESULT_ROWS if behind else tables.BARE_ROWS, count, cables)),
            np.empty((count, cables), dtype=np.int8),
            np.empty((count, 2)),
            np.empty((count, freedoms)),
            np.empty(count, dtype=np.int8),
        )

    def reject_slack(self, verdicts: Verdicts, lengths: Array) -> bool:
        """Mark solved poses as TOO_SLACK if `lengths` (N, m) between guides are NaN. True if a pose is marked."""
        slack = np.isnan(np.atleast_2d(lengths)) & np.isfinite(self.results[tables.LENGTH])
        lost = np.isin(self.pose_status, SOLVED) & slack.any(axis=-1)
        if not lost.any():
            return False
        self.results[tables.LENGTH :, lost] = np.nan
        self.pose_status[lost] = codes.POSE_TOO_SLACK
        for array in (self.residuals, verdicts.brackets):
            array[lost] = np.nan
        verdicts.at_border[lost] = False
        return True

    @property
    def answers(self) -> Answers:
        """Plain tuple of the arrays, as the kernel requires."""
        return self.results, self.cable_status, self.residuals, self.needed, self.pose_status


def solve_inverse_rows(
    robot: Robots,
    method: TensionMethod,
    options: Options,
    rows: Array,
    loads: Array,
    reference: Array,
    stability: bool = False,
    progress: Progress | None = None,
) -> InverseRows:
    """Run the kernel over poses.

    rows: pose rows (N, POSE_COLUMNS); loads: external plus inertial wrenches (1 or N, 6); reference: initial tensions
    of `Closest`, in its variable (m,), or NaN; the kernel overwrites them with the last feasible tensions; stability:
    True to mark solved poses without a proof of stability as UNPROVED_STABILITY; progress: called after each block with
    the number of finished poses, which does not include undecided poses, and the number of all poses.
    """
    shared = first_of(robot)
    behind = has_routing(robot)
    found = InverseRows.empty(len(rows), shared.cable_count, shared.degrees_of_freedom, behind)
    otherwise = None if takes_default_kernel(method) else True
    memory = memory_for(shared.cable_count)
    given = (*options, robot_terms(robot), rows, loads, reference, memory, otherwise, stability, found.answers)
    done = 0
    for part in blocks(len(rows), BLOCK):
        inverse_poses(*given, part.start, part.stop)
        if progress is not None:
            done += int(np.count_nonzero(~np.isin(found.pose_status[part], UNDECIDED)))
            progress(done, len(rows))
    return found


class Verdicts(NamedTuple):
    """Proofs for infeasible poses. The first axis of all arrays has the length N, one entry per pose."""

    # Smallest change of the force that makes the pose feasible [N]: lower bound and sufficient value, (N, 2). The
    # values are 0 at a solved pose, and NaN if the load is not the cause of the failure.
    brackets: Array
    # sufficient change of the force, along the free motions [N], (N, n); NaN if it is not needed or not known
    reliefs: Array
    farkas: Array  # Farkas vectors along the free motions, (N, n)
    blocking: Flags  # cables whose limits oppose the needed wrench, (N, m)
    at_border: Flags  # True for poses that this search solved in place of the tension distribution method, (N,)

    @classmethod
    def empty(cls, count: int, cables: int, freedoms: int) -> Verdicts:
        """Arrays for a batch that has no verdicts yet: all values are NaN or False."""
        return cls(
            np.full((count, 2), np.nan),
            np.full((count, freedoms), np.nan),
            np.full((count, freedoms), np.nan),
            np.zeros((count, cables), dtype=np.bool_),
            np.zeros(count, dtype=np.bool_),
        )

    @property
    def shortfall(self) -> Array:
        """Smallest known sufficient change of the force [N], (N,); infinite if a proof shows that none exists."""
        proved, enough = self.brackets[:, PROVED], self.brackets[:, ENOUGH]
        return np.where(np.isinf(enough) & np.isfinite(proved), np.nan, enough)

    @property
    def answers(self) -> tuple[Array, Array, Array, Flags]:
        """Plain tuple of the arrays, as the kernel requires."""
        return self.brackets, self.reliefs, self.farkas, self.blocking


def covers_all(method: int, redundant: int) -> bool:
    """True if a distribution method solves every feasible pose; closed-form methods do not.

    redundant: number of cables beyond the degrees of freedom.
    """
    return redundant == 0 or not codes.CLOSED_FORM <= method <= codes.PUNCTURE


def decide_rows(
    terms: RobotTerms, options: Options, rows: Array, loads: Array, found: InverseRows, progress: Progress | None = None
) -> Verdicts:
    """Decide the feasibility of poses for which the iterations gave no result. Fill the results of feasible poses.

    terms: from `robot_terms`; rows: pose rows (N, POSE_COLUMNS); loads: external plus inertial wrenches (1 or N,
    6); progress: called after each block with the number of all finished poses, which includes feasible poses, and the
    number of all poses.
    """
    count, n = found.needed.shape
    m = found.cable_status.shape[1]
    verdicts = Verdicts.empty(count, m, n)
    verdicts.brackets[np.isin(found.pose_status, SOLVED)] = 0.0
    which = locked(np.flatnonzero(np.isin(found.pose_status, UNDECIDED)))
    if not which.size:
        return verdicts
    given = (options.model, options.limits, terms, rows, loads)
    how = (covers_all(options.sharing[0], m - n), memory_for(m), found.answers, verdicts.answers)
    for part in blocks(which.size, DECIDED):
        decide_poses(*given, which[part], *how)
        if progress is not None:
            progress(count - which.size + part.stop, count)
    verdicts.at_border[which] = found.pose_status[which] == codes.POSE_SOLVED
    return verdicts


def decide_stability(robot: Robots, model: ModelTerms, rows: Array, found: InverseRows, verdicts: Verdicts) -> None:
    """Decide the stability of solved poses that have no proof of stability. Unstable poses get the status UNSTABLE.

    model: code and constants of the cable model; rows: pose rows (N, POSE_COLUMNS).
    """
    which = locked(np.flatnonzero((found.pose_status == codes.UNPROVED_STABILITY) | verdicts.at_border))
    if not which.size:
        return
    given = ((*model, has_routing(robot) or None), robot_terms(robot), rows)
    memory = memory_for(found.cable_status.shape[1])
    for part in blocks(which.size, BLOCK):
        stabilities_of_poses(*given, which[part], memory, found.results, found.pose_status)
