"""Proofs for boxes of poses: that a robot can work at every pose of a box, or at none, its cables' sag included."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

import numpy as np

from sagline.arguments import callback, instance
from sagline.arrays import Array, Codes, locked, number
from sagline.blocks import Progress
from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.errors import InvalidValueError
from sagline.kernels.workspaces.pose_box_proof import BOX_COLUMNS, prove_boxes, room_for
from sagline.results import Result
from sagline.robot.pose_box import PoseBox
from sagline.robot.robot import Robot
from sagline.statics.tables import robot_terms
from sagline.tension.options import LIMITS_OF
from sagline.workspaces.proof_verdict import ProofVerdict
from sagline.workspaces.wrench_sets import WrenchSet, load_of

BLOCK: Final = 1 << 11  # boxes at once: some hundredths of a second, after which an interrupt is heard
MOST_CELLS: Final = 4_000_000  # that wait at once: 100 MB
OBLONG: Final = 0.6  # of the longest edge: an edge that long is halved with it
PRECISION: Final = (1.0, 1e-12)  # all that slopes leave out counts; a sum of a thousand parts errs by 1e-13 of them
_CATENARY = Catenary()


class Cells(NamedTuple):
    """Boxes that together are the whole one, K of them.

    Attributes:
        low: Lowest position of each [m], shape (K, 3).
        high: Highest position of each [m], shape (K, 3).
        verdict: Codes of `ProofVerdict`, shape (K,).
    """

    low: Array
    high: Array
    verdict: Codes


@dataclass(frozen=True, slots=True, eq=False)
class Proof(Result):
    """Result of `prove`: a box of poses taken apart into cells, each proved inside, proved outside, or open.

    Attributes:
        robot: The robot.
        box: The box of poses.
        wrenches: The set of loads.
        model: The cable model that the proofs hold for.
        verdict: What is proved of the whole box.
        inside: Share of the box at whose poses every load is balanced within the limits, proved, 0 to 1.
        outside: Share at whose poses some load is not, proved.
        open: Share that is not decided.
        cells: The cells.
        tried: How many boxes were looked at.
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
        """Volume of positions of the whole box [m^3]; the shares are of it. Zero for a flat box."""
        return float(np.prod(self.box.high - self.box.low))

    @property
    def inside_volume(self) -> float:
        """Volume proved inside [m^3]: the workspace in the box is at least that large."""
        return self.inside * self.volume

    @property
    def outside_volume(self) -> float:
        """Volume proved outside [m^3]: the workspace in the box is at most the rest."""
        return self.outside * self.volume

    @property
    def open_volume(self) -> float:
        """Volume that is not decided [m^3]."""
        return self.open * self.volume

    def __str__(self) -> str:
        """The verdict, and the share and volume of each kind of cell."""
        rows = (("inside", self.inside), ("outside", self.outside), ("open", self.open))
        shares = "\n".join(f"  {word:<8}{share:>8.2%}{share * self.volume:>12.5g} m3" for word, share in rows)
        return f"{self.verdict.name}: {self.verdict.text}\n{shares}\n  {self.tried:,} boxes tried"


def prove(
    robot: Robot,
    box: PoseBox,
    wrenches: WrenchSet | None = None,
    *,
    budget: float = 10.0,
    model: CableModel = _CATENARY,
    smallest: float | None = None,
    progress: Progress | None = None,
) -> Proof:
    """Prove that a robot can work at every pose of a box, or at none of them, or where in it which holds.

    Level poses, or with a tilt of the box all that are tilted by no more. The box is halved along its edges, again and
    again, and each cell that can be decided is; what remains when the budget ends is open, never a guess. With
    `Catenary()` the proofs hold for the exact cables, at tensions of the same range as in `margin`.

    Args:
        robot: The robot, without pulleys.
        box: Positions, and how far the platform may be tilted there.
        wrenches: The set of loads, all of which have to be balanced; None for the weight alone.
        budget: Time after which no further cells are looked at [s], > 0.
        model: Cable model.
        smallest: Cells are not halved below this edge [m]; None: as long as the budget lasts.
        progress: Called after every few thousand cells: how many are done, of how many are known of.

    Returns:
        Proof.

    Raises:
        InvalidValueError: If an argument is none of its kind, the box is tilted, the robot has pulleys, or fewer cables
            than degrees of freedom.

    Examples:
        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> box = sl.PoseBox([-2, -1, 1], [2, 1, 3])
        >>> print(sl.prove(robot, box, sl.WrenchPolytope([[0, 0, -100, 0, 0, 0]])).verdict.name)
        PROVED_INSIDE

    Source:
        docs/model.md, section 13.
    """
    load = load_of(wrenches)
    check_robot(instance(robot, Robot, "robot"))
    if instance(box, PoseBox, "box").tilt > 0.0:
        step = "Prove the level poses: PoseBox(low, high)."
        raise InvalidValueError("box: tilt", f"{box.tilt:g} rad", "0 rad: proofs are of one orientation", step)
    seconds = number(budget, "budget", "s", above=0.0)
    least = 0.0 if smallest is None else number(smallest, "smallest", "m", above=0.0)
    told = callback(progress, "progress")
    prover = Prover(robot, load, instance(model, CableModel, "model"))
    cells, tried = _halve(prover, box, time.monotonic() + seconds, least, told)
    return _proof(robot, box, load, model, cells, tried)


