"""Proofs, with sagging cables, that every pose of a box is feasible, or that no pose of the box is feasible."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.spatial.transform import Rotation

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import callback, instance
from sagline.core.arrays import Array, Codes, Indices, Progress, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted
from sagline.core.results import Result, Status
from sagline.kernels.workspaces.pose_box_proof import BOX_COLUMNS, INSIDE, OPEN, OUTSIDE, memory_for_proofs, prove_boxes
from sagline.robot.batch import refuse_slanted
from sagline.robot.pose import PoseBox
from sagline.robot.reach import check_cable_count
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.method import LIMITS_OF
from sagline.workspaces.region import check_tilt
from sagline.workspaces.wrench_sets import WrenchSet, load_of


class ProofVerdict(Status):
    """Verdict on a box of poses, or on a cell of a box."""

    OPEN = OPEN, "the whole box has no proof; the shares state how much is proved; a longer budget proves more cells"
    PROVED_INSIDE = INSIDE, "at every pose, tensions within the limits balance every load"
    PROVED_OUTSIDE = OUTSIDE, "at every position, at least one load cannot be balanced by tensions within the limits"


BLOCK: Final = 1 << 11  # boxes per block; a block takes about 0.03 s, and interrupts are handled between blocks
MOST_CELLS: Final = 4_000_000  # largest number of cells that wait for a proof; they take 100 MB
OBLONG: Final = 0.6  # an edge is halved if it is longer than this share of the longest edge
PARTS: Final = (1, 4, 8, 16)  # possible numbers of parts of an edge
# weight of the nonlinear terms, and relative rounding error of a sum of a thousand terms
PRECISION: Final = (1.0, 1e-12)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Cells(Result):
    """The K cells of a divided box of poses.

    Attributes:
        low: Lowest position of each cell [m], shape (K, 3).
        high: Highest position of each cell [m], shape (K, 3).
        verdict: Codes of `ProofVerdict`, shape (K,).
    """

    low: Array
    high: Array
    verdict: Codes


class Prover:
    """Proofs for rows of boxes. Data that do not depend on the boxes are prepared once.

    Attributes:
        size: Approximate mean length of a chord [m].
        axes: Axes about which the platform may rotate, shape (1 or 3, 3).
        deadline: Time on the monotonic clock at which the proofs end [s].
        tried: Number of boxes for which a proof was tried.
    """

    def __init__(
        self,
        robot: Robot,
        wrenches: WrenchSet,
        model: CableModel,
        precision: tuple[float, float] = PRECISION,
        progress: Progress | None = None,
    ) -> None:
        """Prepare the proofs for a robot without pulleys. `precision` exists only for tests."""
        limits = (LIMITS_OF[robot.tension_limits_of], np.nan)
        loads = _load_terms(wrenches, robot)
        self._given = (model.code, *model.parameters), limits, robot_terms(robot), loads, precision
        self.size = 0.5 * float(np.linalg.norm(np.ptp(robot.frame_anchors, axis=0)))
        self.axes = np.eye(3) if robot.plane_normal is None else robot.plane_normal[None]
        self.deadline, self.tried, self._progress = np.inf, 0, progress
        self._work = memory_for_proofs(robot.cable_count)
        self._statuses = np.zeros(robot.cable_count, dtype=np.int8)

    def verdicts(self, middle: Array, half: Array, rotations: Array | None = None, turns: Array | float = 0.0) -> Codes:
        """Verdicts (N,) of boxes of poses, block by block; OPEN after the deadline."""
        # Arguments: `middle` (N, 3) and `half` (3,), centers and half edges of the boxes [m]; `rotations` (N, 3), None
        # for level; `turns`, () or (N,), largest angle between an orientation of a box and its rotation vector [rad].
        boxes = np.zeros((len(middle), BOX_COLUMNS))
        boxes[:, :3] = middle
        boxes[:, 6] = 1.0
        if rotations is not None:
            boxes[:, 3:7] = Rotation.from_rotvec(rotations).as_quat()
        boxes[:, 7:10] = half
        boxes[:, 10] = turns
        found = np.zeros(len(middle), dtype=np.int8)
        model, limits, robot, loads, precision = self._given
        for first in range(0, len(middle), BLOCK):
            if first and self.out_of_time:
                break
            part = slice(first, first + BLOCK)
            own = locked(boxes[part])
            prove_boxes(model, limits, robot, loads, own, precision, self._work, (found[part], self._statuses))
            self.tried += len(own)
            if self._progress is not None:
                self._progress(self.tried, self.tried + max(len(middle) - part.stop, 0))
        return found

    @property
    def out_of_time(self) -> bool:
        """True after the deadline."""
        return time.monotonic() >= self.deadline


def _bisect(prover: Prover, box: PoseBox, smallest: float) -> Cells:
    """Divide `box` breadth-first until all cells are proved or have the edge `smallest` [m], or until the deadline."""
    half = 0.5 * (box.high - box.low)
    waiting = (box.low + half)[None]
    done: list[tuple[Array, Array, Codes]] = []
    while True:
        verdict = _decide(prover, waiting, half, box.tilt)
        offsets, halved = _children(half)
        is_open = verdict == ProofVerdict.OPEN
        count = int(is_open.sum()) * len(offsets)
        if prover.out_of_time or not count or count > MOST_CELLS or len(offsets) == 1 or 2.0 * halved.max() < smallest:
            done.append((waiting - half, waiting + half, verdict))
            break
        decided = waiting[~is_open]
        done.append((decided - half, decided + half, verdict[~is_open]))
        waiting = (waiting[is_open][:, None] + offsets).reshape(-1, 3)
        half = halved
    low, high, verdicts = (np.concatenate(arrays) for arrays in zip(*done, strict=True))
    return Cells(locked(low), locked(high), locked(verdicts))


def _decide(prover: Prover, middle: Array, half: Array, tilt: float) -> Codes:
    """Verdicts of cells of positions, for level poses or for all tilts up to `tilt`."""
    # Tilts are rotation vectors in a ball. Cubes cover the ball. For a planar robot, tilts are rotations about the
    # normal of its plane, and intervals cover their range. The angle between two rotations of a cube is at most the
    # length of the difference of their rotation vectors. A cell is outside if one orientation is infeasible, and inside
    # if all orientations are feasible. Within a cell, the directions of the cables vary by an angle of about the cell's
    # size divided by the length of a chord. Cubes are divided until they are smaller than the angle of this variation.
    if tilt == 0.0:
        return prover.verdicts(middle, half)
    verdict = np.full(len(middle), ProofVerdict.PROVED_INSIDE, dtype=np.int8)
    cells, vectors = np.arange(len(middle)), np.zeros((len(middle), 3))  # one row per cube without a proof
    finest, axes = float(np.linalg.norm(half)) / prover.size, prover.axes
    for place, parts in enumerate(PARTS):
        turn = tilt if parts == 1 else tilt * np.sqrt(len(axes)) / parts
        found = prover.verdicts(middle[cells], half, vectors, turn)
        outermost = vectors * np.minimum(tilt / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300), 1.0)[:, None]
        undecided = found == ProofVerdict.OPEN
        at_one = np.zeros_like(found)
        at_one[undecided] = prover.verdicts(middle[cells[undecided]], half, outermost[undecided])
        fails = (found == ProofVerdict.PROVED_OUTSIDE) | (at_one == ProofVerdict.PROVED_OUTSIDE)
        verdict[cells[fails]] = ProofVerdict.PROVED_OUTSIDE
        kept = undecided & (verdict[cells] != ProofVerdict.PROVED_OUTSIDE)
        cells, vectors = cells[kept], vectors[kept]
        if place + 1 == len(PARTS) or turn < finest or prover.out_of_time:
            break
        cells, vectors = _smaller_cubes(cells, vectors, tilt * axes, parts, PARTS[place + 1])
        if len(cells) > MOST_CELLS:
            break
    verdict[cells[verdict[cells] != ProofVerdict.PROVED_OUTSIDE]] = ProofVerdict.OPEN
    return verdict


def _smaller_cubes(cells: Indices, vectors: Array, edges: Array, parts: int, more: int) -> tuple[Indices, Array]:
    """Parts of each cube that intersect the ball of tilts, and for each part the cell to which it belongs."""
    count = more // parts
    steps = (2.0 * np.arange(count) + 1.0 - count) / more
    places = np.stack(np.meshgrid(*[steps] * len(edges), indexing="ij"), axis=-1).reshape(-1, len(edges))
    smaller = (vectors[:, None] + places @ edges).reshape(-1, 3)
    shares = smaller @ np.linalg.pinv(edges)
    meets = np.linalg.norm(np.maximum(np.abs(shares) - 1.0 / more, 0.0), axis=1) <= 1.0
    return np.repeat(cells, len(places))[meets], smaller[meets]


def _children(half: Array) -> tuple[Array, Array]:
    """Centers of the parts of a box relative to its center, and half edges of the parts. Long edges are bisected."""
    long = (half >= OBLONG * half.max()) & (half > 0.0)
    halved = np.where(long, 0.5 * half, half)
    steps = [np.array([-1.0, 1.0]) * halved[k] if long[k] else np.zeros(1) for k in range(3)]
    return np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3), halved


def _load_terms(wrenches: WrenchSet, robot: Robot) -> tuple[Any, ...]:
    """`wrenches` in the form for the kernel: corners minus their mean, and inertial loads of a level platform."""
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
    ellipsoids = wrenches.ellipsoids.transpose(0, 2, 1)
    arrays = (center, kept, ellipsoids, corners[several], wrenches.sizes[wrenches.sizes > 1])
    return tuple(locked(np.ascontiguousarray(array).view()) for array in arrays)


_CATENARY = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Proof(Result):
    """Result of `prove`: a box of poses divided into cells, each proved inside, proved outside, or open.

    Attributes:
        robot: The robot.
        box: The box of poses.
        wrenches: The set of loads.
        model: Cable model of the proofs.
        verdict: Verdict on the whole box.
        inside: Share of the box, 0 to 1, in which every load is proved feasible.
        outside: Share of the box in which at least one load is proved infeasible.
        open: Share of the box without a proof.
        cells: The cells of the box.
        tried: Number of boxes for which a proof was tried.
    """

    robot: Robot
    box: PoseBox
    wrenches: WrenchSet
    model: CableModel
    verdict: ProofVerdict
    inside: float
    outside: float
    open: float
    cells: Cells
    tried: int

    @property
    def volume(self) -> float:
        """Volume of the whole box of positions [m^3]. The shares refer to this volume, which is zero for a flat box."""
        return float(np.prod(self.box.high - self.box.low))

    @property
    def inside_volume(self) -> float:
        """Volume that is proved inside [m^3]: a lower bound of the volume of the workspace in the box."""
        return self.inside * self.volume

    @property
    def outside_volume(self) -> float:
        """Volume that is proved outside [m^3]. The workspace in the box is at most the rest of the box."""
        return self.outside * self.volume

    @property
    def open_volume(self) -> float:
        """Volume without a proof [m^3]."""
        return self.open * self.volume

    def __str__(self) -> str:
        """The verdict, then share and volume of the cells inside, outside and without a proof."""
        rows = (("inside", self.inside), ("outside", self.outside), ("open", self.open))
        shares = "\n".join(f"  {word:<8}{share:>8.2%}{share * self.volume:>12.5g} m3" for word, share in rows)
        return f"{self.verdict.name}: {self.verdict.text}\n{shares}\n  {counted(self.tried, 'box')} tried"


def prove(
    robot: Robot,
    box: PoseBox,
    wrenches: WrenchSet | None = None,
    *,
    budget: float = 10.0,
    model: CableModel | str = _CATENARY,
    smallest: float | None = None,
    progress: Progress | None = None,
) -> Proof:
    """Prove that every pose of a box is feasible, or that no pose is, for the whole box or for its cells.

    Without a tilt of the box, poses are level. With a tilt, the orientations of a position are all rotations by at most
    this angle about any axis (for a planar platform, about the normal of its plane). A position is inside if all its
    orientations are feasible, and outside if at least one orientation is infeasible. The box is divided until every
    cell is proved. Cells without a proof at the end of the budget are open. With `Catenary()`, the proofs are valid for
    the exact cables; the admissible tensions are the same as in `margin`.

    Args:
        robot: The robot, without pulleys.
        box: Positions, and the largest tilt of the platform.
        wrenches: Set of loads; the cables must balance all of them. None for the weight alone.
        budget: Time limit for the proofs [s], > 0.
        model: Cable model.
        smallest: Smallest length of a cell's longest edge [m]. Smaller cells are not made. None: only the budget is a
            limit.
        progress: Function that is called from time to time with the number of finished cells and of known cells.

    Returns:
        Proof.

    Raises:
        InvalidValueError: If an argument is of the wrong kind. If the robot has pulleys, or fewer cables than degrees
            of freedom. If the box has a tilt but the platform cannot rotate.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> box = sl.PoseBox([-2, -1, 1], [2, 1, 3])
        >>> load = sl.WrenchPolytope([[0, 0, -100, 0, 0, 0]])
        >>> print(sl.prove(robot, box, load).verdict.name)
        PROVED_INSIDE

    Source:
        docs/model.md, section 13.
    """
    load = load_of(wrenches)
    check_provable(instance(robot, Robot, "robot"))
    check_tilt(robot, instance(box, PoseBox, "box").tilt, "box: tilt")
    if box.tilt > 0.0 and load.accelerations[1] > 0.0:
        step = "Replace the accelerations by WrenchBox(moment=...), or prove level poses."
        raise InvalidValueError("wrenches: angular accelerations", "given", "none if the box is tilted", step)
    seconds = number(budget, "budget", "s", above=0.0)
    least = 0.0 if smallest is None else number(smallest, "smallest", "m", above=0.0)
    report = callback(progress, "progress")
    model = model_of(model)
    # the budget does not include the time to load or compile the kernel
    Prover(robot, load, model).verdicts(box.low[None], np.zeros(3))
    prover = Prover(robot, load, model, progress=report)
    prover.deadline = time.monotonic() + seconds
    cells = _bisect(prover, box, least)
    extent = box.high - box.low
    share = ((cells.high - cells.low)[:, extent > 0.0] / extent[extent > 0.0]).prod(axis=1)
    kinds = (ProofVerdict.PROVED_INSIDE, ProofVerdict.PROVED_OUTSIDE, ProofVerdict.OPEN)
    inside, outside, undecided = (float(share[cells.verdict == kind].sum()) for kind in kinds)
    found = set(cells.verdict.tolist())
    verdict = ProofVerdict(found.pop()) if len(found) == 1 else ProofVerdict.OPEN
    return Proof(robot, box, load, model, verdict, inside, outside, undecided, cells, prover.tried)


def check_provable(robot: Robot) -> None:
    """Reject robots with pulleys or with fewer cables than degrees of freedom, because they have no proofs."""
    check_cable_count(robot)
    if robot.winches is not None and (robot.winches.pulley_radius > 0.0).any():
        cable = int(np.argmax(robot.winches.pulley_radius > 0.0))
        radius = f"{robot.winches.pulley_radius[cable]:g} m"
        step = "Prove the box for the robot without pulleys: robot.replace(winches=None)."
        raise InvalidValueError(f"{robot.name}: pulley_radius[{cable}]", radius, "0 m: proofs have no pulleys", step)
    refuse_slanted(robot)  # winches on the platform without pulleys
