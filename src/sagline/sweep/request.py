"""Request of a sweep: robots, poses, wrenches, and the quantities to compute for all combinations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence, Sized
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import brief, choice, elements, listed
from sagline.core.arrays import Array, checked, locked, number
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted
from sagline.core.results import Result, set_fields
from sagline.files.variables import Quantity
from sagline.kinematics.forward_rows import without_guides
from sagline.kinematics.status import PoseStatus
from sagline.robot.pose import Pose, PoseLike, pose_of
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.tension.method import TensionMethod, kernel_options
from sagline.tension.methods import DEFAULT, method_of
from sagline.workspaces.margin import MarginStatus
from sagline.workspaces.wrench_sets import WrenchSet, load_of

_CABLE: Final = ("cable",)  # last dimension, after robot, pose and wrench
_STATUS: Final = Quantity("status", (), "", "status of each request", codes=PoseStatus)
_CHANGE: Final = "change of force that makes the request feasible"
_PROOF: Final = Quantity("proof", (), "N", f"proved lower bound of the {_CHANGE}, 0 if it is feasible")
_TENSION: Final = Quantity("tension", _CABLE, "N", "tension along the chord, T_x / cos phi")
_LENGTH: Final = Quantity("length", _CABLE, "m", "unstrained length L of the cable off the drum")
_LIMIT: Final = "cable whose limit has the most effect on the margin, or -1"

QUANTITIES: Final = MappingProxyType(
    {
        "tension": (_STATUS, _PROOF, _TENSION),
        "length": (_STATUS, _PROOF, _LENGTH),
        "shortfall": (_STATUS, _PROOF, Quantity("enough", (), "N", _CHANGE)),
        "margin": (
            Quantity("margin_status", (), "", "verdict of the margin's bracket", codes=MarginStatus),
            Quantity("margin", (), "N", "additional load that the cables can balance; if negative, excess load"),
            Quantity("margin_low", (), "N", "lower bound of the margin; if >= 0, the request is feasible"),
            Quantity("margin_high", (), "N", "upper bound of the margin; if negative, the request is infeasible"),
            Quantity("limiting_cable", (), "", _LIMIT, values=np.int8),
        ),
    }
)


def variables_of(quantities: Iterable[str]) -> tuple[Quantity, ...]:
    """Names of the variables that contain the given quantities, without repetitions."""
    return tuple(dict.fromkeys(variable for name in quantities for variable in QUANTITIES[name]))


MOST: Final = 1 << 40  # largest number of requests; a hundred cores need about a year for them
_CATENARY: Final = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Request(Result):
    """Request of a sweep: quantities to compute for every robot at every pose under every wrench.

    Attributes:
        robots: The R robots.
        poses: Batch of P poses.
        wrenches: External wrenches on the platform, about the center of mass in world axes [N, N m], shape (W, 6).
        quantities: Quantities to compute, in the order of `sl.sweep.QUANTITIES`, such as "tension" or "margin".
        model: Cable model.
        tension: Tension distribution method, applied to each request independently.
        around: Set of loads that is added to each wrench for the margin; None for each wrench alone.
        moment_arm: Lever arm by which the margin divides moments [m]; None for the mean lever arm of each robot.
    """

    robots: tuple[Robot, ...]
    poses: Pose
    wrenches: Array
    quantities: tuple[str, ...]
    model: CableModel
    tension: TensionMethod
    around: WrenchSet
    moment_arm: float | None

    def __init__(
        self,
        robots: Robot | Sequence[Robot],
        poses: PoseLike,
        wrenches: ArrayLike | None = None,
        quantities: str | Sequence[str] = ("tension",),
        *,
        model: CableModel | str = _CATENARY,
        tension: TensionMethod | str = DEFAULT.alone,
        around: WrenchSet | None = None,
        moment_arm: float | None = None,
    ) -> None:
        """Check the arguments of the request.

        Args:
            robots: A robot, or a sequence of robots, which may have different numbers of cables.
            poses: A single pose, or a batch.
            wrenches: Force [N], then moment [N m], shape (6,) or (W, 6); None for the weight alone.
            quantities: One or several of `sl.sweep.QUANTITIES`.
            model: Cable model.
            tension: Tension distribution method.
            around: Set of loads that is added to each wrench for the margin; None for each wrench alone.
            moment_arm: Lever arm by which the margin divides moments [m], >= 0, as in `sl.margin`.

        Raises:
            InvalidValueError: If an argument has a wrong type, or is empty; if the tension distribution method is not
                defined for a robot; if the motion pattern of a robot does not allow a pose.
        """
        machines = listed(robots, Robot, "robots")
        batch = pose_of(poses, "poses")
        if not batch.shape:
            batch = pose_of([batch])
        loads = np.atleast_2d(checked(np.zeros(6) if wrenches is None else wrenches, "wrenches", "N, N m", shape=(6,)))
        if loads.ndim > 2:
            raise InvalidValueError("wrenches", f"of shape {loads.shape}", "shape (6,) or (W, 6)", "Reshape to (W, 6).")
        words = elements(quantities, str, "quantities", "Give quantities as a list.")
        chosen = {choice(word, f"quantities[{k}]", QUANTITIES) for k, word in enumerate(words)}
        if len(chosen) < len(words):
            raise InvalidValueError("quantities", brief(list(words)), "each once", "Omit repeated names.")
        parts: dict[str, Sized] = {"robots": machines, "poses": batch, "wrenches": loads, "quantities": chosen}
        for item, some in parts.items():
            if not len(some):
                raise InvalidValueError(item, "empty", "one or more", f"Give {item}.")
        if (count := len(machines) * len(batch) * len(loads)) > MOST:
            raise InvalidValueError("the sweep", f"of {count:,} requests", f"<= {MOST:,}", "Make several sweeps.")
        model, method = model_of(model), method_of(tension).alone
        for one in machines:
            kernel_options(without_guides(one, "a sweep", "inverse"), model, method)
            check_reach(one, batch, "poses")
        set_fields(
            self,
            robots=machines,
            poses=batch,
            wrenches=locked(np.ascontiguousarray(loads)),
            quantities=tuple(name for name in QUANTITIES if name in chosen),
            model=model,
            tension=method,
            around=load_of(around),
            moment_arm=None if moment_arm is None else number(moment_arm, "moment_arm", "m", low=0.0),
        )

    @property
    def shape(self) -> tuple[int, int, int]:
        """Numbers of robots, poses and wrenches in the request."""
        return len(self.robots), len(self.poses), len(self.wrenches)

    def __str__(self) -> str:
        """Numbers of robots, poses and wrenches in the request."""
        return " x ".join(map(counted, self.shape, ("robot", "pose", "wrench")))

    @property
    def cable_count(self) -> int:
        """Largest number of cables of all robots."""
        return max(robot.cable_count for robot in self.robots)

    def __len__(self) -> int:
        """Number of requests."""
        robots, poses, wrenches = self.shape
        return robots * poses * wrenches


class RequestBox(NamedTuple):
    """Box of requests: the index of one robot, a range of poses and a range of wrenches."""

    robot: int
    poses: slice
    wrenches: slice

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of poses and wrenches in the box."""
        return self.poses.stop - self.poses.start, self.wrenches.stop - self.wrenches.start

    def pieces(self, most: int) -> Iterator[RequestBox]:
        """Smaller boxes with at most `most` requests each, which together are this box."""
        wide = min(self.shape[1], most)
        tall = max(1, most // wide)
        for first in range(self.poses.start, self.poses.stop, tall):
            for left in range(self.wrenches.start, self.wrenches.stop, wide):
                rows = slice(first, min(first + tall, self.poses.stop))
                yield RequestBox(self.robot, rows, slice(left, min(left + wide, self.wrenches.stop)))
