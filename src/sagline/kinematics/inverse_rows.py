"""Inverse kinematics as arrays: arguments and results of the kernels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final, Literal, NamedTuple

import numpy as np

from sagline.cables.model import CableModel
from sagline.core.arguments import brief, choice, elements
from sagline.core.arrays import Array, Codes, Flags, Indices, Progress, blocks, locked
from sagline.core.errors import InvalidValueError
from sagline.kernels import (
    codes,
    decide_poses,
    inverse_poses,
    inverse_poses_of_slanted,
    stabilities_of_poses,
    tables,
    underconstrained_poses,
)
from sagline.kernels.memory import memory_for
from sagline.robot.batch import Robots, first_of, has_routing
from sagline.robot.equilibrium import result_rows
from sagline.robot.reach import is_underconstrained
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import LIMITS_OF, Options, TensionMethod, takes_default_kernel

if TYPE_CHECKING:
    from sagline.kernels.inverse.poses import Answers, ModelTerms
    from sagline.kernels.inverse.poses import Robots as RobotTerms

UNDECIDED = (codes.POSE_INFEASIBLE, codes.POSE_NOT_CONVERGED)  # statuses of poses without a result of the iterations
SOLVED = (codes.POSE_SOLVED, codes.UNPROVED_STABILITY)  # statuses of poses with a result
BLOCK = 1 << 12  # poses per block of the iterations; it takes at most 0.1 s, and interrupts are handled after it
DECIDED = 1 << 10  # poses per block of the feasibility decision, which needs more time per pose


class InverseRows(NamedTuple):
    """Results and proofs of N poses. The first axis has the length N; `results` has the shape (RESULT_ROWS, N, m)."""

    results: Array
    cable_status: Codes
    residuals: Array
    needed: Array
    pose_status: Codes
    # Smallest change of the force that makes the pose feasible [N]: lower bound and sufficient value, (N, 2). Both
    # values are 0 at a solved pose, and NaN if the load is not the cause of the failure.
    brackets: Array
    # sufficient change of the force [N], along the free motions, (N, n); NaN if no change is needed or known
    reliefs: Array
    farkas: Array  # Farkas vectors along the free motions, (N, n)
    blocking: Flags  # cables whose limits oppose the needed wrench, (N, m)
    at_border: Flags  # True for poses that the tension distribution method did not solve, but `decide_rows` did, (N,)

    @classmethod
    def empty(cls, robot: Robots, count: int) -> InverseRows:
        """New arrays for `count` poses. The results are not initialized; the proofs are NaN or False."""
        shared = first_of(robot)
        m, n = shared.cable_count, shared.degrees_of_freedom
        return cls(
            np.empty((result_rows(robot), count, m)),
            np.empty((count, m), dtype=np.int8),
            np.empty((count, 2)),
            np.empty((count, n)),
            np.empty(count, dtype=np.int8),
            np.full((count, 2), np.nan),
            np.full((count, n), np.nan),
            np.full((count, n), np.nan),
            np.zeros((count, m), dtype=np.bool_),
            np.zeros(count, dtype=np.bool_),
        )

    def reject_slack(self, lengths: Array) -> bool:
        """Set TOO_SLACK at solved poses where `lengths` (N, m) between guides are NaN. True if such a pose exists."""
        slack = np.isnan(np.atleast_2d(lengths)) & np.isfinite(self.results[tables.LENGTH])
        if not slack.any():
            return False
        lost = np.isin(self.pose_status, SOLVED) & slack.any(axis=-1)
        if not lost.any():
            return False
        self.results[tables.LENGTH :, lost] = np.nan
        self.pose_status[lost] = codes.POSE_TOO_SLACK
        for array in (self.residuals, self.brackets):
            array[lost] = np.nan
        self.at_border[lost] = False
        return True

    @property
    def shortfall(self) -> Array:
        """Smallest known sufficient change of the force [N], (N,); infinite if a proof shows that none suffices."""
        proved, enough = self.brackets[:, tables.PROVED], self.brackets[:, tables.ENOUGH]
        return np.where(np.isinf(enough) & np.isfinite(proved), np.nan, enough)

    @property
    def answers(self) -> Answers:
        """The results as a plain tuple, which the kernels require."""
        return self.results, self.cable_status, self.residuals, self.needed, self.pose_status

    @property
    def proofs(self) -> tuple[Array, Array, Array, Flags]:
        """The proofs as a plain tuple, which the kernel requires."""
        return self.brackets, self.reliefs, self.farkas, self.blocking


def solve_inverse_rows(
    robot: Robots,
    method: TensionMethod,
    options: Options,
    rows: Array,
    loads: Array,
    reference: Array,
    stability: bool = False,
    progress: Progress | None = None,
    terms: RobotTerms | None = None,
    swivels: Array | None = None,
) -> InverseRows:
    """Run the kernel over pose rows (N, POSE_COLUMNS). `loads`: external plus inertial wrenches, (1 or N, 6)."""
    # reference: initial tensions of `Closest`, in its variable, or NaN: (m,) for the first pose, (N, m) for each pose
    # independently; stability: True to mark solved poses without a proof of stability as UNPROVED_STABILITY; progress:
    # called after each block with the number of finished poses (undecided poses do not count) and the number of all
    # poses; terms: from `robot_terms`, if they are not those of `robot`; swivels: cable_table with swivel axes, if
    # terms are those of cables from eyelets, whose frame anchors are replaced by the exit points found
    found, last = InverseRows.empty(robot, len(rows)), np.array(np.atleast_2d(reference)[0])
    memory, otherwise = memory_for(last.size), None if takes_default_kernel(method) else True
    terms = robot_terms(robot) if terms is None else terms
    (freedom, bodies, cables), done = terms, 0
    for part in blocks(len(rows), BLOCK if reference.ndim == 1 else 1):
        if reference.ndim > 1:
            last[:] = reference[part.start]
            if isinstance(robot, Robot) and len(cables) > 1:  # moving anchors; the kernel reads the whole table
                terms = freedom, bodies, cables[part]
        if swivels is None:
            inverse_poses(
                *options, terms, rows, loads, last, memory, otherwise, stability, found.answers, part.start, part.stop
            )
        else:
            of_slanted = (*options, terms, swivels, rows, loads, last, memory, stability, found.answers)
            inverse_poses_of_slanted(*of_slanted, part.start, part.stop)
        if progress is not None:
            done += int(np.count_nonzero(~np.isin(found.pose_status[part], UNDECIDED)))
            progress(done, len(rows))
    return found


def covers_all(method: int, redundant: int) -> bool:
    """True if `method` solves every feasible pose with `redundant` redundant cables. Closed-form methods do not."""
    return redundant == 0 or not codes.CLOSED_FORM <= method <= codes.PUNCTURE


def decide_rows(
    terms: RobotTerms, options: Options, rows: Array, loads: Array, found: InverseRows, progress: Progress | None = None
) -> None:
    """Decide the feasibility of poses at which the iterations gave no result. Fill their proofs and results."""
    # terms: from `robot_terms`; rows: pose rows (N, POSE_COLUMNS); loads: external plus inertial wrenches (1 or N, 6);
    # progress: called after each block with the number of finished poses, including feasible poses, and the number of
    # all poses
    count, n = found.needed.shape
    m = found.cable_status.shape[1]
    found.brackets[np.isin(found.pose_status, SOLVED)] = 0.0
    which = locked(np.flatnonzero(np.isin(found.pose_status, UNDECIDED)))
    if not which.size:
        return
    given = (options.model, options.limits, terms, rows, loads)
    how = (covers_all(options.sharing[0], m - n), memory_for(m), found.answers, found.proofs)
    for part in blocks(which.size, DECIDED):
        decide_poses(*given, which[part], *how)
        if progress is not None:
            progress(count - which.size + part.stop, count)
    found.at_border[which] = found.pose_status[which] == codes.POSE_SOLVED


def decide_stability(robot: Robots, model: ModelTerms, rows: Array, found: InverseRows) -> None:
    """Decide the stability of solved poses that have no proof of stability. Unstable poses get the status UNSTABLE."""
    which = locked(np.flatnonzero((found.pose_status == codes.UNPROVED_STABILITY) | found.at_border))
    if not which.size:
        return
    given = ((*model, has_routing(robot) or None), robot_terms(robot, slanted=True), rows)
    memory = memory_for(found.cable_status.shape[1])
    for part in blocks(which.size, BLOCK):
        stabilities_of_poses(*given, which[part], memory, found.results, found.pose_status)


Given = Literal["x", "y", "z", "yaw", "level"]
CODES: Final[dict[str, int]] = {"x": 0, "y": 1, "z": 2, "yaw": codes.YAW, "level": codes.LEVEL}
_DEFAULT: Final = (*"xyz", "level")  # defaults with three or four cables: the first m of these names


def given_codes(robot: Robot, given: Sequence[Given] | None) -> Indices | None:
    """Codes of the given values of an underconstrained platform, (m,); None if the robot has enough cables."""
    # Raises InvalidValueError if the number of names is not m, or m is 1; if a name is unknown or occurs twice; if
    # names are given for a robot with enough cables.
    m = robot.cable_count
    if not is_underconstrained(robot):
        if given is not None:
            step = "Leave it out; the whole pose is given."
            raise InvalidValueError("given", brief(given), f"None for {m} cables and {robot.motion_pattern}", step)
        return None
    if given is None and not (3 <= m <= len(_DEFAULT) and robot.motion_pattern == "3R3T"):
        fewer = "3, 4 or " if robot.motion_pattern == "3R3T" else ""
        allowed = f"{fewer}>= {robot.degrees_of_freedom} for {robot.motion_pattern}"
        step = f"Add cables; or, in Python, name {m} given values for inverse, such as given=('x', 'z')."
        raise InvalidValueError(f"{robot.name}: number of cables", m, allowed, step)
    several, step = f"{m} names of given values", "Give as many values as the robot has cables."
    named = _DEFAULT[:m] if given is None else elements(given, str, "given", step, several)
    names = tuple(choice(name, "given", CODES) for name in named)
    if len(names) != m or len(set(names)) != m or m < 2:
        allowed = f"{m} different names of {', '.join(CODES)} for {m} cables" if m > 1 else "at least 2 cables"
        raise InvalidValueError("given", ", ".join(names), allowed, step)
    return locked(np.array([CODES[name] for name in names], dtype=np.int64))


def solve_underconstrained_rows(
    robot: Robots,
    model: CableModel,
    rows: Array,
    loads: Array,
    given: Indices | None,
    level: float,
    chained: bool,
    stability: bool,
    progress: Progress | None = None,
    terms: RobotTerms | None = None,
) -> tuple[InverseRows, Array]:
    """Results of underconstrained poses, and rows of the found poses (N, POSE_COLUMNS)."""
    # rows: rows of the given poses; loads: external plus inertial wrenches (1 or N, 6); given: codes (m,); level:
    # tension level [N]; chained: True to start each pose at the previous result; stability: True to give solved poses
    # the status UNPROVED_STABILITY; terms: from `robot_terms`, if they are not those of `robot`
    assert given is not None  # the caller has checked this
    shared = first_of(robot)
    found, poses = InverseRows.empty(robot, len(rows)), np.empty_like(rows)
    own = robot_terms(robot) if terms is None else terms
    arguments = (model.code, *model.parameters), (LIMITS_OF[shared.tension_limits_of], np.nan), own
    memory = memory_for(shared.degrees_of_freedom)
    arrays = (found.answers, poses, found.blocking)
    for part in blocks(len(rows), BLOCK):
        underconstrained_poses(*arguments, rows, loads, given, level, chained, memory, *arrays, part.start, part.stop)
        if progress is not None:
            progress(part.stop, len(rows))
    solved = found.pose_status == codes.POSE_SOLVED
    found.brackets[solved] = 0.0
    if stability:
        found.pose_status[solved] = codes.UNPROVED_STABILITY
    return found, locked(poses)