def check_robot(robot: Robot) -> None:
    """Refuse robots of which nothing can be proved yet.

    Args:
        robot: The robot.

    Raises:
        InvalidValueError: If it has pulleys, or fewer cables than degrees of freedom.
    """
    n, m = robot.degrees_of_freedom, robot.cable_count
    if m < n:
        step = "Add cables, or choose a motion pattern with fewer freedoms."
        raise InvalidValueError(f"{robot.name}: number of cables", m, f">= {n} for {robot.motion_pattern}", step)
    if robot.winches is not None and (robot.winches.pulley_radius > 0.0).any():
        cable = int(np.argmax(robot.winches.pulley_radius > 0.0))
        radius = f"{robot.winches.pulley_radius[cable]:g} m"
        step = "Prove it of the robot without: robot.replace(winches=None)."
        raise InvalidValueError(f"{robot.name}: pulley_radius[{cable}]", radius, "0 m: proofs know no pulleys", step)


class Prover:
    """Proofs for rows of boxes, prepared once."""

    __slots__ = ("_given", "_room", "_statuses")

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
        self._room = room_for(robot.cable_count)
        self._statuses = np.zeros(robot.cable_count, dtype=np.int8)

    def verdicts(self, middle: Array, half: Array) -> Codes:
        """What is proved of boxes of positions, level: OPEN, PROVED_INSIDE or PROVED_OUTSIDE.

        Args:
            middle: Of the boxes [m], shape (N, 3).
            half: Their half edges [m], shape (3,).

        Returns:
            Codes, shape (N,).
        """
        boxes = np.zeros((len(middle), BOX_COLUMNS))
        boxes[:, :3] = middle
        boxes[:, 6] = 1.0
        boxes[:, 7:10] = half
        found = np.zeros(len(middle), dtype=np.int8)
        model, limits, robot, loads, precision = self._given
        prove_boxes(model, limits, robot, loads, locked(boxes), precision, self._room, (found, self._statuses))
        return found


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


def _halve(
    prover: Prover, box: PoseBox, deadline: float, smallest: float, progress: Progress | None
) -> tuple[Cells, int]:
    """Halve a box breadth-first until all is decided or the time is over; the cells, and how many were tried."""
    half = 0.5 * (box.high - box.low)
    waiting = (box.low + half)[None]
    done: list[Cells] = []
    tried = 0
    while len(waiting):
        verdict = np.zeros(len(waiting), dtype=np.int8)
        late = False
        for first in range(0, len(waiting), BLOCK):
            part = slice(first, first + BLOCK)
            verdict[part] = prover.verdicts(waiting[part], half)
            tried += len(waiting[part])
            if progress is not None:
                progress(tried, tried + len(waiting) - min(first + BLOCK, len(waiting)))
            late = time.monotonic() >= deadline
            if late:
                break
        offsets, halved = _children(half)
        is_open = verdict == ProofVerdict.OPEN
        count = int(is_open.sum()) * len(offsets)
        if late or 2.0 * halved.max() < smallest or count > MOST_CELLS or len(offsets) == 1:
            done.append(_cells(waiting, half, verdict))
            break
        done.append(_cells(waiting[~is_open], half, verdict[~is_open]))
        waiting = (waiting[is_open][:, None] + offsets).reshape(-1, 3)
        half = halved
    return Cells(*(np.concatenate(arrays) for arrays in zip(*done, strict=True))), tried


def _children(half: Array) -> tuple[Array, Array]:
    """Middles of the parts of a box, from its own, and their half edges: all long edges are halved."""
    long = (half >= OBLONG * half.max()) & (half > 0.0)
    halved = np.where(long, 0.5 * half, half)
    steps = [np.array([-1.0, 1.0]) * halved[k] if long[k] else np.zeros(1) for k in range(3)]
    return np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1).reshape(-1, 3), halved


def _cells(middle: Array, half: Array, verdict: Codes) -> Cells:
    return Cells(middle - half, middle + half, verdict)


def _proof(robot: Robot, box: PoseBox, load: WrenchSet, model: CableModel, cells: Cells, tried: int) -> Proof:
    extent = box.high - box.low
    relative = (cells.high - cells.low)[:, extent > 0.0] / extent[extent > 0.0]
    share = relative.prod(axis=1)
    inside, outside = (
        float(share[cells.verdict == kind].sum()) for kind in (ProofVerdict.PROVED_INSIDE, ProofVerdict.PROVED_OUTSIDE)
    )
    kinds = set(cells.verdict.tolist())
    verdict = ProofVerdict.OPEN
    if ProofVerdict.OPEN not in kinds:
        verdict = ProofVerdict(kinds.pop()) if len(kinds) == 1 else ProofVerdict.PROVED_DIVIDED
    undecided = float(share[cells.verdict == ProofVerdict.OPEN].sum())
    locked_cells = Cells(*(locked(array) for array in cells))
    return Proof(robot, box, load, model, verdict, inside, outside, undecided, locked_cells, tried)
