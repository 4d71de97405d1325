"""The poses at which candidates are compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from sagline.core.arguments import brief, instance, whole_number
from sagline.core.errors import InvalidValueError
from sagline.robot.pose import Pose
from sagline.robot.pose_box import PoseBox
from sagline.robot.reach import check_reach
from sagline.robot.robot import Robot

COUNTS: Final = (9, 7, 5)  # of the grid, along x, y and z
MOST: Final = 100_000  # poses


def poses_of(robot: Robot, poses: Pose | None, box: PoseBox | None, grid: Sequence[int]) -> Pose:
    """The given poses, or level ones evenly over a box.

    Args:
        robot: The robot.
        poses: One pose or a batch; None for a grid.
        box: Where the grid lies; None for the robot's test box.
        grid: Poses along x, y and z; one where the box has no extent.

    Returns:
        A batch.

    Raises:
        InvalidValueError: If poses and box are given, or neither while the robot names no box; if the box is tilted;
            if there are too many, or the robot's motion pattern does not lead there.
    """
    if poses is not None:
        if box is not None:
            raise InvalidValueError("box", "given beside poses", "one of the two", "Leave one of them out.")
        given = instance(poses, Pose, "poses")
        batch = given if given.shape else Pose.from_quaternion(given.position[None], given.quaternion[None])
        if not 0 < len(batch) <= MOST:
            raise InvalidValueError("poses", f"{len(batch):,} of them", f"1 to {MOST:,}", "Give some of them.")
    else:
        batch = _grid(_box(robot, box), _counts(grid))
    check_reach(robot, batch, "poses")
    return batch


def _box(robot: Robot, box: PoseBox | None) -> PoseBox:
    if box is None:
        if robot.test_box is None:
            step = "Give box=PoseBox(low, high), or poses."
            raise InvalidValueError("box", f"missing, and {robot.name} names none", "a PoseBox", step)
        return PoseBox(robot.test_box.low, robot.test_box.high)
    if instance(box, PoseBox, "box").tilt > 0.0:
        step = "Give poses for other orientations."
        raise InvalidValueError("box: tilt", f"{box.tilt:g} rad", "0 rad: the grid is level", step)
    return box


def _counts(grid: Any) -> tuple[int, ...]:
    if not isinstance(grid, Sequence | np.ndarray) or isinstance(grid, str) or len(grid) != 3:
        raise InvalidValueError("grid", brief(grid), "three whole numbers", "Give (9, 7, 5) for instance.")
    counts = tuple(whole_number(count, f"grid[{k}]", 1, MOST) for k, count in enumerate(grid))
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
