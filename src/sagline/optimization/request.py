"""Request of a design search, checked: robot, design variables, goals, loads and poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import model_of
from sagline.core.arguments import brief, choice, elements, instance, optional, whole_number
from sagline.core.errors import InvalidValueError
from sagline.optimization.candidates import AnchorErrors, Candidates, PlatformBox, free_parts
from sagline.optimization.free import Free
from sagline.optimization.free_anchors import FreeAnchors
from sagline.optimization.goals import Goal
from sagline.optimization.search import SEARCHES
from sagline.robot.pose import Pose, PoseBox, PoseLike, pose_of
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot
from sagline.workspaces.wrench_sets import WrenchSet

COUNTS: Final = (9, 7, 5)  # number of points of the grid along x, y and z
MOST: Final = 100_000  # largest number of poses


def poses_of(robot: Robot, poses: PoseLike | None, box: PoseBox | None, grid: Sequence[int]) -> Pose:
    """The given poses as a batch; otherwise, a grid of level poses in a box, by default in the robot's test box."""
    counts = _counts(grid)
    if poses is not None:
        if box is not None:
            raise InvalidValueError("box", "given with poses", "one of the two", "Leave one of them out.")
        given = pose_of(poses, "poses")
        batch = given if given.shape else Pose.from_quaternion(given.position[None], given.quaternion[None])
        if not 0 < len(batch) <= MOST:
            raise InvalidValueError("poses", f"{len(batch):,} of them", f"1 to {MOST:,}", "Give at least one pose.")
    else:
        batch = _grid(_box(robot, box), counts)
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


def _grid(box: PoseBox, counts: tuple[int, ...]) -> Pose:
    axes = [
        np.linspace(low, high, count) if count > 1 and high > low else np.array([0.5 * (low + high)])
        for low, high, count in zip(box.low, box.high, counts, strict=True)
    ]
    places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    return Pose.from_euler(places, 0.0, 0.0, 0.0)


MOST_EVALUATIONS: Final = 10_000_000
_SEED: Final = 2**31 - 1  # largest seed that all optimizers accept


@dataclass(frozen=True, slots=True, eq=False)
class Request:
    """A design search, without its number of evaluations.

    Attributes:
        robot: Initial robot of the search.
        free: Design variables.
        goals: Goals.
        wrenches: Set of loads; None for the weight alone.
        poses: Poses, a batch.
        model: Cable model.
        inner: Anchors that the machine moves from pose to pose.
        robust: Errors of the anchors, or None.
        optimizer: Name of the optimizer.
        seed: Seed of all random numbers.
    """

    robot: Robot
    free: tuple[Free, ...]
    goals: tuple[Goal, ...]
    wrenches: WrenchSet | None
    poses: Pose
    model: CableModel
    inner: tuple[Free, ...]
    robust: AnchorErrors | None
    optimizer: str
    seed: int

    @property
    def candidates(self) -> Candidates:
        """The candidates of the search."""
        return Candidates(self.robot, self.free)


def checked_request(
    robot: Any, free: Any, goals: Any, wrenches: Any, poses: Pose, model: Any, inner: Any, robust: Any,
    optimizer: Any, seed: Any,
) -> Request:  # fmt: skip
    """Make a request from the arguments of `design`, which are checked."""
    optional(wrenches, WrenchSet, "wrenches")
    request = Request(
        instance(robot, Robot, "robot"),
        free_parts(free, "free"),
        _goals(goals),
        wrenches,
        poses,
        model_of(model),
        free_parts(inner, "inner"),
        optional(robust, AnchorErrors, "robust"),
        str(choice(optimizer, "optimizer", SEARCHES)),
        whole_number(seed, "seed", 0, _SEED),
    )
    if not request.free:
        step = "Give design variables; for moving anchors alone, call moving_anchors."
        raise InvalidValueError("free", "empty", "FreeAnchors, FreeCable or FreeLimit", step)
    for k, one in enumerate(request.inner):
        if not isinstance(one, FreeAnchors):
            raise InvalidValueError(f"inner[{k}]", brief(one), "FreeAnchors", "Give only anchors that move.")
    if request.inner and not any(goal.needs == "margin" for goal in request.goals):
        step = "Add Goal('mean_margin'), because anchors move to the largest margin."
        raise InvalidValueError("inner", "given without a goal about margins", "given with a goal about margins", step)
    if request.optimizer == "nsga2":
        _refuse_weights(request.goals)
    _check_platform(request)
    return request


def _goals(given: Any) -> tuple[Goal, ...]:
    """Checked goals; a name is replaced by the goal with this name."""
    many = [given] if isinstance(given, Goal | str) else given
    if not isinstance(many, Sequence) or not many:
        step = 'Give [Goal("workspace_share")] for instance.'
        raise InvalidValueError("goals", brief(given), "one goal or more", step)
    goals = tuple(
        Goal(one) if isinstance(one, str) else instance(one, Goal, f"goals[{k}]") for k, one in enumerate(many)
    )
    kinds = [goal.kind for goal in goals]
    if twice := [kind for kind in kinds if kinds.count(kind) > 1]:
        raise InvalidValueError("goals", f"with {twice[0]} twice", "each once", "Leave one of them out.")
    return goals


def _refuse_weights(goals: tuple[Goal, ...]) -> None:
    for goal in goals:
        if goal.weight != 1.0:
            step = 'Omit the weight, or choose the optimizer "cma".'
            allowed = "1, because a front of robots has no weights"
            raise InvalidValueError(f"weight of {goal.kind}", f"{goal.weight:g}", allowed, step)


def _check_platform(request: Request) -> None:
    """Reject an initial robot with a frame anchor inside the platform; the search rejects such candidates later."""
    anchors = request.robot.frame_anchors
    poses = PlatformBox(request.robot, request.poses).holds(anchors)
    if (poses >= 0).any():
        cable = int(np.argmax(poses >= 0))
        item = f"the frame anchor of cable {cable}, at {', '.join(f'{x:.3g}' for x in anchors[cable])} m"
        value, step = f"inside the platform at pose {int(poses[cable])}", "Omit the pose, or correct the robot."
        raise InvalidValueError(item, value, "outside the platform at all poses", step)
