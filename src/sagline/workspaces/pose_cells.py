"""A box of poses taken apart into cells, breadth-first, until each is proved or the time is over."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.core.arrays import Array, Codes, Indices, locked
from sagline.core.progress import Progress
from sagline.core.results import Result
from sagline.kernels.workspaces.pose_box_proof import BOX_COLUMNS, prove_boxes, room_for
from sagline.robot.pose_box import PoseBox
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.options import LIMITS_OF
from sagline.workspaces.proof_verdict import ProofVerdict
from sagline.workspaces.wrench_sets import WrenchSet

BLOCK: Final = 1 << 11  # boxes at once: some hundredths of a second, after which an interrupt is heard
MOST_CELLS: Final = 4_000_000  # that wait at once: 100 MB
OBLONG: Final = 0.6  # of the longest edge: an edge that long is halved with it
PARTS: Final = (1, 4, 8, 16)  # cubes of rotation vectors along an edge, one after the other: two are hardly smaller
PRECISION: Final = (1.0, 1e-12)  # all that slopes leave out counts; a sum of a thousand parts errs by 1e-13 of them


@dataclass(frozen=True, slots=True, eq=False)
class Cells(Result):
    """Boxes that together are the whole one, K of them.

    Attributes:
        low: Lowest position of each [m], shape (K, 3).
        high: Highest position of each [m], shape (K, 3).
        verdict: Codes of `ProofVerdict`, shape (K,).
    """

    low: Array
    high: Array
    verdict: Codes


class Prover:
    """Proofs for rows of boxes, prepared once."""

    __slots__ = ("_given", "_room", "_statuses", "axes", "size")

    def __init__(
        self, robot: Robot, wrenches: WrenchSet, model: CableModel, precision: tuple[float, float] = PRECISION
    ) -> None:
        """Prepare.

        Args:
            robot: The robot, without pulleys.
            wrenches: The set of loads.
            model: Cable model.
            precision: What the proofs allow for, as in the kernel; another only to show that it is needed.
        """
        limits = (LIMITS_OF[robot.tension_limits_of], np.nan)
        self._given = (
            (model.code, *model.parameters), limits, robot_terms(robot), _load_terms(wrenches, robot), precision,
        )  # fmt: skip
        self.size = 0.5 * float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))  # about a chord [m]
        self.axes = np.eye(3) if robot.plane_normal is None else robot.plane_normal[None]  # about which it may turn
        self._room = room_for(robot.cable_count)
        self._statuses = np.zeros(robot.cable_count, dtype=np.int8)

    def verdicts(self, middle: Array, half: Array, rotations: Array | None = None, turns: Array | float = 0.0) -> Codes:
        """What is proved of boxes of poses: OPEN, PROVED_INSIDE (all poses) or PROVED_OUTSIDE (every pose).

        Args:
            middle: Of the boxes [m], shape (N, 3).
            half: Their half edges [m], shape (3,).
            rotations: Rotation vectors at their middles [rad], shape (N, 3); None for level.
            turns: Largest turn away from there [rad], shape () or (N,).

        Returns:
            Codes, shape (N,).
        """
        boxes = np.zeros((len(middle), BOX_COLUMNS))
        boxes[:, :3] = middle
        boxes[:, 6] = 1.0
        if rotations is not None:
            boxes[:, 3:7] = Rotation.from_rotvec(rotations).as_quat()
        boxes[:, 7:10] = half
        boxes[:, 10] = turns
        found = np.zeros(len(middle), dtype=np.int8)
        model, limits, robot, loads, precision = self._given
        prove_boxes(model, limits, robot, loads, locked(boxes), precision, self._room, (found, self._statuses))
        return found


class Search:
    """What is left to do, and of what.

    Attributes:
        prover: Of what.
        deadline: On the monotonic clock, after which nothing more is looked at [s].
        tried: How many boxes were looked at.
    """

    __slots__ = ("_told", "deadline", "prover", "tried")

    def __init__(self, prover: Prover, deadline: float, progress: Progress | None = None) -> None:
        """Begin."""
        self.prover = prover
        self.deadline = deadline
        self.tried = 0
        self._told = progress

    @property
    def late(self) -> bool:
        """Whether the time is over."""
        return time.monotonic() >= self.deadline

    def verdicts(self, middle: Array, half: Array, rotations: Array | None = None, turns: Array | float = 0.0) -> Codes:
        """Those of the prover, block by block, each of which is told; OPEN where the time is over."""
        verdict = np.zeros(len(middle), dtype=np.int8)
        for first in range(0, len(middle), BLOCK):
            if first and self.late:
                break
            part = slice(first, first + BLOCK)
            turned = None if rotations is None else rotations[part]
            turn = turns if isinstance(turns, float) else turns[part]
            verdict[part] = self.prover.verdicts(middle[part], half, turned, turn)
            self.tried += len(middle[part])
            if self._told is not None:
                self._told(self.tried, self.tried + max(len(middle) - part.stop, 0))
        return verdict


def halve(search: Search, box: PoseBox, smallest: float) -> tuple[Cells, int]:
    """Halve a box breadth-first until all is decided or the time is over.

    Args:
        search: What proves, and until when.
        box: The box.
        smallest: Edge below which cells are not halved [m]; 0 for none.

    Returns:
        The cells, and how many boxes were tried.
    """
    half = 0.5 * (box.high - box.low)
    waiting = (box.low + half)[None]
    done: list[tuple[Array, Array, Codes]] = []
    while True:
        verdict = _decide(search, waiting, half, box.tilt)
        offsets, halved = _children(half)
        is_open = verdict == ProofVerdict.OPEN
        count = int(is_open.sum()) * len(offsets)
        if search.late or not count or count > MOST_CELLS or len(offsets) == 1 or 2.0 * halved.max() < smallest:
            done.append(_cells(waiting, half, verdict))
            break
        done.append(_cells(waiting[~is_open], half, verdict[~is_open]))
        waiting = (waiting[is_open][:, None] + offsets).reshape(-1, 3)
        half = halved
    low, high, verdicts = (np.concatenate(arrays) for arrays in zip(*done, strict=True))
    return Cells(locked(low), locked(high), locked(verdicts)), search.tried


def _decide(search: Search, middle: Array, half: Array, tilt: float) -> Codes:
    """What is proved of cells of positions, level or at all tilts up to one.

    Tilts are rotation vectors in a ball, which cubes cover, or of a planar robot along its normal, which pieces do. A
    turn from one cube's middle to any vector in it is no longer than their difference. Outside needs one orientation,
    inside all. Cubes stay larger than the cells, which turn the cables by their size over a chord.
    """
    if tilt == 0.0:
        return search.verdicts(middle, half)
    verdict = np.full(len(middle), ProofVerdict.PROVED_INSIDE, dtype=np.int8)
    cells, vectors = np.arange(len(middle)), np.zeros((len(middle), 3))  # a row for each cube that is open
    finest, axes = float(np.linalg.norm(half)) / search.prover.size, search.prover.axes
    for place, parts in enumerate(PARTS):
        turn = tilt if parts == 1 else tilt * np.sqrt(len(axes)) / parts
        found = search.verdicts(middle[cells], half, vectors, turn)
        outermost = vectors * np.minimum(tilt / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300), 1.0)[:, None]
        undecided = found == ProofVerdict.OPEN
        at_one = np.zeros_like(found)
        at_one[undecided] = search.verdicts(middle[cells[undecided]], half, outermost[undecided])
        fails = (found == ProofVerdict.PROVED_OUTSIDE) | (at_one == ProofVerdict.PROVED_OUTSIDE)
        verdict[cells[fails]] = ProofVerdict.PROVED_OUTSIDE
        kept = undecided & (verdict[cells] != ProofVerdict.PROVED_OUTSIDE)
        cells, vectors = cells[kept], vectors[kept]
        if place + 1 == len(PARTS) or turn < finest or search.late:
            break
        cells, vectors = _smaller_cubes(cells, vectors, tilt * axes, parts, PARTS[place + 1])
        if len(cells) > MOST_CELLS:
            break
    verdict[cells[verdict[cells] != ProofVerdict.PROVED_OUTSIDE]] = ProofVerdict.OPEN
    return verdict


def _smaller_cubes(cells: Indices, vectors: Array, edges: Array, parts: int, more: int) -> tuple[Indices, Array]:
    """The cubes of each cube that meet the ball of tilts, with the cell that each belongs to.

    Half the edges of the cube around the whole ball are given, one a row.
    """
    count = more // parts
    steps = (2.0 * np.arange(count) + 1.0 - count) / more
    places = np.stack(np.meshgrid(*[steps] * len(edges), indexing="ij"), axis=-1).reshape(-1, len(edges))
    smaller = (vectors[:, None] + places @ edges).reshape(-1, 3)
    shares = smaller @ np.linalg.pinv(edges)
    meets = np.linalg.norm(np.maximum(np.abs(shares) - 1.0 / more, 0.0), axis=1) <= 1.0
    return np.repeat(cells, len(places))[meets], smaller[meets]


def _children(half: Array) -> tuple[Array, Array]:
    """Middles of the parts of a box, from its own, and their half edges: all long edges are halved."""
    long = (half >= OBLONG * half.max()) & (half > 0.0)
    halved = np.where(long, 0.5 * half, half)
    steps = [np.array([-1.0, 1.0]) * halved[k] if long[k] else np.zeros(1) for k in range(3)]
    return np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3), halved


def _cells(middle: Array, half: Array, verdict: Codes) -> tuple[Array, Array, Codes]:
    return middle - half, middle + half, verdict


def _load_terms(wrenches: WrenchSet, robot: Robot) -> tuple[Any, ...]:
    """The set as the kernel takes it: corners from their mean, and the loads of accelerations of a level platform."""
    center, corners, first = wrenches.center.copy(), wrenches.corners.copy(), 0
    for size in wrenches.sizes:
        mean = corners[first : first + size].mean(axis=0)
        center += mean
        corners[first : first + size] -= mean
        first += size
    linear, angular = wrenches.accelerations
    inertial = np.zeros((6, 6))
    inertial[:3, :3] = robot.mass * linear * np.eye(3)
    inertial[3:, 3:] = robot.inertia.T * angular
    segments = np.concatenate([wrenches.segments, inertial])
    kept = segments[np.any(segments != 0.0, axis=1)]
    several = np.repeat(wrenches.sizes > 1, wrenches.sizes)
    arrays = (center, kept, wrenches.ellipsoids, corners[several], wrenches.sizes[wrenches.sizes > 1])
    return tuple(locked(np.ascontiguousarray(array).view()) for array in arrays)
