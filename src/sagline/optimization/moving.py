"""Moving anchors: anchors whose positions give the largest margin at each pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from sagline.cables.model import CableModel
from sagline.cables.models import Catenary, model_of
from sagline.core.arguments import callback, instance, optional
from sagline.core.arrays import Array, locked
from sagline.core.errors import InvalidValueError
from sagline.core.numbers import counted, n
from sagline.core.progress import Progress, blocks
from sagline.core.results import Result
from sagline.core.table import Columns, Tabular
from sagline.optimization.candidates import Candidates, free_parts
from sagline.optimization.free import DesignVariable, Free
from sagline.optimization.goals import Goal
from sagline.optimization.rating import Rating, move_anchors
from sagline.optimization.request import COUNTS, poses_of
from sagline.robot.pose import Pose, PoseBox, PoseLike
from sagline.robot.robot import Robot
from sagline.workspaces.wrench_sets import WrenchSet

BLOCK: Final = 1 << 11  # poses per block, about 0.1 s; interrupts are handled between blocks
_CATENARY: Final = Catenary()


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class MovingAnchors(Result, Tabular):
    """Result of `moving_anchors` at G poses.

    Attributes:
        robot: The robot, with the anchors at their original positions.
        pose: The poses, a batch of G.
        parts: The q moving coordinates.
        moved: Values of the moving coordinates at each pose, shape (G, q).
        margin: Margin with moved anchors [N], shape (G,).
        fixed_margin: Margin with the anchors at their original positions [N], shape (G,).
        moving: The given moving anchors.
    """

    _columns: ClassVar[Columns] = ("pose", "margin", "fixed_margin")

    robot: Robot
    pose: Pose
    parts: tuple[DesignVariable, ...]
    moved: Array
    margin: Array
    fixed_margin: Array
    moving: tuple[Free, ...]

    def __str__(self) -> str:
        """Sentence with the mean increase of the margin."""
        gain = n(np.mean(self.margin - self.fixed_margin), unit="N") if len(self.moved) else "–"
        return f"{self.robot.name}, {counted(len(self.moved), 'pose')}: the margin is {gain} larger on average"

    @property
    def robots(self) -> tuple[Robot, ...]:
        """Robots with moved anchors, one per pose, for functions such as `inverse`."""
        names = [self.robot.name] * len(self.moved)
        return Candidates(self.robot, self.moving, "moving").robots(self.moved, names)


def moving_anchors(
    robot: Robot,
    moving: Sequence[Free],
    wrenches: WrenchSet | None = None,
    poses: PoseLike | None = None,
    *,
    box: PoseBox | None = None,
    grid: Sequence[int] = COUNTS,
    model: CableModel | str = _CATENARY,
    progress: Progress | None = None,
) -> MovingAnchors:
    """Move anchors of a robot to the positions with the largest margin at each pose.

    The best positions of a sample are the start; then steps along one coordinate after another improve them.

    Args:
        robot: The robot.
        moving: Moving anchors: `FreeAnchors`.
        wrenches: Set of loads, for example a `WrenchBox`; None for the weight alone.
        poses: Poses; None for a grid of level poses in a box.
        box: Box of the grid; None for the robot's test box, level.
        grid: Number of poses of the grid along x, y and z.
        model: Cable model.
        progress: Function that is called from time to time with the number of finished poses and of all poses.

    Returns:
        MovingAnchors.

    Raises:
        InvalidValueError: If an argument is of the wrong kind.

    Examples:
        Posts whose anchors move up and down together:

        >>> import sagline as sl
        >>> robot = sl.load_robot("article-suspended")
        >>> posts = sl.FreeAnchors("frame", -1.0, 1.0, along=[0, 0, 1], symmetry="together")
        >>> load = sl.WrenchBox(force=50.0, moment=5.0)
        >>> found = sl.moving_anchors(robot, [posts], load, grid=(3, 3, 3))
        >>> bool((found.margin >= found.fixed_margin).all())
        True
    """
    callback(progress, "progress")
    optional(wrenches, WrenchSet, "wrenches")
    places = poses_of(instance(robot, Robot, "robot"), poses, box, grid)
    parts = free_parts(moving, "moving")
    if not parts:
        raise InvalidValueError("moving", "empty", "FreeAnchors", 'Give FreeAnchors("frame", low, high).')
    inner = Candidates(robot, parts, "moving")
    rating = Rating(inner, (Goal("mean_margin"),), wrenches, places, model_of(model), None, None)
    count = len(rating.rows)
    table = inner.cables(inner.start[None])
    moved, margin = np.empty((count, len(inner.parts))), np.empty(count)
    for part in blocks(count, BLOCK, progress):
        own = np.repeat(table, part.stop - part.start, axis=0)
        moved[part], margin[part] = move_anchors(inner, rating.margins, own, rating.rows[part])
    fixed = rating.margins(table, rating.rows)
    return MovingAnchors(robot, places, inner.parts, locked(moved), locked(margin), locked(fixed), parts)
