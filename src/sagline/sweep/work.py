"""The numbers of a part of a sweep: a pure function of the request and the part."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sagline.arrays import Array, locked
from sagline.kernels import codes, tables
from sagline.kinematics.inverse_rows import Found, Verdicts, decide_rows, solve_rows
from sagline.kinematics.status import PoseStatus
from sagline.robot.robot import Robot
from sagline.statics.tables import pose_rows
from sagline.sweep.quantities import ENOUGH, LENGTH, PROOF, STATUS, TENSION, Variable, variables_of
from sagline.sweep.request import Request
from sagline.tension.options import kernel_options

ROWS: Final = 1 << 14  # requests solved at once: what they take stays in the cache of the processor


class Part(NamedTuple):
    """A box of requests.

    Attributes:
        robot: Index of the robot.
        poses: Which poses.
        wrenches: Which wrenches.
    """

    robot: int
    poses: slice
    wrenches: slice

    @property
    def shape(self) -> tuple[int, int]:
        """How many poses and wrenches."""
        return self.poses.stop - self.poses.start, self.wrenches.stop - self.wrenches.start

    def pieces(self, most: int) -> Iterator[Part]:
        """The same box in boxes of at most so many requests."""
        tall = min(self.shape[0], most)
        wide = max(1, most // tall)
        for first in range(self.poses.start, self.poses.stop, tall):
            for left in range(self.wrenches.start, self.wrenches.stop, wide):
                rows = slice(first, min(first + tall, self.poses.stop))
                yield Part(self.robot, rows, slice(left, min(left + wide, self.wrenches.stop)))


class Counts(NamedTuple):
    """How many requests ended how.

    Attributes:
        feasible: With tensions within their limits.
        infeasible: With a proof that there are none.
        unable: With another reason why there is no answer, as the status says.
        open: With neither tensions nor proof: the bracket of the shortfall holds zero.
        lost: Not at all.
    """

    feasible: int
    infeasible: int
    unable: int
    open: int
    lost: int


def numbers_of(request: Request, part: Part) -> dict[str, NDArray[np.generic]]:
    """All variables of a part.

    Args:
        request: The request.
        part: Which box of it.

    Returns:
        Arrays by the names of the variables, (poses, wrenches), those of cables (poses, wrenches, cables): NaN where a
        robot has fewer, and where there is no answer.
    """
    asked = variables_of(request.quantities)
    shape = part.shape
    filled: dict[str, NDArray[np.generic]] = {each.name: _room(each, shape, request.cable_count) for each in asked}
    solver = _Solver(request, request.robots[part.robot])
    for piece in part.pieces(ROWS):
        rows = slice(piece.poses.start - part.poses.start, piece.poses.stop - part.poses.start)
        columns = slice(piece.wrenches.start - part.wrenches.start, piece.wrenches.stop - part.wrenches.start)
        answers = solver.answers(piece)
        for name, values in filled.items():
            found = answers[name]
            target = values[rows, columns]
            if found.ndim > 1:
                target[..., : found.shape[1]] = found.reshape(*piece.shape, -1)
            else:
                target[...] = found.reshape(piece.shape)
    return filled


def counts_of(numbers: dict[str, NDArray[np.generic]]) -> Counts:
    """How the requests of a part ended.

    Args:
        numbers: Its variables.

    Returns:
        The counts.
    """
    status, proof = numbers[STATUS.name], np.asarray(numbers[PROOF.name], dtype=np.float64)
    infeasible = status == PoseStatus.INFEASIBLE
    proved = int(np.count_nonzero(infeasible & (proof > 0.0)))
    feasible, borderline, lost = (
        int(np.count_nonzero(status == code))
        for code in (PoseStatus.SOLVED, PoseStatus.BORDERLINE, PoseStatus.NOT_CONVERGED)
    )
    left = borderline + int(np.count_nonzero(infeasible)) - proved
    return Counts(feasible, proved, status.size - feasible - proved - left - lost, left, lost)


class _Solver:
    """One robot of a request, set up once."""

    def __init__(self, request: Request, robot: Robot) -> None:
        self._request, self._robot = request, robot
        self._options = kernel_options(robot, request.model, request.tension)
        self._poses = pose_rows(request.poses)

    def answers(self, part: Part) -> dict[str, Array]:
        """All variables of a few requests in rows, (N,) or (N, m), whether they are asked for or not."""
        poses, wrenches = part.shape
        rows = locked(np.repeat(self._poses[part.poses], wrenches, axis=0))
        loads = locked(np.tile(self._request.wrenches[part.wrenches], (poses, 1)))
        none = np.full(self._robot.cable_count, np.nan)
        found = solve_rows(self._robot, self._request.tension, self._options, rows, loads, none)
        verdicts = decide_rows(self._robot, self._options, rows, loads, found)
        return _named(found, verdicts)


def _named(found: Found, verdicts: Verdicts) -> dict[str, Array]:
    lengths = found.results[tables.LENGTH]
    return {
        STATUS.name: found.pose_status,
        PROOF.name: verdicts.brackets[:, 0],
        ENOUGH.name: verdicts.shortfall,
        TENSION.name: found.results[tables.TENSION],
        LENGTH.name: lengths,
    }


def _room(variable: Variable, shape: tuple[int, int], cables: int) -> NDArray[np.generic]:
    whole = (*shape, cables) if variable.a_cable else shape
    return np.full(whole, codes.POSE_NOT_CONVERGED if variable.type == "int8" else np.nan, dtype=variable.type)
