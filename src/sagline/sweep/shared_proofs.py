"""Verdicts on many loads at each pose, with shared proofs: a proof for one load is valid for a half-space of loads.

The proof that a load w is infeasible is a direction y and a gap: along y, the cable forces are too small by the gap.
For another load w' at the same pose, the gap changes by -y (w' - w). If the new gap is positive, w' is infeasible, and
the gap is a lower bound of the change of the force that makes w' feasible.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.kernels import codes
from sagline.kinematics.inverse_rows import UNDECIDED, InverseRows, Verdicts, decide_rows
from sagline.robot.batch import has_routing
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import Options

ITERATIONS: Final = 32  # largest number of proofs per pose that are applied to the other loads
TRUST: Final = 1e-8  # smallest gap relative to the forces: ten times a verdict's tolerance, far above rounding errors
PROVED: Final = 0  # column of the brackets that has the proved bound


def proofs_of(robot: Robot, options: Options, poses: Array, loads: Array, found: InverseRows) -> Array:
    """Decide the requests that the tension distribution left without a verdict, and complete the feasible ones.

    Poses are rows (P, POSE_COLUMNS), and loads have the shape (W, 6). The P W requests in `found` are all loads at the
    first pose, then all loads at the next pose, and so on. Returns a proved lower bound of the necessary change of the
    force [N], (P W,): 0 if the request is feasible, and NaN if it has no result for another reason.
    """
    proof = np.full(found.pose_status.size, np.nan)
    proof[found.pose_status == codes.POSE_SOLVED] = 0.0
    waiting = np.isin(found.pose_status, UNDECIDED).reshape(len(poses), len(loads))
    along = loads @ robot.freedom.T
    size = _forces_at_hand(robot, loads)
    for _ in range(ITERATIONS if _shares(robot, loads) else 0):
        rows = np.flatnonzero(waiting.any(axis=1))
        if not rows.size:
            return proof
        columns = waiting[rows].argmax(axis=1)
        verdicts = _decide(robot, options, poses, loads, found, rows * len(loads) + columns, proof)
        waiting[rows, columns] = False
        gap = _gaps(verdicts, along, columns)
        beyond = waiting[rows] & (gap > TRUST * size)
        row, column = np.nonzero(beyond)
        proof[rows[row] * len(loads) + column] = gap[beyond]
        found.pose_status[rows[row] * len(loads) + column] = codes.POSE_INFEASIBLE
        waiting[rows] &= ~beyond
    _decide(robot, options, poses, loads, found, np.flatnonzero(waiting), proof)
    return proof


def _shares(robot: Robot, loads: Array) -> bool:
    """True if proofs can be shared: there are several loads, and all cables have upper tension limits."""
    return len(loads) > 1 and bool(np.isfinite(robot.tension_max).all())


def _forces_at_hand(robot: Robot, loads: Array) -> Array:
    """Upper bound of the forces at each load [N], (W,); moments are divided by the smallest lever arm."""
    arms = np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1)
    arm = float(arms[arms > 0.0].min(initial=np.inf))
    moments = np.abs(loads[:, 3:]).sum(axis=1) / arm
    longest = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    weight = robot.gravity * (robot.mass + longest * float(robot.cables.linear_density.sum()))
    return np.asarray(np.abs(loads[:, :3]).sum(axis=1) + moments + weight)


def _gaps(verdicts: tuple[Array, Array, Flags], along: Array, columns: Indices) -> Array:
    """Gap (K, W) [N] of all loads at K poses, for the proof of one load per pose; -inf without a proof."""
    proved, direction, known = verdicts
    own = proved + np.einsum("kn,kn->k", direction, along[columns])
    gap = own[:, None] - direction @ along.T
    return np.where(known[:, None], gap, -np.inf)


def _decide(
    robot: Robot, options: Options, poses: Array, loads: Array, found: InverseRows, which: Indices, proof: Array
) -> tuple[Array, Array, Flags]:
    """Decide some requests; returns proved lower bounds, directions of the proofs, and a mask of proved requests."""
    rows = locked(poses[which // len(loads)])
    wrenches = locked(loads[which % len(loads)])
    n, m = robot.degrees_of_freedom, robot.cable_count
    some = InverseRows.empty(len(which), m, n, has_routing(robot))
    some.pose_status[:] = codes.POSE_INFEASIBLE
    some.results[:] = np.nan
    verdicts: Verdicts = decide_rows(robot_terms(robot), options, rows, wrenches, some)
    found.results[:, which] = some.results
    found.pose_status[which] = some.pose_status
    proved = verdicts.brackets[:, PROVED]
    proof[which] = proved
    known = (some.pose_status == codes.POSE_INFEASIBLE) & (proved > 0.0) & np.isfinite(proved)
    known &= np.isfinite(verdicts.farkas).all(axis=1)
    return np.where(known, proved, 0.0), np.where(known[:, None], verdicts.farkas, 0.0), known
