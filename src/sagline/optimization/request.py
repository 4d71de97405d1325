"""Goals of a design search, and the checked arguments of a design search."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import MappingProxyType
from typing import Any, Final, TypeAlias

import numpy as np
from attrs import field, frozen

from sagline.cables.model import CableModel
from sagline.cables.models import model_of
from sagline.core.arguments import brief, choice, elements, instance, optional, whole_number
from sagline.core.arrays import Array, number
from sagline.core.errors import InvalidValueError
from sagline.core.fields import check_fields, checked_by
from sagline.core.results import set_fields
from sagline.optimization.candidates import AnchorErrors, Candidates, PlatformBox, free_parts
from sagline.optimization.free import Free
from sagline.optimization.free_anchors import FreeAnchors
from sagline.optimization.search import SEARCHES
from sagline.robot.pose import Pose, PoseBox, PoseLike, level_grid, pose_of
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.workspaces.wrench_sets import WrenchSet

COUNTS: Final = (9, 7, 5)  # number of points of the grid along x, y and z
MOST: Final = 100_000  # largest number of poses


def poses_of(robot: Robot, poses: PoseLike | None, box: PoseBox | None, grid: Sequence[int]) -> Pose:
    """Batch of the given poses or, if `poses` is None, a grid of poses without rotation in a box."""
    counts = _counts(grid)
    if poses is not None:
        if box is not None:
            raise InvalidValueError("box", "given with poses", "one of the two", "Leave one of them out.")
        given = pose_of(poses, "poses")
        batch = given if given.shape else pose_of([given])
        if not 0 < len(batch) <= MOST:
            raise InvalidValueError("poses", f"{len(batch):,} of them", f"1 to {MOST:,}", "Give at least one pose.")
    else:
        batch = level_grid(_box(robot, box), counts)
    check_reach(robot, batch, "poses")
    return batch


def _box(robot: Robot, box: PoseBox | None) -> PoseBox:
    if box is None:
        if robot.test_box is None:
            step = "Give box=PoseBox(low, high), or poses."
            raise InvalidValueError("box", f"missing, and {robot.name} has no test_box", "a PoseBox", step)
        return PoseBox(robot.test_box.low, robot.test_box.high)
    if instance(box, PoseBox, "box").tilt > 0.0:
        step = "Give `poses` for other orientations."
        raise InvalidValueError("box: tilt", f"{box.tilt:g} rad", "0 rad, because the grid is level", step)
    return box


def _counts(grid: Any) -> tuple[int, ...]:
    step = "Give (9, 7, 5) for instance."
    if len(given := elements(grid, (), "grid", step)) != 3:
        raise InvalidValueError("grid", brief(grid), "three whole numbers", step)
    counts = tuple(whole_number(count, f"grid[{k}]", 1, MOST) for k, count in enumerate(given))
    if (total := counts[0] * counts[1] * counts[2]) > MOST:
        raise InvalidValueError("grid", f"of {total:,} poses", f"up to {MOST:,}", "Take fewer.")
    return counts


MOST_EVALUATIONS: Final = 10_000_000
_SEED: Final = 2**31 - 1  # largest seed that every optimizer accepts


def _goals(given: Any, item: str) -> tuple[Goal, ...]:
    """Checked tuple of goals; a name of a goal is replaced by a `Goal`."""
    many = [given] if isinstance(given, Goal | str) else given
    if not isinstance(many, Sequence) or not many:
        step = 'Give [Goal("workspace_share")] for instance.'
        raise InvalidValueError(item, brief(given), "one goal or more", step)
    goals = tuple(
        Goal(one) if isinstance(one, str) else instance(one, Goal, f"{item}[{k}]") for k, one in enumerate(many)
    )
    kinds = [goal.kind for goal in goals]
    if twice := [kind for kind in kinds if kinds.count(kind) > 1]:
        raise InvalidValueError(item, f"with {twice[0]} twice", "each once", "Leave one of them out.")
    return goals


def _check_platform(request: Request) -> None:
    """Reject an initial robot that has a frame anchor inside the platform at any pose."""
    anchors = request.robot.frame_anchors
    poses = PlatformBox(request.robot, request.poses).holds(anchors)
    if (poses >= 0).any():
        cable = int(np.argmax(poses >= 0))
        item = f"the frame anchor of cable {cable}, at {', '.join(f'{x:.3g}' for x in anchors[cable])} m"
        value, step = f"inside the platform at pose {int(poses[cable])}", "Omit the pose, or correct the robot."
        raise InvalidValueError(item, value, "outside the platform at all poses", step)


# Quantities of N candidates at G poses with S samples of anchor errors (1 without errors):
# "margin": margin of the wrench set [N], (N, S, G); -inf if a pose is singular or a cable has no length
# "tension", "sag": largest cable tension [N] and sag [m], (N, S, G); NaN without tensions
# "stiffness": stiffness in the softest direction [N/m], (N, S, G); NaN without tensions
# "cost": cost of the cables, (N, S)
Measured: TypeAlias = Mapping[str, Array]


def heading(name: str, unit: str) -> str:
    """Heading of a column with name and unit, such as "mean_margin [N]"."""
    return f"{name} [{unit}]" if unit else name


_LEAST, _LARGEST = partial(np.nanmin, axis=-1, initial=np.inf), partial(np.nanmax, axis=-1, initial=-np.inf)
# Kinds of goals: unit ("" for a share or a currency); True if the goal is maximized by default; quantity in `Measured`;
# function that computes the value of the goal from this quantity, over the last axis
KINDS: Final[Mapping[str, tuple[str, bool, str, Callable[[Array], Any]]]] = MappingProxyType(
    {
        "workspace_share": ("", True, "margin", lambda margin: (margin >= 0.0).mean(axis=-1)),
        "mean_margin": ("N", True, "margin", lambda margin: margin.mean(axis=-1)),
        "least_margin": ("N", True, "margin", _LEAST),
        "largest_tension": ("N", False, "tension", _LARGEST),
        "largest_sag": ("m", False, "sag", _LARGEST),
        "least_stiffness": ("N/m", True, "stiffness", _LEAST),
        "cable_cost": ("", False, "cost", lambda cost: cost),
    }
)
AT_POSES: Final = ("tension", "sag", "stiffness")  # quantities that need a tension distribution


@dataclass(frozen=True, slots=True)
class Goal:
    """Goal of a design search: a quantity to maximize or minimize.

    Tensions, sag and stiffness are computed for the platform's weight plus the center of the wrench set, with the
    tension distribution `MinimumNorm`, at all poses at which the initial robot is feasible. A candidate that is
    infeasible at one of these poses is dropped.

    Attributes:
        kind: "workspace_share" (share of the poses with a nonnegative margin), "mean_margin" or "least_margin"
            [N], "largest_tension" [N], "largest_sag" [m], "least_stiffness" [N/m] (against a force in any direction) or
            "cable_cost" (catalogue cost of cables, each as long as its longest chord).
        maximize: True to maximize, False to minimize.
        weight: Weight relative to other goals, > 0.
        scale: Value by which the goal is divided, in the unit of the goal; None for the initial robot's value, or 1 if
            this value is 0.
    """

    kind: str
    maximize: bool
    weight: float
    scale: float | None

    def __init__(
        self, kind: str, *, maximize: bool | None = None, weight: float = 1.0, scale: float | None = None
    ) -> None:
        """Check kind, direction, weight and scale.

        Args:
            kind: One of the seven kinds.
            maximize: True to maximize, False to minimize; None: the default of the kind.
            weight: Weight relative to other goals, > 0.
            scale: Value by which the goal is divided, > 0, or None.

        Raises:
            InvalidValueError: If the goal does not exist, or an argument is of the wrong kind.

        Examples:
            >>> import sagline as sl
            >>> print(sl.Goal("workspace_share").maximize, sl.Goal("cable_cost").maximize)
            True False
        """
        unit, larger_is_better, *_ = KINDS[choice(kind, "goal", KINDS)]
        if maximize is not None and not isinstance(maximize, bool | np.bool_):
            raise InvalidValueError("maximize", brief(maximize), "True, False or None", "Choose one of these goals.")
        set_fields(
            self,
            kind=str(kind),
            maximize=larger_is_better if maximize is None else bool(maximize),
            weight=number(weight, "weight", "", above=0.0),
            scale=None if scale is None else number(scale, "scale", unit, above=0.0),
        )

    @property
    def unit(self) -> str:
        """Unit of the values of the goal."""
        return KINDS[self.kind][0]

    @property
    def needs(self) -> str:
        """Name of the quantity in `Measured` from which the goal is computed."""
        return KINDS[self.kind][2]

    def values(self, measured: Measured, *, worst: bool) -> Array:
        """Value of the goal of each candidate.

        Args:
            measured: Quantities of the candidates, by name.
            worst: True for the worst value of the samples of anchor errors, False for the mean value.

        Returns:
            Values in the unit of the goal, shape (N,).
        """
        samples: Array = KINDS[self.kind][3](measured[self.needs])
        if not worst:
            return np.asarray(samples.mean(axis=-1))
        return np.asarray(samples.min(axis=-1) if self.maximize else samples.max(axis=-1))


def _given(value: Any) -> Any:
    """Converter that returns a value unchanged, and gives type checkers the type of the constructor's argument."""
    return value


