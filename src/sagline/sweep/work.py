"""Tasks of a sweep: computation of a part of the request, and size of the tasks."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.core.arrays import Array, Flags, Indices, locked
from sagline.core.errors import FileError
from sagline.kernels import codes, tables
from sagline.kinematics.inverse_rows import UNDECIDED, InverseRows, decide_rows, solve_inverse_rows
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.sweep.folder import SweepFolder, check_made_here, unknown_value
from sagline.sweep.request import Request, RequestBox, variables_of
from sagline.tension.method import Options, kernel_options
from sagline.workspaces.margin import MarginRows, MarginStatus

# statuses of requests that count as feasible, infeasible, open and lost
INVERSE_ENDS: Final = (PoseStatus.SOLVED, PoseStatus.INFEASIBLE, PoseStatus.BORDERLINE, PoseStatus.NOT_CONVERGED)
MARGIN_ENDS: Final = (MarginStatus.FEASIBLE, MarginStatus.INFEASIBLE, MarginStatus.OPEN, -1)  # none is lost
ROWS: Final = 1 << 14  # number of requests per call, whose arrays fit into the processor's cache


class Counts(NamedTuple):
    """Number of requests for each outcome.

    Attributes:
        feasible: Number of requests with tensions within the limits.
        infeasible: Number of requests with a proof that no tensions within the limits exist.
        unable: Number of requests that have no result for another reason, which the status states.
        open: Number of requests that are too close to the boundary of feasibility for a verdict.
        lost: Number of requests without a verdict because a method failed.
    """

    feasible: int
    infeasible: int
    unable: int
    open: int
    lost: int


def compute_variables(request: Request, part: RequestBox) -> dict[str, NDArray[np.generic]]:
    """Variables of a part by name, (poses, wrenches[, cables]); NaN for missing results and for missing cables."""
    variables = variables_of(request.quantities)
    shape = part.shape
    filled: dict[str, NDArray[np.generic]] = {}
    for one in variables:
        whole = (*shape, request.cable_count)[: 2 + len(one.parts)]
        filled[one.name] = np.full(whole, unknown_value(one), dtype=one.type)
    robot = request.robots[part.robot]
    solvers: list[Callable[[RequestBox], dict[str, NDArray[Any]]]] = []
    if set(request.quantities) != {"margin"}:
        options = kernel_options(robot, request.model, request.tension)
        solvers.append(partial(_inverse_answers, request, robot, options))
    if "margin" in request.quantities:
        margins = MarginRows(robot, request.around, request.model, request.moment_arm)
        solvers.append(partial(_margin_answers, request, margins))
    for piece in part.pieces(ROWS):
        rows = slice(piece.poses.start - part.poses.start, piece.poses.stop - part.poses.start)
        columns = slice(piece.wrenches.start - part.wrenches.start, piece.wrenches.stop - part.wrenches.start)
        answers = {name: found for solver in solvers for name, found in solver(piece).items()}
        for name, values in filled.items():
            found = answers[name]
            target = values[rows, columns]
            if found.ndim > 1:
                target[..., : found.shape[1]] = found.reshape(*piece.shape, -1)
            else:
                target[...] = found.reshape(piece.shape)
    return filled


def count_outcomes(numbers: dict[str, NDArray[np.generic]]) -> Counts:
    """Number of requests for each outcome in a part with the variables `numbers`."""
    name, ends = ("status", INVERSE_ENDS) if "status" in numbers else ("margin_status", MARGIN_ENDS)
    status = numbers[name]
    feasible, infeasible, left, lost = (int(np.count_nonzero(status == int(code))) for code in ends)
    return Counts(feasible, infeasible, status.size - feasible - infeasible - left - lost, left, lost)


def _inverse_answers(request: Request, robot: Robot, options: Options, part: RequestBox) -> dict[str, NDArray[Any]]:
    """Statuses, tensions and lengths by name for the N requests of a part, (N,) or (N, m)."""
    poses, loads = _rows(request.poses, part.poses), request.wrenches[part.wrenches]
    rows = locked(np.repeat(poses, len(loads), axis=0))
    wrenches = locked(np.tile(loads, (len(poses), 1)))
    none = np.full(robot.cable_count, np.nan)
    found = solve_inverse_rows(robot, request.tension, options, rows, wrenches, none)
    answers: dict[str, NDArray[Any]] = {}
    if "shortfall" in request.quantities:
        decide_rows(robot_terms(robot), options, rows, wrenches, found)
        answers["enough"] = found.shortfall
        answers["proof"] = found.brackets[:, tables.PROVED]
    else:
        answers["proof"] = _proofs_of(robot, options, poses, loads, found)
    answers["status"] = found.pose_status
    answers["tension"] = found.results[tables.TENSION]
    answers["length"] = found.results[tables.LENGTH]
    return answers


def _margin_answers(request: Request, margins: MarginRows, part: RequestBox) -> dict[str, NDArray[Any]]:
    """Margins by name for the N requests of a part, (N,)."""
    poses = _rows(request.poses, part.poses)
    found = [margins.about(load).rows(poses) for load in request.wrenches[part.wrenches]]
    columns: dict[str, list[NDArray[Any]]] = {
        "margin": [each.value for each in found],
        "margin_low": [each.low for each in found],
        "margin_high": [each.high for each in found],
        "limiting_cable": [each.cable for each in found],
        "margin_status": [each.status for each in found],
    }
    return {name: np.stack(values, axis=1).ravel() for name, values in columns.items()}


def _rows(poses: Pose, part: slice) -> Array:
    """Poses of a part with unchanged numbers, because the constructor of `Pose` would normalize quaternions again."""
    return locked(np.concatenate((poses.position[part], poses.quaternion[part]), axis=1))


SECONDS: Final = 0.75  # [s], duration of a task; the scheduler needs a hundredth of this time per task
LONGEST: Final = 10.0  # [s], longest duration of a task, for sweeps that take days
TASKS: Final = 4000  # sweeps with more tasks get longer tasks instead, up to the longest duration
LARGEST: Final = 1 << 26  # [bytes], largest output of a task
SAMPLES, SAMPLE = 16, 4096  # number of parts with a measured time, number of requests per part
TIMED: Final = 0.5  # [s], sufficient time to measure the time per request


def task(folder: str, digest: str, number: int) -> tuple[float, tuple[int, ...]]:
    """Compute the task `number` and write its chunks; returns its computing time [s] and the outcomes."""
    start = time.perf_counter()
    opened = _opened(folder, digest)
    numbers = opened.read(number)  # a worker ended after it had written all chunks
    if numbers is None:
        numbers = compute_variables(opened.request, opened.part(number))
        opened.write(number, numbers)
    return time.perf_counter() - start, tuple(count_outcomes(numbers))


@lru_cache(maxsize=4)
def _opened(folder: str, digest: str) -> SweepFolder:
    """Folder of a sweep, which stays open for the next tasks; raises an error if its digest is not `digest`."""
    found = SweepFolder(Path(folder))
    if found.digest != digest:
        step = "Give all workers access to the same folder under the same name."
        raise FileError(folder, "contains another sweep when a worker opens it", step)
    check_made_here(found)
    return found


def measured_size(request: Request) -> tuple[int, int]:
    """Numbers of poses and wrenches per task for a suitable duration, from the measured time of some requests."""
    places = np.linspace(0, len(request) - 1, min(SAMPLES, len(request))).astype(np.int64)
    parts = [_sample(place, request) for place in np.transpose(np.unravel_index(places, request.shape))]
    compute_variables(request, parts[0])  # first call: loads the machine code
    count, seconds = 0, 0.0
    for part in parts:
        start = time.process_time()  # processor time does not depend on other processes
        compute_variables(request, part)
        seconds += time.process_time() - start
        count += part.shape[0] * part.shape[1]
        if seconds > TIMED or count >= len(request):
            break
    each = max(seconds / count, 1e-9)
    wanted = min(max(SECONDS, each * len(request) / TASKS), LONGEST)
    size = sum(8 * request.cable_count ** len(one.parts) for one in variables_of(request.quantities))
    rows = max(1, min(int(wanted / each), LARGEST // size))
    return _size(rows, *request.shape[1:])


def _size(rows: int, poses: int, wrenches: int) -> tuple[int, int]:
    """Numbers of poses and wrenches in a task of `rows` requests; wrenches of a pose stay together if possible."""
    wide = min(wrenches, rows)
    return min(poses, max(1, rows // wide)), wide


def _sample(place: Indices, request: Request) -> RequestBox:
    """Box of at most `SAMPLE` requests, which begins at the indices (3,) of a robot, a pose and a wrench."""
    robot, pose, wrench = (int(k) for k in place)
    _, poses, wrenches = request.shape
    tall, wide = _size(SAMPLE, poses, wrenches)
    first, left = min(pose, poses - tall), min(wrench, wrenches - wide)
    return RequestBox(robot, slice(first, first + tall), slice(left, left + wide))


ITERATIONS: Final = 32  # largest number of proofs at a pose that are tried for other loads
TRUST: Final = 1e-8  # smallest gap of a valid proof, relative to the forces: ten times the tolerance of a verdict


def _proofs_of(robot: Robot, options: Options, poses: Array, loads: Array, found: InverseRows) -> Array:
    """Decide requests that the tension distribution could not decide; complete the results of feasible requests."""
    # The arguments are pose rows (P, POSE_COLUMNS), loads (W, 6), and the results `found` of P W requests: all loads at
    # the first pose, then all loads at the next pose, and so on. Returns (P W,) proved lower bounds of the change of
    # force [N] that makes a request feasible: 0 for a feasible request, NaN for a request without a result.
    proof = np.full(found.pose_status.size, np.nan)
    proof[found.pose_status == codes.POSE_SOLVED] = 0.0
    waiting = np.isin(found.pose_status, UNDECIDED).reshape(len(poses), len(loads))
    along = loads @ robot.freedom.T
    size = _forces_at_hand(robot, loads)
    # one proof may decide several loads if all upper limits are finite
    shared = len(loads) > 1 and bool(np.isfinite(robot.tension_max).all())
    for _ in range(ITERATIONS if shared else 0):
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


def _forces_at_hand(robot: Robot, loads: Array) -> Array:
    """Upper bound (W,) of the forces of cables and load [N]; moments are divided by the smallest lever arm."""
    arms = np.linalg.norm(robot.platform_anchors - robot.center_of_mass, axis=1)
    arm = float(arms[arms > 0.0].min(initial=np.inf))
    moments = np.abs(loads[:, 3:]).sum(axis=1) / arm
    longest = float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
    weight = robot.gravity * (robot.mass + longest * float(robot.cables.linear_density.sum()))
    return np.asarray(np.abs(loads[:, :3]).sum(axis=1) + moments + weight)


def _gaps(verdicts: tuple[Array, Array, Flags], along: Array, columns: Indices) -> Array:
    """Gaps (K, W) [N] by the proof of one load at each of K poses: a load with a positive gap is infeasible."""
    proved, direction, known = verdicts
    own = proved + np.einsum("kn,kn->k", direction, along[columns])
    gap = own[:, None] - direction @ along.T
    return np.where(known[:, None], gap, -np.inf)


def _decide(
    robot: Robot, options: Options, poses: Array, loads: Array, found: InverseRows, which: Indices, proof: Array
) -> tuple[Array, Array, Flags]:
    """Decide the requests `which`; returns proved lower bounds, directions of proofs, and True for proved requests."""
    rows = locked(poses[which // len(loads)])
    wrenches = locked(loads[which % len(loads)])
    some = InverseRows.empty(robot, len(which))
    some.pose_status[:] = codes.POSE_INFEASIBLE
    some.results[:] = np.nan
    decide_rows(robot_terms(robot), options, rows, wrenches, some)
    found.results[:, which] = some.results
    found.pose_status[which] = some.pose_status
    proved = some.brackets[:, tables.PROVED]
    proof[which] = proved
    known = (some.pose_status == codes.POSE_INFEASIBLE) & (proved > 0.0) & np.isfinite(proved)
    known &= np.isfinite(some.farkas).all(axis=1)
    return np.where(known, proved, 0.0), np.where(known[:, None], some.farkas, 0.0), known
