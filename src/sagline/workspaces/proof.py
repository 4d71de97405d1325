"""Proofs for boxes of poses: that a robot can work at every pose of a box, or at none, its cables' sag included."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from sagline.cables.catenary import Catenary
from sagline.cables.model import CableModel
from sagline.core.arguments import callback, instance
from sagline.core.arrays import number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted
from sagline.core.progress import Progress
from sagline.core.results import Result
from sagline.robot.pose_box import PoseBox
from sagline.robot.robot import Robot
from sagline.workspaces.orientations import check_tilt
from sagline.workspaces.pose_cells import Cells, Prover, Search, halve
from sagline.workspaces.proof_verdict import ProofVerdict
from sagline.workspaces.wrench_sets import WrenchSet, load_of

_CATENARY = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
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
        return f"{self.verdict.name}: {self.verdict.text}\n{shares}\n  {counted(self.tried, 'box')} tried"


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

    Poses are level; with a tilt of the box a position is inside where every orientation tilted by no more is, about any
    axis, and outside where one of them is; a planar platform turns about the normal of its plane alone. The box is
    halved along its edges, again and again, and each cell that can be decided is; what remains when the budget ends is
    open, never a guess. With `Catenary()` the proofs hold for the exact cables, at tensions of the same range as in
    `margin`.

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
        InvalidValueError: If an argument is none of its kind, the robot has pulleys, or fewer cables
            than degrees of freedom, or the box tilts a platform that does not turn.

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
    check_robot(instance(robot, Robot, "robot"))
    check_tilt(robot, instance(box, PoseBox, "box").tilt, "box: tilt")
    if box.tilt > 0.0 and load.accelerations[1] > 0.0:
        step = "Give their moments as WrenchBox(moment=...), or prove the level poses."
        raise InvalidValueError("wrenches: angular accelerations", "given", "none where the box is tilted", step)
    seconds = number(budget, "budget", "s", above=0.0)
    least = 0.0 if smallest is None else number(smallest, "smallest", "m", above=0.0)
    told = callback(progress, "progress")
    prover = Prover(robot, load, instance(model, CableModel, "model"))
    prover.verdicts(box.low[None], np.zeros(3))  # what loading or compiling the kernel takes is not of the budget
    search = Search(prover, time.monotonic() + seconds, told)
    cells, tried = halve(search, box, least)
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


def _proof(robot: Robot, box: PoseBox, load: WrenchSet, model: CableModel, cells: Cells, tried: int) -> Proof:
    extent = box.high - box.low
    relative = (cells.high - cells.low)[:, extent > 0.0] / extent[extent > 0.0]
    share = relative.prod(axis=1)
    inside, outside = (
        float(share[cells.verdict == kind].sum()) for kind in (ProofVerdict.PROVED_INSIDE, ProofVerdict.PROVED_OUTSIDE)
    )
    kinds = set(cells.verdict.tolist())
    verdict = ProofVerdict(kinds.pop()) if len(kinds) == 1 else ProofVerdict.OPEN
    undecided = float(share[cells.verdict == ProofVerdict.OPEN].sum())
    return Proof(robot, box, load, model, verdict, inside, outside, undecided, cells, tried)