@frozen(eq=False, weakref_slot=False)
class Request:
    """Checked arguments of `design`, without the number of evaluations."""

    robot: Robot = field(metadata=checked_by(lambda value, item: instance(value, Robot, item)))
    free: tuple[Free, ...] = field(converter=_given, metadata=checked_by(free_parts))  # design variables
    goals: tuple[Goal, ...] = field(converter=_given, metadata=checked_by(_goals))
    # set of wrenches; None for the platform's weight alone
    wrenches: WrenchSet | None = field(metadata=checked_by(lambda value, item: optional(value, WrenchSet, item)))
    poses: Pose
    model: CableModel = field(converter=_given, metadata=checked_by(lambda value, _: model_of(value)))
    # anchors that the machine moves during operation
    inner: tuple[Free, ...] = field(converter=_given, metadata=checked_by(free_parts))
    # errors of the anchors, or None
    robust: AnchorErrors | None = field(metadata=checked_by(lambda value, item: optional(value, AnchorErrors, item)))
    optimizer: str = field(metadata=checked_by(lambda value, item: str(choice(value, item, SEARCHES))))
    seed: int = field(metadata=checked_by(whole_number, 0, _SEED))  # seed of all random numbers

    def __attrs_post_init__(self) -> None:
        """Check each argument, then combinations of arguments."""
        check_fields(self)
        if not self.free:
            step = "Give design variables; for moving anchors alone, call moving_anchors."
            raise InvalidValueError("free", "empty", "FreeAnchors, FreeCable or FreeLimit", step)
        for k, one in enumerate(self.inner):
            if not isinstance(one, FreeAnchors):
                raise InvalidValueError(f"inner[{k}]", brief(one), "FreeAnchors", "Give only anchors that move.")
        if self.inner and not any(goal.needs == "margin" for goal in self.goals):
            step = "Add Goal('mean_margin'), because anchors move to the largest margin."
            value, allowed = (f"given {word} a goal about margins" for word in ("without", "with"))
            raise InvalidValueError("inner", value, allowed, step)
        for goal in self.goals if self.optimizer == "nsga2" else ():
            if goal.weight != 1.0:
                step = 'Omit the weight, or choose the optimizer "cma".'
                allowed = "1, because a front of robots has no weights"
                raise InvalidValueError(f"weight of {goal.kind}", f"{goal.weight:g}", allowed, step)
        _check_platform(self)

    @property
    def candidates(self) -> Candidates:
        """Candidates of the search, prepared for the initial robot."""
        return Candidates(self.robot, self.free)
